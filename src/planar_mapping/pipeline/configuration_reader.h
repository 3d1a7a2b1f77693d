// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/yaml_source.h"

namespace planar_mapping::detail {

/// The words of the key `up`: axes of the world, absent = auto.
const std::vector<std::pair<std::string, std::optional<Vector3>>>& upAxes();

/// Walks the YAML tree of one configuration and collects every problem before it gives up.
class ConfigurationReader {
 public:
  /// \param with_plugins  load those that the file names; without, stages that nothing else has are
  ///     taken to be of plugins, left out and listed in Configuration::unknown_stages
  ConfigurationReader(const std::string& path, StageTable& table,
                      const ConfigurationOverrides& overrides, bool with_plugins);
  /// \throws ConfigError
  Configuration read(const std::string& text);

 private:
  void readTop(const YAML::Node& root);
  void readTopEntry(const std::string& key, const YAML::Node& value, const Report& report);
  void readProfile(const YAML::Node& root);
  void readSetting(const std::string& key, const YAML::Node& value, const Report& report);
  void readStringList(const std::string& key, const YAML::Node& value, const Report& report,
                      std::vector<std::string>& list) const;
  void readPlugins(const YAML::Node& list);
  void readStages(const YAML::Node& list);
  void readStage(const YAML::Node& entry);
  void readStageKeys(ConfiguredStage& stage,
                     const std::vector<std::pair<YAML::Node, YAML::Node>>& entries);
  void applyAssignment(const std::string& assignment);
  void checkOrder();
  void configureStages();
  std::string absolutePath(const std::string& path) const;

  std::string path_;
  StageTable& table_;
  const ConfigurationOverrides& overrides_;
  const bool with_plugins_;
  ProblemList problems_;
  Configuration configuration_;
  ParameterTable settings_;  ///< the keys of the top level that are numbers or words
  int version_ = 1;
  std::int64_t seed_ = static_cast<std::int64_t>(RunSettings().seed);
  std::vector<YAML::Mark> stage_marks_;  ///< of configuration_.stages
};

}  // namespace planar_mapping::detail
