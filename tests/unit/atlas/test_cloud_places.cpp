// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Scans of a simulated building: rooms of one size whose furniture differs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "planar_mapping/atlas/atlas_builder.h"
#include "planar_mapping/atlas/atlas_localizer.h"
#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/keyframe_maker.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "simulated_scan.h"

namespace planar_mapping {
namespace {

constexpr int kScans = 45;
constexpr double kStep = 0.6;  // metres

/// The world of a session that begins somewhere else.
const Pose kElsewhere = motionStep((Vector6() << 3.0, -1.0, 0.4, 0.0, 0.0, 0.8).finished());

struct Walk {
  std::vector<Pose> poses;
  std::vector<std::vector<float>> scans;
};

Walk walkThrough(int walk, std::uint64_t building = 1) {
  evaluation::SceneParams params;
  params.scene = "building";
  params.rooms = 4;
  params.floors = 1;
  params.frames = kScans;
  params.step = kStep;
  params.walk = walk;
  params.seed = building;
  const evaluation::Scene scene = evaluation::makeScene(params);
  Random random(building, static_cast<std::uint64_t>(walk));
  Walk made;
  for (std::size_t i = 0; i < scene.path.size(); ++i) {
    made.poses.push_back(test::scannerAt(scene.path[i]));
    made.scans.push_back(test::scanOf(scene, made.poses.back(), static_cast<int>(i), random));
  }
  return made;
}

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

/// A session with poses from elsewhere.
AtlasData mapped(const Walk& walk, AtlasData known = {}, const Pose& T_session_world = kElsewhere,
                 double shifted = 0.0) {
  PlanarMapParams map;
  map.approximation.resolution = 0.2;
  AtlasBuilder builder({10, 1e3}, map, {0, "walk", ""}, std::move(known));
  for (std::size_t i = 0; i < walk.scans.size(); ++i) {
    AtlasBuilder::Seen seen;
    seen.frame = i;
    seen.timestamp = static_cast<double>(i);
    seen.T_track_sensor = T_session_world * walk.poses[i];
    seen.T_track_sensor.pretranslate(Vector3(shifted, 0.0, 0.0));
    seen.cloud = viewOf(walk.scans[i]);
    seen.is_scan = true;
    FrameObservation frame;
    frame.T_world_sensor = seen.T_track_sensor;
    frame.timestamp = seen.timestamp;
    frame.points = seen.cloud;
    builder.mapForNext().insert(frame);
    builder.add(seen);
  }
  builder.finish();
  return builder.data();
}

/// How far the submaps of the last session are from where they should be, metres; nothing if some
/// are not joined to the first.
std::optional<double> errorOf(const AtlasData& data) {
  double most = 0.0;
  for (const Submap& submap : data.submaps) {
    if (submap.component != 0) return std::nullopt;
    if (submap.session == 0) continue;
    const Pose off = submap.T_world_submap * kElsewhere;
    most = std::max(most, off.translation().norm());
  }
  return most;
}

class ScannedBuilding : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    first = new Walk(walkThrough(0));
    second = new Walk(walkThrough(1));
    known = new AtlasData(mapped(*first, {}, Pose::Identity()));
  }
  static void TearDownTestSuite() {
    delete first;
    delete second;
    delete known;
  }
  static Walk* first;
  static Walk* second;
  static AtlasData* known;
};
Walk* ScannedBuilding::first = nullptr;
Walk* ScannedBuilding::second = nullptr;
AtlasData* ScannedBuilding::known = nullptr;

TEST_F(ScannedBuilding, ASecondSessionOfScansJoins) {
  const AtlasData both = mapped(*second, *known);
  const std::optional<double> error = errorOf(both);
  ASSERT_TRUE(error.has_value());
  std::printf("%zu submaps, off by at most %.3f m\n", both.submaps.size(), *error);
  EXPECT_LT(*error, 0.15);
}

TEST_F(ScannedBuilding, AtlasesOfScansAreMerged) {
  AtlasData both = *known;
  const std::size_t count = both.keyframes.size();
  addAtlas(both, mapped(*second));
  EXPECT_GT(addLoops(both, count, 2), 0u);
  solvePoseGraph(both);
  const std::optional<double> error = errorOf(both);
  ASSERT_TRUE(error.has_value());
  EXPECT_LT(*error, 0.15);
}

TEST_F(ScannedBuilding, ScansOfAnotherBuildingStayByThemselves) {
  for (const std::uint64_t building : {2, 3}) {
    const AtlasData both = mapped(walkThrough(1, building), *known);
    for (const Submap& submap : both.submaps)
      EXPECT_EQ(submap.session == 0, submap.component == 0) << building << ", " << submap.id;
  }
}

TEST_F(ScannedBuilding, AScanIsFoundWhereItWas) {
  const AtlasLocalizer localizer(*known);
  int found = 0;
  for (std::size_t i = 0; i < second->scans.size(); ++i) {
    const std::optional<Place> place = localizer.find(makeKeyframe(viewOf(second->scans[i]), true));
    if (!place) continue;
    ++found;
    const Pose off = place->T_world_sensor.inverse() * second->poses[i];
    EXPECT_LT(off.translation().norm(), 0.2) << i;
    EXPECT_GT(place->evidence.inliers, 0u);
  }
  std::printf("%d of %zu scans found\n", found, second->scans.size());
  EXPECT_GT(found, kScans / 3);
}

TEST_F(ScannedBuilding, AScanThatFitsTwoPlacesIsAtNeither) {
  // The same rooms again, 40 m farther.
  AtlasData twice = *known;
  const std::int64_t last = twice.submaps.back().id;
  addAtlas(twice, mapped(*first, {}, Pose::Identity(), 40.0));
  Link link;
  link.id = static_cast<std::int64_t>(twice.links.size());
  link.kind = LinkKind::Neighbour;
  link.from_submap = last;
  link.to_submap = last + 1;
  link.covariance *= 1e-4;
  twice.links.push_back(link);
  solvePoseGraph(twice);
  ASSERT_EQ(1u, componentsOf(twice).size());
  const AtlasLocalizer localizer(twice);
  for (std::size_t i = 0; i < first->scans.size(); i += 5)
    EXPECT_FALSE(localizer.find(makeKeyframe(viewOf(first->scans[i]), true)).has_value()) << i;
}

}  // namespace
}  // namespace planar_mapping
