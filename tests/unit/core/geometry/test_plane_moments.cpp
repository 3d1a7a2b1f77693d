// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/geometry/detail/plane_moments.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping {
namespace {

std::vector<Vector3> noisyPlane(std::size_t n, double noise, std::uint64_t seed,
                                const Vector3& center = Vector3::Zero()) {
  Random random(seed);
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = random.uniform(-2, 2);
    const double y = random.uniform(-1, 1);
    points.push_back(center + Vector3(x, y, 0.5 * x - 0.2 * y + noise * random.normal()));
  }
  return points;
}

PlaneMoments momentsOf(const std::vector<Vector3>& points) {
  PlaneMoments moments;
  for (const Vector3& p : points) moments.add(p);
  return moments;
}

TEST(PlaneMoments, MatchesSumsByHand) {
  const PlaneMoments moments = momentsOf({{0, 0, 0}, {2, 0, 0}, {0, 4, 0}, {2, 4, 0}});
  EXPECT_DOUBLE_EQ(moments.weight(), 4.0);
  EXPECT_NEAR((moments.mean() - Vector3(1, 2, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(moments.scatter()(0, 0), 4.0, 1e-12);
  EXPECT_NEAR(moments.scatter()(1, 1), 16.0, 1e-12);
  EXPECT_NEAR(moments.scatter()(0, 1), 0.0, 1e-12);
  const auto fit = moments.fit();
  ASSERT_TRUE(fit.valid);
  EXPECT_NEAR((fit.plane.normal - Vector3::UnitZ()).norm(), 0.0, 1e-9);
  EXPECT_NEAR(fit.rms, 0.0, 1e-9);
}

TEST(PlaneMoments, MergingEqualsAddingAll) {
  const auto a = noisyPlane(300, 0.02, 1);
  const auto b = noisyPlane(500, 0.02, 2, {3, 1, -2});
  PlaneMoments merged = momentsOf(a);
  merged.merge(momentsOf(b));
  auto both = a;
  both.insert(both.end(), b.begin(), b.end());
  const PlaneMoments whole = momentsOf(both);
  EXPECT_NEAR((merged.mean() - whole.mean()).norm(), 0.0, 1e-12);
  EXPECT_NEAR((merged.scatter() - whole.scatter()).norm(), 0.0, 1e-9 * whole.scatter().norm());
  merged.merge(PlaneMoments());
  EXPECT_DOUBLE_EQ(merged.weight(), 800.0);
}

TEST(PlaneMoments, FromSumsEqualsAdding) {
  const auto points = noisyPlane(100, 0.01, 3, {5, 5, 5});
  const Vector3 origin(4.5, 5.5, 5.0);
  Vector3 sum = Vector3::Zero();
  Matrix3 outer = Matrix3::Zero();
  for (const Vector3& p : points) {
    sum += p - origin;
    outer += (p - origin) * (p - origin).transpose();
  }
  const PlaneMoments a = PlaneMoments::fromSums(100, sum, outer, origin);
  const PlaneMoments b = momentsOf(points);
  EXPECT_NEAR((a.mean() - b.mean()).norm(), 0.0, 1e-12);
  EXPECT_NEAR((a.scatter() - b.scatter()).norm(), 0.0, 1e-9);
}

TEST(PlaneMoments, FitFollowsRigidMotion) {
  const PlaneMoments moments = momentsOf(noisyPlane(400, 0.02, 4));
  Pose T = Pose::Identity();
  T.linear() = Quaternion(0.8, 0.4, -0.1, 0.3).normalized().toRotationMatrix();
  T.translation() = Vector3(10, -3, 4);
  const auto before = moments.fit();
  const auto after = moments.transformed(T).fit();
  const Plane expected = transformed(before.plane, T);
  EXPECT_NEAR(std::abs(expected.normal.dot(after.plane.normal)), 1.0, 1e-12);
  EXPECT_NEAR(after.rms, before.rms, 1e-12);
}

TEST(PlaneMoments, SurvivesCoordinatesFarFromTheOrigin) {
  const auto near_fit = momentsOf(noisyPlane(500, 0.01, 5)).fit();
  const auto far_fit = momentsOf(noisyPlane(500, 0.01, 5, {1e6, -1e6, 1e6})).fit();
  ASSERT_TRUE(far_fit.valid);
  EXPECT_NEAR(far_fit.rms, near_fit.rms, 1e-6);
  EXPECT_NEAR(std::abs(far_fit.plane.normal.dot(near_fit.plane.normal)), 1.0, 1e-9);
}

TEST(PlaneMoments, DegenerateSetsAreNotPlanes) {
  EXPECT_FALSE(PlaneMoments().fit().valid);
  EXPECT_FALSE(momentsOf({{1, 2, 3}, {4, 5, 6}}).fit().valid);
  EXPECT_FALSE(momentsOf({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}).fit().valid);
  EXPECT_FALSE(momentsOf({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}}).fit().valid);
}

TEST(PlaneMoments, PointsWithoutWeightDoNotCount) {
  PlaneMoments moments = momentsOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  moments.add({9, 9, 9}, 0.0);
  moments.add({9, 9, 9}, -1.0);
  moments.add({9, 9, 9}, std::nan(""));
  EXPECT_DOUBLE_EQ(moments.weight(), 3.0);
}

// 200 simulated sets of points: the spread of the fitted offsets and normals is what the covariance
// says, within sampling error.
TEST(PlaneMoments, CovarianceMatchesTheSpreadOfManyFits) {
  constexpr int kSets = 400;
  std::vector<Vector4> fits;
  Matrix4 predicted = Matrix4::Zero();
  for (int i = 0; i < kSets; ++i) {
    const PlaneMoments moments = momentsOf(noisyPlane(60, 0.02, 100 + i, {1, 2, 3}));
    const auto fit = moments.fit();
    fits.push_back(fit.plane.coefficients());
    predicted += moments.planeCovariance(fit) / kSets;
  }
  Vector4 mean = Vector4::Zero();
  for (const Vector4& f : fits) mean += f / kSets;
  Matrix4 spread = Matrix4::Zero();
  for (const Vector4& f : fits) spread += (f - mean) * (f - mean).transpose() / (kSets - 1);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(predicted(i, i) / spread(i, i), 1.0, 0.3) << i;
}

TEST(PlaneMoments, CovarianceOfAnInvalidFitIsZero) {
  const PlaneMoments moments = momentsOf({{0, 0, 0}, {1, 1, 1}});
  EXPECT_EQ(moments.planeCovariance(moments.fit()), Matrix4(Matrix4::Zero()));
}

}  // namespace
}  // namespace planar_mapping
