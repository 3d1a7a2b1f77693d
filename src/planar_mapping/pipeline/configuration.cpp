// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/configuration.h"

#include <dlfcn.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/configuration_reader.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

/// share/planar_mapping/config beside the folder of this library (of the program, if it is linked
/// statically) or up to three folders higher: lib/x86_64-linux-gnu and lib/python3/dist-packages
/// are below lib. Empty if there is none.
fs::path readyConfigurations() {
  constexpr int kMaxLevels = 4;
  Dl_info self{};
  if (::dladdr(reinterpret_cast<const void*>(&findConfiguration), &self) == 0) return {};
  std::error_code error;
  fs::path folder = fs::canonical(self.dli_fname, error).parent_path();
  for (int level = 0; level < kMaxLevels && folder.has_relative_path(); ++level) {
    folder = folder.parent_path();
    fs::path configurations = folder / "share" / "planar_mapping" / "config";
    if (fs::is_directory(configurations, error)) return configurations;
  }
  return {};
}

/// For a message: "; ready: a.yaml, b.yaml", or that there are none.
std::string listReadyConfigurations() {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(readyConfigurations(), error))
    names.push_back(entry.path().filename().string());
  if (names.empty()) return "; none is ready: no share/planar_mapping/config is near the program";
  std::sort(names.begin(), names.end());
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "; ready: " : ", ") + name;
  return list;
}

constexpr std::uintmax_t kLargestFile = 1u << 20u;  // a configuration of a megabyte is a mistake

std::string readText(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status))
    throw ConfigError({path + ":1:1: there is no such file" + listReadyConfigurations()});
  if (!fs::is_regular_file(status))
    throw ConfigError({path + ":1:1: this is not a file; give a configuration file (*.yaml)"});
  if (fs::file_size(path, error) > kLargestFile)
    throw ConfigError({path + ":1:1: larger than 1 MiB, so this is no configuration file"});
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  // An empty file sets failbit on the receiving stream, which is no reading error.
  if (!in.is_open() || in.bad())
    throw ConfigError({path + ":1:1: the file cannot be read; check its permissions"});
  return text.str();
}

void appendList(std::string& yaml, const std::string& key, const std::vector<std::string>& items) {
  if (items.empty()) return;
  yaml += key + ":\n";
  for (const std::string& item : items) yaml += "  - " + toYaml(ParameterValue(item)) + "\n";
}

}  // namespace

std::string FrameSelection::text() const {
  return std::to_string(first) + ":" + (last < 0 ? "" : std::to_string(last)) + ":" +
         std::to_string(step);
}

FrameSelection parseFrameSelection(const std::string& text) {
  const auto fail = [&text]() {
    return InputError("frames '" + text +
                      "' are not A:B:STEP with 0 <= A < B and STEP >= 1 (parts may be left out)");
  };
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ':') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  if (text.empty() || parts.size() > 3) throw fail();
  FrameSelection selection;
  std::int64_t* const targets[] = {&selection.first, &selection.last, &selection.step};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].empty()) continue;
    const char* end = parts[i].data() + parts[i].size();
    std::int64_t number = 0;
    const auto result = std::from_chars(parts[i].data(), end, number);
    *targets[i] = number;
    if (result.ec != std::errc() || result.ptr != end || *targets[i] < 0) throw fail();
  }
  if (parts.size() == 1) selection.last = selection.first + 1;
  if (selection.step < 1 || (selection.last >= 0 && selection.last <= selection.first))
    throw fail();
  return selection;
}

bool hasStage(const Configuration& configuration, StageKind kind) {
  return std::any_of(
      configuration.stages.begin(), configuration.stages.end(),
      [kind](const ConfiguredStage& stage) { return stage.kind == kind && stage.enabled; });
}

bool usesImages(const Configuration& configuration) {
  return hasStage(configuration, StageKind::Images) ||
         hasStage(configuration, StageKind::Features) || hasStage(configuration, StageKind::Motion);
}

bool hasStageWith(const Configuration& configuration, StageKind kind, const std::string& key,
                  const std::string& word) {
  return std::any_of(configuration.stages.begin(), configuration.stages.end(),
                     [&](const ConfiguredStage& stage) {
                       const Parameter* parameter = stage.parameters.find(key);
                       return stage.enabled && stage.kind == kind && parameter != nullptr &&
                              parameter->get() == ParameterValue(word);
                     });
}

Configuration loadConfiguration(const std::string& path, StageTable& table,
                                const ConfigurationOverrides& overrides, Plugins plugins) {
  const std::string found = findConfiguration(path);
  return parseConfiguration(readText(found), found, table, overrides, plugins);
}

std::string effectiveYaml(const Configuration& configuration) {
  const RunSettings& settings = configuration.settings;
  std::string yaml = "version: " + std::to_string(Configuration::kVersion) + "\n";
  yaml +=
      std::string("profile: ") + (settings.profile == Profile::Paper ? "paper" : "compact") + "\n";
  yaml += "seed: " + std::to_string(settings.seed) + "\n";
  yaml += "threads: " + std::to_string(settings.threads) + "\n";
  if (configuration.scale != 1.0)
    yaml += "scale: " + toYaml(ParameterValue(configuration.scale)) + "\n";
  if (configuration.sensor_origin)
    yaml += "sensor_origin_m: " + toYaml(ParameterValue(*configuration.sensor_origin)) + "\n";
  for (const auto& [word, axis] : detail::upAxes()) {
    if (axis && axis == settings.up) yaml += "up: " + word + "\n";
  }
  appendList(yaml, "inputs", configuration.inputs);
  if (!configuration.poses.empty())
    yaml += "poses: " + toYaml(ParameterValue(configuration.poses)) + "\n";
  if (!configuration.calibration.empty())
    yaml += "calibration: " + toYaml(ParameterValue(configuration.calibration)) + "\n";
  yaml += "frames: \"" + configuration.frames.text() + "\"\n";
  appendList(yaml, "plugins", configuration.plugins);
  yaml += configuration.stages.empty() ? "stages: []\n" : "stages:\n";
  for (const ConfiguredStage& stage : configuration.stages) {
    yaml += "  - stage: " + stage.name + "\n";
    if (!stage.enabled) yaml += "    enabled: false\n";
    for (const Parameter& parameter : stage.parameters.parameters())
      yaml += "    " + parameter.name + ": " + toYaml(parameter.get()) + "\n";
  }
  return yaml;
}

std::string withoutThreads(std::string effective_yaml) {
  const std::size_t before = effective_yaml.find("\nthreads: ");
  if (before != std::string::npos)
    effective_yaml.erase(before, effective_yaml.find('\n', before + 1) - before);
  return effective_yaml;
}

std::string findConfiguration(const std::string& name) {
  std::error_code error;
  if (name.empty() || fs::path(name).has_parent_path() || fs::exists(name, error)) return name;
  const fs::path ready = readyConfigurations() / name;
  return ready.is_absolute() && fs::is_regular_file(ready, error) ? ready.string() : name;
}

}  // namespace planar_mapping
