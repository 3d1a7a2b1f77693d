// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/cuboid_approximation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "planar_mapping/core/error.h"
#include "planar_mapping/core/random.h"

namespace planar_mapping {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Scene {
  std::vector<float> xyz;
  std::vector<PlaneSegment> planes;

  PointsView view() const { return PointsView(xyz.data(), xyz.size() / 3); }
  int add(const Vector3& p) {
    for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(p[k]));
    return static_cast<int>(xyz.size() / 3) - 1;
  }
  /// Random points of a rectangle spanned at \p corner, as a plane of the scene.
  void addPatch(Random& random, const Vector3& corner, const Vector3& a, const Vector3& b,
                int count, double noise) {
    const Vector3 normal = a.cross(b).normalized();
    PlaneSegment segment;
    segment.plane = {normal, -normal.dot(corner)};
    for (int i = 0; i < count; ++i) {
      segment.inliers.push_back(add(corner + random.uniform() * a + random.uniform() * b +
                                    noise * random.uniform(-1, 1) * normal));
    }
    planes.push_back(segment);
  }
};

/// A corner of a room with a box-shaped cloud of loose points.
Scene room(std::uint64_t seed = 1) {
  Random random(seed);
  Scene scene;
  scene.addPatch(random, {3, -1.5, 0}, {0, 3, 0}, {0, 0, 2}, 20000, 0.01);
  scene.addPatch(random, {0.5, 1.5, 0.03}, {2.4, 0, 0}, {0, 0, 1.5}, 15000, 0.01);
  scene.addPatch(random, {1.0, -1.0, 0.5}, {0.9, 0.2, 0}, {-0.1, 0.5, 0.2}, 5000, 0.005);
  for (int i = 0; i < 3000; ++i) {
    scene.add({random.uniform(1.2, 1.6), random.uniform(0.2, 0.7), random.uniform(0.1, 0.9)});
  }
  return scene;
}

CuboidApproximationParams paramsFor(Profile profile, double resolution = 0.1) {
  CuboidApproximationParams params;
  params.profile = profile;
  params.resolution = resolution;
  return params;
}

double coverage(const Scene& scene, const std::vector<Cuboid>& cuboids, double margin) {
  std::size_t inside = 0;
  const PointsView points = scene.view();
  for (std::size_t i = 0; i < points.size; ++i) {
    inside += std::any_of(cuboids.begin(), cuboids.end(),
                          [&](const Cuboid& c) { return contains(c, points.point(i), margin); });
  }
  return static_cast<double>(inside) / static_cast<double>(points.size);
}

void expectSameCuboids(const std::vector<Cuboid>& l, const std::vector<Cuboid>& r) {
  ASSERT_EQ(l.size(), r.size());
  for (std::size_t i = 0; i < l.size(); ++i) {
    EXPECT_TRUE(l[i].center == r[i].center && l[i].size == r[i].size);
    EXPECT_EQ(l[i].plane_id, r[i].plane_id);
  }
}

TEST(CuboidApproximation, WallBecomesOneCuboidBehindItsSurface) {
  Scene scene;
  PlaneSegment wall;
  wall.plane = planeFromCoefficients(1, 0, 0, -2);  // turned towards the sensor by us
  for (int y = 0; y <= 40; ++y) {
    for (int z = 0; z <= 20; ++z) wall.inliers.push_back(scene.add({2, 0.05 * y, 0.05 * z}));
  }
  scene.planes.push_back(wall);
  for (const Profile profile : {Profile::Paper, Profile::Compact}) {
    CuboidApproximationParams params = paramsFor(profile);
    params.thickness = 0.25;
    const auto cuboids = approximateCuboids(scene.view(), nullptr, scene.planes, params);
    ASSERT_EQ(cuboids.size(), 1u);
    EXPECT_NEAR((cuboids[0].center - Vector3(2.125, 1.0, 0.5)).norm(), 0.0, 1e-6);
    EXPECT_NEAR((cuboids[0].size - Vector3(2.0, 1.0, 0.25)).norm(), 0.0, 1e-6);
    EXPECT_TRUE((cuboids[0].orientation * Vector3::UnitZ()).isApprox(Vector3(-1, 0, 0), 1e-9));
    EXPECT_EQ(cuboids[0].plane_id, 0);
    EXPECT_FALSE(contains(cuboids[0], {1.99, 1.0, 0.5}));
  }
}

