// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "painted_room.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

constexpr int kTurn = 24;         // frames of a full turn
constexpr double kEndless = 1e3;  // metres

AtlasBuilder builderOf(int frames, double path, AtlasData known = {}) {
  return AtlasBuilder({frames, path}, test::paintedMapParams(), {0, "walk", ""}, std::move(known));
}

std::vector<std::size_t> framesOfSubmaps(const AtlasData& data) {
  std::vector<std::size_t> frames;
  for (const Submap& submap : data.submaps) frames.push_back(submap.map->frames());
  return frames;
}

std::size_t countOf(const AtlasData& data, LinkKind kind) {
  return static_cast<std::size_t>(
      std::count_if(data.links.begin(), data.links.end(),
                    [kind](const Link& link) { return link.kind == kind; }));
}

/// What is wrong with poses of a session after so many frames.
Pose driftAfter(int frame, double times = 1.0) {
  const double k = times * frame / static_cast<double>(kTurn);
  return motionStep(
      (Vector6() << 0.02 * k, -0.02 * k, 0.045 * k, 0.002 * k, -0.002 * k, 0.006 * k).finished());
}

/// Once around the room and on, with drift.
class Loop {
 public:
  explicit Loop(AtlasBuilder& builder, const Pose& T_session_world = Pose::Identity(),
                std::uint64_t paint = 1, bool with_images = true, double drift = 1.0,
                std::size_t track = 0)
      : builder_(builder),
        T_session_world_(T_session_world),
        paint_(paint),
        images_(with_images),
        drift_(drift),
        track_(track) {}

  AtlasBuilder::Update step() {
    const Pose truth = test::aroundRoom(frame_, kTurn);
    const AtlasBuilder::Update update =
        test::addView(builder_, static_cast<std::size_t>(frame_), test::lookAtPaint(truth, paint_),
                      T_session_world_ * driftAfter(frame_, drift_) * truth, images_, track_);
    ++frame_;
    return update;
  }
  void walk(int frames) {
    for (int i = 0; i < frames; ++i) step();
  }

 private:
  AtlasBuilder& builder_;
  Pose T_session_world_;
  std::uint64_t paint_;
  bool images_;
  double drift_;  ///< times driftAfter()
  std::size_t track_;
  int frame_ = 0;
};

TEST(AtlasBuilder, ASubmapClosesAfterItsFrames) {
  AtlasBuilder builder = builderOf(3, kEndless);
  Loop(builder).walk(8);
  const AtlasData& data = builder.data();
  EXPECT_EQ((std::vector<std::size_t>{3, 3, 2}), framesOfSubmaps(data));
  EXPECT_EQ(2u, countOf(data, LinkKind::Neighbour));
  for (const Link& link : data.links) {
    if (link.kind != LinkKind::Neighbour) continue;
    EXPECT_EQ(link.from_submap + 1, link.to_submap);
    EXPECT_TRUE(link.T_to_from.matrix().isIdentity(0.0));
    EXPECT_GT(link.covariance.diagonal().minCoeff(), 0.0);
  }
  for (const Submap& submap : data.submaps) EXPECT_EQ(0, submap.component);
}

TEST(AtlasBuilder, ASubmapClosesAfterItsPath) {
  AtlasBuilder builder = builderOf(100, 0.5);
  const test::PaintedView view = test::lookAtPaint(test::aroundRoom(0, kTurn), 1);
  Pose pose = view.pose;
  for (std::size_t i = 0; i < 9; ++i) {
    test::addView(builder, i, view, pose);
    pose.translation().x() += 0.2;
  }
  // Full at 0.6 m; the step between two submaps belongs to the second.
  EXPECT_EQ((std::vector<std::size_t>{4, 3, 2}), framesOfSubmaps(builder.data()));
}

TEST(AtlasBuilder, ASubmapClosesWhenItIsToldTo) {
  AtlasBuilder builder = builderOf(3, kEndless);
  builder.closeSubmap();  // there is none yet
  Loop(builder).walk(2);
  builder.closeSubmap();
  builder.closeSubmap();
  Loop(builder).walk(4);
  EXPECT_EQ((std::vector<std::size_t>{2, 3, 1}), framesOfSubmaps(builder.data()));
}

TEST(AtlasBuilder, WrongParametersAreRefused) {
  EXPECT_THROW(builderOf(0, 1.0), ParameterError);
  EXPECT_THROW(builderOf(1, 0.0), ParameterError);
  EXPECT_THROW(builderOf(1, std::nan("")), ParameterError);
}

