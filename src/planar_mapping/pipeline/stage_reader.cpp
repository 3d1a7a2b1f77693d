// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The stages of a configuration, and what the command line sets of them.
#include <algorithm>
#include <optional>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/pipeline/configuration_reader.h"

namespace planar_mapping::detail {
namespace {

/// What a stage does that has a place in the chain.
const char* placeOf(StageKind kind) {
  constexpr const char* kPlaces[] = {"makes the cloud from images",
                                     "finds key features",
                                     "finds the pose",
                                     "works on points",
                                     "finds planes",
                                     "decides on points",
                                     "puts the frame into the map"};
  return kPlaces[static_cast<int>(kind)];
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

void ConfigurationReader::readStages(const YAML::Node& list) {
  if (!list.IsSequence())
    return problems_.add(
        list.Mark(), "stages must be a list, each entry '- stage: NAME', not " + describe(list));
  if (list.size() == 0)
    problems_.add(list.Mark(), "the list of stages is empty; see planar_map stages");
  for (const auto& entry : list) readStage(entry);
}

void ConfigurationReader::readStage(const YAML::Node& entry) {
  if (!entry.IsMap())
    return problems_.add(entry.Mark(),
                         "an entry of stages is written '- stage: NAME' with its keys below, not " +
                             describe(entry));
  const auto entries = entriesOf(entry, "this stage", problems_);
  const YAML::Node* name_node = nullptr;
  for (const auto& item : entries) {
    if (item.first.Scalar() == "stage") name_node = &item.second;
  }
  if (name_node == nullptr || !name_node->IsScalar())
    return problems_.add(entry.Mark(), "key 'stage', the name of the stage, is missing here");
  const std::string& name = name_node->Scalar();
  const StageEntry* known = table_.find(name);
  const std::string option = known == nullptr ? table_.missingOption(name) : "";
  if (!option.empty())
    return problems_.add(name_node->Mark(), "stage '" + name +
                                                "' was not built; configure with -D" + option +
                                                "=ON and its dependencies installed");
  if (known == nullptr && !with_plugins_ && !configuration_.plugins.empty()) {
    configuration_.unknown_stages.push_back(name);
    return;
  }
  if (known == nullptr) {
    std::vector<std::string> names;
    for (const StageEntry& each : table_.entries()) names.push_back(each.name);
    const std::string meant = didYouMean(name, names);
    return problems_.add(name_node->Mark(),
                         "there is no stage '" + name + "'" +
                             (meant.empty() ? "; planar_map stages lists them" : meant));
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
  const Report report = problems_.elsewhere(overrides_.assigned_by + assignment);
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0)
    return report("is not of the form stage.key=value");
  const std::string target = assignment.substr(0, equals);
  YAML::Node value;
  try {
    value = YAML::Load(assignment.substr(equals + 1));
  } catch (const YAML::Exception& error) {
    return report("the value is no YAML: " + error.msg);
  }
  const std::size_t dot = target.find('.');
  if (dot == std::string::npos) {
    const bool settable = target == "seed" || target == "threads" || target == "scale" ||
                          target == "frames" || target == "up" || target == "sensor_origin_m";
    if (settable) {
      readTopEntry(target, value, report);
    } else if (target != "profile") {
      report("there is no such key" +
             didYouMean(target, {"seed", "threads", "scale", "frames", "profile", "up",
                                 "sensor_origin_m"}) +
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
  const std::vector<std::string>& unknown = configuration_.unknown_stages;
  const bool may_be_of_plugin = std::find(unknown.begin(), unknown.end(), name) != unknown.end();
  if (!found && !may_be_of_plugin)
    report("there is no stage '" + name + "' in " + path_ + didYouMean(name, chain));
}

void ConfigurationReader::checkOrder() {
  const ConfiguredStage* last = nullptr;
  bool may_move = true;  // a Motion stage may come after the stages so far
  for (std::size_t i = 0; i < configuration_.stages.size(); ++i) {
    const ConfiguredStage& stage = configuration_.stages[i];
    if (stage.kind == StageKind::Any || !stage.enabled) continue;
    const bool in_order = last == nullptr || stage.kind >= last->kind ||
                          (stage.kind == StageKind::Motion && may_move);
    may_move = may_move && (stage.kind < StageKind::Motion ||
                            (stage.kind == StageKind::Points && stage.stage->worksBeforeMotion()));
    if (!in_order) {
      problems_.add(stage_marks_[i], "stage '" + stage.name + "' " + placeOf(stage.kind) +
                                         " and so must stand before '" + last->name + "', which " +
                                         placeOf(last->kind));
    } else if (last != nullptr && stage.kind == last->kind && stage.kind != StageKind::Points) {
      problems_.add(stage_marks_[i], "stage '" + stage.name + "' cannot follow '" + last->name +
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

}  // namespace planar_mapping::detail
