// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/simulated_sequence.h"

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping::evaluation {
namespace {

using Json = nlohmann::ordered_json;

/// All that a frame depends on, by name.
template <typename Params, typename Act>
void forEachParameter(Params& params, const Act& act) {
  act("scene", params.scene);
  act("frames", params.frames);
  act("path", params.path);
  act("step_m", params.step);
  act("length_m", params.length);
  act("floors", params.floors);
  act("rooms", params.rooms);
  act("walk", params.walk);
  act("moving", params.moving);
  act("seed", params.seed);
  act("yaw_rad", params.yaw);
  act("width", params.width);
  act("height", params.height);
  act("focal_length_px", params.focal_length);
  act("plain_fraction", params.plain_fraction);
  act("image_noise", params.image_noise);
  act("color", params.color_images);
  auto& sensor = params.sensor;
  act("baseline_m", sensor.baseline);
  act("noise_px", sensor.noise_px);
  act("disparity_step_px", sensor.disparity_step_px);
  act("smallest_disparity_px", sensor.smallest_disparity_px);
  act("edge_px", sensor.edge_px);
  act("flying_fraction", sensor.flying_fraction);
  act("edge_hole_fraction", sensor.edge_hole_fraction);
  act("hole_fraction", sensor.hole_fraction);
  act("smallest_incidence", sensor.smallest_incidence);
  act("wrong_fraction", sensor.wrong_fraction);
}

class SimulatedFrames : public io::FrameMaker {
 public:
  explicit SimulatedFrames(const SimulationParams& params) : simulation_(params) {}

  void make(std::size_t index, io::Frame& frame) const override {
    SimulatedFrame seen = simulation_.frame(index);
    frame.cloud.width = static_cast<std::uint32_t>(seen.truth.camera.width);
    frame.cloud.height = static_cast<std::uint32_t>(seen.truth.camera.height);
    frame.cloud.xyz = std::move(seen.xyz);
    frame.left = std::move(seen.left);
  }

 private:
  Simulation simulation_;
};

}  // namespace

void writeDescription(const Simulation& simulation, const std::string& directory, bool overwrite) {
  const io::Overwrite mode = overwrite ? io::Overwrite::Allow : io::Overwrite::Refuse;
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) throw IoError(directory, "cannot be created: " + error.message());
  Json json;
  forEachParameter(simulation.params(),
                   [&](const char* name, const auto& value) { json[name] = value; });
  json["frames"] = simulation.size();
  io::writeFileAtomically(directory + "/simulation.json", json.dump(1) + "\n", mode);
  io::Calibration calibration = simulation.params().calibration();
  calibration.depth_scale = kTruthDepthScale;  // unused: nothing is stored
  io::writeFileAtomically(directory + "/calib.yaml", io::toYaml(calibration), mode);
  io::writeTumPoses(directory + "/poses.txt", simulation.trajectory(), mode);
}

std::unique_ptr<const io::FrameMaker> openSimulation(const std::string& path) {
  SimulationParams params;
  params.images = params.left_only = true;
  try {
    const Json json = Json::parse(io::readWholeText(path));
    forEachParameter(params, [&](const char* name, auto& value) { json.at(name).get_to(value); });
    return std::make_unique<SimulatedFrames>(params);
  } catch (const Json::exception&) {
    throw IoError(path, "is no description of a simulation, or damaged");
  } catch (const ParameterError& error) {
    throw IoError(path, error.what());
  }
}

}  // namespace planar_mapping::evaluation
