// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// planar_map atlas plan, submap, places, links, solve, tile, join: one survey as jobs over files.
#include <nlohmann/json.hpp>

#include "planar_mapping/atlas/atlas_store.h"
#include "simulated_rgbd.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Two walks in one room: 13 frames in pieces of 4 and one shared frame, and 5 frames.
class Survey : public CliTest {
 protected:
  static const SimulatedRgbd& walk() {
    static const SimulatedRgbd made(program(), {"room", "--path", "return", "--frames", "13"});
    return made;
  }
  static const SimulatedRgbd& second() {
    static const SimulatedRgbd made(program(), {"room", "--frames", "5", "--seed", "2"});
    return made;
  }
  ProgramResult plan(const std::vector<std::string>& more) const {
    return planarMap(joined({"atlas", "plan", "-o", plan_, "-q", "--force", "--piece-frames", "4",
                             "--submap-frames", "2"},
                            more));
  }
  ProgramResult job(const std::vector<std::string>& arguments,
                    const ProgramOptions& options = {}) const {
    return planarMap(joined({"atlas"}, arguments), options);
  }
  ProgramResult submap(int piece, const ProgramOptions& options = {}) const {
    return job({"submap", plan_, std::to_string(piece), "-o", out_}, options);
  }
  ProgramResult links(int piece, const ProgramOptions& options = {}) const {
    return job({"links", plan_, std::to_string(piece), "-o", out_}, options);
  }
  /// All jobs, the last pieces first.
  void doJobs(int pieces) const {
    for (int piece = pieces; piece-- > 0;) expectExit(0, submap(piece));
    expectExit(0, job({"places", out_}));
    for (int piece = pieces; piece-- > 1;) expectExit(0, links(piece));
    expectExit(0, job({"solve", out_}));
    expectExit(0, job({"join", out_, "-o", out_ + "/map.pmap"}));
  }
  /// Walks through a building of which nothing but the description is on the disk.
  std::string building(const std::vector<std::string>& more) const {
    const std::string folder = directory_ / "building";
    expectExit(0, planarMap(joined({"simulate", "building", "--write", "description", "--width",
                                    "160", "--height", "120", "--baseline", "0.48", "--frames",
                                    "12", "-q", "-o", folder},
                                   more)));
    return folder;
  }
  void expectSameFolders(const std::string& a, const std::string& b) const {
    ASSERT_EQ(list(a), list(b));
    for (const std::string& name : list(a))
      EXPECT_TRUE(read(a + "/" + name) == read(b + "/" + name)) << name;
  }
  Json info(const std::string& file) const {
    return Json::parse(expectExit(0, job({"info", file, "--json"})).out);
  }

  const std::string plan_ = directory_ / "plan.json";
  const std::string out_ = directory_ / "out";
};

TEST_F(Survey, JobsGiveTheBytesOfOneProcess) {
  expectExit(0, plan({walk().path(), second().path()}));
  doJobs(4);
  expectExit(0, planarMap({"run", "--plan", plan_, "-o", directory_ / "one", "-q", "-j", "2"}));
  expectSameFolders("out", "one");
  const Json made = info(out_ + "/survey.atlas");
  EXPECT_EQ(4u, made["sessions"].size());
  EXPECT_EQ(1u, made["components"].size()) << "links join the two walks";
  expectExit(0, job({"export", out_ + "/survey.atlas", directory_ / "exported.pmap"}));
  EXPECT_TRUE(read("exported.pmap") == read("out/map.pmap"));
  // Pieces share frames, but no frame is in the map twice.
  EXPECT_EQ(18, Json::parse(planarMap({"info", out_ + "/map.pmap", "--json"}).out)["frames"]);
}

TEST_F(Survey, PiecesWithoutLinksLieWhereTheSharedFramesSay) {
  expectExit(0, plan({walk().path(), "--set", "motion_estimation.poses=ignore"}));
  for (int piece = 0; piece < 3; ++piece) expectExit(0, submap(piece));
  expectExit(0, job({"solve", out_, "--allow-missing"}));
  const AtlasData data = loadAtlas(out_ + "/survey.atlas");
  ASSERT_EQ(0, data.submaps.back().component);
  const auto poseAt = [&](double time) {
    for (const Submap& submap : data.submaps)
      for (const auto& [stamp, T_submap_sensor] : submap.map->trajectory())
        if (stamp == time) return Pose(submap.T_world_submap * T_submap_sensor);
    throw std::runtime_error("no frame of that time");
  };
  const Pose T_last_first =
      poseAt(walk().poses.back().timestamp).inverse() * poseAt(walk().poses.front().timestamp);
  const Pose truth = walk().poses.back().pose.inverse() * walk().poses.front().pose;
  EXPECT_LT((T_last_first.translation() - truth.translation()).norm(), 0.1);
}

