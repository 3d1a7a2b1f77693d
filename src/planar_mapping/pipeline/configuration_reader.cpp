// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/configuration_reader.h"

#include <algorithm>
#include <filesystem>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/pipeline/plugin.h"

namespace planar_mapping::detail {
namespace {

const std::vector<std::string> kTopKeys = {
    "version", "profile", "seed",  "threads", "inputs", "poses",          "calibration",
    "frames",  "plugins", "scale", "stages",  "up",     "sensor_origin_m"};

}  // namespace

const std::vector<std::pair<std::string, std::optional<Vector3>>>& upAxes() {
  static const std::vector<std::pair<std::string, std::optional<Vector3>>> axes = {
      {"auto", std::nullopt},
      {"x", Vector3(Vector3::UnitX())},
      {"y", Vector3(Vector3::UnitY())},
      {"z", Vector3(Vector3::UnitZ())},
      {"-x", Vector3(-Vector3::UnitX())},
      {"-y", Vector3(-Vector3::UnitY())},
      {"-z", Vector3(-Vector3::UnitZ())}};
  return axes;
}

ConfigurationReader::ConfigurationReader(const std::string& path, StageTable& table,
                                         const ConfigurationOverrides& overrides, bool with_plugins)
    : path_(path),
      table_(table),
      overrides_(overrides),
      with_plugins_(with_plugins),
      problems_(path) {
  configuration_.path = path;
  settings_.word("profile", configuration_.settings.profile,
                 {{"paper", Profile::Paper}, {"compact", Profile::Compact}}, "");
  settings_.integer("version", version_, Range::between(1, Configuration::kVersion), "");
  settings_.integer("seed", seed_, Range::between(0, RunSettings::kLargestSeed), "");
  settings_.word("up", configuration_.settings.up, upAxes(), "");
  settings_.integer("threads", configuration_.settings.threads, Range::between(0, 1024), "");
  settings_.number("scale", configuration_.scale, Range::between(1e-6, 1e6), "");
  settings_.vector("sensor_origin_m", configuration_.sensor_origin, "");
}

Configuration ConfigurationReader::read(const std::string& text) {
  const YAML::Node root = loadDocument(text, problems_);
  if (root.IsDefined()) {
    if (root.IsMap()) {
      readTop(root);
    } else {
      problems_.add(root.Mark(), "a configuration is a mapping of keys, not " + describe(root) +
                                     "; it starts with 'version: 1'");
    }
  }
  if (!problems_.empty()) throw ConfigError(problems_.sorted());
  return std::move(configuration_);
}

void ConfigurationReader::readTop(const YAML::Node& root) {
  const auto entries = entriesOf(root, "the configuration", problems_);
  const auto find = [&entries](const std::string& key) {
    for (const auto& entry : entries) {
      if (entry.first.Scalar() == key) return entry.second;
    }
    return YAML::Node(YAML::NodeType::Undefined);
  };
  if (!find("version").IsDefined())
    problems_.add(root.Mark(), "key 'version' is missing; write 'version: 1'");
  if (!find("stages").IsDefined())
    problems_.add(root.Mark(), "key 'stages' is missing: the list of what to do with each frame");
  // The profile decides on the stages' defaults and plugins on their names: both come first.
  readProfile(find("profile"));
  if (find("plugins").IsDefined()) readPlugins(find("plugins"));
  for (const auto& entry : entries) {
    const std::string& key = entry.first.Scalar();
    if (key == "profile" || key == "plugins" || key == "stages") continue;
    if (std::find(kTopKeys.begin(), kTopKeys.end(), key) == kTopKeys.end()) {
      problems_.add(entry.first.Mark(),
                    "there is no key '" + key + "' here" + didYouMean(key, kTopKeys));
      continue;
    }
    readTopEntry(key, entry.second, problems_.at(entry.second.Mark()));
  }
  if (find("stages").IsDefined()) readStages(find("stages"));
  for (const std::string& assignment : overrides_.assignments) applyAssignment(assignment);
  checkOrder();
  configuration_.settings.seed = static_cast<std::uint64_t>(seed_);
  if (problems_.empty()) configureStages();
}

void ConfigurationReader::readProfile(const YAML::Node& value) {
  if (value.IsDefined()) readSetting("profile", value, problems_.at(value.Mark()));
  for (const std::string& assignment : overrides_.assignments) {
    if (assignment.compare(0, 8, "profile=") != 0) continue;
    readSetting("profile", YAML::Node(assignment.substr(8)),
                problems_.elsewhere(overrides_.assigned_by + assignment));
  }
  if (overrides_.profile)
    readSetting("profile", YAML::Node(*overrides_.profile),
                problems_.elsewhere("--profile " + *overrides_.profile));
}

void ConfigurationReader::readSetting(const std::string& key, const YAML::Node& value,
                                      const Report& report) {
  const Parameter& parameter = *settings_.find(key);
  ParameterValue parsed;
  if (readValue(parameter, value, parsed, report)) parameter.set(parsed);
}

void ConfigurationReader::readTopEntry(const std::string& key, const YAML::Node& value,
                                       const Report& report) {
  if (key == "version") {
    readSetting(key, value, [&report](const std::string& text) {
      report(text + "; this program reads version 1");
    });
  } else if (settings_.find(key) != nullptr) {
    readSetting(key, value, report);
  } else if (key == "inputs") {
    readStringList(key, value, report, configuration_.inputs);
  } else if (key == "poses" || key == "calibration") {
    if (value.IsScalar() && !value.Scalar().empty()) {
      std::string& path = key == "poses" ? configuration_.poses : configuration_.calibration;
      path = absolutePath(value.Scalar());
    } else {
      report(key + " must be the path of a " +
             (key == "poses" ? "trajectory in TUM or KITTI format" : "calib.yaml") + ", not " +
             describe(value));
    }
  } else if (key == "frames") {
    try {
      configuration_.frames = parseFrameSelection(value.IsScalar() ? value.Scalar() : "");
    } catch (const InputError& error) {
      report(error.what());
    }
  }
}

void ConfigurationReader::readStringList(const std::string& key, const YAML::Node& value,
                                         const Report& report,
                                         std::vector<std::string>& list) const {
  if (!value.IsSequence()) return report(key + " must be a list of paths, not " + describe(value));
  for (const auto& item : value) {
    if (item.IsScalar() && !item.Scalar().empty()) {
      list.push_back(absolutePath(item.Scalar()));
    } else {
      report(key + " must be a list of paths; one of them is " + describe(item));
    }
  }
}

void ConfigurationReader::readPlugins(const YAML::Node& list) {
  std::vector<std::string> paths;
  readStringList("plugins", list, problems_.at(list.Mark()), paths);
  std::size_t i = 0;
  for (const auto& item : list) {
    if (i >= paths.size()) break;
    const std::string& path = paths[i++];
    const std::filesystem::path name = item.Scalar();
    if (!name.is_absolute() && name.has_parent_path()) {
      problems_.add(item.Mark(), "plugin " + item.Scalar() +
                                     " has to be named by an absolute path, or lie beside the "
                                     "configuration file and be named without a folder");
      continue;
    }
    configuration_.plugins.push_back(path);
    if (!with_plugins_) continue;
    try {
      loadPlugin(path, table_);
    } catch (const Error& error) {
      problems_.add(item.Mark(), std::string("plugin ") + error.what());
    }
  }
}

std::string ConfigurationReader::absolutePath(const std::string& path) const {
  namespace fs = std::filesystem;
  if (fs::path(path).is_absolute()) return path;
  return fs::absolute(fs::path(path_).parent_path() / path).lexically_normal().string();
}

}  // namespace planar_mapping::detail

namespace planar_mapping {

Configuration parseConfiguration(const std::string& text, const std::string& path,
                                 StageTable& table, const ConfigurationOverrides& overrides,
                                 Plugins plugins) {
  // Nothing of a file that is rejected is executed.
  Configuration configuration =
      detail::ConfigurationReader(path, table, overrides, false).read(text);
  if (configuration.plugins.empty() || plugins == Plugins::Ignore) return configuration;
  return detail::ConfigurationReader(path, table, overrides, true).read(text);
}

}  // namespace planar_mapping
