// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/pipeline/parameter.h"

// What yaml-cpp leaves to us: positions from 1, repeated keys, strict scalars.
namespace planar_mapping::detail {

/// Reports a problem of one value.
using Report = std::function<void(const std::string& text)>;

/// All problems of one configuration, in the order of the file.
class ProblemList {
 public:
  explicit ProblemList(std::string file) : file_(std::move(file)) {}
  /// \p mark counts from 0, as yaml-cpp does.
  void add(const YAML::Mark& mark, const std::string& text);
  Report at(const YAML::Mark& mark) {
    return [this, mark](const std::string& text) { add(mark, text); };
  }
  /// Of something that stands on the command line.
  Report elsewhere(const std::string& where);
  bool empty() const { return problems_.empty(); }
  std::vector<std::string> sorted() const;

 private:
  struct Problem {
    int line;
    int column;
    std::string text;
  };
  std::string file_;
  std::vector<Problem> problems_;
};

/// The only document of \p text; an undefined node if that was reported as a problem.
YAML::Node loadDocument(const std::string& text, ProblemList& problems);

/// The entries of a mapping, each key once: repeated keys and keys that are no words are reported.
std::vector<std::pair<YAML::Node, YAML::Node>> entriesOf(const YAML::Node& mapping,
                                                         const std::string& what,
                                                         ProblemList& problems);

/// Reads the value of a parameter. \return false if a problem was reported
bool readValue(const Parameter& parameter, const YAML::Node& node, ParameterValue& value,
               const Report& report);

/// "a mapping", "a list", "nothing" or "'text'".
std::string describe(const YAML::Node& node);

}  // namespace planar_mapping::detail
