// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "atlas_scene.h"
#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/base/error.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

using namespace test;

/// All rows of all tables, and the schema; what `sqlite3 FILE .dump` prints is made of them.
std::string rowsOf(const std::string& path) {
  sqlite3* file = nullptr;
  EXPECT_EQ(SQLITE_OK, sqlite3_open_v2(path.c_str(), &file, SQLITE_OPEN_READONLY, nullptr));
  std::string all;
  const auto add = [](void* text, int columns, char** values, char**) {
    for (int i = 0; i < columns; ++i)
      *static_cast<std::string*>(text) += std::string(values[i] != nullptr ? values[i] : "-") + '|';
    *static_cast<std::string*>(text) += '\n';
    return 0;
  };
  for (const char* query :
       {"SELECT sql FROM sqlite_schema ORDER BY rowid", "SELECT * FROM sessions",
        "SELECT id, session, component, hex(T_world_submap) FROM submaps",
        "SELECT submap, hex(pmap) FROM maps",
        "SELECT id, submap, frame, source, timestamp, hex(T_submap_keyframe), hex(camera), width, "
        "height, hex(sightings), hex(descriptors), descriptor_bytes, hex(inverse_depths), "
        "cells_across, hex(thumbnail), hex(points), point_step, is_scan FROM keyframes",
        "SELECT id, kind, state, from_submap, to_submap, from_keyframe, to_keyframe, "
        "hex(T_to_from), hex(covariance), inliers, matches, off_plane, agreement, seen_through, "
        "log_odds, residual FROM "
        "links",
        "SELECT submap, component, hex(T_world_submap) FROM submaps_before",
        "SELECT * FROM links_before", "SELECT * FROM open_session"})
    EXPECT_EQ(SQLITE_OK, sqlite3_exec(file, query, add, &all, nullptr)) << query;
  sqlite3_close(file);
  return all;
}

class AtlasStoreTest : public ::testing::Test {
 protected:
  AtlasStore grown(const std::string& name, const AtlasData& data) const {
    AtlasStore store = AtlasStore::create(directory_ / name);
    for (const Submap& submap : data.submaps) store.append(submapOf(data, submap.id));
    return store;
  }

  TemporaryDirectory directory_;
};

TEST_F(AtlasStoreTest, GivesBackEveryBit) {
  AtlasData data = walkedAtlas(3);
  data.links.back().from_keyframe = data.links.back().to_keyframe = -1;
  data.links.back().kind = LinkKind::Surface;
  data.links.back().state = LinkState::Rejected;
  data.keyframes[1].sightings.clear();
  data.keyframes[1].descriptors.clear();
  data.keyframes[1].inverse_depths.clear();
  data.keyframes[1].cells_across = 0;
  data.keyframes[1].points = {1, -32767, 32767};
  data.keyframes[1].point_step = 3e-30;
  data.keyframes[1].is_scan = true;
  data.sessions[0].source = std::string("a'b\0c", 5);
  saveAtlas(data, directory_ / "a.atlas");
  expectSame(data, loadAtlas(directory_ / "a.atlas"));
  saveAtlas({}, directory_ / "empty.atlas");
  expectSame({}, loadAtlas(directory_ / "empty.atlas"));
}

TEST_F(AtlasStoreTest, ReadsPosesWithoutMapsAndImages) {
  const AtlasData data = walkedAtlas(3);
  saveAtlas(data, directory_ / "a.atlas");
  AtlasData without = data;
  for (Submap& submap : without.submaps) submap.map.reset();
  expectSame(without, loadAtlas(directory_ / "a.atlas", 1, AtlasContent::WithoutMaps));
  for (Keyframe& keyframe : without.keyframes) {
    keyframe.sightings.clear();
    keyframe.descriptors.clear();
    keyframe.inverse_depths.clear();
    keyframe.thumbnail.clear();
    keyframe.descriptor_bytes = 0;
    keyframe.cells_across = 0;
  }
  expectSame(without, loadAtlas(directory_ / "a.atlas", 1, AtlasContent::Outline));
  AtlasStore store = AtlasStore::open(directory_ / "a.atlas");
  EXPECT_TRUE(store.map(1)->serialize() == data.submaps[1].map->serialize());
  EXPECT_THROW(store.map(99), InputError);
}

TEST_F(AtlasStoreTest, GrowsSubmapBySubmap) {
  const AtlasData data = walkedAtlas(3);
  {
    AtlasStore store = grown("a.atlas", data);
    expectSame(data, store.load());
  }
  expectSame(data, loadAtlas(directory_ / "a.atlas"));
  // A file that is closed is one file.
  for (const char* end : {"-wal", "-shm", "-journal"})
    EXPECT_FALSE(std::filesystem::exists(directory_ / "a.atlas" + end)) << end;
}

