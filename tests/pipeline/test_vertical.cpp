// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "map_scene.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping {
namespace {

Pipeline pipelineOf(const std::string& stages) {
  StageTable table;
  registerBuiltinStages(table);
  return Pipeline(parseConfiguration("version: 1\nstages:\n" + stages, "test", table));
}

constexpr const char* kStages =
    "  - stage: multi_plane_segmentation\n"
    "  - stage: planar_cuboid_approximation\n    up: auto\n";

double degreesBetween(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / M_PI;
}

/// World = first camera, which looks down by 44 degrees: no axis of the world is upwards, and the
/// images have upwards next to the axis that leans more.
TEST(Vertical, OfTheWorldOfACameraThatLooksDownIsWhatThePlanesSay) {
  const test::View view =
      test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 44.0 * M_PI / 180.0));
  const Vector3 up = view.pose.linear().transpose() * Vector3::UnitZ();
  Frame frame;
  frame.source = "test";
  frame.cloud = cloudOf(view.xyz, static_cast<std::uint32_t>(view.camera.width),
                        static_cast<std::uint32_t>(view.camera.height));
  frame.camera = view.camera;
  frame.given_pose = Pose::Identity();
  Pipeline pipeline = pipelineOf(kStages);
  pipeline.setMeanUp(Eigen::AngleAxisd(10.0 * M_PI / 180.0, Vector3::UnitX()) * up);
  pipeline.process(frame);
  EXPECT_LT(degreesBetween(pipeline.map().params().approximation.up, up), 0.5);
}

/// A street and the fronts of its houses in a map that has y upwards.
TEST(Vertical, OfAMergedMapIsTheAxisThatNearlyAllOfItFacesAlong) {
  for (const double sign : {1.0, -1.0}) {
    Frame frame;
    frame.source = "test";
    frame.pose_assumed = true;
    frame.cloud = pcl::make_shared<FrameCloud>();
    // Too far from the origin of its frame to have been seen from there.
    const auto add = [&](double x, double y, double z) {
      frame.cloud->push_back(
          {static_cast<float>(x + 2000.0), static_cast<float>(sign * y), static_cast<float>(z)});
    };
    for (int i = 0; i < 120; ++i) {
      for (int j = 0; j < 160; ++j) add(0.5 * i, -1.9, 0.5 * j);
      for (int j = 0; j < 10; ++j) add(0.5 * i, -1.9 + 0.5 * j, 0.0);
    }
    Pipeline pipeline = pipelineOf(kStages);
    pipeline.process(frame);
    EXPECT_EQ(pipeline.map().params().approximation.up, Vector3(0.0, sign, 0.0));
    ASSERT_EQ(2u, frame.warnings.size());
    EXPECT_NE(std::string::npos, frame.warnings[1].find("`up: auto` is")) << frame.warnings[1];
  }
}

}  // namespace
}  // namespace planar_mapping