TEST(AtlasBuilder, AKeyframeIsKeptWhereTheViewChanges) {
  AtlasBuilder builder = builderOf(100, kEndless);
  const test::PaintedView view = test::lookAtPaint(test::aroundRoom(0, kTurn), 1);
  for (std::size_t i = 0; i < 3; ++i) test::addView(builder, i, view, view.pose);
  EXPECT_EQ(1u, builder.data().keyframes.size());
  const Pose other = test::aroundRoom(3, kTurn);
  test::addView(builder, 3, test::lookAtPaint(other, 1), other);
  ASSERT_EQ(2u, builder.data().keyframes.size());
  const Keyframe& key = builder.data().keyframes[1];
  EXPECT_EQ(3u, key.frame);
  EXPECT_EQ("rgb/3.png", key.source);
  EXPECT_EQ(3.0, key.timestamp);
  EXPECT_EQ(other.matrix(), key.T_submap_keyframe.matrix());
}

TEST(AtlasBuilder, ALoopMovesSubmapsAndTheUpdateSaysWhich) {
  AtlasBuilder builder = builderOf(6, kEndless);
  Loop loop(builder);
  loop.walk(kTurn - 2);
  EXPECT_EQ(0u, countOf(builder.data(), LinkKind::Loop));
  bool found = false;
  std::set<std::int64_t> moved;
  for (int i = 0; i < 8; ++i) {
    std::vector<Pose> before;
    for (const Submap& submap : builder.data().submaps) before.push_back(submap.T_world_submap);
    const std::size_t links = builder.data().links.size();
    const AtlasBuilder::Update update = loop.step();
    found = found || !update.links.empty();
    for (const Link& link : update.links) {
      EXPECT_GE(static_cast<std::size_t>(link.id), links);
      EXPECT_EQ(LinkKind::Loop, link.kind);
      EXPECT_EQ(builder.data().links[static_cast<std::size_t>(link.id)].state, link.state);
    }
    for (std::size_t k = 0; k < before.size(); ++k) {
      const bool is_named =
          std::count(update.moved.begin(), update.moved.end(), static_cast<std::int64_t>(k)) > 0;
      EXPECT_EQ(before[k].matrix() != builder.data().submaps[k].T_world_submap.matrix(), is_named)
          << k;
    }
    moved.insert(update.moved.begin(), update.moved.end());
  }
  EXPECT_TRUE(found);
  EXPECT_EQ(0u, moved.count(0));  // the world is that of the first
  EXPECT_GE(moved.size(), 3u);
  // The keyframes of the second round lie where those of the first did.
  const AtlasData& data = builder.data();
  const Submap& last = data.submaps.back();
  const int frame = static_cast<int>(data.keyframes.back().frame);
  const Pose truth = test::aroundRoom(frame, kTurn);
  const Pose placed = last.T_world_submap * data.keyframes.back().T_submap_keyframe;
  const double before = (driftAfter(frame) * truth.translation() - truth.translation()).norm();
  const double off = (placed.translation() - truth.translation()).norm();
  std::printf("off by %.1f mm, without the loop by %.1f mm\n", 1e3 * off, 1e3 * before);
  EXPECT_LT(off, 0.3 * before);
}

TEST(AtlasBuilder, TheMapFollowsACorrection) {
  constexpr double kManyTimes = 2.5;  // the drift of other tests: 0.17 m, 1 degree
  AtlasBuilder builder = builderOf(3, kEndless);
  Loop loop(builder, Pose::Identity(), 1, true, kManyTimes);
  loop.walk(kTurn + 6);
  PlanarMap as_given(test::paintedMapParams());
  for (const Submap& submap : builder.data().submaps) as_given.merge(*submap.map);
  const auto floors = [](const PlanarMap& map) {
    const std::vector<MapPlane>& planes = map.planes();
    return std::count_if(planes.begin(), planes.end(), [](const MapPlane& plane) {
      return std::abs(plane.plane.normal.z()) > 0.95 && std::abs(plane.plane.offset) < 0.2;
    });
  };
  EXPECT_EQ(1, floors(builder.map()));
  EXPECT_GT(floors(as_given), 1);
  EXPECT_LT(builder.map().planes().size(), as_given.planes().size());
  EXPECT_EQ(static_cast<std::size_t>(kTurn + 6), builder.map().frames());
}

TEST(AtlasBuilder, TheOpenSubmapIsInTheMapAndTheData) {
  AtlasBuilder builder = builderOf(4, kEndless);
  Loop loop(builder);
  for (std::size_t frames = 1; frames <= 6; ++frames) {
    loop.step();
    EXPECT_EQ(frames, builder.map().frames());
    std::size_t in_data = 0;
    for (const std::size_t count : framesOfSubmaps(builder.data())) in_data += count;
    EXPECT_EQ(frames, in_data);
  }
}