TEST(CuboidApproximation, EveryPointIsInsideOrWithinHalfACell) {
  const Scene scene = room();
  for (const double s : {0.05, 0.1, 0.3}) {
    const auto compact =
        approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(Profile::Compact, s));
    EXPECT_EQ(coverage(scene, compact, 0.5 * s + 1e-6), 1.0) << s;
    const auto paper =
        approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(Profile::Paper, s));
    EXPECT_GT(coverage(scene, paper, 0.5 * s + 1e-6), 0.99) << s;
    EXPECT_LT(compact.size(), paper.size());
  }
}

TEST(CuboidApproximation, DiagnosticsAddUp) {
  const Scene scene = room();
  CuboidApproximationDiagnostics d;
  const auto cuboids =
      approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(Profile::Compact),
                         Vector3::Zero(), nullptr, &d);
  EXPECT_EQ(d.planar_points, 40000u);
  EXPECT_EQ(d.non_planar_points, 3000u);
  EXPECT_EQ(d.dropped_points, 0u);
  EXPECT_EQ(d.planar_cuboids + d.non_planar_cuboids, cuboids.size());
  EXPECT_GT(d.standard_cells, cuboids.size());
}

TEST(CuboidApproximation, MovesWithTheScene) {
  const Scene scene = room();
  Pose T = Pose::Identity();
  T.linear() =
      (Eigen::AngleAxisd(0.7, Vector3::UnitZ()) * Eigen::AngleAxisd(-0.4, Vector3::UnitX()))
          .toRotationMatrix();
  T.translation() = Vector3(4, -2, 1);
  Scene moved;
  for (std::size_t i = 0; i < scene.view().size; ++i) moved.add(T * scene.view().point(i));
  moved.planes = scene.planes;
  for (PlaneSegment& segment : moved.planes) segment.plane = transformed(segment.plane, T);

  CuboidApproximationParams params = paramsFor(Profile::Compact);
  const auto before = approximateCuboids(scene.view(), nullptr, scene.planes, params);
  params.up = T.linear() * params.up;
  const auto after =
      approximateCuboids(moved.view(), nullptr, moved.planes, params, T.translation());
  std::vector<Cuboid> planar_before, planar_after;
  const auto planar = [](const Cuboid& c) { return c.plane_id >= 0; };
  std::copy_if(before.begin(), before.end(), std::back_inserter(planar_before), planar);
  std::copy_if(after.begin(), after.end(), std::back_inserter(planar_after), planar);
  ASSERT_EQ(planar_before.size(), planar_after.size());
  for (std::size_t i = 0; i < planar_before.size(); ++i) {
    const Cuboid expected = transformed(planar_before[i], T);
    EXPECT_NEAR((expected.center - planar_after[i].center).norm(), 0.0, 1e-5);
    EXPECT_TRUE(expected.size.isApprox(planar_after[i].size, 1e-9));
    EXPECT_NEAR(expected.orientation.angularDistance(planar_after[i].orientation), 0.0, 1e-6);
  }
}

TEST(CuboidApproximation, OrderOfThePointsDoesNotMatter) {
  const Scene scene = room();
  const std::size_t count = scene.view().size;
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  Random random(3);
  for (std::size_t i = count - 1; i > 0; --i) {
    std::swap(order[i], order[random.below(static_cast<std::uint32_t>(i + 1))]);
  }
  std::vector<int> place(count);
  Scene shuffled;
  for (std::size_t i = 0; i < count; ++i) {
    place[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
    shuffled.add(scene.view().point(static_cast<std::size_t>(order[i])));
  }
  shuffled.planes = scene.planes;
  for (PlaneSegment& segment : shuffled.planes) {
    for (int& i : segment.inliers) i = place[static_cast<std::size_t>(i)];
    std::sort(segment.inliers.begin(), segment.inliers.end());
  }
  for (const Profile profile : {Profile::Paper, Profile::Compact}) {
    const auto l = approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(profile));
    const auto r =
        approximateCuboids(shuffled.view(), nullptr, shuffled.planes, paramsFor(profile));
    ASSERT_EQ(l.size(), r.size());
    for (std::size_t i = 0; i < l.size(); ++i) {
      EXPECT_NEAR((l[i].center - r[i].center).norm(), 0.0, 1e-6);
    }
  }
}