TEST_F(Survey, AMapLargerThanMemoryComesInTilesEachAJobOfItsOwn) {
  expectExit(0, plan({walk().path(), "--tile", "3"}));
  doJobs(3);
  const std::string tiles = out_ + "/tiles_0";
  const Json solved = Json::parse(read("out/survey.json"));
  EXPECT_EQ(3.2, solved["tile_m"]);
  const auto count = static_cast<int>(solved["tiles"].size());
  ASSERT_GT(count, 8);
  for (int number = count; number-- > 0;)
    expectExit(0, job({"tile", out_, std::to_string(number)}));
  EXPECT_EQ(std::string::npos, expectExit(0, job({"tile", out_})).out.find("wrote"));
  expectExit(4, job({"tile", out_, std::to_string(count)}), "there is no tile");
  expectExit(0, planarMap({"run", "--plan", plan_, "-o", directory_ / "one", "-q"}));
  expectSameFolders("out/tiles_0", "one/tiles_0");
  EXPECT_FALSE(exists("one/map.pmap"));
  // As one map, and a point that only its tile is read for. Planes are joined in another order.
  expectExit(0, planarMap({"compare", out_ + "/map.pmap", tiles, "--threshold", "0.05"}));
  expectExit(0, planarMap({"info", tiles}));
  const auto stateAt = [&](const std::string& map) {
    return planarMap({"query", map, "--point", "1.5,1.5,-0.05"}).out;
  };
  const std::string state = stateAt(tiles);
  EXPECT_EQ(0u, state.find("point 1.5,1.5,-0.05: ")) << state;
  write("out/tiles_0/map_-1_-1.pmap", "cut");
  EXPECT_EQ(state, stateAt(tiles));
  expectExit(4, planarMap({"convert", tiles, directory_ / "all.json"}), "map_-1_-1.pmap");
  expectExit(0, job({"tile", out_}));
  expectExit(0, planarMap({"convert", tiles, directory_ / "all.json"}));
}

TEST_F(Survey, FramesOfABuildingAreMadeByTheJobThatMapsThem) {
  const std::string folder = building({"--walks", "2", "--floors", "2", "--moving"});
  EXPECT_EQ((std::vector<std::string>{"calib.yaml", "poses.txt", "simulation.json"}),
            list("building/walk_1"));
  expectExit(0, plan({folder + "/walk_0", folder + "/walk_1"}));
  expectExit(0, planarMap({"run", "--plan", plan_, "-o", directory_ / "one", "-q"}));
  doJobs(6);
  expectSameFolders("out", "one");
  EXPECT_EQ(
      24, Json::parse(planarMap({"info", out_ + "/map.pmap", "--json"}).out)["frames"].get<int>() +
              Json::parse(read("out/survey.json"))["components"].size() - 1);
  write("building/walk_0/simulation.json", "{");
  expectExit(4, plan({folder + "/walk_0"}), "is no description of a simulation, or damaged");
}

TEST_F(Survey, APieceIsComparedWithThoseThatLookMostLikeIt) {
  expectExit(0, plan({walk().path(), second().path(), "--link-pieces", "1"}));
  doJobs(4);
  const Json alike = Json::parse(read("out/places.json"))["alike"];
  EXPECT_EQ(Json::parse("[[], [0], [0, 1]]"), Json(alike.begin(), alike.begin() + 3))
      << "the piece before it, and another one";
  EXPECT_EQ(1u, alike[3].size()) << "the first of the second walk";
  EXPECT_EQ(2u, Json::parse(read("out/links_3.json"))["read"].size());
  EXPECT_EQ(1u, info(out_ + "/survey.atlas")["components"].size());
}

TEST_F(Survey, WalksWithoutACommonPlaceAreComponentsOfOneAtlas) {
  const std::string near = building({"--seed", "3"});
  fs::rename(near, directory_ / "near");
  const std::string far = building({"--seed", "4"});
  expectExit(0, plan({directory_ / "near", far}));
  doJobs(6);
  const Json solved = Json::parse(read("out/survey.json"));
  ASSERT_EQ(2u, solved["components"].size());
  expectExit(0, job({"join", out_, "-o", directory_ / "second.pmap", "--component",
                     solved["components"][1].dump()}));
  for (const std::string& map : {out_ + "/map.pmap", directory_ / "second.pmap"})
    EXPECT_EQ(12, Json::parse(planarMap({"info", map, "--json"}).out)["frames"]);
  expectExit(4, job({"join", out_, "-o", directory_ / "none.pmap", "--component", "1"}),
             "there is no component 1");
}

TEST_F(Survey, AJobThatIsDoneIsSkippedAndOneCutShortIsDoneAgain) {
  expectExit(0, plan({walk().path()}));
  doJobs(3);
  const std::string piece = read("out/piece_1.atlas");
  const auto time = fs::last_write_time(out_ + "/piece_1.atlas");
  EXPECT_NE(std::string::npos, expectExit(0, submap(1)).out.find("done before"));
  EXPECT_EQ(time, fs::last_write_time(out_ + "/piece_1.atlas"));
  const std::string map = read("out/map.pmap");
  for (const char* name :
       {"piece_1.atlas", "places.json", "links_2.json", "survey.atlas", "map.pmap"}) {
    const std::string whole = read(std::string("out/") + name);
    write(std::string("out/") + name, whole.substr(0, whole.size() / 2));
    doJobs(3);
    EXPECT_TRUE(whole == read(std::string("out/") + name)) << name;
  }
  EXPECT_TRUE(map == read("out/map.pmap"));
}

