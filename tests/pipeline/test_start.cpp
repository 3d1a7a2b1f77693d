// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "map_scene.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping {
namespace {

Pipeline pipelineWithAuto() {
  StageTable table;
  registerBuiltinStages(table);
  return Pipeline(parseConfiguration(
      "version: 1\nstages:\n  - stage: multi_plane_segmentation\n    min_inliers: auto\n"
      "  - stage: planar_cuboid_approximation\n    up: [0, 0, 1]\n",
      "test", table));
}

/// \param kept  of how many points one is measured
Frame frameOf(std::size_t number, std::size_t kept) {
  const test::View view = test::look(
      test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.1 * static_cast<double>(number), 0.4));
  Frame frame;
  frame.number = number;
  frame.source = "test";
  frame.cloud = cloudOf(view.xyz, static_cast<std::uint32_t>(view.camera.width),
                        static_cast<std::uint32_t>(view.camera.height));
  for (std::size_t i = 0; i < frame.cloud->size(); ++i) {
    if (i % kept != 0) (*frame.cloud)[i].x = std::numeric_limits<float>::quiet_NaN();
  }
  frame.camera = view.camera;
  frame.given_pose = view.pose;
  frame.T_world_sensor = view.pose;
  return frame;
}

TEST(Start, IsNotAnImageThatHardlyMeasuredAnything) {
  Pipeline pipeline = pipelineWithAuto();
  Frame empty = frameOf(0, 100);
  EXPECT_NE(std::string::npos,
            pipeline.process(empty).skip_reason.find("the map begins with another"));
  EXPECT_TRUE(pipeline.map().empty());
  Frame full = frameOf(1, 1);
  EXPECT_EQ("", pipeline.process(full).skip_reason);
  // Its pose is known: it is in the map after all.
  ASSERT_EQ(1u, pipeline.takePlacedAgain().size());
  EXPECT_EQ(2u, pipeline.map().frames());

  Pipeline alone = pipelineWithAuto();
  alone.process(full);
  EXPECT_EQ(effectiveYaml(alone.configuration()), effectiveYaml(pipeline.configuration()));
}

TEST(Start, IsAnyImageWhereAllHaveFewPoints) {
  Pipeline pipeline = pipelineWithAuto();
  std::size_t placed_again = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    Frame frame = frameOf(i, 100);
    EXPECT_EQ(i < 4, !pipeline.process(frame).skip_reason.empty()) << i;
    placed_again += pipeline.takePlacedAgain().size();
  }
  EXPECT_EQ(4u, placed_again);
  EXPECT_EQ(5u, pipeline.map().frames());

  Frame last = frameOf(0, 100);
  last.is_last = true;
  EXPECT_EQ("", pipelineWithAuto().process(last).skip_reason);
}

}  // namespace
}  // namespace planar_mapping
