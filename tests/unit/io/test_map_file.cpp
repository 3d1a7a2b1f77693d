// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/map_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "map_scene.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "planar_mapping/io/sequence.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace io {
namespace {

using test::look;
using test::lookFrom;
using test::Scene;

PlanarMap smallMap() {
  PlanarMap map;
  map.insert(look(Scene(), lookFrom({0.0, 0.0, 1.0})).frame());
  return map;
}

TEST(MapFile, GivesBackWhatWasSaved) {
  const TemporaryDirectory directory;
  const std::string path = directory / "map.pmap";
  const PlanarMap map = smallMap();
  saveMap(map, path);
  EXPECT_EQ(loadMap(path).serialize(), map.serialize());
  EXPECT_EQ(std::filesystem::file_size(path), map.serialize().size());
}

TEST(MapFile, IsNotOverwrittenUnlessToldSo) {
  const TemporaryDirectory directory;
  const std::string path = directory / "map.pmap";
  saveMap(smallMap(), path);
  EXPECT_THROW(saveMap(PlanarMap(), path), IoError);
  EXPECT_FALSE(loadMap(path).empty());
  saveMap(PlanarMap(), path, Overwrite::Allow);
  EXPECT_TRUE(loadMap(path).empty());
}

TEST(MapFile, LeavesNothingElseInItsDirectory) {
  const TemporaryDirectory directory;
  saveMap(smallMap(), directory / "map.pmap");
  EXPECT_THROW(saveMap(PlanarMap(), directory / "map.pmap"), IoError);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory.path())) {
    (void)entry;
    ++files;
  }
  EXPECT_EQ(files, 1u);
}

TEST(MapFile, NamesThePathAndTheProblemOfABadFile) {
  const TemporaryDirectory directory;
  const std::string path = directory / "bad.pmap";
  EXPECT_THROW(loadMap(path), IoError);
  EXPECT_THROW(loadMap(directory.path()), IoError);
  const auto problem = [&](const std::string& content) -> std::string {
    writeFileAtomically(path, content, Overwrite::Allow);
    try {
      loadMap(path);
    } catch (const IoError& error) {
      EXPECT_EQ(error.path(), path);
      EXPECT_EQ(std::string(error.what()).find(path), 0u);
      return error.what();
    }
    return "";
  };
  EXPECT_NE(problem(""), "");
  EXPECT_NE(problem("# .PCD v0.7\n").find("no planar map"), std::string::npos);
  const std::vector<std::uint8_t> bytes = smallMap().serialize();
  std::string whole(bytes.begin(), bytes.end());
  EXPECT_NE(problem(whole.substr(0, whole.size() / 2)).find("cut short"), std::string::npos);
  whole[whole.size() / 2] = static_cast<char>(whole[whole.size() / 2] ^ 1);
  EXPECT_NE(problem(whole).find("damaged"), std::string::npos);
}

TEST(MapFile, IsNotWrittenIntoADirectoryThatIsNotThere) {
  const TemporaryDirectory directory;
  EXPECT_THROW(saveMap(smallMap(), directory / "no/such/map.pmap"), IoError);
}

/// Frames of a real sequence with known poses into a map.
PlanarMap mapOfSequence(const std::string& folder, std::size_t step, bool unknown) {
  const Sequence sequence({folder});
  PlanarMapParams params;
  params.max_range = 8.0;
  params.unknown_space = unknown;
  PlanarMap map(params);
  MultiPlaneParams segmentation;
  segmentation.min_inliers = 1000;
  for (std::size_t i = 0; i < sequence.size(); i += step) {
    const Frame frame = sequence.read(i, CloudChannels::none());
    const PlaneSet found = findPlanes(frame.cloud.view(), nullptr, segmentation);
    FrameObservation observation;
    observation.T_world_sensor = frame.T_world_sensor.value();
    observation.timestamp = frame.timestamp;
    observation.points = frame.cloud.view();
    observation.planes = &found.planes;
    observation.camera = frame.camera;
    map.insert(observation);
  }
  return map;
}

TEST(MapFile, HoldsFiveRealFramesInLittleSpace) {
  const std::string folder =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/rgbd_icl_five";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  const PlanarMap map = mapOfSequence(folder, 1, false);
  EXPECT_EQ(map.frames(), 5u);
  EXPECT_GE(map.planes().size(), 6u);
  EXPECT_LT(map.serialize().size(), 11400u);  // OctoMap's .bt of these frames at 0.1 m
  // The world has y down; the room's ceiling and floor are where the data's notes say.
  bool floor = false, ceiling = false;
  for (const MapPlane& plane : map.planes()) {
    const bool is_level = std::abs(plane.plane.normal.y()) > 0.99;
    floor |= is_level && std::abs(plane.plane.signedDistance({0.0, 1.38, 0.0})) < 0.1;
    ceiling |= is_level && std::abs(plane.plane.signedDistance({0.0, -1.13, 0.0})) < 0.1;
  }
  EXPECT_TRUE(floor);
  EXPECT_TRUE(ceiling);
  const PlanarMap loaded = PlanarMap::deserialize(map.serialize().data(), map.serialize().size());
  EXPECT_EQ(loaded.cuboids().size(), map.cuboids().size());
}

TEST(MapFile, KeepsOneFloorOfAWalkAroundACabinet) {
  const std::string folder =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/rgbd_tum_cabinet";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  const PlanarMap map = mapOfSequence(folder, 6, true);
  std::size_t floors = 0;
  for (const MapPlane& plane : map.planes()) {
    const bool is_level = plane.plane.normal.z() > 0.98;
    floors += is_level && plane.frames >= 5 &&
              std::abs(plane.plane.signedDistance(plane.moments.mean())) < 0.05 &&
              std::abs(plane.moments.mean().z()) < 0.08;
  }
  EXPECT_EQ(floors, 1u);
}

}  // namespace
}  // namespace io
}  // namespace planar_mapping
