// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a map makes of noise: which cells it believes, and where it puts a noisy surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "noisy_sequence.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using namespace test;

/// Frames of a camera that moves a little from place to place.
void walkThrough(PlanarMap& map, const Scene& scene, const StereoErrors& errors, int frames,
                 Random& random) {
  for (int i = 0; i < frames; ++i) {
    const Pose pose = lookFrom({-0.4 + 0.1 * i, -0.6 + 0.02 * i, 1.1}, 0.02 * (i % 3), 0.1);
    map.insert(observationOf(test::lookNoisy(scene, pose, errors, random, 300), errors));
  }
}

/// Fraction of the points of a grid over a rectangle at depth y that the map has within `margin`.
double shareFound(const PlanarMap& map, double x0, double x1, double z0, double z1, double y,
                  double margin) {
  int found = 0, all = 0;
  for (double x = x0; x <= x1; x += 0.02) {
    for (double z = z0; z <= z1; z += 0.02, ++all)
      found += map.cuboidsAt({x, y, z}, margin).empty() ? 0 : 1;
  }
  return static_cast<double>(found) / all;
}

TEST(BelievedSurfaces, AThinPoleStays) {
  const Scene scene = roomWith({{0.20, 1.50, 0.0}, {0.24, 1.54, 2.2}, false, false});
  const StereoErrors errors = noiseOf(0.25);
  Random random(5);
  PlanarMap map(roomParams());
  walkThrough(map, scene, errors, 8, random);
  EXPECT_GT(shareFound(map, 0.21, 0.23, 0.4, 1.8, 1.50, 0.1), 0.95);
}

TEST(BelievedSurfaces, PixelsThatFlyBetweenABoxAndTheWallAreNoPartOfTheMap) {
  const Scene scene = roomWith({{-0.5, 1.6, 0.0}, {0.4, 2.0, 1.6}, false, true});
  std::size_t wrong[2] = {0, 0};
  for (const bool forgets : {false, true}) {
    const StereoErrors errors = noiseOf(0.25, 0.3);
    Random random(5);
    PlanarMapParams params = roomParams();
    if (!forgets) params.miss_factor = params.first_belief = 1.0;
    PlanarMap map(params);
    walkThrough(map, scene, errors, 10, random);
    wrong[forgets ? 1 : 0] = test::mappingError(map, scene, 0.1).wrong;
    EXPECT_GT(shareFound(map, -0.45, 0.35, 0.6, 1.55, 1.6, 0.1), 0.999) << forgets;
  }
  EXPECT_LT(wrong[1], 0.5 * static_cast<double>(wrong[0]));
}

TEST(BelievedSurfaces, APersonWhoWalksAwayIsNoLongerThere) {
  // No plane is made of a person.
  const SceneBox here{{-0.5, 1.6, 0.1}, {-0.1, 1.9, 1.7}, false, false};
  const SceneBox there{{0.6, 1.6, 0.1}, {1.0, 1.9, 1.7}, false, false};
  const StereoErrors errors = noiseOf(0.25);
  Random random(9);
  PlanarMap map(roomParams());
  walkThrough(map, roomWith(here), errors, 4, random);
  EXPECT_GT(shareFound(map, -0.45, -0.15, 0.5, 1.6, 1.6, 0.1), 0.99);
  walkThrough(map, roomWith(there), errors, 6, random);
  EXPECT_LT(shareFound(map, -0.45, -0.15, 0.5, 1.6, 1.75, 0.05), 0.02);
  EXPECT_GT(shareFound(map, 0.65, 0.95, 0.5, 1.6, 1.6, 0.1), 0.99);
}

/// The view with a quarter of its pixels in holes, in blocks of 2 x 2.
View withHoles(View view, Random& random) {
  for (int row = 0; row + 1 < view.camera.height; row += 2) {
    for (int column = 0; column + 1 < view.camera.width; column += 2) {
      if (random.uniform() >= 0.25) continue;
      for (const int pixel : {0, 1, view.camera.width, view.camera.width + 1}) {
        const std::size_t i = static_cast<std::size_t>(row * view.camera.width + column + pixel);
        std::fill_n(&view.xyz[3 * i], 3, std::numeric_limits<float>::quiet_NaN());
      }
    }
  }
  for (PlaneSegment& plane : view.planes) {
    const auto isHole = [&](int i) {
      return std::isnan(view.xyz[3 * static_cast<std::size_t>(i)]);
    };
    plane.inliers.erase(std::remove_if(plane.inliers.begin(), plane.inliers.end(), isHole),
                        plane.inliers.end());
  }
  return view;
}

