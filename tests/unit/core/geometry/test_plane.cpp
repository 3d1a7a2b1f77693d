// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/geometry/plane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/base/detail/random.h"

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

}  // namespace
}  // namespace planar_mapping
