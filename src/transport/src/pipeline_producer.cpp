// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <yaml-cpp/yaml.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>

#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/transport/front_end.h"

namespace planar_mapping::transport {
namespace {

constexpr const char* kName = "configuration of the mapping side";

/// Only what says how to look at frames: the mapping side shall not make this machine read its
/// files or load its libraries.
void requireHarmless(const std::string& yaml) {
  static const std::vector<std::string> allowed = {"version", "profile", "seed", "frames",
                                                   "stages"};
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (!root.IsMap()) throw ConfigError({std::string(kName) + ":1:1: this is no configuration"});
    for (const auto& entry : root) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (std::find(allowed.begin(), allowed.end(), key) == allowed.end()) {
        throw ConfigError(
            {std::string(kName) + ":1:1: key '" + key + "' is not taken from the network"});
      }
    }
  } catch (const YAML::Exception& error) {
    throw ConfigError({std::string(kName) + ":1:1: " + error.msg});
  }
}

class PipelineProducer : public FrameProducer {
 public:
  explicit PipelineProducer(Configuration configuration)
      : source_(configuration), pipeline_(std::move(configuration)) {}

  Ready describe() const override {
    Ready ready;
    ready.kind = source_.kind();
    ready.pose_source = source_.poseSource();
    ready.frames = source_.size().value_or(0);
    uLong checksum = ::crc32(0, nullptr, 0);
    for (const std::string& name : source_.names()) {
      const std::string file = std::filesystem::path(name).lexically_normal().filename().string();
      checksum = ::crc32_z(checksum, reinterpret_cast<const Bytef*>(file.data()), file.size() + 1);
    }
    ready.fingerprint = checksum;
    ready.name = source_.names().front();
    return ready;
  }

  std::optional<Frame> next() override {
    std::optional<Frame> frame = source_.next();
    if (frame) pipeline_.processFrontEnd(*frame);
    return frame;
  }

 private:
  SequenceSource source_;
  Pipeline pipeline_;
};

}  // namespace

std::unique_ptr<FrameProducer> makePipelineProducer(const std::string& yaml,
                                                    const FrontEndInput& input) {
  requireHarmless(yaml);
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  if (input.threads >= 0) {
    overrides.assignments.push_back("threads=" + std::to_string(input.threads));
  }
  Configuration configuration = parseConfiguration(yaml, kName, table, overrides);
  configuration.inputs = input.inputs;
  configuration.poses = input.poses;
  return std::make_unique<PipelineProducer>(std::move(configuration));
}

}  // namespace planar_mapping::transport