/// Sees a person for some frames, then the room without.
PlanarMap mapOfOneWhoLeft(bool with_noise, int frames) {
  const SceneBox here{{-0.5, 1.6, 0.1}, {0.0, 1.9, 1.7}, false, true};
  const StereoErrors errors = noiseOf(0.1);
  Random random(9);
  PlanarMap map(roomParams());
  for (int i = 0; i < 3 + frames; ++i) {
    const Scene scene =
        i < 3 ? roomWith(here) : roomWith({{3, 3, 3}, {3.1, 3.1, 3.1}, false, false});
    const Pose pose = lookFrom({-0.4 + 0.05 * i, -0.6, 1.1}, 0.02 * (i % 3), 0.1);
    const View view = withHoles(test::lookNoisy(scene, pose, errors, random, 300), random);
    map.insert(with_noise ? observationOf(view, errors) : view.frame());
  }
  return map;
}

TEST(BelievedSurfaces, APersonWhoWalksAwayIsNoLongerThereThoughThereAreHolesInAllViews) {
  for (const bool with_noise : {false, true}) {
    EXPECT_GT(shareFound(mapOfOneWhoLeft(with_noise, 0), -0.45, -0.05, 0.5, 1.6, 1.6, 0.1), 0.9);
    EXPECT_LT(shareFound(mapOfOneWhoLeft(with_noise, 8), -0.45, -0.05, 0.5, 1.6, 1.6, 0.05), 0.05)
        << with_noise;
  }
}

/// Of a depth camera half a cell behind the cell is enough.
TEST(BelievedSurfaces, AHandBeforeAWallIsNoLongerThere) {
  Scene scene = roomWith({{-1.2, 1.75, 0.0}, {1.2, 2.0, 2.4}, false, true});
  PlanarMap map(roomParams());
  const auto see = [&](int frames) {
    Random random(4);
    for (int i = 0; i < frames; ++i) {
      const Pose pose = lookFrom({-0.1 + 0.05 * i, -0.6, 1.0}, 0.0, 0.0);
      map.insert(test::lookNoisy(scene, pose, noiseOf(0.02), random, 300).frame());
    }
  };
  scene.boxes.push_back({{-0.4, 1.60, 0.7}, {0.2, 1.63, 1.3}, false, false});
  see(3);
  ASSERT_GT(shareFound(map, -0.35, 0.15, 0.75, 1.25, 1.62, 0.03), 0.99);
  scene.boxes.pop_back();
  see(6);
  EXPECT_LT(shareFound(map, -0.35, 0.15, 0.75, 1.25, 1.62, 0.0), 0.05);
  EXPECT_GT(shareFound(map, -1.0, 1.0, 0.3, 1.8, 1.76, 0.03), 0.99) << "the wall stays";
}

TEST(BelievedSurfaces, WhatMeasuresNothingIsNotLookedThrough) {
  // A box of which the camera sees no more than a hole later on, and the room around it.
  const SceneBox box{{-0.5, 1.6, 0.1}, {0.0, 1.9, 1.7}, false, true};
  Random random(9);
  PlanarMap map(roomParams());
  for (int i = 0; i < 8; ++i) {
    const Pose pose = lookFrom({-0.4 + 0.05 * i, -0.6, 1.1}, 0.0, 0.1);
    View view = test::lookNoisy(roomWith(box), pose, noiseOf(0.0), random, 300);
    for (std::size_t k = 0; i >= 3 && 3 * k < view.xyz.size(); ++k) {
      const Vector3 p = pose * Vector3(view.xyz[3 * k], view.xyz[3 * k + 1], view.xyz[3 * k + 2]);
      if (std::abs(p.x() + 0.25) < 0.26 && p.y() > 1.5 && p.y() < 2.0)
        std::fill_n(&view.xyz[3 * k], 3, std::numeric_limits<float>::quiet_NaN());
    }
    if (i >= 3) view.planes.clear();
    map.insert(view.frame());
  }
  EXPECT_GT(shareFound(map, -0.45, -0.05, 0.5, 1.6, 1.6, 0.1), 0.99);
}

