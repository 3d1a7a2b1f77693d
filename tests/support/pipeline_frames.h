// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "evaluation/simulation/simulation.h"
#include "map_scene.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping::test {

/// The simulated corridor of the long runs, turned by 20 degrees against the grid, as a stereo
/// camera of 0.12 m sees it.
struct SimulatedCorridor {
  bool standing = false;  ///< every frame from one place
  int frames = 1000;
  double length = 100.0;  ///< metres
  int width = 320;        ///< of the images, pixels; the height is 3/4 of it
  double noise_px = 0.5;  ///< of the disparity, at a width of 640 pixels

  evaluation::SimulationParams params() const {
    constexpr double kYaw = 0.35;   // radians
    constexpr double kWidth = 640;  // pixels, that the noise is meant for
    evaluation::SimulationParams params;
    params.scene = "corridor";
    params.frames = frames;
    params.yaw = kYaw;
    params.length = length;
    if (standing) params.path = evaluation::Path::Standing;
    params.width = width;
    params.height = width * 3 / 4;
    params.sensor.baseline = 0.12;
    params.sensor.noise_px = noise_px * width / kWidth;
    params.sensor.smallest_disparity_px *= width / kWidth;
    params.colors = false;
    params.threads = 0;
    return params;
  }
};

/// A frame of a simulation as the pipeline takes it, with its pose given.
inline Frame simulatedFrame(const evaluation::Simulation& simulation, std::size_t index) {
  const evaluation::SimulatedFrame simulated = simulation.frame(index);
  Frame frame;
  frame.number = index;
  frame.timestamp = simulated.timestamp;
  frame.T_world_sensor = simulated.T_world_camera;
  frame.given_pose = simulated.T_world_camera;
  frame.camera = simulated.truth.camera;
  frame.baseline = simulation.params().sensor.baseline;
  frame.cloud = FrameCloud::Ptr(new FrameCloud(static_cast<std::uint32_t>(frame.camera->width),
                                               static_cast<std::uint32_t>(frame.camera->height)));
  frame.cloud->is_dense = false;
  for (std::size_t i = 0; i < frame.cloud->size(); ++i) {
    pcl::PointXYZ& point = (*frame.cloud)[i];
    point.x = simulated.xyz[3 * i];
    point.y = simulated.xyz[3 * i + 1];
    point.z = simulated.xyz[3 * i + 2];
  }
  return frame;
}

/// What a camera in a scene sees, as the pipeline takes it, with its pose given.
inline Frame frameOf(const View& view) {
  Frame frame;
  frame.source = "test";
  frame.cloud = cloudOf(view.xyz, static_cast<std::uint32_t>(view.camera.width),
                        static_cast<std::uint32_t>(view.camera.height));
  frame.camera = view.camera;
  frame.given_pose = view.pose;
  return frame;
}

/// Of stages as YAML lists them.
inline Configuration configurationOf(const std::string& stages) {
  StageTable table;
  registerBuiltinStages(table);
  return parseConfiguration("version: 1\nstages:\n" + stages, "test", table);
}
inline Pipeline pipelineOf(const std::string& stages) {
  return Pipeline(configurationOf(stages));
}

/// One of the folder config/.
inline Configuration readyConfiguration(const std::string& name,
                                        const std::vector<std::string>& assignments = {}) {
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments = assignments;
  return loadConfiguration(std::string(PLANAR_MAPPING_SOURCE_DIR) + "/config/" + name, table,
                           overrides);
}

}  // namespace planar_mapping::test