/// A wrong measure of a turn errs about its axis: it tilts nothing.
TEST(AtlasBuilder, GivenPosesDriftAboutTheAxisOfTheirTurns) {
  AtlasBuilder builder = builderOf(kTurn / 2, kEndless);
  Loop(builder, Pose::Identity(), 1, false).walk(kTurn / 2 + 1);
  ASSERT_EQ(1u, builder.data().links.size());
  const Vector3 rotation = builder.data().links[0].covariance.diagonal().tail<3>().cwiseSqrt();
  EXPECT_GT(rotation.z(), 0.05);
  EXPECT_LT(rotation.head<2>().maxCoeff(), 0.4 * rotation.z());
}

TEST(AtlasBuilder, CloudsWithoutImagesCloseLoops) {
  AtlasBuilder builder = builderOf(6, kEndless);
  const int frames = kTurn + 6;
  Loop(builder, Pose::Identity(), 1, false).walk(frames);
  const AtlasData& data = builder.data();
  EXPECT_EQ(5u, data.submaps.size());
  for (const Keyframe& key : data.keyframes) EXPECT_FALSE(key.points.empty() || key.is_scan);
  EXPECT_EQ(static_cast<std::size_t>(frames), builder.map().frames());
  EXPECT_GE(countOf(data, LinkKind::Surface), 3u);
  const Vector3 truth = test::aroundRoom(frames - 1, kTurn).translation();
  const Vector3 drifted = driftAfter(frames - 1) * truth;
  const double before = (drifted - truth).norm();
  const double off = (data.submaps.back().T_world_submap * drifted - truth).norm();
  std::printf("off by %.1f mm, without the loop by %.1f mm\n", 1e3 * off, 1e3 * before);
  EXPECT_LT(off, 0.3 * before);
}

TEST(AtlasBuilder, CloudsOfTheNextRoomLikeThisAreNotTakenForIt) {
  // 3 m farther there is the same room again, by a way from this one or in another track.
  Pose next_door = Pose::Identity();
  next_door.translation().x() = 3.0;
  for (const std::size_t track : {0, 1}) {
    AtlasBuilder builder = builderOf(6, kEndless);
    Loop(builder, Pose::Identity(), 1, false, 0.0).walk(kTurn / 2);
    Loop(builder, next_door, 1, false, 0.0, track).walk(kTurn / 2);
    const Submap& last = builder.data().submaps.back();
    EXPECT_EQ(track == 0 ? 0 : 2, last.component);
    EXPECT_LT(last.T_world_submap.translation().norm(), 0.1);
  }
}

/// A session begins somewhere else, in a frame of its own.
const Pose kElsewhere = motionStep((Vector6() << 3.0, -1.0, 0.4, 0.0, 0.0, 0.8).finished());

TEST(AtlasBuilder, ASecondSessionThatFindsItselfJoins) {
  AtlasBuilder first = builderOf(6, kEndless);
  Loop(first).walk(kTurn / 2);
  const AtlasData known = first.data();
  AtlasBuilder second = builderOf(6, kEndless, known);
  Loop loop(second, kElsewhere);
  loop.walk(kTurn / 2);
  const AtlasData& data = second.data();
  ASSERT_EQ(2u, data.sessions.size());
  EXPECT_EQ(1, data.sessions[1].id);
  ASSERT_EQ(2 * known.submaps.size(), data.submaps.size());
  for (std::size_t i = 0; i < data.submaps.size(); ++i) {
    EXPECT_EQ(static_cast<std::int64_t>(i), data.submaps[i].id);
    EXPECT_EQ(0, data.submaps[i].component) << i;
    EXPECT_EQ(i < known.submaps.size() ? 0 : 1, data.submaps[i].session) << i;
  }
  // Both in one map, whose world is that of the first.
  EXPECT_EQ(static_cast<std::size_t>(kTurn), second.map().frames());
  const Pose off = data.submaps.back().T_world_submap * kElsewhere;
  std::printf("off by %.1f mm, %.2f deg\n", 1e3 * off.translation().norm(),
              rotationAngle(off.linear()) / kRadiansPerDegree);
  EXPECT_LT(off.translation().norm(), 0.05);
  EXPECT_LT(rotationAngle(off.linear()), 1.0 * kRadiansPerDegree);
}

TEST(AtlasBuilder, ASessionElsewhereStaysByItself) {
  AtlasBuilder first = builderOf(6, kEndless);
  Loop(first).walk(kTurn / 2);
  const AtlasData known = first.data();
  AtlasBuilder second = builderOf(6, kEndless, known);
  Loop loop(second, Pose::Identity(), 2);
  loop.walk(kTurn / 2);
  const AtlasData& data = second.data();
  for (std::size_t i = 0; i < data.submaps.size(); ++i)
    EXPECT_EQ(i < known.submaps.size() ? 0 : static_cast<std::int64_t>(known.submaps.size()),
              data.submaps[i].component)
        << i;
  EXPECT_EQ(static_cast<std::size_t>(kTurn / 2), second.map().frames());
}