/// The noise is 14 cm on a wall 6 m away, which fills four layers of cells with points: one wall.
TEST(BelievedSurfaces, AFarNoisyWallIsOnePlaneWithHardlyAnythingInFrontOfIt) {
  Scene scene;
  scene.boxes = {{{-3.0, -1.0, 0.0}, {3.0, 5.2, 2.6}, true, true}};
  const StereoErrors errors = noiseOf(0.25);
  Random random(13);
  PlanarMap map(roomParams());
  std::set<std::array<int, 3>> standard;  // cells that hold points well before the wall
  const auto isBefore = [](const Vector3& p) {
    return std::abs(p.x()) < 1.5 && p.z() > 0.5 && p.z() < 2.1 && p.y() > 4.0 && p.y() < 5.05;
  };
  for (int i = 0; i < 8; ++i) {
    const Pose pose = lookFrom({-0.1 + 0.05 * i, -0.8, 1.3}, 0.0, 0.0);
    const View view = test::lookNoisy(scene, pose, errors, random, 300);
    map.insert(observationOf(view, errors));
    for (std::size_t k = 0; k + 2 < view.xyz.size(); k += 3) {
      const Vector3 p = view.pose * Vector3(view.xyz[k], view.xyz[k + 1], view.xyz[k + 2]);
      if (!isBefore(p)) continue;
      standard.insert({static_cast<int>(std::floor(p.x() / 0.1)),
                       static_cast<int>(std::floor(p.y() / 0.1)),
                       static_cast<int>(std::floor(p.z() / 0.1))});
    }
  }
  const auto walls = std::count_if(map.planes().begin(), map.planes().end(), [](const MapPlane& p) {
    return p.plane.normal.y() < -0.9 && p.moments.weight() > 3000;
  });
  EXPECT_EQ(walls, 1);
  double in_front = 0.0;  // cells
  for (const Cuboid& cuboid : map.cuboids()) {
    if (isBefore(cuboid.center)) in_front += cuboid.volume() / 1e-3;
  }
  EXPECT_GT(standard.size(), 1000u);
  EXPECT_LT(in_front, 0.1 * static_cast<double>(standard.size()));
  EXPECT_GT(shareFound(map, -1.5, 1.5, 0.5, 2.1, 5.2, 0.1), 0.999);
}

/// Of the points that were measured, the fraction within half a cell of a cuboid.
double covered(const PlanarMap& map, const std::vector<View>& views, double s) {
  std::size_t found = 0, all = 0;
  for (const View& view : views) {
    for (std::size_t i = 0; i + 2 < view.xyz.size(); i += 3 * 31) {
      const Vector3 p(view.xyz[i], view.xyz[i + 1], view.xyz[i + 2]);
      if (!p.allFinite()) continue;
      ++all;
      found += map.cuboidsAt(view.pose * p, 0.5 * s).empty() ? 0 : 1;
    }
  }
  return static_cast<double>(found) / static_cast<double>(all);
}

TEST(BelievedSurfaces, ANoisyWallIsAsThickAsItsPointsSay) {
  constexpr double kSide = 0.05;
  Scene scene;
  scene.boxes = {{{-3.0, -1.0, 0.0}, {3.0, 3.0, 2.6}, true, true}};
  const StereoErrors errors = noiseOf(0.1);  // 2.3 cm at 3.8 m
  double fraction[2] = {0.0, 0.0};
  for (const bool as_thick : {false, true}) {
    Random random(17);
    PlanarMapParams params = roomParams(kSide);
    if (!as_thick) params.surface_factor = 0.0;
    PlanarMap map(params);
    std::vector<View> views;
    for (int i = 0; i < 4; ++i) {
      const Pose pose = lookFrom({-0.1 + 0.05 * i, -0.8, 1.3}, 0.0, 0.0);
      views.push_back(test::lookNoisy(scene, pose, errors, random, 300));
      map.insert(observationOf(views.back(), errors));
    }
    fraction[as_thick ? 1 : 0] = covered(map, views, kSide);
    for (const Cuboid& cuboid : map.cuboids()) {
      if (cuboid.plane_id < 0) continue;
      EXPECT_GE(cuboid.size.z(), 0.5 * kSide - 1e-9);  // a box that lies on the wall may be thin
      EXPECT_LE(cuboid.size.z(), (as_thick ? 1.2 : 1.0) * kSide + 1e-9);
    }
  }
  EXPECT_GT(fraction[1], fraction[0] + 0.02);
  EXPECT_GT(fraction[1], 0.96);
}