TEST(CuboidApproximation, PermutedPlanesOnlyPermuteTheIds) {
  const Scene scene = room();
  Scene permuted = scene;
  std::rotate(permuted.planes.begin(), permuted.planes.begin() + 1, permuted.planes.end());
  const auto l =
      approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(Profile::Compact));
  auto r =
      approximateCuboids(permuted.view(), nullptr, permuted.planes, paramsFor(Profile::Compact));
  for (Cuboid& c : r) {
    if (c.plane_id >= 0) c.plane_id = (c.plane_id + 1) % 3;
  }
  std::stable_sort(r.begin(), r.end(), [](const Cuboid& a, const Cuboid& b) {
    return static_cast<std::uint32_t>(a.plane_id) < static_cast<std::uint32_t>(b.plane_id);
  });
  expectSameCuboids(l, r);
}

TEST(CuboidApproximation, SubsetByIndexIsSubsetByCopy) {
  const Scene scene = room();
  Scene copy;
  Indices indices;
  std::vector<int> place(scene.view().size, -1);
  for (std::size_t i = 0; i < scene.view().size; i += 3) {
    indices.push_back(static_cast<int>(i));
    place[i] = copy.add(scene.view().point(i));
  }
  copy.planes = scene.planes;
  for (PlaneSegment& segment : copy.planes) {
    Indices kept;
    for (const int i : segment.inliers) {
      if (place[static_cast<std::size_t>(i)] >= 0)
        kept.push_back(place[static_cast<std::size_t>(i)]);
    }
    segment.inliers = kept;
  }
  expectSameCuboids(
      approximateCuboids(scene.view(), &indices, scene.planes, paramsFor(Profile::Compact)),
      approximateCuboids(copy.view(), nullptr, copy.planes, paramsFor(Profile::Compact)));
}

TEST(CuboidApproximation, ThreadsDoNotChangeTheResult) {
  const Scene scene = room();
  CuboidApproximationParams params = paramsFor(Profile::Compact);
  const auto one = approximateCuboids(scene.view(), nullptr, scene.planes, params);
  params.threads = 4;
  expectSameCuboids(one, approximateCuboids(scene.view(), nullptr, scene.planes, params));
}

TEST(CuboidApproximation, PointsAtAPlaneAreAbsorbedAndIsolatedNoiseIsDropped) {
  Random random(2);
  Scene scene;
  scene.addPatch(random, {2, 0, 0}, {0, 1, 0}, {0, 0, 1}, 5000, 0.0);
  scene.add({1.96, 0.5, 0.5});   // within half a cell of the wall
  scene.add({1.0, 0.52, 0.52});  // alone in the air
  CuboidApproximationDiagnostics d;
  CuboidApproximationParams params = paramsFor(Profile::Compact);
  EXPECT_EQ(
      approximateCuboids(scene.view(), nullptr, scene.planes, params, Vector3::Zero(), nullptr, &d)
          .size(),
      2u);
  EXPECT_EQ(d.absorbed_points, 1u);
  params.min_points_per_cell = 2;
  EXPECT_EQ(
      approximateCuboids(scene.view(), nullptr, scene.planes, params, Vector3::Zero(), nullptr, &d)
          .size(),
      1u);
  EXPECT_EQ(d.dropped_points, 1u);
  params.profile = Profile::Paper;
  params.min_points_per_cell = 1;
  EXPECT_EQ(approximateCuboids(scene.view(), nullptr, scene.planes, params).size(), 3u);
}

