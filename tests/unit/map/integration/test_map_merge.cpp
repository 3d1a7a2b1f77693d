// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// PlanarMap::merge()
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using namespace test;

PlanarMapParams paramsOf(Profile profile = Profile::Compact) {
  PlanarMapParams params;
  params.approximation.profile = profile;
  params.unknown_space = true;
  return params;
}

/// What is seen at a step of a walk across the room of map_scene.h.
View viewAt(int step) {
  return look(Scene(), lookFrom({-0.6 + 0.2 * step, 0.0, 1.0}, 0.08 * (step - 3)), 0.1 * step);
}

/// Steps first to last - 1 of the walk, in a world that lies at T_room_world.
PlanarMap walk(int first, int last, const PlanarMapParams& params = paramsOf(),
               const Pose& T_room_world = Pose::Identity()) {
  PlanarMap map(params);
  for (int i = first; i < last; ++i) {
    View view = viewAt(i);
    view.pose = T_room_world.inverse() * view.pose;
    map.insert(view.frame());
  }
  return map;
}

Pose somewhere() {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(0.6, Vector3::UnitZ()).toRotationMatrix();
  pose.translation() = Vector3(3.17, -1.26, 0.43);
  return pose;
}

/// How many of the points of the room's inside two maps judge differently, and of how many.
std::size_t differentlyJudged(const PlanarMap& a, const PlanarMap& b, std::size_t& points) {
  std::size_t different = 0;
  points = 0;
  for (double x = -1.97; x < 2.0; x += 0.06) {
    for (double y = -0.97; y < 5.0; y += 0.06) {
      for (double z = 0.03; z < 2.6; z += 0.06) {
        ++points;
        different += a.stateAt({x, y, z}) != b.stateAt({x, y, z}) ? 1 : 0;
      }
    }
  }
  return different;
}

TEST(MergeMaps, IntoAnEmptyMapGivesTheSameMap) {
  for (const Profile profile : {Profile::Compact, Profile::Paper}) {
    const PlanarMap map = walk(0, 4, paramsOf(profile));
    PlanarMap merged(map.params());
    const FrameUpdate update = merged.merge(map);
    EXPECT_EQ(update.planes_new, map.planes().size());
    EXPECT_EQ(merged.frames(), 4u);
    EXPECT_EQ(merged.planes().size(), map.planes().size());
    EXPECT_EQ(merged.unknownCells(), map.unknownCells());
    EXPECT_EQ(compareMaps(merged, map).fraction(), 0.0);
    std::size_t points = 0;
    EXPECT_EQ(differentlyJudged(merged, map, points), 0u);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(merged.trajectory()[i].first, map.trajectory()[i].first);
      EXPECT_TRUE(merged.trajectory()[i].second.isApprox(map.trajectory()[i].second, 1e-12));
    }
  }
}

TEST(MergeMaps, WithItselfChangesNothing) {
  for (const Profile profile : {Profile::Compact, Profile::Paper}) {
    const PlanarMap map = walk(0, 4, paramsOf(profile));
    PlanarMap merged = map;
    merged.merge(merged);
    EXPECT_EQ(merged.serialize(), map.serialize());
    merged.merge(map);
    EXPECT_EQ(merged.serialize(), map.serialize());
    PlanarMap copy(map.params());
    copy.merge(map);
    merged.merge(copy);
    EXPECT_EQ(merged.frames(), 4u);
    EXPECT_EQ(merged.serialize(), map.serialize());
  }
}

TEST(MergeMaps, WithItselfAtAnotherPlaceIsTwoMaps) {
  PlanarMap map = walk(0, 2);
  const std::size_t planes = map.planes().size();
  Pose away = Pose::Identity();
  away.translation().x() = 50.0;
  map.merge(map, away);
  EXPECT_EQ(map.frames(), 4u);
  EXPECT_EQ(map.planes().size(), 2 * planes);
}

