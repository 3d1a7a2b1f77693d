// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Which planes of a map those of a frame belong to.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "map_scene.h"
#include "map_walk.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using namespace test;

void addPoint(const Vector3& point, PlaneSegment& plane, std::vector<float>& xyz) {
  plane.inliers.push_back(static_cast<int>(xyz.size() / 3));
  plane.moments.add(point);
  for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(point[axis]));
}

TEST(PlaneAssociation, SeesTheSameWallTwiceAsOnePlane) {
  PlanarMap map(paramsAt(0.1));
  const std::vector<View> views = walk(6);
  std::size_t faces = 0;
  for (const View& view : views) {
    const FrameUpdate update = map.insert(view.frame());
    EXPECT_EQ(update.planes_new + update.planes_matched, view.planes.size());
    faces = std::max(faces, map.planes().size());
  }
  // Floor, ceiling, three walls, and of the boxes at most front, top and one side each.
  EXPECT_LE(map.planes().size(), 5u + 2u * 4u);
  for (std::size_t i = 0; i < map.planes().size(); ++i) {
    for (std::size_t j = i + 1; j < map.planes().size(); ++j) {
      const Plane& a = map.planes()[i].plane;
      const Plane& b = map.planes()[j].plane;
      EXPECT_FALSE(a.normal.dot(b.normal) > 0.999 && std::abs(a.offset - b.offset) < 0.02)
          << i << " and " << j << " are one plane";
    }
  }
  for (const View& view : views) EXPECT_GT(coverage(map, view, 0.05), 0.999);
  EXPECT_EQ(map.cuboidCount(), map.cuboids().size());
}

TEST(PlaneAssociation, RefitsFromMomentsAndNotFromPoints) {
  PlanarMap map(paramsAt(0.1));
  const std::vector<View> views = walk(3);
  double weight = 0.0;
  for (const View& view : views) {
    map.insert(view.frame());
    for (const PlaneSegment& plane : view.planes) weight += plane.moments.weight();
  }
  double kept = 0.0;
  for (const MapPlane& plane : map.planes()) kept += plane.moments.weight();
  EXPECT_NEAR(kept, weight, 1e-3 * weight);  // kept to ten bits
}

TEST(PlaneAssociation, RefusesAPlaneFarFromItsInliers) {
  std::vector<float> xyz;
  std::vector<PlaneSegment> planes(1);
  for (float x = 0.0f; x < 1.0f; x += 0.1f)
    for (float y = 0.0f; y < 1.0f; y += 0.1f) addPoint({x, y, 3.0}, planes[0], xyz);
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  frame.planes = &planes;
  PlanarMap map(paramsAt(0.1));
  planes[0].plane = {-Vector3::UnitZ(), 3.0 + 1e6};
  EXPECT_THROW(map.insert(frame), InputError);
  EXPECT_EQ(0u, map.frames());
  planes[0].plane = {-Vector3::UnitZ(), 3.0};
  EXPECT_NO_THROW(map.insert(frame));
}

TEST(PlaneAssociation, MergesPlanesThatTurnOutToBeOne) {
  // Two pieces of one wall, too far apart to belong together, until the middle is seen.
  const auto piece = [](float from, float to, std::vector<float>& xyz) {
    std::vector<PlaneSegment> planes(1);
    planes[0].plane = {-Vector3::UnitZ(), 3.0};
    for (float x = from; x < to; x += 0.02f) {
      for (float y = -0.5f; y < 0.5f; y += 0.02f) {
        addPoint({x, y, 3.0}, planes[0], xyz);
      }
    }
    return planes;
  };
  PlanarMapParams params = paramsAt(0.1);
  params.unknown_space = false;
  params.miss_factor = 1.0;
  PlanarMap map(params);
  const auto insert = [&](float from, float to) {
    std::vector<float> xyz;
    const std::vector<PlaneSegment> planes = piece(from, to, xyz);
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.planes = &planes;
    return map.insert(frame);
  };
  insert(-2.0f, -1.0f);
  insert(1.0f, 2.0f);
  EXPECT_EQ(map.planes().size(), 2u);
  const FrameUpdate update = insert(-1.0f, 1.0f);
  EXPECT_EQ(update.planes_merged, 1u);
  ASSERT_EQ(map.planes().size(), 1u);
  EXPECT_EQ(map.planes()[0].id, 0);
  for (double x = -1.95; x < 1.95; x += 0.05) EXPECT_TRUE(map.isOccupied({x, 0.0, 3.02})) << x;
  EXPECT_EQ(map.cuboids().size(), 1u);  // no seam, no hole
}

TEST(PlaneAssociation, KeepsPlanesApartThatOneFrameTellsApart) {
  // A shelf 6 cm above a table: within the association offset, but seen together.
  std::vector<float> xyz;
  std::vector<PlaneSegment> planes(2);
  for (int k = 0; k < 2; ++k) {
    const double depth = 2.0 - 0.06 * k;
    planes[static_cast<std::size_t>(k)].plane = {-Vector3::UnitZ(), depth};
    for (int i = 0; i < 2500; ++i) {
      addPoint({0.02 * (i % 50) + k, 0.02 * (i / 50), depth}, planes[static_cast<std::size_t>(k)],
               xyz);
    }
  }
  PlanarMap map(paramsAt(0.1));
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  std::vector<PlaneSegment> first{planes[0]};
  std::vector<int> mapped = planes[0].inliers;
  frame.planes = &first;
  frame.indices = &mapped;
  map.insert(frame);
  frame.planes = &planes;
  frame.indices = nullptr;
  map.insert(frame);
  map.insert(frame);
  EXPECT_EQ(map.planes().size(), 2u);
}