TEST_F(AtlasStoreTest, SameDataGiveTheSameRowsAndSavedAtOnceTheSameBytes) {
  const AtlasData data = walkedAtlas(3);
  grown("grown.atlas", data).closeSession();
  saveAtlas(data, directory_ / "a.atlas");
  saveAtlas(loadAtlas(directory_ / "grown.atlas"), directory_ / "b.atlas");
  EXPECT_EQ(rowsOf(directory_ / "grown.atlas"), rowsOf(directory_ / "a.atlas"));
  EXPECT_TRUE(io::readWholeFile(directory_ / "a.atlas") ==
              io::readWholeFile(directory_ / "b.atlas"));
}

TEST_F(AtlasStoreTest, SolvedPosesAndStatesAreUpdatedAndNothingElse) {
  AtlasData data = walkedAtlas(3);
  AtlasStore store = grown("a.atlas", data);
  AtlasData solved;
  solved.submaps = {data.submaps[2]};
  solved.submaps[0].T_world_submap.translation().x() = 7.0 / 3.0;
  solved.submaps[0].component = 2;
  solved.submaps[0].map = nullptr;  // not written again
  solved.links = {data.links[2]};
  solved.links[0].state = LinkState::Refused;
  solved.links[0].residual = 12.5;
  store.update(solved);
  data.submaps[2].T_world_submap = solved.submaps[0].T_world_submap;
  data.submaps[2].component = 2;
  data.links[2].state = LinkState::Refused;
  data.links[2].residual = 12.5;
  expectSame(data, store.load());
}

TEST_F(AtlasStoreTest, UpdatesGoWithTheSubmapTheyBelongTo) {
  AtlasData data = walkedAtlas(3);
  AtlasStore store = AtlasStore::create(directory_ / "a.atlas");
  store.append(submapOf(data, 0));
  data.submaps[0].T_world_submap.translation().y() = 0.25;
  store.append(submapOf(data, 1), data.submaps.empty() ? data : submapOf(data, 0));
  const AtlasData loaded = store.load();
  ASSERT_EQ(2u, loaded.submaps.size());
  EXPECT_EQ(0.25, loaded.submaps[0].T_world_submap.translation().y());
}

TEST_F(AtlasStoreTest, WhatIsNotSoundIsRefusedWhole) {
  const AtlasData data = walkedAtlas(3);
  AtlasStore store = AtlasStore::create(directory_ / "a.atlas");
  store.append(submapOf(data, 0));
  store.append(submapOf(data, 1));
  const AtlasData before = store.load();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::string, std::function<void(AtlasData&)>>> cases = {
      {"submap 1 is in", [](AtlasData& part) { part.submaps[0].id = 1; }},
      {"submap 2 refers to", [](AtlasData& part) { part.submaps[0].session = 5; }},
      {"CHECK", [](AtlasData& part) { part.submaps[0].component = 3; }},
      {"submap 2 has no map", [](AtlasData& part) { part.submaps[0].map = nullptr; }},
      {"submap 2: T_world_submap",
       [&](AtlasData& part) { part.submaps[0].T_world_submap.translation().x() = nan; }},
      {"keyframe 4 refers to", [](AtlasData& part) { part.keyframes[0].submap = 9; }},
      {"keyframe 3 is in", [](AtlasData& part) { part.keyframes[0].id = 3; }},
      {"keyframe -1 has a negative", [](AtlasData& part) { part.keyframes[0].id = -1; }},
      {"keyframe 4 has a time", [&](AtlasData& part) { part.keyframes[0].timestamp = nan; }},
      {"keyframe 4: ", [&](AtlasData& part) { part.keyframes[0].camera.fx = nan; }},
      {"keyframe 4: T_submap_keyframe",
       [](AtlasData& part) { part.keyframes[0].T_submap_keyframe.linear() *= 2.0; }},
      {"descriptor", [](AtlasData& part) { part.keyframes[0].descriptors.pop_back(); }},
      {"feature", [&](AtlasData& part) { part.keyframes[0].sightings[1].row = nan; }},
      {"whole rows", [](AtlasData& part) { part.keyframes[0].inverse_depths.pop_back(); }},
      {"whole rows", [](AtlasData& part) { part.keyframes[0].cells_across = 0; }},
      {"negative size",
       [](AtlasData& part) {
         part.keyframes[0].inverse_depths.clear();
         part.keyframes[0].cells_across = -1;
       }},
      {"link 1 refers to", [](AtlasData& part) { part.links[0].from_submap = 8; }},
      {"link 1 joins", [](AtlasData& part) { part.links[0].from_submap = 2; }},
      {"one keyframe", [](AtlasData& part) { part.links[0].to_keyframe = -1; }},
      {"covariance", [&](AtlasData& part) { part.links[0].covariance(3, 4) = nan; }},
      {"variance", [](AtlasData& part) { part.links[0].covariance(3, 3) = 0.0; }},
      {"T_to_from", [&](AtlasData& part) { part.links[0].T_to_from.linear()(1, 1) = nan; }},
      {"evidence", [&](AtlasData& part) { part.links[0].residual = nan; }}};
  for (const auto& [problem, spoil] : cases) {
    SCOPED_TRACE(problem);
    AtlasData part = submapOf(data, 2);
    spoil(part);
    try {
      store.append(part);
      ADD_FAILURE() << "it was taken";
    } catch (const InputError& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find(problem)) << error.what();
    }
    expectSame(before, store.load());
  }
  EXPECT_THROW(store.update(submapOf(data, 2)), InputError);
  expectSame(before, store.load());
  store.append(submapOf(data, 2));
  expectSame(data, store.load());
}

