// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/geometry/cloud_scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping {
namespace {

/// Points of a wall of 4 x 3 units, 2 units ahead of the sensor, all times \p unit.
std::vector<float> wall(std::size_t points, double unit) {
  Random random(1);
  std::vector<float> xyz;
  for (std::size_t i = 0; i < points; ++i) {
    for (const double at : {random.uniform(-2, 2), random.uniform(-1.5, 1.5), 2.0})
      xyz.push_back(static_cast<float>(unit * at));
  }
  return xyz;
}

TEST(CloudScale, MeasuresExtentSpacingAndRange) {
  const std::vector<float> xyz = wall(20000, 1.0);
  const PointsView points(xyz.data(), xyz.size() / 3);
  const CloudScale scale = scaleOf(points, usablePoints(points));
  EXPECT_EQ(scale.points, 20000u);
  EXPECT_NEAR(scale.extent, 4.9, 0.1);
  EXPECT_NEAR(scale.spacing, 0.0245, 0.005);  // 12 square metres
  EXPECT_NEAR(scale.max_range, 3.1, 0.1);
  EXPECT_TRUE(scale.optical);
  EXPECT_EQ(scale.up, Vector3(0, -1, 0));
  EXPECT_EQ(automaticResolution(scale), 0.1);
}

/// What a sensor at the origin sees of a room of 6 x 4 x 3 m around it, a ray every degree, with a
/// table before one wall. \param through  rays go on behind what they met first
std::vector<float> roomScan(bool through) {
  std::vector<float> xyz;
  for (int ring = -80; ring < 80; ++ring) {
    for (int step = 0; step < 360; ++step) {
      const Vector3 ray(std::cos(ring * test::kDegree) * std::cos(step * test::kDegree),
                        std::cos(ring * test::kDegree) * std::sin(step * test::kDegree),
                        std::sin(ring * test::kDegree));
      const double wall = (Vector3(3.0, 2.0, 1.5).array() / ray.array().abs()).minCoeff();
      const bool table = std::abs(ring + 20) < 15 && std::abs(step - 90) < 60;
      for (const double range : {0.5 * wall, wall}) {
        if (range < wall ? !table : table && !through) continue;
        for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(range * ray[axis]));
      }
    }
  }
  return xyz;
}

/// Scans of two other places added: what is hidden from the origin was seen from there.
std::vector<float> threeScans() {
  std::vector<float> xyz = roomScan(false);
  const std::vector<float> other = roomScan(true);
  for (std::size_t i = 0; i < other.size(); i += 3) {
    xyz.insert(xyz.end(), {other[i] + 5.0f, other[i + 1], other[i + 2]});
    xyz.insert(xyz.end(), {other[i] - 5.0f, other[i + 1], other[i + 2]});
  }
  return xyz;
}

TEST(IsMerged, KnowsWhatNoSensorAtTheOriginCanSee) {
  const auto merged = [](const std::vector<float>& xyz) {
    return isMerged(PointsView(xyz.data(), xyz.size() / 3), nullptr);
  };
  EXPECT_FALSE(merged(roomScan(false)));
  EXPECT_TRUE(merged(threeScans()));
  // Seen from outside, hardly anything is half as far again as what is before it.
  std::vector<float> outside = threeScans();
  for (std::size_t i = 0; i < outside.size(); i += 3) {
    outside[i] += 25.0f;
    outside[i + 1] += 10.0f;
  }
  EXPECT_TRUE(merged(outside));
  // In coordinates of a country.
  std::vector<float> far = roomScan(false);
  for (std::size_t i = 0; i < far.size(); i += 3) far[i] += 1000.0f;
  EXPECT_TRUE(merged(far));
  EXPECT_FALSE(merged({}));
  EXPECT_FALSE(merged({0, 0, 0, 1, 2, 3}));
}

TEST(IsMerged, EchoesOnTheSensorHideNothing) {
  std::vector<float> xyz = roomScan(false);
  const std::size_t room = xyz.size();
  for (std::size_t i = 0; i < room; i += 3 * 8) {  // an eighth, as scans of cars have them
    for (std::size_t axis = 0; axis < 3; ++axis) xyz.push_back(0.02f * xyz[i + axis]);
  }
  EXPECT_FALSE(isMerged(PointsView(xyz.data(), xyz.size() / 3), nullptr));
}

