// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/core/base/detail/spelling.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/plugin.h"
#include "yaml_source.h"

namespace planar_mapping::detail {
namespace {

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
  void checkOrder(const std::vector<YAML::Mark>& marks);
  void configureStages();
  std::string absolutePath(const std::string& path) const;
  bool mayBeOfAPlugin(const std::string& stage) const;
  std::vector<std::string> stageNames() const;

  std::string path_;
  StageTable& table_;
  const ConfigurationOverrides& overrides_;
  const bool with_plugins_;
  ProblemList problems_;
  Configuration configuration_;
  ParameterTable settings_;  ///< the keys of the top level that are numbers or words
  int version_ = 1;
  int seed_ = static_cast<int>(RunSettings().seed);
  std::vector<YAML::Mark> stage_marks_;  ///< of configuration_.stages
};

const std::vector<std::string> kTopKeys = {"version", "profile",     "seed",   "threads", "inputs",
                                           "poses",   "calibration", "frames", "plugins", "stages"};

const char* placeOf(StageKind kind) {
  switch (kind) {
    case StageKind::Images:
      return "makes the cloud from images";
    case StageKind::Features:
      return "finds key features";
    case StageKind::Motion:
      return "finds the pose";
    case StageKind::Points:
      return "works on points";
    case StageKind::Planes:
      return "finds planes";
    case StageKind::Beliefs:
      return "decides on points";
    case StageKind::Map:
      return "puts the frame into the map";
    case StageKind::Any:
      break;
  }
  return "may stand anywhere";
}

/// The key that every stage has beside its own.
const char* const kEnabled = "enabled";

Parameter enabledParameter(ConfiguredStage& stage) {
  Parameter parameter;
  parameter.name = kEnabled;
  parameter.type = ParameterType::Flag;
  parameter.get = [&stage]() -> ParameterValue { return stage.enabled; };
  parameter.set = [&stage](const ParameterValue& value) { stage.enabled = std::get<bool>(value); };
  return parameter;
}

/// One of a stage's own, or `enabled`; nothing if it has no such key.
std::optional<Parameter> parameterOf(ConfiguredStage& stage, const std::string& key) {
  if (key == kEnabled) return enabledParameter(stage);
  const Parameter* own = stage.parameters.find(key);
  return own == nullptr ? std::nullopt : std::optional<Parameter>(*own);
}

std::string noSuchKey(const ConfiguredStage& stage, const std::string& key) {
  std::vector<std::string> names = {kEnabled};
  for (const Parameter& parameter : stage.parameters.parameters()) names.push_back(parameter.name);
  return "stage '" + stage.name + "' has no key '" + key + "'" + didYouMean(key, names);
}

}  // namespace

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
  settings_.integer("seed", seed_, Range::atLeast(0), "");
  settings_.integer("threads", configuration_.settings.threads, Range::between(0, 1024), "");
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
  if (!find("version").IsDefined()) {
    problems_.add(root.Mark(), "key 'version' is missing; write 'version: 1'");
  }
  if (!find("stages").IsDefined()) {
    problems_.add(root.Mark(), "key 'stages' is missing: the list of what to do with each frame");
  }
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
    const YAML::Mark mark = entry.second.Mark();
    readTopEntry(key, entry.second,
                 [this, mark](const std::string& text) { problems_.add(mark, text); });
  }
  if (find("stages").IsDefined()) readStages(find("stages"));
  for (const std::string& assignment : overrides_.assignments) applyAssignment(assignment);
  checkOrder(stage_marks_);
  configuration_.settings.seed = static_cast<std::uint64_t>(seed_);
  if (problems_.empty()) configureStages();
}

