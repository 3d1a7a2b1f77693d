// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/map/joined_map.h"
#include "planar_mapping/map/map_query.h"

namespace planar_mapping {
namespace {

using namespace test;

using SubmapPtr = std::shared_ptr<const PlanarMap>;

/// Steps first to last - 1 of a walk across the room of map_scene.h.
SubmapPtr submapOf(int first, int last, int threads = 1) {
  PlanarMapParams params;
  params.approximation.threads = threads;
  auto map = std::make_shared<PlanarMap>(params);
  for (int i = first; i < last; ++i)
    map->insert(
        look(Scene(), lookFrom({-0.6 + 0.2 * i, 0.0, 1.0}, 0.08 * (i - 3)), 0.1 * i).frame());
  return map;
}

Pose motion(double x, double turn = 0.0) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(turn, Vector3::UnitZ()).toRotationMatrix();
  pose.translation().x() = x;
  return pose;
}

TEST(JoinedMap, OfOneSubmapIsThatMap) {
  JoinedMap joined;
  EXPECT_EQ(joined.map().frames(), 0u);
  const SubmapPtr map = submapOf(0, 3);
  joined.set(7, map, Pose::Identity());
  EXPECT_EQ(&joined.map(), map.get());
  joined.set(9, submapOf(3, 5), Pose::Identity());
  EXPECT_EQ(joined.map().frames(), 5u);
  joined.remove(9);
  EXPECT_EQ(joined.map().serialize(), map->serialize());
}

TEST(JoinedMap, JoinsAsMergeDoes) {
  JoinedMap joined;
  joined.set(0, submapOf(0, 3), Pose::Identity());
  joined.set(1, submapOf(3, 5), Pose::Identity());
  joined.set(2, submapOf(5, 7), motion(0.3, 0.2));
  PlanarMap merged = *submapOf(0, 3);
  merged.merge(*submapOf(3, 5));
  merged.merge(*submapOf(5, 7), motion(0.3, 0.2));
  EXPECT_EQ(joined.map().serialize(), merged.serialize());
}

TEST(JoinedMap, DoesNotDependOnTheOrderOfCallsNorOnThreads) {
  std::vector<std::vector<std::uint8_t>> bytes;
  for (const int threads : {1, 3}) {
    const SubmapPtr maps[] = {submapOf(0, 3, threads), submapOf(3, 5, threads),
                              submapOf(5, 7, threads)};
    JoinedMap at_once;
    for (int id = 0; id < 3; ++id) at_once.set(id, maps[id], motion(0.31 * id));
    bytes.push_back(at_once.map().serialize());
    JoinedMap step_by_step;
    for (const int id : {2, 0, 1}) {
      step_by_step.set(id, maps[id], motion(3.0 - 0.7 * id, 0.1));
      step_by_step.map();
    }
    for (const int id : {1, 2, 0}) {
      EXPECT_TRUE(step_by_step.move(id, motion(0.31 * id)));
      step_by_step.map();
    }
    bytes.push_back(step_by_step.map().serialize());
  }
  for (const std::vector<std::uint8_t>& other : bytes) EXPECT_EQ(other, bytes.front());
}

TEST(JoinedMap, JoinsOnlyWhatIsNew) {
  JoinedMap joined;
  for (int id = 0; id < 3; ++id) joined.set(id, submapOf(2 * id, 2 * id + 2), Pose::Identity());
  joined.map();
  EXPECT_EQ(joined.lastJoined(), 3u);
  joined.map();
  EXPECT_EQ(joined.lastJoined(), 0u);
  joined.map().cuboids();
  joined.set(3, submapOf(6, 8), Pose::Identity());
  joined.map();
  EXPECT_EQ(joined.lastJoined(), 1u);
  JoinedMap anew;
  for (int id = 0; id < 4; ++id) anew.set(id, submapOf(2 * id, 2 * id + 2), Pose::Identity());
  EXPECT_EQ(joined.map().serialize(), anew.map().serialize());
}

/// The open submap of a run, which is asked for again and again.
TEST(JoinedMap, ALastOneThatGrowsIsJoinedAlone) {
  JoinedMap joined;
  std::vector<Pose> poses;
  for (int id = 0; id < 5; ++id) poses.push_back(motion(0.31 * id));
  const auto at = [&poses](int id) { return poses[static_cast<std::size_t>(id)]; };
  for (int id = 0; id < 3; ++id) joined.set(id, submapOf(2 * id, 2 * id + 2), at(id));
  joined.map();
  const auto expectAsAnew = [&](int last, int frames) {
    JoinedMap anew;
    for (int id = 0; id <= last; ++id)
      anew.set(id, submapOf(2 * id, 2 * id + (id < last ? 2 : frames)), at(id));
    EXPECT_EQ(joined.map().serialize(), anew.map().serialize());
  };
  const auto joinedAfter = [&](int last, int frames) {
    joined.set(last, submapOf(2 * last, 2 * last + frames), at(last));
    joined.map();
    const std::size_t count = joined.lastJoined();
    expectAsAnew(last, frames);
    return count;
  };
  EXPECT_EQ(1u, joinedAfter(3, 1));
  EXPECT_EQ(4u, joinedAfter(3, 2));  // now it is known to grow
  EXPECT_EQ(1u, joinedAfter(3, 1));
  EXPECT_EQ(1u, joinedAfter(3, 2));
  EXPECT_EQ(1u, joinedAfter(4, 1));
  EXPECT_EQ(2u, joinedAfter(4, 2));  // and the one before it, which does not any more
  EXPECT_EQ(1u, joinedAfter(4, 1));
  poses[1] = motion(0.0, 0.1);
  EXPECT_TRUE(joined.move(1, poses[1]));
  joined.map();
  EXPECT_EQ(5u, joined.lastJoined());
  expectAsAnew(4, 1);
  EXPECT_EQ(1u, joinedAfter(4, 2));
  joined.remove(0);
  joined.map();
  EXPECT_EQ(4u, joined.lastJoined());
}

TEST(JoinedMap, StaysWhereAPoseMovesItByLessThanHalfACell) {
  JoinedMap joined;
  joined.set(0, submapOf(0, 3), Pose::Identity());
  joined.set(1, submapOf(3, 6), Pose::Identity());
  const std::vector<std::uint8_t> before = joined.map().serialize();
  EXPECT_FALSE(joined.move(1, motion(0.049)));
  EXPECT_EQ(joined.pose(1).matrix(), Pose::Identity().matrix());
  joined.map();
  EXPECT_EQ(joined.lastJoined(), 0u);
  EXPECT_TRUE(joined.move(1, motion(0.051)));
  EXPECT_NE(joined.map().serialize(), before);
  EXPECT_EQ(joined.lastJoined(), 2u);
  EXPECT_TRUE(joined.move(1, motion(0.0, 0.05)));  // far from the origin that is more than a cell
}

TEST(JoinedMap, ComesBackToTheSameMap) {
  JoinedMap joined;
  joined.set(0, submapOf(0, 3), Pose::Identity());
  joined.set(1, submapOf(3, 6), Pose::Identity());
  const std::vector<std::uint8_t> before = joined.map().serialize();
  joined.move(1, motion(0.4, 0.1));
  EXPECT_NE(joined.map().serialize(), before);
  joined.move(1, Pose::Identity());
  EXPECT_EQ(joined.map().serialize(),
            before);  // resampled from the submap, not from the joined map
}

TEST(JoinedMap, TheHigherIdIsTheLaterWhateverItsClockSays) {
  const auto lookInto = [](const Scene& scene) {
    auto map = std::make_shared<PlanarMap>(PlanarMapParams());
    for (int i = 0; i < 4; ++i)  // every session begins at 0
      map->insert(look(scene, lookFrom({-0.6 + 0.3 * i, 0.0, 1.0}, 0.04 * i), 0.1 * i).frame());
    return map;
  };
  Scene empty;
  empty.boxes.resize(1);
  const Vector3 in_box(-0.8, 2.05, 0.5), in_clutter(0.28, 1.72, 0.25);
  for (const bool is_last_empty : {false, true}) {
    JoinedMap joined;
    joined.set(0, lookInto(is_last_empty ? Scene() : empty), Pose::Identity());
    joined.set(1, lookInto(is_last_empty ? empty : Scene()), Pose::Identity());
    for (const Vector3& place : {in_box, in_clutter})
      EXPECT_EQ(joined.map().isFree(place), is_last_empty);
    for (const Vector3& place : {in_box, in_clutter})
      EXPECT_EQ(joined.map().isOccupied(place), !is_last_empty);
  }
}

TEST(JoinedMap, AnotherOriginIsShifted) {
  JoinedMap same, shifted;
  for (JoinedMap* joined : {&same, &shifted}) joined->set(0, submapOf(0, 3), Pose::Identity());
  same.set(1, submapOf(3, 6), Pose::Identity());
  auto away = std::make_shared<PlanarMap>(PlanarMapParams());
  const Pose origin = motion(12.34, 0.0);  // of the later session, in the world
  for (int i = 3; i < 6; ++i) {
    View view = look(Scene(), lookFrom({-0.6 + 0.2 * i, 0.0, 1.0}, 0.08 * (i - 3)), 0.1 * i);
    view.pose = origin.inverse() * view.pose;
    away->insert(view.frame());
  }
  shifted.set(1, away, origin);
  EXPECT_EQ(same.map().planes().size(), shifted.map().planes().size());
  EXPECT_LT(compareMaps(same.map(), shifted.map()).fraction(), 0.05);
}

/// Up is what its track took it to be: a loop may say otherwise, and a run goes on.
TEST(JoinedMap, ASubmapThatIsTiltedIsJoined) {
  const SubmapPtr level = submapOf(0, 3);
  Pose tilt = Pose::Identity();
  tilt.linear() = Eigen::AngleAxisd(0.5, Vector3::UnitX()).toRotationMatrix();
  PlanarMap tilted(level->params());
  for (int i = 3; i < 5; ++i) {
    const auto view = look(Scene(), lookFrom({-0.6 + 0.2 * i, 0.0, 1.0}, 0.08 * (i - 3)), 0.1 * i);
    FrameObservation frame = view.frame();
    frame.T_world_sensor = tilt.inverse() * frame.T_world_sensor;
    tilted.insert(frame);
  }
  JoinedMap joined;
  joined.set(0, level, Pose::Identity());
  joined.set(1, std::make_shared<PlanarMap>(std::move(tilted)), tilt);
  JoinedMap straight;
  straight.set(0, level, Pose::Identity());
  straight.set(1, submapOf(3, 5), Pose::Identity());
  EXPECT_EQ(joined.map().planes().size(), straight.map().planes().size());
  EXPECT_THROW(PlanarMap(*level).merge(*submapOf(3, 5), tilt), InputError);
}

TEST(JoinedMap, RefusesWhatDoesNotFit) {
  JoinedMap joined;
  joined.set(0, submapOf(0, 2), Pose::Identity());
  PlanarMapParams params;
  params.approximation.resolution = 0.2;
  EXPECT_THROW(joined.set(1, std::make_shared<PlanarMap>(params), Pose::Identity()), InputError);
  EXPECT_THROW(joined.set(1, nullptr, Pose::Identity()), InputError);
  EXPECT_THROW(
      joined.set(1, std::make_shared<PlanarMap>(submapOf(0, 1)->finished()), Pose::Identity()),
      InputError);
  Pose skewed = Pose::Identity();
  skewed.linear() *= 2.0;
  EXPECT_THROW(joined.move(0, skewed), InputError);
  EXPECT_THROW(joined.move(5, Pose::Identity()), InputError);
  EXPECT_THROW(joined.remove(5), InputError);
  EXPECT_THROW(joined.pose(5), InputError);
  EXPECT_EQ(joined.size(), 1u);
  EXPECT_TRUE(joined.contains(0));
  EXPECT_FALSE(joined.contains(1));
}

}  // namespace
}  // namespace planar_mapping