TEST(CuboidApproximation, SmallHolesAreFilledAndLargeOnesStayOpen) {
  Scene scene;
  PlaneSegment wall;
  wall.plane = planeFromCoefficients(-1, 0, 0, 2);
  for (int y = 0; y < 120; ++y) {
    for (int z = 0; z < 80; ++z) {
      const bool small = y / 4 == 5 && z / 4 == 5;
      const bool large = y / 4 >= 12 && y / 4 < 16 && z / 4 >= 8 && z / 4 < 12;
      if (small || large) continue;
      wall.inliers.push_back(scene.add({2, 0.025 * y + 0.0125, 0.025 * z + 0.0125}));
    }
  }
  scene.planes.push_back(wall);
  CuboidApproximationParams params = paramsFor(Profile::Compact);
  const Vector3 in_small(2.01, 0.55, 0.55), in_large(2.01, 1.4, 1.0);
  const auto holds = [&](const Vector3& p) {
    const auto cuboids = approximateCuboids(scene.view(), nullptr, scene.planes, params);
    return std::any_of(cuboids.begin(), cuboids.end(),
                       [&](const Cuboid& c) { return contains(c, p); });
  };
  EXPECT_TRUE(holds(in_small));
  EXPECT_FALSE(holds(in_large));
  params.hole_size = 0.01;  // less than a cell: off
  EXPECT_FALSE(holds(in_small));
  params.hole_size = 0.5;
  EXPECT_TRUE(holds(in_large));
}

TEST(CuboidApproximation, BeliefIsTheMeanOverCellsOfTheMeanOverPoints) {
  Scene scene;
  PlaneSegment wall;
  wall.plane = planeFromCoefficients(-1, 0, 0, 2);
  std::vector<float> belief;
  const auto addPoint = [&](double y, double z, float p) {
    wall.inliers.push_back(scene.add({2, y, z}));
    belief.push_back(p);
  };
  addPoint(0.00, 0.00, 0.2f);  // first cell: mean 0.3
  addPoint(0.05, 0.05, 0.4f);
  addPoint(0.20, 0.10, 0.9f);  // second cell
  scene.planes.push_back(wall);
  const auto only = [&](double rectangle_cells) {
    CuboidApproximationParams params = paramsFor(Profile::Compact);
    params.rectangle_cells = rectangle_cells;
    const auto cuboids =
        approximateCuboids(scene.view(), nullptr, scene.planes, params, Vector3::Zero(), &belief);
    EXPECT_EQ(cuboids.size(), 1u);
    return cuboids.at(0);
  };
  EXPECT_EQ(only(0.0).plane_id, 0);
  EXPECT_NEAR(only(0.0).probability, 0.6, 1e-6);
  // A box of the same: over the three quarters of cells that hold points.
  EXPECT_EQ(only(4.0).plane_id, -1);
  EXPECT_NEAR(only(4.0).probability, 0.5, 1e-6);
}

TEST(CuboidApproximation, HostileCloudsGiveSmallAnswers) {
  const CuboidApproximationParams compact = paramsFor(Profile::Compact, 0.05);
  const CuboidApproximationParams paper = paramsFor(Profile::Paper, 0.05);
  EXPECT_TRUE(approximateCuboids(PointsView(), nullptr, {}, compact).empty());

  Scene scene;
  PlaneSegment plane;
  plane.plane = planeFromCoefficients(0, 0, 1, -1);
  for (const double far : {0.0, 1e3, 1e9, -1e9, 3e38}) {
    plane.inliers.push_back(scene.add({far, 1, 1}));
    plane.inliers.push_back(scene.add({far, -far, 1}));
    scene.add({far, 2, far});
  }
  for (int i = 0; i < 50; ++i) plane.inliers.push_back(scene.add({0.01 * i, 5, 1}));  // a line
  for (int i = 0; i < 50; ++i) plane.inliers.push_back(scene.add({7, 7, 1}));         // one place
  for (const float bad :
       {kNan, std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vector3 p(0.1, 0.2, 1);
      p[axis] = static_cast<double>(bad);
      plane.inliers.push_back(scene.add(p));
      scene.add(p);
    }
  }
  for (int side = 0; side < 2; ++side) {
    scene.planes.assign(static_cast<std::size_t>(side), plane);
    for (const CuboidApproximationParams& params : {compact, paper}) {
      CuboidApproximationDiagnostics d;
      const auto cuboids = approximateCuboids(scene.view(), nullptr, scene.planes, params,
                                              Vector3::Zero(), nullptr, &d);
      EXPECT_FALSE(cuboids.empty());
      EXPECT_LT(cuboids.size(), 60u);
      EXPECT_GE(d.dropped_points, 18u);
      for (const Cuboid& c : cuboids) {
        EXPECT_TRUE(c.center.allFinite() && c.size.allFinite());
        EXPECT_NEAR(c.orientation.norm(), 1.0, 1e-9);
      }
    }
  }
}

