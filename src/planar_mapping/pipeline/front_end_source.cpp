// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/front_end_source.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <sstream>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/sequence_source.h"

namespace planar_mapping {
namespace {

constexpr const char* kName = "configuration of the mapping side";

[[noreturn]] void refuse(const std::string& problem) {
  throw ConfigError({std::string(kName) + ":1:1: " + problem});
}

/// Only keys that say how to look at frames: the mapping side must not make this machine read its
/// files or load its libraries.
void requireHarmless(const std::string& yaml) {
  static const std::vector<std::string> allowed = {"version", "profile", "seed", "frames",
                                                   "stages"};
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (!root.IsMap()) refuse("this is no configuration");
    for (const auto& entry : root) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (std::find(allowed.begin(), allowed.end(), key) == allowed.end())
        refuse("key '" + key + "' is not taken from the network");
    }
  } catch (const YAML::Exception& error) {
    refuse(error.msg);
  }
}

class FrontEndSource : public SequenceSource {
 public:
  explicit FrontEndSource(Configuration configuration)
      : SequenceSource(configuration), pipeline_(std::move(configuration)) {}

  std::optional<Frame> next() override {
    std::optional<Frame> frame = SequenceSource::next();
    if (frame) pipeline_.processFrontEnd(*frame);
    return frame;
  }

 private:
  Pipeline pipeline_;
};

}  // namespace

std::string frontEndYaml(const Configuration& configuration) {
  std::size_t wanted = 1;
  for (std::size_t i = 0; i < configuration.stages.size(); ++i) {
    const StageKind kind = configuration.stages[i].kind;
    if (kind == StageKind::Images || kind == StageKind::Features) wanted = i + 1;
  }
  std::istringstream lines(effectiveYaml(configuration));
  std::string yaml;
  bool keeps = true;
  std::size_t stages = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.front() != ' ') {  // top level
      const std::string key = line.substr(0, line.find(':'));
      keeps = key != "inputs" && key != "poses" && key != "calibration" && key != "plugins" &&
              key != "threads";
    } else if (line.compare(0, 10, "  - stage:") == 0 && ++stages > wanted) {
      keeps = false;
    }
    if (keeps) yaml += line + "\n";
  }
  return yaml;
}

std::unique_ptr<FrameSource> makeFrontEndSource(const std::string& yaml,
                                                const FrontEndInput& input) {
  requireHarmless(yaml);
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  if (input.threads >= 0)
    overrides.assignments.push_back("threads=" + std::to_string(input.threads));
  Configuration configuration = parseConfiguration(yaml, kName, table, overrides);
  configuration.inputs = input.inputs;
  configuration.poses = input.poses;
  configuration.calibration = input.calibration;
  return std::make_unique<FrontEndSource>(std::move(configuration));
}

}  // namespace planar_mapping
