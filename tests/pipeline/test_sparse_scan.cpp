// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// One scan of few points, with everything automatic: its floor has to be floor.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "pipeline_frames.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/plan/plan.h"

namespace planar_mapping {
namespace {

constexpr double kHeight = 1.2;  // of the scanner over the floor, metres

struct Box {
  double x, y, half, height;
};
constexpr Box kBoxes[] = {
    {6, 3, 1, 1.5}, {-8, -6, 1.5, 2}, {3, -9, 0.8, 1}, {-5, 7, 1.2, 1.2}, {12, -4, 1, 2}};

/// How far a ray goes in a yard of 40 x 30 m with a wall of 3 m around it and boxes in it.
double rangeOf(const Vector3& ray) {
  double range = ray.z() < 0.0 ? -kHeight / ray.z() : INFINITY;
  for (int axis = 0; axis < 2; ++axis) {
    const double wall = (axis == 0 ? 20.0 : 15.0) / std::abs(ray[axis]);
    if (wall * ray.z() + kHeight < 3.0) range = std::min(range, wall);
  }
  for (const Box& box : kBoxes) {
    const Vector3 low(box.x - box.half, box.y - box.half, -kHeight);
    const Vector3 high(box.x + box.half, box.y + box.half, box.height - kHeight);
    const Eigen::Array3d one = low.cwiseQuotient(ray).array();
    const Eigen::Array3d other = high.cwiseQuotient(ray).array();
    const double enters = one.min(other).maxCoeff();
    if (enters > 0.0 && enters < one.max(other).minCoeff()) range = std::min(range, enters);
  }
  return range;
}

bool isBesideABox(double x, double y) {
  for (const Box& box : kBoxes)
    if (std::max(std::abs(x - box.x), std::abs(y - box.y)) < box.half + 1.0) return true;
  return std::abs(x) > 19.0 || std::abs(y) > 14.0;
}

/// Percentage of the places measured on the floor that are occupied from above.
double occupiedFloor(const std::vector<Vector3>& rays, double largest_cell) {
  Pipeline pipeline = test::pipelineOf(
      "  - stage: multi_plane_segmentation\n    distance_threshold_m: auto\n    min_inliers: auto\n"
      "  - stage: planar_cuboid_approximation\n    resolution_m: auto\n    max_range_m: auto\n"
      "    up: auto\n");
  Random random(1);
  Frame frame;
  frame.source = "test";
  frame.pose_assumed = true;
  frame.cloud = pcl::make_shared<FrameCloud>();
  std::vector<Vector3> floor;
  for (const Vector3& ray : rays) {
    const double range = rangeOf(ray);
    if (range > 60.0) continue;
    const Vector3 p = (range + 0.015 * random.normal()) * ray;
    frame.cloud->push_back(
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
    if (p.z() < 0.1 - kHeight && !isBesideABox(p.x(), p.y())) floor.push_back(p);
  }
  pipeline.process(frame);
  const Plan grid = plansOf(pipeline.map()).front();
  EXPECT_LE(grid.cell, largest_cell);
  int occupied = 0;
  for (const Vector3& p : floor) {
    const Vector2 cell = (p.head<2>() - grid.origin) / grid.cell;
    if (cell.minCoeff() < 0.0 || cell.x() >= grid.width || cell.y() >= grid.height) continue;
    occupied += grid.at(static_cast<std::uint32_t>(cell.x()),
                        static_cast<std::uint32_t>(cell.y())) == Plan::kOccupied;
  }
  return 100.0 * occupied / static_cast<double>(floor.size());
}

Vector3 rayAt(double azimuth, double elevation_deg) {
  const double elevation = elevation_deg * M_PI / 180.0;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

/// Three spacings, as up to 0.2 m, would be cells of 1 m: two thirds and more of the floor black.
TEST(SparseScan, OfAllDirectionsShowsItsFloor) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    Random random(seed);
    std::vector<Vector3> rays;
    for (int i = 0; i < 5000; ++i)
      rays.push_back(rayAt(random.uniform(-M_PI, M_PI), random.uniform(-30.0, 10.0)));
    EXPECT_LT(occupiedFloor(rays, 0.5), 15.0) << seed;
  }
}

TEST(SparseScan, OfSixteenRingsShowsItsFloor) {
  std::vector<Vector3> rays;
  for (int ring = 0; ring < 16; ++ring)
    for (int column = 0; column < 1800; ++column)
      rays.push_back(rayAt(column * M_PI / 900.0, -15.0 + 2.0 * ring));
  EXPECT_LT(occupiedFloor(rays, 0.2), 5.0);
}

Pipeline pipelineWithAuto() {
  return test::pipelineOf(
      "  - stage: multi_plane_segmentation\n    min_inliers: auto\n"
      "  - stage: planar_cuboid_approximation\n    up: [0, 0, 1]\n");
}

/// \param kept  of how many points one is measured
Frame scanOf(std::size_t number, std::size_t kept) {
  const test::View view = test::look(
      test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.1 * static_cast<double>(number), 0.4));
  Frame frame = test::frameOf(view);
  frame.number = number;
  for (std::size_t i = 0; i < frame.cloud->size(); ++i) {
    if (i % kept != 0) (*frame.cloud)[i].x = std::numeric_limits<float>::quiet_NaN();
  }
  return frame;
}

TEST(Start, IsNotAnImageThatHardlyMeasuredAnything) {
  Pipeline pipeline = pipelineWithAuto();
  Frame empty = scanOf(0, 100);
  EXPECT_NE(std::string::npos,
            pipeline.process(empty).skip_reason.find("the map begins with another"));
  EXPECT_TRUE(pipeline.map().empty());
  Frame full = scanOf(1, 1);
  EXPECT_EQ("", pipeline.process(full).skip_reason);
  EXPECT_EQ(1u, pipeline.map().frames());

  Pipeline alone = pipelineWithAuto();
  alone.process(full);
  EXPECT_EQ(effectiveYaml(alone.configuration()), effectiveYaml(pipeline.configuration()));
}

TEST(Start, IsAnyImageWhereAllHaveFewPoints) {
  Pipeline pipeline = pipelineWithAuto();
  for (std::size_t i = 0; i < 5; ++i) {
    Frame frame = scanOf(i, 100);
    EXPECT_EQ(i < 4, !pipeline.process(frame).skip_reason.empty()) << i;
  }
  EXPECT_EQ(1u, pipeline.map().frames());

  Frame last = scanOf(0, 100);
  last.is_last = true;
  EXPECT_EQ("", pipelineWithAuto().process(last).skip_reason);
}

}  // namespace
}  // namespace planar_mapping