TEST(IsMerged, ARoomBehindAWallIsOfAnotherScan) {
  std::vector<float> xyz = roomScan(false);
  const std::vector<float> next_room = roomScan(true);
  for (std::size_t i = 0; i < next_room.size(); i += 3 * 4) {  // a fifth of all
    xyz.insert(xyz.end(), {next_room[i] + 6.2f, next_room[i + 1], next_room[i + 2]});
  }
  EXPECT_TRUE(isMerged(PointsView(xyz.data(), xyz.size() / 3), nullptr));
  // What is seen between posts is of the same scan.
  std::vector<float> posts;
  const std::vector<float> room = roomScan(false);
  for (std::size_t i = 0; i < room.size(); i += 3) {
    const bool post = static_cast<int>(30.0f * std::atan2(room[i + 1], room[i])) % 6 == 0;
    for (int axis = 0; axis < 3; ++axis) posts.push_back((post ? 0.4f : 1.0f) * room[i + axis]);
  }
  EXPECT_FALSE(isMerged(PointsView(posts.data(), posts.size() / 3), nullptr));
}

TEST(IsMerged, AYardSeenThroughAFenceIsOfOneScan) {
  std::vector<float> xyz;  // 64 rings in a yard of 30 x 24 m, beside a mesh of 5 cm
  for (int ring = 0; ring < 64; ++ring) {
    for (int step = 0; step < 1800; ++step) {
      const double up = (0.45 * ring - 20.0) * test::kDegree, around = 0.2 * step * test::kDegree;
      const Vector3 ray(std::cos(up) * std::cos(around), std::cos(up) * std::sin(around),
                        std::sin(up));
      double range =
          (Vector3(15.0, 12.0, ray.z() < 0.0 ? 1.2 : 9.0).array() / ray.array().abs()).minCoeff();
      const Vector3 at_fence = 3.0 / ray.y() * ray;
      const auto isWire = [](double at) { return at - 0.05 * std::floor(at / 0.05) < 0.01; };
      if (ray.y() > 0.0 && std::abs(at_fence.x()) < 4.0 && at_fence.z() < 1.0 &&
          (isWire(at_fence.x()) || isWire(at_fence.z()))) {
        range = std::min(range, at_fence.norm());
      }
      for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(range * ray[axis]));
    }
  }
  EXPECT_FALSE(isMerged(PointsView(xyz.data(), xyz.size() / 3), nullptr));
}

TEST(IsMerged, HeightsAboveTheSeaAreNoDepths) {
  std::vector<float> high = roomScan(false);
  for (std::size_t i = 2; i < high.size(); i += 3) high[i] += 285.0f;
  PointsView points(high.data(), high.size() / 3);
  EXPECT_TRUE(isMerged(points, nullptr));
  EXPECT_FALSE(isCameraView(points, nullptr));
  EXPECT_EQ(Vector3::UnitZ(), verticalOf(points, nullptr, Pose::Identity()));
  // A wall across the view of a camera is no map, however far.
  std::vector<float> wide = wall(20000, 1.0);
  for (float& value : wide) value *= 10.0f;
  EXPECT_TRUE(isCameraView(PointsView(wide.data(), wide.size() / 3), nullptr));
  EXPECT_FALSE(isMerged(PointsView(wide.data(), wide.size() / 3), nullptr));
  // An image far from everything is a camera's all the same.
  points.width = static_cast<std::uint32_t>(points.size / 2);
  points.height = 2;
  EXPECT_TRUE(isCameraView(points, nullptr));
}

TEST(IsMerged, AMergedCloudHighAboveItsOriginIsNoCamera) {
  std::vector<float> xyz = threeScans();
  for (std::size_t i = 2; i < xyz.size(); i += 3) xyz[i] += 9.0f;
  const PointsView points(xyz.data(), xyz.size() / 3);
  EXPECT_TRUE(isMerged(points, nullptr));
  EXPECT_EQ(-Vector3::UnitY(), verticalOf(points, nullptr, Pose::Identity()))
      << "a model in the frame of its first camera";
  for (std::size_t i = 2; i < xyz.size(); i += 3) xyz[i] += 10.0f;  // a fraction of its extent
  EXPECT_TRUE(isMerged(points, nullptr));
  EXPECT_FALSE(isCameraView(points, nullptr));
  EXPECT_EQ(Vector3::UnitZ(), verticalOf(points, nullptr, Pose::Identity()));
}

