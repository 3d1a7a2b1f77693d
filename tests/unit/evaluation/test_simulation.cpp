// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/simulated_sequence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "temporary_directory.h"

namespace planar_mapping::evaluation {
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

TEST(WriteDescription, FramesAreThoseOfTheSimulation) {
  const TemporaryDirectory directory;
  SimulationParams params = smallParams("room");
  params.sensor.noise_px = 0.1;
  params.seed = 7;
  writeDescription(Simulation(params), directory.path(), false);
  EXPECT_THROW(writeDescription(Simulation(params), directory.path(), false), IoError);
  io::setFrameMaker(openSimulation);
  const io::Sequence sequence({directory.path()});
  ASSERT_EQ(io::SequenceKind::Rgbd, sequence.kind());
  ASSERT_EQ(3u, sequence.size());
  params.images = true;
  const SimulatedFrame expected = Simulation(params).frame(2);
  const io::Frame frame = sequence.read(2);
  ASSERT_EQ(expected.xyz.size(), frame.cloud.xyz.size());
  EXPECT_EQ(0, std::memcmp(expected.xyz.data(), frame.cloud.xyz.data(), 4 * expected.xyz.size()));
  EXPECT_EQ(expected.left.pixels, frame.left.pixels);
  EXPECT_EQ(expected.truth.camera.width, frame.left.width);
  ASSERT_TRUE(frame.T_world_sensor);
  EXPECT_LT((expected.T_world_camera.inverse() * *frame.T_world_sensor).translation().norm(), 1e-6);
}

TEST(Simulation, ThreadsChangeNothing) {
  SimulationParams params = smallParams("corridor");
  params.images = true;
  const SimulatedFrame one = Simulation(params).frame(2);
  params.threads = 3;
  const SimulatedFrame three = Simulation(params).frame(2);
  EXPECT_EQ(one.left.pixels, three.left.pixels);
  EXPECT_EQ(one.right.pixels, three.right.pixels);
  EXPECT_EQ(one.truth.depth, three.truth.depth);
  EXPECT_EQ(one.disparity, three.disparity);
  EXPECT_EQ(one.labels, three.labels);
}

TEST(Simulation, TakesASceneOfTheCaller) {
  Scene scene;
  scene.name = "wall";
  SceneObject wall;
  wall.size = Vector3(10, 10, 1);
  wall.T_world_object.translation() = Vector3(0, 0, 3.5);
  scene.objects.push_back(wall);
  scene.path.assign(2, Pose::Identity());
  SimulationParams params = smallParams("room");
  params.sensor = StereoSensorParams::perfect();
  const Simulation simulation(params, scene);
  EXPECT_EQ(simulation.size(), 2u);
  EXPECT_EQ(simulation.planes().size(), 6u);
  const SimulatedFrame frame = simulation.frame(1);
  for (std::size_t i = 0; i < frame.labels.size(); ++i) {
    EXPECT_NEAR(frame.xyz[3 * i + 2], 3.0, 1e-5);
    EXPECT_EQ(frame.labels[i], static_cast<std::uint32_t>(simulation.planeOf(0, 4) + 1));
  }
  EXPECT_THROW(Simulation(params, Scene()), InputError) << "without a path";
}

TEST(WriteSequence, ImagesAreAStereoFolderWithTheTruthBeside) {
  const TemporaryDirectory dir;
  SimulationParams params = smallParams("outdoor");
  params.images = true;
  const Simulation simulation(params);
  writeSequence(simulation, dir / "both", false);
  const io::Sequence stereo({dir / "both"});
  EXPECT_EQ(stereo.kind(), io::SequenceKind::Stereo);
  ASSERT_EQ(stereo.size(), 3u);
  ASSERT_TRUE(stereo.calibration() && stereo.calibration()->baseline);
  EXPECT_DOUBLE_EQ(*stereo.calibration()->baseline, params.sensor.baseline);
  const io::Sequence clouds({dir / "both/measured"});
  EXPECT_EQ(clouds.kind(), io::SequenceKind::Clouds);
  EXPECT_EQ(clouds.size(), 3u);
  EXPECT_EQ(clouds.poseSource(), io::PoseSource::File);
  for (std::size_t k = 0; k < 3; ++k) {
    const SimulatedFrame truth = simulation.frame(k);
    const std::string name = "/00000" + std::to_string(k) + ".png";
    EXPECT_EQ(io::readImage(dir / "both/left" + name).pixels, truth.left.pixels);
    EXPECT_EQ(io::readImage(dir / "both/right" + name).pixels, truth.right.pixels);
    const io::DepthImage depth = io::readDepthPng(dir / "both/depth_gt" + name);
    const io::DepthImage labels = io::readDepthPng(dir / "both/labels_gt" + name);
    ASSERT_EQ(depth.values.size(), truth.labels.size());
    for (std::size_t i = 0; i < truth.labels.size(); ++i) {
      EXPECT_NEAR(depth.values[i] / kTruthDepthScale, truth.truth.depth[i], 0.00051);
      EXPECT_EQ(labels.values[i], truth.labels[i]);
    }
    EXPECT_TRUE(stereo.read(k).T_world_sensor->isApprox(truth.T_world_camera, 1e-12));
  }
  EXPECT_THROW(writeSequence(simulation, dir / "both", false), IoError);
  EXPECT_NO_THROW(writeSequence(simulation, dir / "both", true));
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
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.length = 20.0; })), ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.step = NAN; })), ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.plain_fraction = 2.0; })),
               ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.image_noise = -1.0; })), ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) { p.threads = -1; })), ParameterError);
  EXPECT_THROW(Simulation(with([](SimulationParams& p) {
                 p.images = true;
                 p.colors = false;
               })),
               ParameterError);
  EXPECT_THROW(Simulation(smallParams("room")).frame(3), InputError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