TEST(MergeMaps, IsTheSameWhicheverMapTakesTheOther) {
  for (const Profile profile : {Profile::Compact, Profile::Paper}) {
    const PlanarMap early = walk(0, 4, paramsOf(profile)), late = walk(3, 7, paramsOf(profile));
    PlanarMap a = early, b = late;
    const FrameUpdate into_early = a.merge(late), into_late = b.merge(early);
    EXPECT_EQ(into_early.planes_new, late.planes().size());
    EXPECT_EQ(into_late.planes_new, early.planes().size());
    EXPECT_EQ(a.serialize(), b.serialize());
    EXPECT_EQ(a.frames(), 7u + 1u);
    EXPECT_GT(compareMaps(a, early).fraction(), 0.0);
    a.insert(viewAt(2).frame());  // what was derived before is not used again
    b.insert(viewAt(2).frame());
    EXPECT_EQ(a.serialize(), b.serialize());
  }
}

TEST(MergeMaps, IsTheSameWhicheverMapTakesTheOtherWithoutTimes) {
  const auto timeless = [](int step) {
    PlanarMap map(paramsOf());
    View view = viewAt(step);
    view.timestamp = 0.0;
    map.insert(view.frame());
    return map;
  };
  const PlanarMap one = timeless(1), other = timeless(5);
  PlanarMap a = one, b = other;
  a.merge(other);
  b.merge(one);
  EXPECT_EQ(a.frames(), 2u);
  EXPECT_EQ(a.serialize(), b.serialize());
}

/// What the message of the refusal says.
std::string refusalOf(PlanarMap map, const PlanarMap& other,
                      const Pose& T_map_other = Pose::Identity()) {
  const std::vector<std::uint8_t> before = map.serialize();
  try {
    map.merge(other, T_map_other);
  } catch (const InputError& error) {
    EXPECT_EQ(map.serialize(), before);
    return error.what();
  }
  return "";
}

TEST(MergeMaps, SaysInWhatTheMapsDiffer) {
  const PlanarMap map = walk(0, 2);
  PlanarMapParams params = paramsOf();
  params.approximation.resolution = 0.2;
  EXPECT_NE(refusalOf(map, walk(0, 1, params)).find("0.1 m here, 0.2 m in the other"),
            std::string::npos);
  params = paramsOf();
  params.unknown_resolution = 0.3;
  EXPECT_NE(refusalOf(map, walk(0, 1, params)).find("unknown space"), std::string::npos);
  params = paramsOf();
  params.approximation.up = -Vector3::UnitY();
  const Pose camera = Pose(Eigen::AngleAxisd(M_PI / 2, Vector3::UnitX()));  // its y is our z
  const PlanarMap optical = walk(0, 1, params, camera);
  EXPECT_NE(refusalOf(map, optical).find("up is (0, 0, 1) here, but (0, -1, 0)"), std::string::npos)
      << refusalOf(map, optical);
  Pose turn = Pose::Identity();  // -y to z
  turn.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  EXPECT_EQ(refusalOf(map, optical, turn), "");
}

TEST(MergeMaps, OfTwoHalvesIsAboutTheMapOfTheWhole) {
  const PlanarMap whole = walk(0, 7);
  PlanarMap merged = walk(0, 4);
  std::size_t points = 0;
  const std::size_t before = differentlyJudged(merged, whole, points);
  const FrameUpdate update = merged.merge(walk(4, 7));
  EXPECT_GE(update.planes_merged, 5u);  // floor, walls, ceiling: each one plane
  EXPECT_EQ(merged.planes().size(), whole.planes().size());
  EXPECT_EQ(merged.frames(), 7u);
  const std::size_t after = differentlyJudged(merged, whole, points);
  EXPECT_LT(after, points / 200);
  EXPECT_LT(after, before);
  const double cuboids = static_cast<double>(whole.cuboids().size());
  EXPECT_LT(static_cast<double>(merged.cuboids().size()), 1.3 * cuboids);
}

