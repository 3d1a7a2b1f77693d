// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "cli_fixture.h"
#include "pipeline_frames.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "ring_scan.h"

namespace planar_mapping {
namespace {

using test::frameOf;
using test::pipelineOf;

Frame frameOf(const std::vector<float>& xyz) {
  Frame frame;
  frame.source = "test";
  frame.cloud = pcl::make_shared<FrameCloud>();
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    frame.cloud->push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  return frame;
}

/// Every fifth point without a measurement.
std::vector<float> roomWithGaps() {
  std::vector<float> xyz = roomPoints(5000);
  for (std::size_t i = 0; i < xyz.size(); i += 15) xyz[i] = std::numeric_limits<float>::quiet_NaN();
  return xyz;
}

template <typename Keep>
Indices expected(const Frame& frame, const Keep& keep) {
  Indices indices;
  for (std::size_t i = 0; i < frame.cloud->size(); ++i) {
    const auto& p = (*frame.cloud)[i];
    if (std::isfinite(p.x) && keep(p)) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

TEST(Stages, FiltersInARowKeepTheCommonPoints) {
  Frame frame = frameOf(roomWithGaps());
  pipelineOf(
      "  - stage: pass_through\n    axis: x\n    min_m: 2\n    max_m: 3\n"
      "  - stage: pass_through\n    axis: y\n    min_m: -1\n    max_m: 1\n    negative: true\n")
      .process(frame);
  EXPECT_EQ(expected(frame,
                     [](const auto& p) {
                       return p.x >= 2.0f && p.x <= 3.0f && (p.y < -1.0f || p.y > 1.0f);
                     }),
            frame.indices);
}

TEST(Stages, CropBoxInTheWorldFollowsThePose) {
  Frame frame = frameOf(roomWithGaps());
  frame.T_world_sensor.translation() = Vector3(10.0, 0.0, 0.0);
  pipelineOf("  - stage: crop_box\n    frame: world\n    min_x_m: 12\n    max_x_m: 13\n")
      .process(frame);
  EXPECT_EQ(expected(frame, [](const auto& p) { return p.x >= 2.0f && p.x <= 3.0f; }),
            frame.indices);
}

TEST(Stages, RadiusOutlierRemovalDropsTheIsolatedPoint) {
  std::vector<float> xyz = roomWithGaps();
  xyz.insert(xyz.end(), {50.0f, 50.0f, 50.0f});
  Frame frame = frameOf(xyz);
  pipelineOf("  - stage: radius_outlier_removal\n    radius_m: 1\n    min_neighbors: 3\n")
      .process(frame);
  EXPECT_EQ(expected(frame, [](const auto& p) { return p.x < 40.0f; }), frame.indices);
}

TEST(Stages, StatisticalOutlierRemovalDropsTheFarPointOfAnImage) {
  std::vector<float> xyz;
  for (int row = 0; row < 20; ++row) {
    for (int column = 0; column < 20; ++column) {
      xyz.insert(xyz.end(), {0.1f * static_cast<float>(column), 0.1f * static_cast<float>(row),
                             column == 7 && row == 3 ? 9.0f : 2.0f});
    }
  }
  Frame frame = frameOf(xyz);
  frame.cloud->width = 20;
  frame.cloud->height = 20;
  pipelineOf("  - stage: statistical_outlier_removal\n    neighbors: 8\n    deviations: 3\n")
      .process(frame);
  EXPECT_EQ(expected(frame, [](const auto& p) { return p.z < 5.0f; }), frame.indices);
}

TEST(Stages, VoxelGridGivesTheCentroidOfEachVoxel) {
  Frame frame = frameOf(roomWithGaps());
  const FrameCloud before = *frame.cloud;
  std::map<std::array<int, 3>, std::pair<Vector3, int>> voxels;
  for (const auto& p : before) {
    if (!std::isfinite(p.x)) continue;
    const auto cell = [](float v) { return static_cast<int>(std::floor(v / 0.25f)); };
    auto& voxel = voxels
                      .emplace(std::array<int, 3>{cell(p.x), cell(p.y), cell(p.z)},
                               std::make_pair(Vector3(Vector3::Zero()), 0))
                      .first->second;
    voxel.first += p.getVector3fMap().cast<double>();
    ++voxel.second;
  }
  pipelineOf("  - stage: voxel_grid\n    leaf_size_m: 0.25\n").process(frame);
  ASSERT_EQ(voxels.size(), frame.indices.size());
  for (const int i : frame.indices) {
    const Vector3 p = (*frame.cloud)[static_cast<std::size_t>(i)].getVector3fMap().cast<double>();
    double nearest = 1.0;
    for (const auto& voxel : voxels)
      nearest = std::min(nearest, (voxel.second.first / voxel.second.second - p).norm());
    EXPECT_LT(nearest, 1e-4);
  }
  EXPECT_EQ(5000u, frame.points_input);
  EXPECT_EQ(4000u, frame.points_valid);
}

TEST(Stages, VoxelGridKeepsGroundPointsApart) {
  Frame frame = frameOf(roomPoints(20000));
  const FrameReport report =
      pipelineOf(
          "  - stage: ground_removal\n    camera_height_m: 0.5\n    up: [0, 0, 1]\n"
          "    optical_axis: [1, 0, 0]\n"
          "  - stage: voxel_grid\n    leaf_size_m: 0.1\n")
          .process(frame);
  EXPECT_GT(report.points_ground, 5000u);
  for (const int i : frame.ground) EXPECT_LT((*frame.cloud)[static_cast<std::size_t>(i)].z, -0.4f);
  std::set<int> seen(frame.indices.begin(), frame.indices.end());
  seen.insert(frame.ground.begin(), frame.ground.end());
  EXPECT_EQ(frame.cloud->size(), seen.size());
}

TEST(Stages, VoxelGridRefusesAnAbsurdLeafInsteadOfDoingNothing) {
  Frame frame = frameOf({0, 0, 1, 1e6f, 1e6f, 1e6f});
  EXPECT_THROW(pipelineOf("  - stage: voxel_grid\n    leaf_size_m: 0.001\n").process(frame),
               InputError);
}

TEST(Stages, FiltersThatRemoveEverythingAreNoFailure) {
  Frame frame = frameOf(roomPoints(1000));
  const FrameReport report = pipelineOf(
                                 "  - stage: pass_through\n    min_m: 100\n    max_m: 101\n"
                                 "  - stage: voxel_grid\n  - stage: statistical_outlier_removal\n"
                                 "  - stage: radius_outlier_removal\n  - stage: ground_removal\n"
                                 "  - stage: multi_plane_segmentation\n  - stage: kl_occupancy\n"
                                 "  - stage: planar_cuboid_approximation\n")
                                 .process(frame);
  EXPECT_EQ(0u, report.planes);
  EXPECT_EQ(0u, report.cuboids);
  EXPECT_EQ(1000u, report.points_rejected);
}

TEST(Stages, PlanesFromSampledFeaturesHoldAllTheirPoints) {
  Frame frame = frameOf(roomPoints(20000));
  pipelineOf(
      "  - stage: multi_plane_segmentation\n    method: multi_ransac\n    features: 1000\n"
      "    distance_threshold_m: 0.03\n    min_inliers: 500\n")
      .process(frame);
  ASSERT_GE(frame.planes.size(), 4u);
  std::set<int> seen;
  std::size_t total = 0;
  for (const PlaneSegment& plane : frame.planes) {
    EXPECT_GE(plane.inliers.size(), 500u);
    EXPECT_TRUE(std::is_sorted(plane.inliers.begin(), plane.inliers.end()));
    seen.insert(plane.inliers.begin(), plane.inliers.end());
    total += plane.inliers.size();
  }
  EXPECT_EQ(total, seen.size());
  EXPECT_GT(total, 18000u);
}

TEST(Stages, SeenAgainASurfaceKeepsBeliefAndALonePointLosesIt) {
  Pipeline pipeline = pipelineOf("  - stage: kl_occupancy\n    resolution_m: 0.1\n");
  std::vector<float> xyz = roomPoints(100000);
  xyz.insert(xyz.end(), {3.05f, 0.85f, 0.75f});  // in the air, alone in its cell
  double believed_before = 0.0;
  double lone_before = 0.0;
  for (int seen = 0; seen < 4; ++seen) {
    Frame frame = frameOf(xyz);
    pipeline.process(frame);
    // Cells that a surface only grazes hold single points and are doubted like those. The others
    // go back and forth between 1 and Eq. 4 under Eq. 10, so what counts is that they stay.
    double believed = 0.0;
    for (std::size_t i = 0; i < 100000; ++i)
      believed += frame.probability[i] > 0.5f ? 1.0 / 100000.0 : 0;
    const double lone = frame.probability.back();
    if (seen > 0) {
      EXPECT_GE(believed, believed_before - 1e-9);
      EXPECT_LT(lone, 0.5);
      EXPECT_LE(lone, lone_before);
    }
    believed_before = believed;
    lone_before = lone;
  }
  EXPECT_GT(believed_before, 0.9);
}

/// Most cells of a hall hold a single point of a scanner of 16 rings.
TEST(Stages, SeenAgainASparseScanStays) {
  Pipeline pipeline = pipelineOf("  - stage: multi_plane_segmentation\n  - stage: kl_occupancy\n");
  Random random(3);
  const std::vector<float> xyz =
      test::ringScan({-12.0, -8.0, -1.5}, {12.0, 8.0, 5.0}, 0.4, 0.015, random);
  for (int seen = 0; seen < 3; ++seen) {
    Frame frame = frameOf(xyz);
    pipeline.process(frame);
    const auto believed = std::count_if(frame.probability.begin(), frame.probability.end(),
                                        [](float p) { return p >= 0.5f; });
    EXPECT_GT(believed, static_cast<std::ptrdiff_t>(xyz.size() / 3 * 98 / 100)) << seen;
  }
}

TEST(Stages, MapHasTheParametersOfItsStage) {
  Frame frame = frameOf(roomPoints(20000));
  Pipeline pipeline = pipelineOf(
      "  - stage: multi_plane_segmentation\n"
      "  - stage: planar_cuboid_approximation\n    resolution_m: 0.2\n    max_range_m: auto\n"
      "    association_angle_deg: 7\n");
  pipeline.process(frame);
  EXPECT_EQ(0.2, pipeline.map().params().approximation.resolution);
  EXPECT_NEAR(0.1221730, pipeline.map().params().association_angle, 1e-6);
  EXPECT_EQ(2048 * 0.2, pipeline.map().params().max_range);
  EXPECT_NEAR(5.2, pipeline.map().params().miss_range, 0.3);
}

TEST(Stages, CellsAreMissedAsFarAsPointsAreMappedAndSpaceIsClearedAsFarAsTheyAreMeasured) {
  const auto rangesWith = [](const std::string& limit, const std::string& range) {
    Frame frame = frameOf(roomPoints(20000));
    Pipeline pipeline = pipelineOf(
        "  - stage: depth_error_limit\n    max_error_m: 0.1\n    noise: given\n"
        "    baseline_m: 0.1\n    focal_length_px: 500\n" +
        limit + "  - stage: planar_cuboid_approximation\n    resolution_m: 0.2\n    max_range_m: " +
        range + "\n");
    pipeline.process(frame);
    const PlanarMapParams& params = pipeline.map().params();
    return std::make_pair(params.miss_range, params.max_range);
  };
  // Where z^2 / (0.1 m 500 px) 0.5 px = 0.1 m.
  EXPECT_FLOAT_EQ(std::sqrt(10.0F), static_cast<float>(rangesWith("", "auto").first));
  EXPECT_EQ(2048 * 0.2, rangesWith("", "auto").second);
  EXPECT_EQ(std::make_pair(4.0, 4.0), rangesWith("", "4.0"));
  EXPECT_NEAR(5.2, rangesWith("    enabled: false\n", "auto").first, 0.3);
  // The paper's reading: what lies behind the mapped part is not said to be unknown.
  const auto [missed, judged] = rangesWith("", "auto\n    unseen: free");
  EXPECT_EQ(missed, judged);
}

TEST(Stages, ScaleIsThatOfTheCloudNotOfItsOutliers) {
  std::vector<float> xyz = roomPoints(20000);
  xyz.insert(xyz.end(), {1e9f, 1e9f, 1e9f});
  const Frame frame = frameOf(xyz);
  Indices all(frame.cloud->size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
  const CloudScale scale = scaleOf(pointsOf(*frame.cloud), all);
  EXPECT_NEAR(5.4, scale.extent, 0.2);  // diagonal of 4 x 3 x 2 metres
  // 24.48 square metres (floor 12, walls 6 + 8, box 0.48, of which the floor has two fifths).
  EXPECT_NEAR(0.036, scale.spacing, 0.012);
  EXPECT_FALSE(scale.optical);
}

TEST(Stages, VerticalOfATiltedWorldIsWhatThePlanesSay) {
  for (const double degrees : {0.0, 3.0, 26.0}) {
    const test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 0.4));
    const Matrix3 tilt(Eigen::AngleAxisd(degrees * M_PI / 180.0, Vector3(0.6, 0.8, 0.0)));
    Frame frame = frameOf(view);
    frame.given_pose = tilt * view.pose;
    Pipeline pipeline = pipelineOf(
        "  - stage: multi_plane_segmentation\n"
        "  - stage: planar_cuboid_approximation\n    up: auto\n");
    pipeline.process(frame);
    ASSERT_FALSE(pipeline.map().empty());
    const Vector3 up = pipeline.map().params().approximation.up;
    const Vector3 expected = degrees < 5.0 ? Vector3(Vector3::UnitZ()) : Vector3(tilt.col(2));
    EXPECT_GT(up.dot(expected), std::cos(0.5 * M_PI / 180.0)) << degrees << ": " << up.transpose();
  }
}

TEST(Stages, IgnoredPosesAreNoIdentityOfFeatures) {
  const test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 0.4));
  for (const std::string poses : {"ignore", "use"}) {
    Pipeline pipeline = pipelineOf(
        "  - stage: key_features\n    source: cloud\n  - stage: motion_estimation\n    poses: " +
        poses +
        "\n  - stage: multi_plane_segmentation\n  - stage: kl_occupancy\n    features: tracks\n"
        "  - stage: planar_cuboid_approximation\n");
    FrameReport report;
    for (std::size_t number = 0; number < 2; ++number) {
      Frame frame = frameOf(view);
      frame.number = number;
      report = pipeline.process(frame);
    }
    EXPECT_GT(report.features, 100u);
    EXPECT_EQ(report.matches > 0, poses == "use") << report.matches;
  }
}

/// The robot looks the same in every scan: it would say that nothing moves.
TEST(Stages, MotionIsFoundWithoutThePointsThatAreCutBeforeIt) {
  const std::string cut =
      "  - stage: crop_box\n    negative: true\n    min_x_m: -0.4\n    max_x_m: 0.4\n"
      "    min_y_m: -0.4\n    max_y_m: 0.4\n    min_z_m: -0.4\n    max_z_m: 0.4\n";
  const auto placesOf = [](const std::string& first, bool robot) {
    Pipeline pipeline =
        pipelineOf(first +
                   "  - stage: motion_estimation\n    start: identity\n"
                   "  - stage: multi_plane_segmentation\n  - stage: planar_cuboid_approximation\n");
    std::vector<Vector3> places;
    for (std::size_t number = 0; number < 3; ++number) {
      std::vector<float> xyz = roomPoints(20000, number);
      for (std::size_t k = 0; k < xyz.size(); k += 3) xyz[k] -= 0.3f * static_cast<float>(number);
      for (int k = 0; k < 40000; ++k) {
        const float x = robot ? -0.3f + 0.003f * static_cast<float>(k % 200) : NAN;
        xyz.insert(xyz.end(), {x, -0.3f + 0.003f * static_cast<float>(k / 200), -0.2f});
      }
      Frame frame = frameOf(xyz);
      frame.number = number;
      const FrameReport report = pipeline.process(frame);
      if (report.skip_reason.empty()) places.push_back(frame.T_world_sensor.translation());
    }
    return places;
  };
  const std::vector<Vector3> places = placesOf(cut, true);
  ASSERT_EQ(3u, places.size());
  EXPECT_LT((places[2] - Vector3(0.6, 0.0, 0.0)).norm(), 0.03) << places[2].transpose();
  EXPECT_EQ(placesOf("", false), places);
  EXPECT_NE(placesOf("", true), places);
}

TEST(Stages, VerticalOfACameraThatLooksDownIsThatOfAllItsPoses) {
  const test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 1.0));
  const auto verticalWith = [&](const std::optional<ImagesUp>& mean_up) {
    Frame frame = frameOf(view);
    Pipeline pipeline = pipelineOf(
        "  - stage: multi_plane_segmentation\n"
        "  - stage: planar_cuboid_approximation\n    up: auto\n");
    if (mean_up) pipeline.setMeanUp(*mean_up);
    pipeline.process(frame);
    return pipeline.map().params().approximation.up;
  };
  // Its image has upwards nearer to an axis across than to z.
  EXPECT_LT(verticalWith(std::nullopt).z(), 0.5);
  EXPECT_EQ(verticalWith(ImagesUp{Vector3(0.1, -0.2, 0.4), false}), Vector3::UnitZ());
}

}  // namespace
}  // namespace planar_mapping
