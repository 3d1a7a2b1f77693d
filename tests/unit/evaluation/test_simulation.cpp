// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/simulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "planar_mapping/core/error.h"
#include "planar_mapping/io/sequence.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace evaluation {
namespace {

SimulationParams smallParams(const std::string& scene) {
  SimulationParams params;
  params.scene = scene;
  params.frames = 3;
  params.width = 96;
  params.height = 72;
  return params;
}

TEST(Simulation, PerfectPointsLieOnTheLabelledPlanes) {
  for (const std::string& scene : sceneNames()) {
    SimulationParams params = smallParams(scene);
    params.sensor = StereoSensorParams::perfect();
    params.yaw = 0.3;
    const Simulation simulation(params);
    for (std::size_t k = 0; k < simulation.size(); ++k) {
      const SimulatedFrame frame = simulation.frame(k);
      std::size_t on_planes = 0;
      for (std::size_t i = 0; i < frame.labels.size(); ++i) {
        if (frame.labels[i] == 0) continue;
        ASSERT_LE(frame.labels[i], simulation.planes().size());
        const Vector3 point(frame.xyz[3 * i], frame.xyz[3 * i + 1], frame.xyz[3 * i + 2]);
        const double depth = point.z();
        const Plane& plane = simulation.planes()[frame.labels[i] - 1];
        EXPECT_NEAR(plane.signedDistance(frame.T_world_camera * point), 0.0, 1e-5 * depth);
        ++on_planes;
      }
      EXPECT_GT(on_planes, frame.labels.size() / 4) << scene;
    }
  }
}

TEST(Simulation, TheSameSeedGivesTheSameFramesInAnyOrder) {
  const Simulation first(smallParams("room"));
  const Simulation second(smallParams("room"));
  second.frame(2);
  const std::vector<float> a = first.frame(1).xyz;
  const std::vector<float> b = second.frame(1).xyz;
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0);
  SimulationParams other = smallParams("room");
  other.seed = 99;
  EXPECT_NE(Simulation(other).frame(1).disparity, first.frame(1).disparity);
  EXPECT_NE(first.frame(0).disparity, first.frame(1).disparity);
}

TEST(Simulation, NoisyPointsStayNearTheTruth) {
  SimulationParams params = smallParams("room");
  params.width = 320;
  params.height = 240;
  const Simulation simulation(params);
  const SimulatedFrame frame = simulation.frame(0);
  const double bf = simulation.params().sensor.baseline * frame.truth.camera.fx;
  std::size_t measured = 0, far = 0;
  for (std::size_t i = 0; i < frame.labels.size(); ++i) {
    if (frame.disparity[i] <= 0.0f) {
      EXPECT_TRUE(std::isnan(frame.xyz[3 * i]));
      continue;
    }
    ++measured;
    far += std::abs(frame.disparity[i] - bf / frame.truth.depth[i]) > 1.0 ? 1 : 0;
  }
  EXPECT_GT(measured, frame.labels.size() / 2);
  EXPECT_LT(far, measured / 20) << "only flying pixels are";
}

TEST(Simulation, CameraMovesAtTheSpeedAskedFor) {
  SimulationParams params = smallParams("corridor");
  params.frames = 10;
  const Simulation simulation(params);
  for (std::size_t i = 1; i < simulation.size(); ++i) {
    const SimulatedFrame a = simulation.frame(i - 1);
    const SimulatedFrame b = simulation.frame(i);
    const double distance =
        (b.T_world_camera.translation() - a.T_world_camera.translation()).norm();
    EXPECT_LE(distance / (b.timestamp - a.timestamp), 0.4 + 1e-9);
  }
}

TEST(WriteSequence, IsReadBackAsASequenceWithItsPoses) {
  const TemporaryDirectory dir;
  const Simulation simulation(smallParams("outdoor"));
  std::size_t done = 0;
  writeSequence(simulation, dir / "a/b", false, [&done](std::size_t count) { done = count; });
  EXPECT_EQ(done, 3u);
  const io::Sequence sequence({dir / "a/b"});
  ASSERT_EQ(sequence.size(), 3u);
  EXPECT_EQ(sequence.kind(), io::SequenceKind::Clouds);
  EXPECT_EQ(sequence.poseSource(), io::PoseSource::File);
  for (std::size_t i = 0; i < 3; ++i) {
    const SimulatedFrame truth = simulation.frame(i);
    const io::Frame frame = sequence.read(i);
    EXPECT_EQ(frame.timestamp, truth.timestamp);
    EXPECT_TRUE(frame.T_world_sensor->isApprox(truth.T_world_camera, 1e-12));
    EXPECT_TRUE(frame.cloud.T_world_sensor.isApprox(truth.T_world_camera, 1e-12));
    ASSERT_TRUE(frame.camera);
    EXPECT_DOUBLE_EQ(frame.camera->fx, truth.truth.camera.fx);
    EXPECT_EQ(frame.cloud.labels, truth.labels);
    EXPECT_EQ(frame.cloud.colors, truth.truth.colors);
    EXPECT_EQ(std::memcmp(frame.cloud.xyz.data(), truth.xyz.data(), truth.xyz.size() * 4), 0);
  }
  EXPECT_TRUE(std::filesystem::exists(dir / "a/b/scene.json"));
  EXPECT_THROW(writeSequence(simulation, dir / "a/b", false), IoError);
  EXPECT_NO_THROW(writeSequence(simulation, dir / "a/b", true));
  EXPECT_THROW(writeSequence(simulation, "/proc/nowhere", false), IoError);
}

TEST(Simulation, RefusesParametersOutOfRange) {
  const auto with = [](void (*change)(SimulationParams&)) {
    SimulationParams params = smallParams("room");
    change(params);
    return params;
  };
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.scene = "attic"; })), InputError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.frames = 0; })), ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.width = 4; })), ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.speed = 0.0; })), ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.yaw = NAN; })), ParameterError);
  EXPECT_THROW(Simulation(smallParams("room")).frame(3), InputError);
}

}  // namespace
}  // namespace evaluation
}  // namespace planar_mapping