TEST(MergeMaps, DiffersFromTheMapOfTheWholeAsMuchAsTheOrderOfFramesDoes) {
  const PlanarMap whole = walk(0, 7);
  PlanarMap reversed(paramsOf());
  for (int i = 6; i >= 0; --i) reversed.insert(viewAt(i).frame());
  // Rasters start with the first frame that sees a plane, so that cells of two maps lie apart.
  double difference = 0.0;
  for (int split = 1; split < 7; ++split) {
    PlanarMap merged = walk(0, split);
    merged.merge(walk(split, 7));
    difference += compareMaps(merged, whole).fraction() / 6.0;
  }
  EXPECT_LT(difference, 0.125);
  EXPECT_LT(compareMaps(reversed, whole).fraction(), 0.125);
}

TEST(MergeMaps, BringsAMapOfAnotherWorldIntoOurs) {
  for (const Profile profile : {Profile::Compact, Profile::Paper}) {
    const PlanarMapParams params = paramsOf(profile);
    const PlanarMap whole = walk(0, 7, params);
    PlanarMap merged = walk(0, 4, params);
    merged.merge(walk(4, 7, params, somewhere()), somewhere());
    EXPECT_EQ(merged.planes().size(), whole.planes().size());
    std::size_t points = 0;
    const std::size_t after = differentlyJudged(merged, whole, points);
    EXPECT_LT(after, points / 50);  // borders of space and boxes, by nearest cells
    EXPECT_LT(compareMaps(merged, whole).fraction(), 0.15);
    EXPECT_TRUE(merged.trajectory().back().second.isApprox(whole.trajectory().back().second, 1e-3));
  }
}

TEST(MergeMaps, GoesOnAsAMap) {
  PlanarMap merged = walk(0, 4);
  merged.merge(walk(4, 7, paramsOf(), somewhere()), somewhere());
  const std::vector<std::uint8_t> file = merged.serialize();
  const PlanarMap loaded = PlanarMap::deserialize(file.data(), file.size());
  EXPECT_EQ(loaded.serialize(), file);
  EXPECT_EQ(compareMaps(loaded, merged).fraction(), 0.0);
  const std::size_t planes = merged.planes().size();
  merged.insert(look(Scene(), lookFrom({0.0, 0.0, 1.0}), 1.0).frame());
  EXPECT_EQ(merged.planes().size(), planes);
}

TEST(MergeMaps, ChangesNothingWhereItRefuses) {
  PlanarMap map = walk(0, 2);
  const std::vector<std::uint8_t> before = map.serialize();
  EXPECT_THROW(map.merge(walk(0, 1, paramsOf(Profile::Paper))), InputError);
  Pose skewed = Pose::Identity();
  skewed.linear() *= 2.0;
  EXPECT_THROW(map.merge(walk(0, 1), skewed), InputError);
  Pose nowhere = Pose::Identity();
  nowhere.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(map.merge(walk(0, 1), nowhere), InputError);
  EXPECT_EQ(map.serialize(), before);
  map.merge(PlanarMap(paramsOf()));
  EXPECT_EQ(map.serialize(), before);
}

TEST(MergeMaps, RefusesWhatWouldLieBeyondTheLattice) {
  PlanarMap map = walk(0, 2);
  const std::vector<std::uint8_t> before = map.serialize();
  const PlanarMap other = walk(2, 4);
  Pose far = Pose::Identity();
  for (const double x : {1e6, -1e7}) {
    far.translation().x() = x;
    EXPECT_THROW(map.merge(other, far), InputError) << x;
    EXPECT_THROW(PlanarMap(map.params()).merge(other, far), InputError) << x;
  }
  EXPECT_EQ(map.serialize(), before);
  far.translation().x() = 40000.0;
  map.merge(other, far);
  EXPECT_EQ(map.planes().size(), walk(0, 2).planes().size() + other.planes().size());
}

