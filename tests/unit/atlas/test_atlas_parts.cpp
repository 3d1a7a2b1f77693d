// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_parts.h"

#include <gtest/gtest.h>

#include "atlas_scene.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

using namespace test;

TEST(AtlasParts, AComponentIsJoinedInTheOrderOfItsSubmaps) {
  AtlasData data = walkedAtlas(3, 0.2);
  PlanarMap expected = *data.submaps[0].map;
  expected.merge(*data.submaps[1].map, data.submaps[1].T_world_submap);
  data.submaps[2].component = 2;
  EXPECT_EQ(expected.serialize(), joinSubmaps(data, 0).serialize());
  EXPECT_EQ((std::vector<std::int64_t>{0, 2}), componentsOf(data));
  EXPECT_GT(joinSubmaps(data, 2).cuboidCount(), 0u);
  EXPECT_THROW(joinSubmaps(data, 1), InputError);
  data.submaps[1] = walkedAtlas(2, 0.3).submaps[1];
  try {
    joinSubmaps(data, 0);
    ADD_FAILURE() << "maps of different cells were joined";
  } catch (const InputError& error) {
    EXPECT_EQ(0u, std::string(error.what()).find("submap 1 does not fit to submap 0: "));
  }
}

TEST(AtlasParts, KeyframesArePlacedByTheirSubmaps) {
  AtlasData data = walkedAtlas(2, 0.3);
  data.submaps[1].T_world_submap = Pose(Eigen::Translation3d(1.0, 2.0, 3.0));
  const std::vector<io::StampedPose> poses = keyframePoses(data, 0);
  ASSERT_EQ(4u, poses.size());
  EXPECT_EQ(1.1, poses[3].timestamp);
  EXPECT_EQ(data.keyframes[3].T_submap_keyframe.translation() + Vector3(1.0, 2.0, 3.0),
            poses[3].pose.translation());
  EXPECT_TRUE(keyframePoses(data, 1).empty());
  // In the coordinates of the poses that were given, far from where cells are counted from.
  PlanarMapParams far = data.submaps[0].map->params();
  far.origin = Vector3(689000.0, 5334000.0, 0.0);
  data.submaps[0].map = std::make_shared<PlanarMap>(far);
  EXPECT_EQ(poses[3].pose.translation() + far.origin, keyframePoses(data, 0)[3].pose.translation());
}

TEST(AtlasParts, MapsOfOtherCellsAreNamed) {
  const AtlasData data = walkedAtlas(2, 0.3);
  PlanarMapParams params = data.submaps[0].map->params();
  EXPECT_NO_THROW(requireFits(data, params));
  params.unknown_resolution = params.approximation.thickness = 0.3;  // as they are
  EXPECT_NO_THROW(requireFits(data, params));
  params.unknown_resolution = 0.6;
  EXPECT_THROW(requireFits(data, params), InputError);
  params = PlanarMapParams::of(Profile::Paper);
  params.setResolution(0.3);
  EXPECT_THROW(requireFits(data, params), InputError);
}

TEST(AtlasParts, APartKeepsWhatBelongsToItsSubmaps) {
  const AtlasData data = walkedAtlas(4, 0.3);  // links 0-1, 1-2, 2-3, 0-3
  const AtlasData part = partOf(data, [](const Submap& submap) { return submap.id != 1; });
  ASSERT_EQ(3u, part.submaps.size());
  EXPECT_EQ(6u, part.keyframes.size());
  ASSERT_EQ(2u, part.links.size());
  EXPECT_EQ((std::vector<std::int64_t>{0}), componentsOf(part));  // by the loop
  AtlasData refused = data;
  refused.links[3].state = LinkState::Refused;
  const AtlasData two = partOf(refused, [](const Submap& submap) { return submap.id != 1; });
  EXPECT_EQ((std::vector<std::int64_t>{0, 2}), componentsOf(two));
  EXPECT_EQ(2, two.submaps[2].component);
  EXPECT_TRUE(partOf(data, [](const Submap&) { return false; }).sessions.empty());
  expectSame(data, partOf(data, [](const Submap&) { return true; }));
}

TEST(AtlasParts, MergedAtlasesAreNumberedOnAndStayApart) {
  const AtlasData first = walkedAtlas(3, 0.3), second = walkedAtlas(2, 0.3);
  const AtlasData merged = mergeAtlases({first, second});
  ASSERT_EQ(2u, merged.sessions.size());
  EXPECT_EQ(1, merged.sessions[1].id);
  ASSERT_EQ(5u, merged.submaps.size());
  EXPECT_EQ(4, merged.submaps[4].id);
  EXPECT_EQ(1, merged.submaps[4].session);
  EXPECT_EQ((std::vector<std::int64_t>{0, 3}), componentsOf(merged));
  ASSERT_EQ(10u, merged.keyframes.size());
  EXPECT_EQ(4, merged.keyframes[9].submap);
  ASSERT_EQ(4u, merged.links.size());
  EXPECT_EQ(3, merged.links[3].id);
  EXPECT_EQ(3, merged.links[3].from_submap);
  EXPECT_EQ(8, merged.links[3].to_keyframe);
  expectSame(first, mergeAtlases({first}));
  expectSame(first, mergeAtlases({{}, first}));
  expectSame(first, partOf(merged, [](const Submap& submap) { return submap.component == 0; }));
}

}  // namespace
}  // namespace planar_mapping
