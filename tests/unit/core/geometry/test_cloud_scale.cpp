// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/geometry/cloud_scale.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

/// Points of a wall of 4 x 3 units, 2 units ahead of the sensor, all times \p unit.
std::vector<float> wall(std::size_t points, double unit) {
  Random random(1);
  std::vector<float> xyz;
  for (std::size_t i = 0; i < points; ++i) {
    for (const double at : {random.uniform(-2, 2), random.uniform(-1.5, 1.5), 2.0}) {
      xyz.push_back(static_cast<float>(unit * at));
    }
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

TEST(UsablePoints, AreFiniteAndNotTooFarToSquare) {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> xyz = {1, 2, 3, nan, 2, 3, 1, inf, 3, 1, 2, -inf, 1, 2, 2e12f, 0, 0, 0};
  EXPECT_EQ(usablePoints(PointsView(xyz.data(), 6)), (Indices{0, 5}));
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