TEST(VerticalOf, AnImageKnowsWhereItsTopIs) {
  // A tilted wall, in frames whose axes run with the columns and rows, or against them.
  constexpr std::uint32_t kColumns = 64, kRows = 48;
  for (int frame = 0; frame < 8; ++frame) {
    const Vector3 sign(frame & 1 ? -1.0 : 1.0, frame & 2 ? -1.0 : 1.0, frame & 4 ? -1.0 : 1.0);
    std::vector<float> image, heights;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t column = 0; column < kColumns; ++column) {
        const Vector3 ray(0.02 * (column - 31.5), 0.02 * (row - 23.5), 1.0);
        const double depth = 2.0 / (1.0 + 0.3 * ray.x() + 0.5 * ray.y());
        for (int axis = 0; axis < 3; ++axis) {
          const double along = axis < 2 ? ray[axis] : depth;
          image.push_back(static_cast<float>(sign[axis] * depth * ray[axis]));
          heights.push_back(static_cast<float>(sign[axis] * along));
        }
      }
    }
    EXPECT_EQ(Vector3(0.0, -sign.y(), 0.0),
              verticalOf(PointsView(image.data(), kColumns, kRows, 3), nullptr, Pose::Identity()))
        << sign.transpose();
    // Heights over a grid are no image.
    if (sign.z() < 0.0) {
      EXPECT_EQ(Vector3::UnitZ(), verticalOf(PointsView(heights.data(), kColumns, kRows, 3),
                                             nullptr, Pose::Identity()));
    }
  }
}

TEST(IsMerged, OrganizedCloudsAreOfOneScan) {
  const std::vector<float> two = threeScans();
  PointsView points(two.data(), two.size() / 3);
  EXPECT_TRUE(isMerged(points, nullptr));
  points.width = static_cast<std::uint32_t>(points.size / 2);
  points.height = 2;
  EXPECT_FALSE(isMerged(points, nullptr));
}

TEST(CloudScale, NoiseIsTheDistanceFromLocalPlanes) {
  const auto scaleWith = [](double noise) {
    std::vector<float> xyz = wall(50000, 1.0);
    Random random(2);
    for (std::size_t i = 2; i < xyz.size(); i += 3)
      xyz[i] += static_cast<float>(noise * random.normal());
    const PointsView points(xyz.data(), 50000);
    return scaleOf(points, usablePoints(points));
  };
  EXPECT_LT(scaleWith(0.0).noise, 1e-4);
  EXPECT_NEAR(scaleWith(0.01).noise, 0.01, 0.003);
  EXPECT_NEAR(scaleWith(0.06).noise, 0.06, 0.02);  // more than the first cells can hold
  EXPECT_EQ(automaticResolution(scaleWith(0.01)), 0.05);
  EXPECT_EQ(automaticResolution(scaleWith(0.06)), 0.2);
}

TEST(CloudScale, BothFacesOfAWallAreNoNoise) {
  // Cells of the sample are 0.5 m wide and hold both faces.
  for (const double thickness : {0.15, 0.2, 0.24}) {
    Random random(3);
    std::vector<float> xyz;
    for (int i = 0; i < 60000; ++i) {
      const double x = (i % 2 == 0 ? 0.0 : thickness) + 0.003 * random.normal();
      for (const double at : {x, random.uniform(0.0, 20.0), random.uniform(0.0, 10.0)}) {
        xyz.push_back(static_cast<float>(at));
      }
    }
    const PointsView points(xyz.data(), xyz.size() / 3);
    const CloudScale scale = scaleOf(points, usablePoints(points));
    EXPECT_NEAR(scale.noise, 0.003, 0.0005) << thickness;
    EXPECT_EQ(automaticResolution(scale), 0.2) << thickness;
  }
}

TEST(CloudScale, DoesNotDependOnWhereTheCloudLies) {
  const auto noiseAt = [](const Vector3& place) {
    std::vector<float> xyz = threeScans();
    Random random(4);
    for (std::size_t i = 0; i < xyz.size(); ++i)
      xyz[i] += static_cast<float>(place[static_cast<int>(i % 3)] + 0.02 * random.normal());
    const PointsView points(xyz.data(), xyz.size() / 3);
    return scaleOf(points, usablePoints(points)).noise;
  };
  const double here = noiseAt(Vector3::Zero());
  EXPECT_GT(here, 0.01);
  for (const Vector3& place :
       {Vector3(20.0, 0.0, 0.0), Vector3(45.0, 65.0, 2.0), Vector3(0.31, -0.17, 285.0)}) {
    EXPECT_NEAR(here, noiseAt(place), 0.02 * here) << place.transpose();
  }
}

