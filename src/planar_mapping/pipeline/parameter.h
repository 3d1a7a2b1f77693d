// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// Allowed values of a number, in the unit of the key.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;  ///< low itself is not allowed

  static Range any() { return {}; }
  static Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
  static Range atLeast(double low) { return {low, std::numeric_limits<double>::infinity(), false}; }
  static Range between(double low, double high) { return {low, high, false}; }
  static Range above(double low, double high) { return {low, high, true}; }

  bool contains(double value) const {
    return (low_open ? value > low : value >= low) && value <= high;
  }
  /// "> 0", "[0, 1]", "(0, 1]", ">= 3" or "any number".
  PLANAR_MAPPING_EXPORT std::string text() const;
};

enum class ParameterType : std::uint8_t { Flag, Integer, Number, Word, Text, Vector };

/// The value of a parameter as it stands in a file; std::monostate is `auto`.
using ParameterValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, Vector3>;

/// A parameter, declared once: this feeds the YAML reader and its checks, `stages --describe`,
/// `config --defaults` and docs/parameters.md.
struct Parameter {
  std::string name;  ///< with its unit as suffix: _m, _deg, _s, _px
  ParameterType type = ParameterType::Number;
  Range range;
  std::vector<std::string> words;  ///< of an enumeration
  bool automatic = false;          ///< the word `auto` is allowed
  bool basic = false;              ///< of interest in a first configuration; others are advanced
  std::string meaning;
  std::function<ParameterValue()> get;
  std::function<void(const ParameterValue&)> set;

  /// "m", "deg", "s", "px" or "" from the suffix of the name.
  PLANAR_MAPPING_EXPORT std::string unit() const;
  /// Whether a vector is a place, which may be the origin, and not a direction.
  bool isPoint() const { return unit() == "m"; }
  /// What may be written: "> 0 m", "true or false", "a, b or c".
  PLANAR_MAPPING_EXPORT std::string allowed() const;
};

/// The parameters of one stage, bound to its members. The member's value at the time of the
/// declaration is the default.
class PLANAR_MAPPING_EXPORT ParameterTable {
 public:
  void flag(const std::string& name, bool& value, const std::string& meaning);
  void integer(const std::string& name, int& value, const Range& range, const std::string& meaning);
  /// As above; without an end of \p range it ends where that of int does.
  void integer(const std::string& name, std::int64_t& value, const Range& range,
               const std::string& meaning);
  /// As above; `auto` in the file is std::nullopt.
  void integer(const std::string& name, std::optional<int>& value, const Range& range,
               const std::string& meaning);
  /// A name that ends in _deg is in degrees in the file and in radians in \p value: this is the one
  /// place that converts. \p range is in the unit of the file.
  void number(const std::string& name, double& value, const Range& range,
              const std::string& meaning);
  /// As above; `auto` in the file is std::nullopt.
  void number(const std::string& name, std::optional<double>& value, const Range& range,
              const std::string& meaning);
  void text(const std::string& name, std::string& value, const std::string& meaning);
  void vector(const std::string& name, Vector3& value, const std::string& meaning);
  /// As above; `auto` in the file is std::nullopt.
  void vector(const std::string& name, std::optional<Vector3>& value, const std::string& meaning);

  template <typename Enum>
  void word(const std::string& name, Enum& value,
            const std::vector<std::pair<std::string, Enum>>& words, const std::string& meaning) {
    std::vector<std::string> names;
    for (const auto& entry : words) names.push_back(entry.first);
    addWord(
        name, names, meaning,
        [&value, words]() {
          for (const auto& entry : words) {
            if (entry.second == value) return entry.first;
          }
          return words.front().first;
        },
        [&value, words](const std::string& chosen) {
          for (const auto& entry : words) {
            if (entry.first == chosen) value = entry.second;
          }
        });
  }

  /// Marks parameters declared before as basic.
  /// \throws InputError if there is none of a name
  void basic(const std::vector<std::string>& names);

  const std::vector<Parameter>& parameters() const { return parameters_; }
  /// Null if there is none of that name.
  const Parameter* find(const std::string& name) const;

 private:
  Parameter& add(const std::string& name, ParameterType type, const Range& range,
                 const std::string& meaning);
  void addWord(const std::string& name, std::vector<std::string> words, const std::string& meaning,
               std::function<std::string()> get, std::function<void(const std::string&)> set);

  std::vector<Parameter> parameters_;
};

/// A value as YAML text; numbers in the shortest form that reads back to the same bits.
PLANAR_MAPPING_EXPORT std::string toYaml(const ParameterValue& value);
/// A number in the shortest form that reads back to the same bits.
PLANAR_MAPPING_EXPORT std::string formatNumber(double value);

}  // namespace planar_mapping