TEST(PlaneAssociation, GivesUpCellsWhereAPlaneIsSeenLater) {
  PlanarMapParams params = paramsAt(0.1);
  PlanarMap map(params);
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  FrameObservation frame = view.frame();
  frame.planes = nullptr;
  map.insert(frame);
  EXPECT_TRUE(map.planes().empty());
  std::size_t cells = 0;
  for (const Cuboid& c : map.cuboids())
    cells += static_cast<std::size_t>(std::lround(c.volume() / 1e-3));
  frame.planes = &view.planes;
  map.insert(frame);
  std::size_t left = 0;
  for (const Cuboid& c : map.cuboids()) {
    if (c.plane_id < 0) left += static_cast<std::size_t>(std::lround(c.volume() / 1e-3));
  }
  EXPECT_LT(left, cells / 2);
  EXPECT_GT(coverage(map, view, 0.05), 0.999);
}

TEST(PlaneAssociation, AbsorbsPointsThatAPlaneCovers) {
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  std::vector<PlaneSegment> planes = view.planes;
  // Every tenth point of each plane is nobody's.
  std::size_t taken = 0;
  for (PlaneSegment& plane : planes) {
    Indices kept;
    for (std::size_t i = 0; i < plane.inliers.size(); ++i) {
      if (i % 10 != 0) kept.push_back(plane.inliers[i]);
    }
    taken += plane.inliers.size() - kept.size();
    plane.inliers = kept;
  }
  FrameObservation frame = view.frame();
  frame.planes = &planes;
  PlanarMap map(paramsAt(0.1));
  const FrameUpdate update = map.insert(frame);
  EXPECT_GE(update.absorbed_points, taken * 99 / 100);
  PlanarMap whole(paramsAt(0.1));
  whole.insert(view.frame());
  EXPECT_LE(map.cuboids().size(), whole.cuboids().size() + 4);
}

/// Far measurements of one thing that are as rough as the thing is wide fit another plane in every
/// frame: they are cells, not a plane each.
/// Three frames of points of a square wall; the last are in \p xyz.
/// \param known_at_once  else the first frame has its points on no plane
PlanarMap mapOfSquare(double side, double scatter, bool known_at_once, std::vector<float>& xyz) {
  PlanarMap map(paramsAt(0.1));
  Random random(7);
  const Matrix3 turn = Eigen::AngleAxisd(0.5, Vector3(0.3, 1.0, 0.2).normalized()).matrix();
  for (int frame = 0; frame < 3; ++frame) {
    xyz.clear();
    PlaneMoments moments;
    for (int i = 0; i < 4000; ++i) {
      const Vector3 p =
          turn * Vector3(random.uniform(-0.5 * side, 0.5 * side),
                         random.uniform(-0.5 * side, 0.5 * side), scatter * random.normal()) +
          Vector3(0.0, 0.0, 3.0);
      moments.add(p);
      for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(p[k]));
    }
    std::vector<PlaneSegment> planes(1);
    planes[0].plane = moments.fit().plane;
    for (int i = 0; i < 4000; ++i) planes[0].inliers.push_back(i);
    FrameObservation observation;
    observation.points = PointsView(xyz.data(), 4000);
    if (frame > 0 || known_at_once) observation.planes = &planes;
    map.insert(observation);
  }
  return map;
}

/// Fraction of the points within half a cell of a cuboid.
double coveredFraction(const PlanarMap& map, const std::vector<float>& xyz) {
  std::size_t covered = 0;
  for (std::size_t i = 0; i < xyz.size(); i += 3) {
    const Vector3 p(xyz[i], xyz[i + 1], xyz[i + 2]);
    covered += map.cuboidsAt(p, 0.05 + 1e-9).empty() ? 0 : 1;
  }
  return static_cast<double>(covered) / static_cast<double>(xyz.size() / 3);
}

TEST(PlaneAssociation, RoughPointsAreNoNewPlane) {
  for (const double scatter : {0.005, 0.05}) {
    std::vector<float> xyz;
    const PlanarMap map = mapOfSquare(0.6, scatter, true, xyz);
    EXPECT_EQ(map.planes().size(), scatter > 0.01 ? 0u : 1u);
    EXPECT_GT(coveredFraction(map, xyz), 0.98) << scatter;
  }
}

TEST(PlaneAssociation, WhereTheMapHasCellsWhatIsSmallerThanNineIsNoNewPlane) {
  for (const double side : {0.28, 0.32}) {
    for (const bool known_at_once : {true, false}) {
      std::vector<float> xyz;
      const PlanarMap map = mapOfSquare(side, 0.002, known_at_once, xyz);
      EXPECT_EQ(map.planes().size(), side > 0.3 || known_at_once ? 1u : 0u) << side;
      EXPECT_GT(coveredFraction(map, xyz), 0.98) << side;
    }
  }
}

}  // namespace
}  // namespace planar_mapping