TEST(AutomaticResolution, FollowsExtentSpacingAndNoise) {
  const auto resolution = [](double extent, double spacing, double noise) {
    CloudScale scale;
    scale.extent = extent;
    scale.spacing = spacing;
    scale.noise = noise;
    return automaticResolution(scale);
  };
  EXPECT_EQ(0.05, resolution(5.0, 0.005, 0.002));
  EXPECT_EQ(0.2, resolution(39.0, 0.01, 0.002));    // a corridor
  EXPECT_EQ(0.2, resolution(1000.0, 0.01, 0.002));  // a dense town
  EXPECT_EQ(0.5, resolution(1000.0, 0.3, 0.002));   // a sparse one
  EXPECT_EQ(0.2, resolution(10.0, 0.05, 0.002));    // three spacings, not two
  EXPECT_EQ(0.2, resolution(40.0, 0.14, 0.002));    // two, not three: 16 rings in a yard
  EXPECT_EQ(0.2, resolution(5.0, 0.005, 0.05));     // a noisy room
  EXPECT_EQ(20.0, resolution(2000.0, 6.0, 2.0));    // millimetres
  EXPECT_EQ(0.1, resolution(0.0, 0.0, 0.0));
}

TEST(UsablePoints, AreMeasuredAndNotTooFarToSquare) {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> xyz = {1,    2, 3, nan,   2, 3, 1, inf, 3, 1, 2,
                                  -inf, 1, 2, 2e12f, 0, 0, 0, 0,   0, 1};
  EXPECT_EQ(usablePoints(PointsView(xyz.data(), 7)), (Indices{0, 6}));
  EXPECT_TRUE(usablePoints(PointsView()).empty());
}

TEST(RequireMetres, RefusesMillimetresAndSaysWhatToDo) {
  const std::vector<float> metres = wall(50000, 1.0);
  const std::vector<float> millimetres = wall(50000, 1000.0);
  EXPECT_NO_THROW(requireMetres(PointsView(metres.data(), 50000), nullptr, 1.0, "resolution"));
  try {
    requireMetres(PointsView(millimetres.data(), 50000), nullptr, 1.0, "resolution");
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("0.001"), std::string::npos) << text;
    EXPECT_NE(text.find("set resolution"), std::string::npos) << text;
  }
  try {
    requireMetres(PointsView(metres.data(), 50000), nullptr, 1e-4, "resolution");
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("too much for resolution: set a larger value"), std::string::npos) << text;
  }
}

TEST(UsablePoints, MoreThanAnIndexCountsAreRefused) {
  const float one[3] = {1.0F, 2.0F, 3.0F};
  EXPECT_THROW(usablePoints(PointsView(one, std::size_t{1} << 31U)), InputError);
}

TEST(RequireMetres, AcceptsSparseAndFarClouds) {
  const std::vector<float> sparse = wall(200, 100.0);  // 20 m apart, but half of them within 300 m
  EXPECT_NO_THROW(requireMetres(PointsView(sparse.data(), 200), nullptr, 10.0, "resolution"));
  std::vector<float> far = wall(50000, 1.0);  // dense, in coordinates far from the origin
  for (std::size_t i = 0; i < far.size(); i += 3) far[i] += 5000.0f;
  EXPECT_NO_THROW(requireMetres(PointsView(far.data(), 50000), nullptr, 1.0, "resolution"));
  EXPECT_NO_THROW(requireMetres(PointsView(), nullptr, 1.0, "resolution"));
}

TEST(RequireMetres, LooksAtIndexedPointsOnly) {
  std::vector<float> xyz = wall(1000, 1.0);
  const std::vector<float> far = wall(1000, 1000.0);
  xyz.insert(xyz.end(), far.begin(), far.end());
  Indices near_ones(1000), far_ones(1000);
  std::iota(near_ones.begin(), near_ones.end(), 0);
  std::iota(far_ones.begin(), far_ones.end(), 1000);
  const PointsView points(xyz.data(), 2000);
  EXPECT_NO_THROW(requireMetres(points, &near_ones, 1.0, "resolution"));
  EXPECT_THROW(requireMetres(points, &far_ones, 1.0, "resolution"), InputError);
}

}  // namespace
}  // namespace planar_mapping
