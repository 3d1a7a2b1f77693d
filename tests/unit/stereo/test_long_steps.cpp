// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Steps of a vehicle, between which texture looks different. Seeds 7101 to 7103 chose the numbers.
#include <gtest/gtest.h>

#include <utility>

#include "planar_mapping/evaluation/simulation.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping {
namespace {

/// 3.2 m and up to 37 degrees a step: the ground and the far wall are larger in the next image, so
/// that their gray values hardly agree, but features know them again.
TEST(LongSteps, OutdoorsArePlacedByWhatLiesInSpace) {
  evaluation::SimulationParams params;
  params.scene = "outdoor";
  params.seed = 7211;
  params.frames = 16;
  params.clouds = false;
  params.images = true;
  params.threads = 0;
  const evaluation::Simulation simulation(params);
  io::Calibration calibration;
  calibration.camera = params.camera();
  calibration.cx_right = calibration.camera.cx;
  calibration.baseline = params.sensor.baseline;

  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments = {"motion_estimation.poses=ignore"};
  Pipeline pipeline(loadConfiguration(PLANAR_MAPPING_SOURCE_DIR "/config/stereo_outdoor.yaml",
                                      table, overrides));
  std::vector<std::pair<Pose, Pose>> placed;  // true, found
  for (std::size_t i = 0; i < simulation.size(); i += 2) {
    const evaluation::SimulatedFrame simulated = simulation.frame(i);
    Frame frame;
    frame.number = simulated.index;
    frame.timestamp = simulated.timestamp;
    frame.cloud = pcl::make_shared<FrameCloud>();
    frame.images.left = simulated.left;
    frame.images.right = simulated.right;
    frame.images.calibration = calibration;
    pipeline.process(frame);
    if (frame.skip_reason.empty())
      placed.emplace_back(simulated.T_world_camera, frame.T_world_sensor);
  }
  ASSERT_GE(placed.size(), 7u) << "of 8";  // 3, where gray values have to agree
  for (std::size_t i = 1; i < placed.size(); ++i) {
    const Pose truth = placed[i - 1].first.inverse() * placed[i].first;
    const Pose found = placed[i - 1].second.inverse() * placed[i].second;
    const double metres = (truth.translation() - found.translation()).norm();
    EXPECT_LT(metres, 0.1 + 0.05 * truth.translation().norm()) << "step " << i;
    EXPECT_LT(Eigen::AngleAxisd(Matrix3(truth.linear().transpose() * found.linear())).angle(), 0.02)
        << "step " << i;
  }
}

}  // namespace
}  // namespace planar_mapping