/// A second session of two submaps that a loop joins with the first, and that moves it.
AtlasData secondSession(const AtlasData& first, AtlasData& solved) {
  AtlasData both = mergeAtlases({first, walkedAtlas(2)});
  AtlasData second = partOf(both, [](const Submap& submap) { return submap.session == 1; });
  Link loop = first.links.back();
  loop.id = both.links.back().id + 1;
  loop.to_submap = second.submaps[1].id;
  loop.to_keyframe = second.keyframes[2].id;
  second.links.push_back(loop);
  for (Submap& submap : second.submaps) submap.component = 0;
  solved.submaps = first.submaps;
  for (Submap& submap : solved.submaps) submap.T_world_submap.translation().x() += 0.25;
  solved.links = first.links;
  solved.links.back().state = LinkState::Rejected;
  solved.links.back().residual = 99.0;
  return second;
}

TEST_F(AtlasStoreTest, TheLastSessionIsTakenBackOrReplaced) {
  const AtlasData first = walkedAtlas(3);
  AtlasStore store = AtlasStore::create(directory_ / "a.atlas");
  EXPECT_FALSE(store.isLastSessionOpen());
  store.append(first);
  EXPECT_TRUE(store.isLastSessionOpen());
  expectSame({}, store.loadWithoutLastSession());
  AtlasData solved;
  const AtlasData second = secondSession(first, solved);
  const AtlasData part = submapOf(second, 3);
  AtlasData begun = part;
  begun.sessions = second.sessions;
  store.append(begun, solved);
  const AtlasData interrupted = store.load();
  EXPECT_EQ(4u, interrupted.submaps.size());
  EXPECT_TRUE(store.isLastSessionOpen());
  expectSame(first, store.loadWithoutLastSession());
  expectSame(interrupted, store.load());
  // What fails takes nothing back.
  AtlasData bad = second;
  bad.links.back().to_submap = 77;
  EXPECT_THROW(store.append(bad, solved, Append::InPlaceOfLastSession), InputError);
  expectSame(interrupted, store.load());
  store.append(second, solved, Append::InPlaceOfLastSession);
  expectSame(first, store.loadWithoutLastSession());
  // As if it had never been interrupted.
  AtlasStore whole = AtlasStore::create(directory_ / "whole.atlas");
  whole.append(first);
  whole.append(second, solved);
  expectSame(whole.load(), store.load());
  store.closeSession();
  EXPECT_FALSE(store.isLastSessionOpen());
  expectSame(whole.load(), store.load());
}

TEST_F(AtlasStoreTest, NoSessionOfMergedOnesIsOpen) {
  saveAtlas(mergeAtlases({walkedAtlas(2), walkedAtlas(1)}), directory_ / "a.atlas");
  EXPECT_FALSE(AtlasStore::open(directory_ / "a.atlas").isLastSessionOpen());
}

TEST_F(AtlasStoreTest, CreateOverwritesOnlyWhenAsked) {
  const std::string path = directory_ / "a.atlas";
  saveAtlas(walkedAtlas(1), path);
  EXPECT_THROW(AtlasStore::create(path), io::FileExistsError);
  EXPECT_EQ(1u, loadAtlas(path).submaps.size());
  AtlasStore::create(path, io::Overwrite::Allow);
  EXPECT_EQ(0u, loadAtlas(path).submaps.size());
}

TEST_F(AtlasStoreTest, ThePageOfTheFormatHasTheSchema) {
  const std::string page =
      io::readWholeText(std::string(PLANAR_MAPPING_SOURCE_DIR) + "/docs/atlas_format.md");
  saveAtlas({}, directory_ / "a.atlas");
  sqlite3* file = nullptr;
  ASSERT_EQ(SQLITE_OK, sqlite3_open((directory_ / "a.atlas").c_str(), &file));
  std::vector<std::string> tables;
  const auto add = [](void* list, int, char** values, char**) {
    static_cast<std::vector<std::string>*>(list)->push_back(std::string(values[0]) + ";\n");
    return 0;
  };
  sqlite3_exec(file, "SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL", add, &tables, nullptr);
  sqlite3_close(file);
  EXPECT_EQ(8u, tables.size());
  for (const std::string& sql : tables) EXPECT_NE(std::string::npos, page.find(sql)) << sql;
}

}  // namespace
}  // namespace planar_mapping