TEST(BelievedSurfaces, AnExactWallBeginsAtItsSurface) {
  const Scene scene;
  PlanarMap map(roomParams());
  map.insert(test::look(scene, lookFrom({0.0, -0.6, 1.2})).frame());
  int walls = 0;
  std::int32_t last_id = 0;
  for (const Cuboid& cuboid : map.cuboids()) {
    // Planes' own cuboids come first, by plane; boxes on planes have the faces of half cells.
    if (cuboid.plane_id < last_id) break;
    last_id = cuboid.plane_id;
    const Vector3 normal = cuboid.orientation * Vector3::UnitZ();
    if (!(normal.y() < -0.999) || cuboid.center.y() < 4.5) continue;
    ++walls;
    EXPECT_NEAR(cuboid.center.y() - 0.5 * cuboid.size.z(), 5.0, 1e-4);
    EXPECT_NEAR(cuboid.size.z(), 0.1, 1e-9);
  }
  EXPECT_GE(walls, 1);
}

/// The face of a narrow board that sticks 3 cm into a cell of half a metre is a small fraction of
/// the cell, but much wider than a pixel.
TEST(BelievedSurfaces, ACoarseCellIsKeptForANarrowPieceOfSurface) {
  const Scene scene = roomWith({{0.47, 1.6, 0.0}, {0.53, 1.7, 2.2}, false, false});
  const StereoErrors errors = noiseOf(0.0);
  for (const double rim_pixels : {1.0, 1e6}) {
    PlanarMapParams params = roomParams(0.5);
    params.rim_pixels = rim_pixels;
    PlanarMap map(params);
    Random random(19);
    const View view =
        test::lookNoisy(scene, lookFrom({0.0, -0.6, 1.1}, 0.0, 0.0), errors, random, 3000);
    map.insert(view.frame());  // the board is no plane
    // A cuboid stands for what is within half a cell of it.
    const double margin = rim_pixels == 1.0 ? 0.25 : 0.0;
    const double right = shareFound(map, 0.51, 0.53, 0.6, 1.4, 1.6, margin);
    const double left = shareFound(map, 0.47, 0.49, 0.6, 1.4, 1.6, margin);
    if (rim_pixels == 1.0) {
      EXPECT_GT(std::min(left, right), 0.99);
    } else {
      EXPECT_LT(std::min(left, right), 0.01);
    }
  }
}

/// Points of a sensor whose depth error nobody knows may lie beside their cell: only looking
/// through a cell tells against it.
TEST(BelievedSurfaces, WithoutADepthErrorOnlyLookingThroughACellDoubtsIt) {
  const SceneBox before{{-0.5, 1.60, 0.3}, {0.3, 1.90, 1.5}, false, false};
  const SceneBox after{{-0.5, 1.48, 0.3}, {0.3, 1.90, 1.5}, false, false};  // nearer by a cell
  for (const bool known : {false, true}) {
    PlanarMap map(roomParams());
    const auto see = [&](const SceneBox& box) {
      Random random(3);
      const View view = test::lookNoisy(roomWith(box), lookFrom({0.0, -0.6, 1.0}, 0.0, 0.0),
                                        noiseOf(0.0), random, 300);
      FrameObservation frame = view.frame();
      if (known) frame.noise = StereoNoise{0.25, view.camera.fx, 0.5};
      map.insert(frame);
    };
    see(before);
    ASSERT_GT(shareFound(map, -0.4, 0.2, 0.5, 1.4, 1.62, 0.0), 0.99);
    for (int i = 0; i < 3; ++i) see(after);
    const double left = shareFound(map, -0.4, 0.2, 0.5, 1.4, 1.66, 0.0);
    if (known) {
      EXPECT_LT(left, 0.05);
    } else {
      EXPECT_GT(left, 0.95);
    }
  }
}

TEST(BelievedSurfaces, RefusesFactorsThatMeanNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {-0.1, 10.1, nan}) {
    PlanarMapParams params;
    params.surface_factor = bad;
    EXPECT_THROW(PlanarMap{params}, ParameterError) << bad;
  }
  for (const double bad : {-1.0, 1e7, nan}) {
    PlanarMapParams params;
    params.rim_pixels = bad;
    EXPECT_THROW(PlanarMap{params}, ParameterError) << bad;
  }
}

}  // namespace
}  // namespace planar_mapping
