// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping {
namespace {

void expectRightHanded(const PlaneFrame& frame) {
  EXPECT_NEAR(frame.u.norm(), 1.0, 1e-12);
  EXPECT_NEAR(frame.n.norm(), 1.0, 1e-12);
  EXPECT_NEAR((frame.n.cross(frame.u) - frame.v).norm(), 0.0, 1e-12);
}

TEST(PlaneFrame, WallHasHorizontalUAndUpwardV) {
  // The wall x = 2, seen from the origin.
  const PlaneFrame frame = makePlaneFrame(planeFromCoefficients(-1, 0, 0, 2), Vector3::Zero());
  expectRightHanded(frame);
  EXPECT_TRUE(frame.n.isApprox(Vector3(-1, 0, 0)));
  EXPECT_TRUE(frame.u.isApprox(Vector3(0, -1, 0)));
  EXPECT_TRUE(frame.v.isApprox(Vector3(0, 0, 1)));
  EXPECT_TRUE(frame.origin.isApprox(Vector3(2, 0, 0)));
}

TEST(PlaneFrame, OriginIsTheFootOfTheNearPoint) {
  Random random(1);
  for (int run = 0; run < 50; ++run) {
    const Vector3 normal(random.normal(), random.normal(), random.normal());
    const Plane plane = planeFromCoefficients(normal.x(), normal.y(), normal.z(), random.normal());
    const Vector3 near(random.normal(), random.normal(), random.normal());
    const PlaneFrame frame = makePlaneFrame(plane, near);
    expectRightHanded(frame);
    EXPECT_NEAR(plane.signedDistance(frame.origin), 0.0, 1e-12);
    EXPECT_NEAR((near - frame.origin).cross(frame.n).norm(), 0.0, 1e-12);
    EXPECT_NEAR(frame.u.z(), 0.0, 1e-12);
    const Vector3 p(random.normal(), random.normal(), random.normal());
    EXPECT_NEAR((frame.fromPlane(frame.toPlane(p)) - p).norm(), 0.0, 1e-12);
    EXPECT_NEAR(frame.toPlane(p).z(), plane.signedDistance(p), 1e-12);
  }
}

TEST(PlaneFrame, HorizontalPlaneGetsTheSameDirectionEveryTime) {
  const PlaneFrame table = makePlaneFrame(planeFromCoefficients(0, 0, 1, -0.7), Vector3(3, 4, 5));
  expectRightHanded(table);
  EXPECT_TRUE(table.u.isApprox(Vector3::UnitX()));
  EXPECT_TRUE(table.origin.isApprox(Vector3(3, 4, 0.7)));
}

TEST(PlaneFrame, UpMayBeAnyDirectionOfAnyLength) {
  const PlaneFrame frame =
      makePlaneFrame(planeFromCoefficients(0, 0, -1, 2), Vector3::Zero(), Vector3(0, -7, 0));
  expectRightHanded(frame);
  EXPECT_NEAR(frame.u.y(), 0.0, 1e-12);
  EXPECT_TRUE(frame.v.isApprox(Vector3(0, -1, 0)));
}

TEST(PlaneFrame, RefusesWhatIsNoPlane) {
  Plane plane;
  plane.normal.setZero();
  EXPECT_THROW(makePlaneFrame(plane, Vector3::Zero()), InputError);
  plane = Plane();
  plane.offset = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(makePlaneFrame(plane, Vector3::Zero()), InputError);
  EXPECT_THROW(makePlaneFrame(Plane(), Vector3(0, std::numeric_limits<double>::infinity(), 0)),
               InputError);
  EXPECT_THROW(makePlaneFrame(Plane(), Vector3::Zero(), Vector3::Zero()), ParameterError);
}

TEST(PlaneFrame, TurnsFlatPlanesAlongTheDirectionGiven) {
  const Vector3 along(1.0, 2.0, 0.0);
  const Plane floor{Vector3(0.01, -0.02, 1.0).normalized(), 0.3};
  const PlaneFrame turned = makePlaneFrame(floor, Vector3::Zero(), Vector3::UnitZ(), along);
  EXPECT_NEAR(turned.u.dot(floor.normal), 0.0, 1e-12);
  EXPECT_GT(turned.u.dot(along.normalized()), 0.999);
  EXPECT_NEAR((turned.n.cross(turned.u) - turned.v).norm(), 0.0, 1e-12);
  // A slope keeps its horizontal, whatever is asked.
  const Plane slope{Vector3(0.0, -1.0, 1.0).normalized(), 0.3};
  const PlaneFrame kept = makePlaneFrame(slope, Vector3::Zero(), Vector3::UnitZ(), along);
  EXPECT_NEAR(std::abs(kept.u.x()), 1.0, 1e-12);
}

TEST(DominantDirection, FollowsTheSteepPlaneWithTheMostWeight) {
  const std::vector<Plane> planes{
      {Vector3::UnitZ(), 0.0}, {Vector3::UnitX(), 1.0}, {Vector3(0.6, 0.8, 0.1).normalized(), 2.0}};
  const Vector3 direction = dominantDirection(planes, {900.0, 10.0, 20.0});
  EXPECT_NEAR(direction.dot(planes[2].normal), 0.0, 1e-12);
  EXPECT_NEAR(direction.z(), 0.0, 1e-12);
  EXPECT_NEAR(direction.norm(), 1.0, 1e-12);
  EXPECT_EQ(dominantDirection({planes[0]}, {900.0}), Vector3::Zero());
  EXPECT_THROW(dominantDirection(planes, {1.0}), InputError);
}

}  // namespace
}  // namespace planar_mapping