void ConfigurationReader::readProfile(const YAML::Node& value) {
  if (value.IsDefined()) {
    readSetting("profile", value,
                [this, &value](const std::string& text) { problems_.add(value.Mark(), text); });
  }
  for (const std::string& assignment : overrides_.assignments) {
    if (assignment.compare(0, 8, "profile=") != 0) continue;
    readSetting("profile", YAML::Node(assignment.substr(8)), [&](const std::string& text) {
      problems_.addElsewhere("--set " + assignment, text);
    });
  }
  if (overrides_.profile) {
    readSetting("profile", YAML::Node(*overrides_.profile), [this](const std::string& text) {
      problems_.addElsewhere("--profile " + *overrides_.profile, text);
    });
  }
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
  if (!value.IsSequence()) {
    report(key + " must be a list of paths, not " + describe(value));
    return;
  }
  for (const auto& item : value) {
    if (item.IsScalar() && !item.Scalar().empty()) {
      list.push_back(absolutePath(item.Scalar()));
    } else {
      report(key + " must be a list of paths; one of them is " + describe(item));
    }
  }
}

void ConfigurationReader::readPlugins(const YAML::Node& list) {
  const YAML::Mark mark = list.Mark();
  std::vector<std::string> paths;
  readStringList(
      "plugins", list, [this, mark](const std::string& text) { problems_.add(mark, text); }, paths);
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

void ConfigurationReader::readStages(const YAML::Node& list) {
  if (!list.IsSequence()) {
    return problems_.add(
        list.Mark(), "stages must be a list, each entry '- stage: NAME', not " + describe(list));
  }
  if (list.size() == 0) {
    problems_.add(list.Mark(), "the list of stages is empty; see planar_map stages");
  }
  for (const auto& entry : list) readStage(entry);
}

void ConfigurationReader::readStage(const YAML::Node& entry) {
  if (!entry.IsMap()) {
    problems_.add(entry.Mark(),
                  "an entry of stages is written '- stage: NAME' with its keys below, not " +
                      describe(entry));
    return;
  }
  const auto entries = entriesOf(entry, "this stage", problems_);
  const YAML::Node* name_node = nullptr;
  for (const auto& item : entries) {
    if (item.first.Scalar() == "stage") name_node = &item.second;
  }
  if (name_node == nullptr || !name_node->IsScalar()) {
    return problems_.add(entry.Mark(), "key 'stage', the name of the stage, is missing here");
  }
  const std::string& name = name_node->Scalar();
  const StageEntry* known = table_.find(name);
  const std::string option = known == nullptr ? table_.missingOption(name) : "";
  if (!option.empty()) {
    problems_.add(name_node->Mark(), "stage '" + name + "' was not built; configure with -D" +
                                         option + "=ON and its dependencies installed");
    return;
  }
  if (known == nullptr && !with_plugins_ && !configuration_.plugins.empty()) {
    configuration_.unknown_stages.push_back(name);
    return;
  }
  if (known == nullptr) {
    problems_.add(
        name_node->Mark(),
        "there is no stage '" + name + "'" + didYouMean(name, stageNames()) +
            (didYouMean(name, stageNames()).empty() ? "; planar_map stages lists them" : ""));
    return;
  }
  ConfiguredStage stage;
  stage.name = name;
  stage.kind = known->kind;
  stage.stage = known->make();
  stage.stage->applyProfile(configuration_.settings.profile);
  stage.stage->declare(stage.parameters);
  readStageKeys(stage, entries);
  configuration_.stages.push_back(std::move(stage));
  stage_marks_.push_back(name_node->Mark());
}

void ConfigurationReader::readStageKeys(
    ConfiguredStage& stage, const std::vector<std::pair<YAML::Node, YAML::Node>>& entries) {
  for (const auto& item : entries) {
    const std::string& key = item.first.Scalar();
    if (key == "stage") continue;
    const std::optional<Parameter> parameter = parameterOf(stage, key);
    if (!parameter) {
      problems_.add(item.first.Mark(), noSuchKey(stage, key));
      continue;
    }
    ParameterValue value;
    const YAML::Mark mark = item.second.Mark();
    const bool sound = readValue(*parameter, item.second, value, [&](const std::string& text) {
      problems_.add(mark.is_null() ? item.first.Mark() : mark,
                    "stage '" + stage.name + "': " + text);
    });
    if (sound) parameter->set(value);
  }
}

void ConfigurationReader::applyAssignment(const std::string& assignment) {
  const std::string where = "--set " + assignment;
  const auto report = [this, &where](const std::string& text) {
    problems_.addElsewhere(where, text);
  };
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    return report("is not of the form stage.key=value");
  }
  const std::string target = assignment.substr(0, equals);
  YAML::Node value;
  try {
    value = YAML::Load(assignment.substr(equals + 1));
  } catch (const YAML::Exception& error) {
    return report("the value is no YAML: " + error.msg);
  }
  const std::size_t dot = target.find('.');
  if (dot == std::string::npos) {
    const bool settable = target == "seed" || target == "threads" || target == "frames";
    if (settable) {
      readTopEntry(target, value, report);
    } else if (target != "profile") {
      report("there is no such key" + didYouMean(target, {"seed", "threads", "frames", "profile"}) +
             "; a stage's key is written stage.key=value");
    }
    return;
  }
  const std::string name = target.substr(0, dot);
  const std::string key = target.substr(dot + 1);
  bool found = false;
  std::vector<std::string> chain;
  for (ConfiguredStage& stage : configuration_.stages) {
    chain.push_back(stage.name);
    if (stage.name != name) continue;
    found = true;
    const std::optional<Parameter> parameter = parameterOf(stage, key);
    if (!parameter) return report(noSuchKey(stage, key));
    ParameterValue parsed;
    if (readValue(*parameter, value, parsed, report)) parameter->set(parsed);
  }
  if (!found && !mayBeOfAPlugin(name)) {
    report("there is no stage '" + name + "' in " + path_ + didYouMean(name, chain));
  }
}

