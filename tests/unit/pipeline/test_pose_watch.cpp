// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "advice/watches.h"

#include <gtest/gtest.h>

#include "ring_scan.h"

namespace planar_mapping::detail {
namespace {

/// What is said of a scan from \p place in a room of 2 \p half_length x 6 x 3 m by a pose that is
/// off by \p error.
std::optional<double> misfitOf(PoseWatch& watch, const Vector3& place, const Vector3& error,
                               double half_length = 4.0) {
  const Eigen::Array3d low(-half_length, -3, 0), high(half_length, 3, 3);
  const std::vector<float> xyz = test::boxScan(low - place.array(), high - place.array(), 40.0);
  const PointsView points(xyz.data(), xyz.size() / 3);
  return watch.misfit(points, findPlanes(points, nullptr, MultiPlaneParams()).planes,
                      Pose(Eigen::Translation3d(place + error)), CuboidApproximationParams());
}

TEST(PoseWatch, PosesThatFitSayNothing) {
  PoseWatch watch;
  for (const double x : {-2.0, -1.0, 0.0, 0.5}) {
    EXPECT_FALSE(misfitOf(watch, {x, 0.3 * x, 1.2}, Vector3::Zero())) << x;
  }
}

TEST(PoseWatch, TheFirstPoseThatDoesNotFitIsSaidOnce) {
  PoseWatch watch;
  EXPECT_FALSE(misfitOf(watch, {-1.0, 0.0, 1.2}, Vector3::Zero()));
  const std::optional<double> misfit = misfitOf(watch, {0.0, 0.0, 1.2}, {0.25, 0.25, 0.0});
  ASSERT_TRUE(misfit);
  EXPECT_NEAR(*misfit, 0.25, 0.03);
  EXPECT_FALSE(misfitOf(watch, {1.0, 0.0, 1.2}, {-0.3, 0.3, 0.0}));
}

TEST(PoseWatch, StepsAlongAHallAreJudgedByWhatStandsAcross) {
  PoseWatch watch;
  EXPECT_FALSE(misfitOf(watch, {-1.0, 0.0, 1.2}, Vector3::Zero(), 9.0));
  const std::optional<double> misfit = misfitOf(watch, {0.0, 0.0, 1.2}, {0.4, 0.0, 0.0}, 9.0);
  ASSERT_TRUE(misfit);
  EXPECT_NEAR(*misfit, 0.4, 0.03);
}

}  // namespace
}  // namespace planar_mapping::detail