TEST(MergeMaps, ByWholeBlocksIsByNearestCells) {
  const PlanarMap map = walk(0, 4);
  Pose blocks = Pose::Identity(), cells = Pose::Identity();
  blocks.translation().x() =
      12.0 * (map.params().unknown_resolution > 0.0 ? map.params().unknown_resolution
                                                    : map.params().approximation.resolution);
  cells.translation().x() = blocks.translation().x() + 1e-9;
  PlanarMap a(map.params()), b(map.params());
  a.merge(map, blocks);
  b.merge(map, cells);
  // Cells on the faces of planes may change.
  const auto cells_of_b = static_cast<double>(b.unknownCells());
  EXPECT_NEAR(static_cast<double>(a.unknownCells()), cells_of_b, 0.005 * cells_of_b);
  std::size_t points = 0;
  const std::size_t different = differentlyJudged(a, b, points);
  EXPECT_LT(different, points / 500);
}

/// Four looks into a room, from the given time on.
PlanarMap looksInto(const Scene& scene, double begins) {
  PlanarMap map(paramsOf());
  for (int i = 0; i < 4; ++i)
    map.insert(
        look(scene, lookFrom({-0.6 + 0.3 * i, 0.0, 1.0}, 0.04 * i), begins + 0.1 * i).frame());
  return map;
}

/// How many places on the faces of a box that look to the room have a cuboid within half a cell,
/// and how many have none.
struct Covered {
  int there = 0;
  int gone = 0;
};
Covered coveredOf(const PlanarMap& map, const SceneBox& box) {
  const double s = map.params().approximation.resolution;
  Covered covered;
  for (double a = 0.05; a < 1.0; a += 0.1) {
    for (double b = 0.05; b < 1.0; b += 0.1) {
      const Vector3 size = box.high - box.low;
      const Vector3 front = box.low + Vector3(a * size.x(), 0.0, b * size.z());
      const Vector3 top = box.low + Vector3(a * size.x(), b * size.y(), size.z());
      for (const Vector3& place : {front, top}) {
        if (place.z() < 2.0 * s) continue;  // cuboids of the floor are near
        ++(map.cuboidsAt(place, 0.5 * s).empty() ? covered.gone : covered.there);
      }
    }
  }
  return covered;
}

TEST(MergeMaps, TheLaterMapDecidesWhatIsFree) {
  Scene full, empty;
  empty.boxes.resize(1);  // the room alone
  const SceneBox box = full.boxes[1], clutter = full.boxes[3];
  const Vector3 wall(0.0, 5.02, 1.5);
  PlanarMap gone = looksInto(full, 0.0);
  for (const SceneBox& thing : {box, clutter}) EXPECT_EQ(coveredOf(gone, thing).gone, 0);
  gone.merge(looksInto(empty, 10.0));
  for (const SceneBox& thing : {box, clutter}) EXPECT_EQ(coveredOf(gone, thing).there, 0);
  EXPECT_TRUE(gone.isFree({-0.8, 2.05, 0.5}));
  EXPECT_TRUE(gone.isFree({0.28, 1.72, 0.15}));
  EXPECT_TRUE(gone.isOccupied(wall));
  PlanarMap come = looksInto(empty, 0.0);
  come.merge(looksInto(full, 10.0));
  for (const SceneBox& thing : {box, clutter}) EXPECT_EQ(coveredOf(come, thing).gone, 0);
}

TEST(MergeMaps, WhatMovedIsWhereTheLaterMapSawIt) {
  for (const std::size_t thing : {std::size_t{1}, std::size_t{3}}) {  // a box and clutter
    Scene before, after;
    before.boxes = after.boxes = {Scene().boxes[0], Scene().boxes[thing]};
    const Vector3 by(thing == 1 ? 1.53 : -0.73, 0.0, 0.0);  // not by whole cells
    after.boxes[1].low += by;
    after.boxes[1].high += by;
    PlanarMap map = looksInto(before, 0.0);
    PlanarMap later(paramsOf());
    for (int i = 0; i < 4; ++i) {  // in a world of its own
      View view = look(after, lookFrom({-0.6 + 0.3 * i, 0.0, 1.0}, 0.04 * i), 10.0 + 0.1 * i);
      view.pose = somewhere().inverse() * view.pose;
      later.insert(view.frame());
    }
    map.merge(later, somewhere());
    EXPECT_EQ(coveredOf(map, before.boxes[1]).there, 0) << thing;
    EXPECT_EQ(coveredOf(map, after.boxes[1]).gone, 0) << thing;
  }
}