TEST(CuboidApproximation, WideThinPlanesNeedLittleMemory) {
  // A diagonal line of 100 km: as a dense raster it would take 10^13 cells.
  Scene scene;
  PlaneSegment plane;
  plane.plane = planeFromCoefficients(0, 0, 1, -1);
  for (int i = 0; i < 20000; ++i) plane.inliers.push_back(scene.add({5.0 * i, 5.0 * i, 1}));
  for (int i = 0; i < 20000; ++i) plane.inliers.push_back(scene.add({0.02 * i, -0.02 * i, 1}));
  scene.planes.push_back(plane);
  for (const Profile profile : {Profile::Paper, Profile::Compact}) {
    const auto cuboids =
        approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(profile));
    EXPECT_GT(cuboids.size(), 20000u);
    EXPECT_LT(cuboids.size(), 30000u);
  }
}

TEST(CuboidApproximation, WhatCannotBeUsedIsRefused) {
  Scene scene = room();
  const CuboidApproximationParams params = paramsFor(Profile::Compact);
  const Indices outside = {0, 43000};
  EXPECT_THROW(approximateCuboids(scene.view(), &outside, {}, params), InputError);
  const Indices negative = {-1};
  EXPECT_THROW(approximateCuboids(scene.view(), &negative, {}, params), InputError);
  const std::vector<float> few(7, 1.0f);
  EXPECT_THROW(approximateCuboids(scene.view(), nullptr, {}, params, Vector3::Zero(), &few),
               InputError);
  EXPECT_THROW(approximateCuboids(scene.view(), nullptr, {}, params, Vector3(0, NAN, 0)),
               InputError);
  scene.planes[0].inliers.push_back(1 << 30);
  EXPECT_THROW(approximateCuboids(scene.view(), nullptr, scene.planes, params), InputError);
}

TEST(CuboidApproximation, ParametersOutOfRangeAreNamed) {
  const auto refused = [](auto change) {
    CuboidApproximationParams params;
    change(params);
    EXPECT_THROW(params.validate(), ParameterError);
  };
  EXPECT_NO_THROW(CuboidApproximationParams().validate());
  refused([](auto& p) { p.resolution = 0; });
  refused([](auto& p) { p.resolution = std::nan(""); });
  refused([](auto& p) { p.thickness = -1; });
  refused([](auto& p) { p.density_threshold = 0; });
  refused([](auto& p) { p.density_threshold = 1.1; });
  refused([](auto& p) { p.min_width = -0.1; });
  refused([](auto& p) { p.min_height = std::nan(""); });
  refused([](auto& p) { p.min_points_per_cell = 0; });
  refused([](auto& p) { p.hole_size = -1; });
  refused([](auto& p) { p.absorption = 0.6; });
  refused([](auto& p) { p.up.setZero(); });
  refused([](auto& p) { p.up.x() = std::nan(""); });
  refused([](auto& p) { p.threads = -1; });
}

TEST(CuboidsOfPlane, RectanglesLieBehindThePlaneInItsFrame) {
  const PlaneFrame frame = makePlaneFrame(planeFromCoefficients(-1, 0, 0, 2), Vector3::Zero());
  CellMask mask;
  mask.a0 = 2;
  mask.b0 = -1;
  mask.width = 3;
  mask.height = 1;
  mask.cells = {1, 1, 1};
  const auto cuboids =
      cuboidsOfPlane(frame, mask, {0.2f, 0.4f, 0.9f}, 7, CuboidApproximationParams());
  ASSERT_EQ(cuboids.size(), 1u);
  // u = -y from cell 2 to 5, v = z from cell -1 to 0, s = 0.1.
  EXPECT_TRUE(cuboids[0].center.isApprox(Vector3(2.05, -0.35, -0.05), 1e-9));
  EXPECT_TRUE(cuboids[0].size.isApprox(Vector3(0.3, 0.1, 0.1), 1e-9));
  EXPECT_EQ(cuboids[0].plane_id, 7);
  EXPECT_NEAR(cuboids[0].probability, 0.5, 1e-6);
  EXPECT_THROW(cuboidsOfPlane(frame, mask, {0.2f}, 7, CuboidApproximationParams()), InputError);
}

}  // namespace
}  // namespace planar_mapping
