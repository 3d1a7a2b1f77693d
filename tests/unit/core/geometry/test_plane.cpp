// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/geometry/plane.h"
#include "planar_mapping/geometry/plane_moments.h"

namespace planar_mapping {
namespace {

TEST(Plane, CoefficientsAreNormalised) {
  const Plane plane = planeFromCoefficients(0, 3, 4, 10);
  EXPECT_NEAR((plane.normal - Vector3(0, 0.6, 0.8)).norm(), 0.0, 1e-15);
  EXPECT_DOUBLE_EQ(plane.offset, 2.0);
  EXPECT_NEAR(plane.signedDistance({7, -10.0 / 3.0, 0}), 0.0, 1e-15);
}

TEST(Plane, RejectsCoefficientsWithoutANormal) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(planeFromCoefficients(0, 0, 0, 1), ParameterError);
  EXPECT_THROW(planeFromCoefficients(nan, 0, 1, 0), ParameterError);
  EXPECT_THROW(planeFromCoefficients(INFINITY, 0, 1, 0), ParameterError);
  EXPECT_THROW(planeFromCoefficients(0, 0, 1, nan), ParameterError);
}

TEST(Plane, ThroughThreePointsContainsThem) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const auto draw = [&] {
      return Vector3(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    };
    const Vector3 p = draw(), q = draw(), r = draw();
    Plane plane;
    ASSERT_TRUE(planeFromPoints(p, q, r, plane));
    for (const Vector3& x : {p, q, r}) EXPECT_NEAR(plane.signedDistance(x), 0.0, 1e-9);
    EXPECT_NEAR(plane.normal.norm(), 1.0, 1e-12);
    EXPECT_GT(plane.normal.dot((q - p).cross(r - p)), 0.0);
  }
}

TEST(Plane, DegenerateTriplesLeaveThePlaneUntouched) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Plane plane = planeFromCoefficients(1, 0, 0, -5);
  EXPECT_FALSE(planeFromPoints({1, 1, 1}, {1, 1, 1}, {2, 0, 0}, plane));
  EXPECT_FALSE(planeFromPoints({0, 0, 0}, {1, 1, 1}, {3, 3, 3}, plane));
  EXPECT_FALSE(planeFromPoints({0, 0, 0}, {1, 0, 0}, {2, 1e-9, 0}, plane));
  EXPECT_FALSE(planeFromPoints({nan, 0, 0}, {1, 0, 0}, {0, 1, 0}, plane));
  EXPECT_FALSE(planeFromPoints({INFINITY, 0, 0}, {1, 0, 0}, {0, 1, 0}, plane));
  EXPECT_DOUBLE_EQ(plane.offset, -5.0);
}

TEST(Plane, FollowsRigidMotion) {
  Random random(2);
  const Plane plane = planeFromCoefficients(0.3, -0.5, 0.8, 1.5);
  Pose T = Pose::Identity();
  T.linear() = Quaternion(0.8, 0.1, -0.5, 0.3).normalized().toRotationMatrix();
  T.translation() = Vector3(3, -7, 2);
  const Plane moved = transformed(plane, T);
  for (int i = 0; i < 50; ++i) {
    const Vector3 p(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(-9, 9));
    EXPECT_NEAR(moved.signedDistance(T * p), plane.signedDistance(p), 1e-12);
  }
}

TEST(Plane, IsOrientedTowardsTheSensor) {
  const Plane wall = planeFromCoefficients(0, 0, 1, -2);
  EXPECT_LT(orientedTowards(wall, Vector3::Zero()).normal.z(), 0.0);
  EXPECT_GT(orientedTowards(wall, {0, 0, 5}).normal.z(), 0.0);
}

// Eq. 2 and 3 worked by hand.
TEST(Plane, TiltFollowsTheEquations) {
  EXPECT_NEAR(tilt(planeFromCoefficients(0, 0, 2, 1)), 0.0, 1e-12);
  EXPECT_NEAR(tilt(planeFromCoefficients(0, 0, -2, 1)), M_PI, 1e-12);
  EXPECT_NEAR(tilt(planeFromCoefficients(1, 0, 0, 1)), M_PI_2, 1e-12);
  EXPECT_NEAR(tilt(planeFromCoefficients(0, 1, 1, 1)), M_PI / 4, 1e-12);
  EXPECT_NEAR(normalizedTilt(planeFromCoefficients(0, 1, 1, 1)), M_PI / 4, 1e-12);
  EXPECT_NEAR(normalizedTilt(planeFromCoefficients(0, 1, -1, 1)), -M_PI / 4, 1e-12);
  EXPECT_NEAR(normalizedTilt(planeFromCoefficients(0, 0, 1, 1)), 0.0, 1e-12);
  EXPECT_NEAR(normalizedTilt(planeFromCoefficients(0, 0, -1, 1)), 0.0, 1e-12);
  EXPECT_NEAR(normalizedTilt(planeFromCoefficients(1, 0, 0, 1)), M_PI_2, 1e-12);
}

TEST(Plane, NormalisedTiltStaysInItsRange) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const Plane plane = planeFromCoefficients(random.uniform(-1, 1), random.uniform(-1, 1),
                                              random.uniform(-1, 1), 0.0);
    EXPECT_GT(normalizedTilt(plane), -M_PI_2);
    EXPECT_LE(normalizedTilt(plane), M_PI_2);
  }
}

Cuboid tilted() {
  Cuboid cuboid;
  cuboid.center = Vector3(1, -2, 3);
  cuboid.orientation = Quaternion(0.8, 0.2, -0.3, 0.4).normalized();
  cuboid.size = Vector3(2.0, 0.6, 0.1);
  return cuboid;
}

TEST(Cuboid, ContainsItsCornersAndNothingBeyond) {
  const Cuboid cuboid = tilted();
  for (const Vector3& corner : corners(cuboid)) {
    EXPECT_TRUE(contains(cuboid, corner, 1e-9));
    EXPECT_FALSE(contains(cuboid, corner + 0.01 * (corner - cuboid.center).normalized()));
  }
  EXPECT_TRUE(contains(cuboid, cuboid.center));
  EXPECT_FALSE(contains(cuboid, Vector3(NAN, 0, 0)));
}

TEST(Cuboid, MarginWidensItOnAllSides) {
  Cuboid cuboid;
  cuboid.size = Vector3(2, 2, 2);
  EXPECT_FALSE(contains(cuboid, {1.05, 0, 0}));
  EXPECT_TRUE(contains(cuboid, {1.05, -1.05, 1.05}, 0.1));
}

TEST(Cuboid, CornerBitsChooseTheSigns) {
  Cuboid cuboid;
  cuboid.size = Vector3(2, 4, 6);
  const auto c = corners(cuboid);
  EXPECT_EQ(c[0], Vector3(-1, -2, -3));
  EXPECT_EQ(c[1], Vector3(1, -2, -3));
  EXPECT_EQ(c[2], Vector3(-1, 2, -3));
  EXPECT_EQ(c[4], Vector3(-1, -2, 3));
  EXPECT_EQ(c[7], Vector3(1, 2, 3));
}

TEST(Cuboid, StatesHaveNames) {
  EXPECT_EQ(toString(CellState::Free), std::string("free"));
  EXPECT_EQ(toString(CellState::Occupied), std::string("occupied"));
  EXPECT_EQ(toString(CellState::Unknown), std::string("unknown"));
}

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