TEST(MergeMaps, ADoorIsAsItWasSeenLast) {
  Scene open;
  open.boxes = {{{-2.0, -1.0, 0.0}, {2.0, 5.0, 2.6}, true, true},
                {{-2.0, 2.5, 0.0}, {-0.45, 2.6, 2.6}, false, true},
                {{0.45, 2.5, 0.0}, {2.0, 2.6, 2.6}, false, true}};
  Scene closed = open;
  closed.boxes.push_back({{-0.45, 2.54, 0.0}, {0.45, 2.58, 2.6}, false, true});
  const Vector3 in_door(0.0, 2.56, 1.0), behind(0.0, 3.5, 0.5);
  PlanarMap map = looksInto(open, 0.0);
  EXPECT_TRUE(map.isFree(in_door));
  map.merge(looksInto(closed, 10.0));
  EXPECT_TRUE(map.isOccupied(in_door));
  EXPECT_TRUE(map.isFree(behind));  // nobody saw that it is not
  map.merge(looksInto(open, 20.0));
  EXPECT_TRUE(map.isFree(in_door));
  EXPECT_TRUE(map.isOccupied({-1.0, 2.52, 1.0}));
  EXPECT_TRUE(map.isOccupied({1.0, 2.52, 1.0}));
}

TEST(MergeMaps, KeepsWhatTheLaterMapDidNotSee) {
  PlanarMap map = looksInto(Scene(), 0.0);
  const PlanarMap before = map;
  PlanarMap later(paramsOf());
  later.insert(look(Scene(), lookFrom({0.0, 3.8, 1.0}), 10.0).frame());  // past the boxes
  map.merge(later);
  for (const Vector3& place : {Vector3(-0.8, 2.05, 0.5), Vector3(0.28, 1.72, 0.15)})
    EXPECT_TRUE(map.isOccupied(place));
}

/// Within a wall at y = 2: points of a square, as a plane or not.
PlanarMap wallOf(bool is_plane, double y, double begins) {
  std::vector<float> xyz;
  PlaneSegment segment;
  for (double x = -1.0; x < 1.0; x += 0.02) {
    for (double z = 0.0; z < 2.0; z += 0.02) {
      segment.inliers.push_back(static_cast<int>(xyz.size() / 3));
      xyz.insert(xyz.end(), {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    }
  }
  segment.plane = {-Vector3::UnitY(), y};
  const std::vector<PlaneSegment> planes{segment};
  FrameObservation frame;
  frame.timestamp = begins;
  frame.points = PointsView(xyz.data(), static_cast<std::uint32_t>(xyz.size() / 3), 1, 3);
  if (is_plane) frame.planes = &planes;
  PlanarMapParams params = paramsOf();
  params.unknown_space = false;
  PlanarMap map(params);
  map.insert(frame);
  return map;
}

TEST(MergeMaps, UnitesPlanesLikeThoseOfAFrame) {
  PlanarMap map = wallOf(true, 2.03, 0.0);
  map.merge(wallOf(true, 2.09, 1.0));  // by more than noise, but not more than poses are off
  ASSERT_EQ(map.planes().size(), 1u);
  EXPECT_NEAR(std::abs(map.planes()[0].plane.offset), 2.06, 1e-6);
  EXPECT_EQ(map.planes()[0].frames, 2u);
}

TEST(MergeMaps, ClutterThatLiesInAPlaneOfTheOtherMapIsGone) {
  const std::size_t cuboids = wallOf(true, 2.03, 0.0).cuboids().size();
  for (const bool first : {false, true}) {
    PlanarMap map = wallOf(first, 2.03, 0.0);
    map.merge(wallOf(!first, 2.06, 1.0));
    EXPECT_EQ(map.cuboids().size(), cuboids);
    EXPECT_EQ(map.planes().size(), 1u);
  }
}

}  // namespace
}  // namespace planar_mapping