void ConfigurationReader::checkOrder(const std::vector<YAML::Mark>& marks) {
  const ConfiguredStage* last = nullptr;
  for (std::size_t i = 0; i < configuration_.stages.size(); ++i) {
    const ConfiguredStage& stage = configuration_.stages[i];
    if (stage.kind == StageKind::Any || !stage.enabled) continue;
    if (last != nullptr && stage.kind < last->kind) {
      problems_.add(marks[i], "stage '" + stage.name + "' " + placeOf(stage.kind) +
                                  " and so must stand before '" + last->name + "', which " +
                                  placeOf(last->kind));
    } else if (last != nullptr && stage.kind == last->kind && stage.kind != StageKind::Points) {
      problems_.add(marks[i], "stage '" + stage.name + "' cannot follow '" + last->name +
                                  "': one stage that " + placeOf(stage.kind) + " is enough");
    } else {
      last = &stage;
    }
  }
}

void ConfigurationReader::configureStages() {
  configuration_.settings.ignores_poses =
      hasStageWith(configuration_, StageKind::Motion, "poses", "ignore");
  for (std::size_t i = 0; i < configuration_.stages.size(); ++i) {
    try {
      configuration_.stages[i].stage->configure(configuration_.settings);
    } catch (const ParameterError& error) {
      problems_.add(stage_marks_[i],
                    "stage '" + configuration_.stages[i].name + "': " + error.what());
    }
  }
}

std::string ConfigurationReader::absolutePath(const std::string& path) const {
  namespace fs = std::filesystem;
  if (fs::path(path).is_absolute()) return path;
  return fs::absolute(fs::path(path_).parent_path() / path).lexically_normal().string();
}

bool ConfigurationReader::mayBeOfAPlugin(const std::string& stage) const {
  const std::vector<std::string>& names = configuration_.unknown_stages;
  return std::find(names.begin(), names.end(), stage) != names.end();
}

std::vector<std::string> ConfigurationReader::stageNames() const {
  std::vector<std::string> names;
  for (const StageEntry& entry : table_.entries()) names.push_back(entry.name);
  return names;
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