TEST(AtlasBuilder, WhatIsStoredSubmapBySubmapIsTheWhole) {
  const TemporaryDirectory directory;
  const std::string path = directory / "walk.atlas";
  AtlasBuilder first = builderOf(6, kEndless);
  Loop(first).walk(kTurn / 2);
  saveAtlas(first.data(), path);
  AtlasBuilder builder = builderOf(5, kEndless, loadAtlas(path));
  Loop loop(builder, kElsewhere);
  std::optional<AtlasStore> store = AtlasStore::open(path, AtlasAccess::Write);
  const auto append = [&store](const AtlasData& added, const AtlasData& solved) {
    store->append(added, solved);
  };
  std::size_t times = 0;
  for (int i = 0; i < kTurn + 3; ++i) {
    loop.step();
    if (builder.store(append)) ++times;
    EXPECT_FALSE(builder.store(append));
  }
  EXPECT_EQ(static_cast<std::size_t>(kTurn + 2) / 5, times);
  builder.finish();
  EXPECT_TRUE(builder.store(append));
  EXPECT_FALSE(builder.store(append));
  store.reset();
  const std::string whole = directory / "whole.atlas";
  saveAtlas(builder.data(), whole);
  const std::string again = directory / "again.atlas";
  saveAtlas(loadAtlas(path), again);
  EXPECT_GT(countOf(builder.data(), LinkKind::Loop), 0u);
  EXPECT_EQ(io::readWholeText(whole), io::readWholeText(again));
}

TEST(AtlasBuilder, WhatCouldNotBeWrittenIsGivenAgain) {
  AtlasBuilder builder = builderOf(2, kEndless);
  Loop(builder).walk(5);
  const auto fail = [](const AtlasData&, const AtlasData&) { throw IoError("x", "is full"); };
  EXPECT_THROW(builder.store(fail), IoError);
  std::size_t submaps = 0;
  std::size_t sessions = 0;
  const auto count = [&](const AtlasData& added, const AtlasData&) {
    submaps += added.submaps.size();
    sessions += added.sessions.size();
  };
  EXPECT_TRUE(builder.store(count));
  EXPECT_EQ(2u, submaps);
  builder.finish();
  EXPECT_TRUE(builder.store(count));
  EXPECT_EQ(3u, submaps);
  EXPECT_EQ(1u, sessions);
}

TEST(AtlasBuilder, ALostTrackBeginsAComponentThatALoopJoins) {
  AtlasBuilder builder = builderOf(100, kEndless);
  Loop loop(builder);
  loop.walk(4);
  // Where the room looks other; then the first one again, in a frame of its own.
  Loop(builder, Pose::Identity(), 2, true, 1.0, 1).walk(4);
  EXPECT_EQ((std::vector<std::size_t>{4, 4}), framesOfSubmaps(builder.data()));
  EXPECT_EQ(1, builder.data().submaps[1].component);
  EXPECT_EQ(0u, countOf(builder.data(), LinkKind::Neighbour));
  EXPECT_EQ(4u, builder.map().frames());
  ASSERT_EQ(2u, builder.trajectories().size());
  EXPECT_EQ(1, builder.trajectories()[1].first);
  EXPECT_EQ(4u, builder.trajectories()[1].second.size());
  Loop(builder, kElsewhere, 1, true, 1.0, 2).walk(4);
  ASSERT_EQ(3u, builder.data().submaps.size());
  EXPECT_EQ(0, builder.data().submaps[2].component);
  EXPECT_EQ(8u, builder.map().frames());
  EXPECT_EQ(8u, builder.trajectories()[0].second.size());
}

TEST(AtlasBuilder, ATrackThatIsFoundAgainGoesOnInASubmapOfItsOwn) {
  AtlasBuilder builder = builderOf(100, kEndless);
  Loop first(builder);
  first.walk(3);
  Loop(builder, Pose::Identity(), 2, true, 1.0, 1).walk(1);
  first.walk(2);
  const AtlasData& data = builder.data();
  EXPECT_EQ((std::vector<std::size_t>{3, 1, 2}), framesOfSubmaps(data));
  ASSERT_EQ(1u, countOf(data, LinkKind::Neighbour));
  const auto link = std::find_if(data.links.begin(), data.links.end(),
                                 [](const Link& one) { return one.kind == LinkKind::Neighbour; });
  EXPECT_EQ(0, link->from_submap);
  EXPECT_EQ(2, link->to_submap);
  EXPECT_GT(link->covariance.diagonal().minCoeff(), 0.0);
  EXPECT_EQ(0, data.submaps[2].component);
  EXPECT_EQ(5u, builder.map().frames());
}

}  // namespace
}  // namespace planar_mapping