TEST_F(Survey, WhatIsMissingIsNamedAndMayBeLeftOut) {
  expectExit(0, plan({walk().path(), second().path()}));
  for (const int piece : {0, 1, 3}) expectExit(0, submap(piece));
  expectExit(4, job({"solve", out_}), "piece 2 (");
  expectExit(4, job({"join", out_, "-o", out_ + "/map.pmap"}), "atlas solve comes first");
  expectExit(4, job({"places", out_}), "piece 2 (");
  expectExit(4, links(3), "has no places.json: planar_map atlas places comes first");
  expectExit(0, job({"places", out_, "--allow-missing"}));
  expectExit(4, job({"solve", out_}), "piece 2 (");
  expectExit(0, job({"links", plan_, "3", "-o", out_, "--allow-missing"}));
  expectExit(0, job({"solve", out_, "--allow-missing"}));
  EXPECT_EQ(3u, info(out_ + "/survey.atlas")["sessions"].size());
}

TEST_F(Survey, APlanOfChangedFilesIsRefused) {
  const std::string input = directory_ / "walk";
  fs::copy(walk().path(), input, fs::copy_options::recursive);
  expectExit(0, plan({input}));
  expectExit(0, submap(0));
  write("walk/calib.yaml", read("walk/calib.yaml") + "\n");
  expectExit(0, submap(0));  // it was done before
  expectExit(4, submap(1), "its files have changed since the plan was made");
  expectExit(0, plan({input}));
  expectExit(4, submap(1), "has results of another plan");
}

TEST_F(Survey, SequencesThatDoNotFitAreRefusedBeforeAnyWork) {
  const std::string other = directory_ / "other";
  fs::copy(walk().path(), other, fs::copy_options::recursive);
  write("other/calib.yaml", read("other/calib.yaml") + "depth_along: ray\n");
  expectExit(4, plan({walk().path(), other}), "its calibration is not that of");
  expectExit(4, plan({walk().path(), building({})}),
             "its calibration is not that of");  // 160 x 120
  expectExit(4, plan({walk().path(), directory_ / "none"}), "none: no such file");
  expectExit(4, plan({walk().path(), room()}), "room.pcd: ");
  expectExit(2, plan({"a.yaml", "b.yaml", walk().path()}), "one configuration");
  expectExit(4, plan({walk().path(), "--frames", "50:"}), "select none of");
  EXPECT_FALSE(fs::exists(plan_));
}

TEST_F(Survey, APlanOfAnotherVersionOrDamagedIsRefused) {
  expectExit(0, plan({walk().path()}));
  Json json = Json::parse(read("plan.json"));
  json["program"] = "0.0.9";
  write("plan.json", json.dump());
  expectExit(4, submap(0), "it was made by planar_map 0.0.9, and this is planar_map");
  write("plan.json", json.dump().substr(0, 500));
  expectExit(4, submap(0), "is no plan of planar_map atlas plan, or damaged");
  expectExit(4, job({"solve", directory_.path()}), "or damaged");
}

TEST_F(Survey, NumbersThatNameNothingAreRefused) {
  expectExit(0, plan({walk().path()}));
  expectExit(4, submap(3), "there is no piece 3: the plan has 3 pieces");
  expectExit(4, links(0), "between a piece and earlier ones");
  expectExit(4, links(3), "there is no piece 3 with earlier ones among 3 pieces");
  expectExit(4, job({"solve", directory_ / "nothing"}), "nothing");
  expectExit(2, planarMap({"run", walk().path(), "--plan", plan_}), "--plan");
}

TEST_F(Survey, OnAFullDiskNothingIsLost) {
  expectExit(0, plan({walk().path()}));
  ProgramOptions full;
  full.file_size_limit = 20000;
  expectExit(1, submap(0, full), "piece_0.atlas");
  EXPECT_EQ(std::vector<std::string>{"plan.json"}, list("out"));
  for (int piece = 0; piece < 3; ++piece) expectExit(0, submap(piece));
  full.file_size_limit = 100;
  expectExit(1, job({"places", out_}, full), "places.json");
  expectExit(0, job({"places", out_}));
  expectExit(1, links(2, full), "links_2.json");
  for (const int piece : {1, 2}) expectExit(0, links(piece));
  expectExit(1, job({"solve", out_}, full), "survey.atlas");
  expectExit(0, job({"solve", out_}));
  expectExit(1, job({"join", out_, "-o", out_ + "/map.pmap"}, full), "map.pmap");
  expectExit(0, job({"join", out_, "-o", out_ + "/map.pmap"}));
  expectExit(0, planarMap({"run", "--plan", plan_, "-o", directory_ / "one", "-q"}));
  expectSameFolders("out", "one");
}

}  // namespace
}  // namespace planar_mapping
