// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// planar_map run --atlas and localize.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "../unit/atlas/atlas_scene.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "real_data.h"
#include "simulated_rgbd.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kFrames = 24;  // of two rounds

class AtlasRuns : public CliTest {
 protected:
  static const SimulatedRgbd& room() {
    static const SimulatedRgbd made(program(), {"room", "--path", "return", "--frames", "24"});
    return made;
  }
  static const SimulatedRgbd& corridor() {
    static const SimulatedRgbd made(program(), {"corridor", "--frames", "4", "--step", "0.2"});
    return made;
  }
  std::vector<std::string> command(const std::string& output,
                                   const std::vector<std::string>& more) const {
    return joined({"run", room().path(), "-o", directory_ / output, "-q", "--submap-frames", "5"},
                  more);
  }
  ProgramResult run(const std::string& output, const std::vector<std::string>& more,
                    const ProgramOptions& options = {}) const {
    return planarMap(command(output, more), options);
  }
  /// An atlas of the first round, made once.
  std::string building() const {
    static const std::string bytes = [this]() {
      expectExit(0, run("first", {"--frames", ":12", "--atlas", directory_ / "first.atlas"}));
      return read("first.atlas");
    }();
    return write("building.atlas", bytes);
  }
  Json info(const std::string& file) const {
    return Json::parse(expectExit(0, planarMap({"atlas", "info", file, "--json"})).out);
  }
  std::string exported(const std::string& name) const {
    const std::string file = directory_ / name;
    expectExit(0, planarMap({"atlas", "export", file, file + ".pmap"}));
    return read(name + ".pmap");
  }
  void expectSameMap(const std::string& map, const std::string& atlas) const {
    EXPECT_TRUE(read(map) == exported(atlas));
  }
  ProgramResult localize(const std::string& atlas, const std::vector<std::string>& more) const {
    return planarMap(joined({"localize", atlas}, more));
  }

  const std::string file_ = directory_ / "a.atlas";
};

TEST_F(AtlasRuns, ARunMakesAnAtlas) {
  expectExit(0, run("out", {"--atlas", file_}));
  const Json made = info(file_);
  EXPECT_EQ(5, made["submaps"]);  // of five frames each
  EXPECT_EQ(kFrames, made["keyframes"]);
  EXPECT_EQ(4, made["links"]["neighbour"]);
  EXPECT_GE(made["links"]["loop"], 5);  // the second round sees what the first one saw
  ASSERT_EQ(1u, made["components"].size());
  ASSERT_EQ(1u, made["sessions"].size());
  EXPECT_EQ(room().path(), made["sessions"][0]["source"]);
  const AtlasData data = loadAtlas(file_);
  EXPECT_NE(std::string::npos, data.sessions[0].configuration.find("stages:")) << "all parameters";
  expectSameMap("out/map.pmap", "a.atlas");
  EXPECT_NE(std::string::npos, read("out/run.log").find("loop ")) << read("out/run.log");
  EXPECT_NE(std::string::npos, read("out/run.log").find(": 5 submaps, ")) << read("out/run.log");
  const std::string rows = read("out/frames.csv");
  EXPECT_NE(std::string::npos, rows.find(",submap,component\n")) << rows;
  EXPECT_EQ(",4,0\n", rows.substr(rows.size() - 5)) << rows;
}

TEST_F(AtlasRuns, AnOfficeTakesThirtyKilobytesAKeyframeMapsIncluded) {
  const std::string office = "rgbd_replica_office";
  if (test::isMissing(office)) GTEST_SKIP() << office << " is not beside the sources";
  expectExit(0, planarMap({"run", config("rgbd_indoor.yaml"), "-i", test::realData(office), "-o",
                           directory_ / "out", "-q", "--set", "motion_estimation.poses=ignore"}));
  const AtlasData data = loadAtlas(directory_ / "out/map.atlas");
  ASSERT_GE(data.keyframes.size(), 10U);
  for (const Keyframe& keyframe : data.keyframes) {
    EXPECT_LE(keyframe.sightings.size() * sizeof(FeatureSighting) + keyframe.descriptors.size() +
                  2 * keyframe.inverse_depths.size() + keyframe.thumbnail.size(),
              30000U);
  }
  EXPECT_LE(read("out/map.atlas").size(), 30000U * data.keyframes.size());
}

/// How many planes of at least 0.6 m2 face a direction to within 15 degrees, of a map.json.
int largePlanesFacing(const std::string& map, const Vector3& direction) {
  constexpr double kLeast = 0.6;
  constexpr double kCosine = 0.966;  // of 15 degrees
  const Json read = Json::parse(map);
  std::map<int, double> areas;
  for (const Json& cuboid : read.at("cuboids")) {
    std::vector<double> sides = cuboid.at("size");
    std::sort(sides.begin(), sides.end());
    areas[cuboid.at("plane_id")] += sides[1] * sides[2];
  }
  int count = 0;
  for (const Json& plane : read.at("planes")) {
    const std::vector<double> c = plane.at("coefficients");
    count += Vector3(c[0], c[1], c[2]).dot(direction) > kCosine && areas[plane.at("id")] > kLeast;
  }
  return count;
}

TEST_F(AtlasRuns, AnOdometerThatDriftsMakesOneFloorOnceItsLoopsAreClosed) {
  const std::string way = directory_ / "way";
  expectExit(0, planarMap({"simulate", "corridor", "--write", "description", "--path", "back",
                           "--frames", "60", "--moving", "--odometry-drift", "0.5,5", "--width",
                           "320", "--height", "240", "-o", way, "-q"}));
  const auto mapOf = [&](const std::string& output, const std::vector<std::string>& more) {
    expectExit(0, planarMap(joined({"run", way, "--poses", way + "/odometry.txt", "-o",
                                    directory_ / output, "-q"},
                                   more)));
    return read(output + "/map.json");
  };
  const std::string before = mapOf("before", {});
  EXPECT_LE(2, largePlanesFacing(before, Vector3::UnitZ())) << "the drift is seen";
  EXPECT_LE(3, largePlanesFacing(before, Vector3::UnitY()));
  const std::string after = mapOf("after", {"--atlas", file_, "--submap-frames", "5"});
  EXPECT_EQ(1, largePlanesFacing(after, Vector3::UnitZ())) << "one floor";
  EXPECT_EQ(1, largePlanesFacing(after, Vector3::UnitY())) << "one wall";
  // A person stood there until the camera came near.
  for (const char* place : {"4.3,0.35,0.5", "4.3,0.35,1.0", "4.3,0.35,1.4"}) {
    const std::string said =
        expectExit(0, planarMap({"query", directory_ / "after/map.pmap", "--point", place})).out;
    EXPECT_NE(std::string::npos, said.find("free")) << said;
  }
}

TEST_F(AtlasRuns, ASecondRunGoesOnInIt) {
  const std::string file = building();
  const Json before = info(file);
  expectExit(0, run("second", {"--frames", "12:", "--atlas", file}));
  const Json after = info(file);
  EXPECT_EQ(2u, after["sessions"].size());
  EXPECT_EQ(6, after["submaps"]);
  EXPECT_EQ(kFrames, after["keyframes"]);
  EXPECT_EQ(before["sessions"][0], after["sessions"][0]);
  ASSERT_EQ(1u, after["components"].size());  // it found itself
  // The map of the second run is that of both.
  expectSameMap("second/map.pmap", "building.atlas");
  const Json both =
      Json::parse(expectExit(0, planarMap({"info", directory_ / "second/map.pmap", "--json"})).out);
  EXPECT_EQ(kFrames, both["frames"]);
}

TEST_F(AtlasRuns, ASessionElsewhereStaysAComponentOfItsOwn) {
  const std::string file = building();
  const std::string first = exported("building.atlas");
  expectExit(0, planarMap({"run", corridor().path(), "-o", directory_ / "out", "-q", "--atlas",
                           file, "--set", "motion_estimation.poses=use"}));
  const Json both = info(file);
  ASSERT_EQ(2u, both["components"].size());
  EXPECT_EQ(2, both["components"][1]["keyframes"]);
  expectExit(0,
             planarMap({"atlas", "export", file, directory_ / "again.pmap", "--component", "0"}));
  EXPECT_TRUE(first == read("again.pmap"));
}

TEST_F(AtlasRuns, MergedAtlasesAreLinkedWhereBothHaveBeen) {
  const std::string first = building(), second = directory_ / "b.atlas";
  expectExit(0, run("second", {"--frames", "12:", "--atlas", second}));
  const std::string both = directory_ / "both.atlas";
  const ProgramResult merged =
      expectExit(0, planarMap({"atlas", "merge", first, second, "-o", both}));
  EXPECT_NE(std::string::npos, merged.out.find(" between them, 1 component\n")) << merged.out;
  const Json found = info(both);
  ASSERT_EQ(1u, found["components"].size());
  const std::size_t loops = found["links"]["loop"];
  EXPECT_GE(loops, info(first)["links"]["loop"].get<std::size_t>() +
                       info(second)["links"]["loop"].get<std::size_t>() + 5);
  // In one world: where the simulated camera was.
  expectExit(0, planarMap({"atlas", "export", both, directory_ / "both.txt"}));
  const std::vector<io::StampedPose> poses = io::readTumPoses(directory_ / "both.txt");
  ASSERT_EQ(kFrames, poses.size());
  for (std::size_t i = 0; i < kFrames; ++i)
    EXPECT_LT((poses[i].pose.translation() - room().poses[i].pose.translation()).norm(), 0.02) << i;
}

TEST_F(AtlasRuns, CellsAreThoseOfTheAtlasOrTheRunIsRefusedAtOnce) {
  const std::string file = building();
  const AtlasData before = loadAtlas(file);
  const double side = before.submaps[0].map->params().approximation.resolution;
  const std::string key = "planar_cuboid_approximation.resolution_m=";
  const ProgramResult refused =
      run("out", {"--frames", "12:", "--atlas", file, "--set", key + std::to_string(2.0 * side)});
  expectExit(4, refused, file + ": submap 0 has cells of ");
  test::expectSame(before, loadAtlas(file));
  EXPECT_FALSE(exists("out/map.pmap"));
  // A wall at arm's length alone would get smaller cells.
  expectExit(0, run("auto", {"--frames", "12:", "--atlas", file, "--set", key + "auto"}));
  EXPECT_EQ(side, loadAtlas(file).submaps.back().map->params().approximation.resolution);
}

TEST_F(AtlasRuns, ARunThatFindsPosesKeepsItsAtlasBesideTheMap) {
  const std::vector<std::string> found = {"--set", "motion_estimation.poses=ignore", "--force"};
  expectExit(0, run("one", joined(found, {"-j", "1"})));
  const Json metrics = Json::parse(read("one/metrics.json"));
  EXPECT_EQ(0, metrics["frames_skipped"]);
  EXPECT_EQ(0, metrics["frames_elsewhere"]);
  EXPECT_LT(metrics["motion_error"]["absolute_rms_m"], 0.02) << metrics["motion_error"];
  EXPECT_GE(info(directory_ / "one/map.atlas")["links"]["loop"], 5);
  expectSameMap("one/map.pmap", "one/map.atlas");
  expectExit(0, run("two", joined(found, {"--atlas", directory_ / "two.atlas", "-j", "2"})));
  EXPECT_FALSE(exists("two/map.atlas"));
  EXPECT_TRUE(read("one/map.pmap") == read("two/map.pmap"));
  // Another run begins anew.
  expectExit(0, run("one", joined(found, {"--frames", ":6"})));
  EXPECT_EQ(2, info(directory_ / "one/map.atlas")["submaps"]);
  expectExit(0, run("given", {}));
  EXPECT_FALSE(exists("given/map.atlas"));
}

/// A camera that is carried elsewhere without seeing the way.
TEST_F(AtlasRuns, FramesThatNothingJoinsAreAComponentOfTheirOwn) {
  namespace fs = std::filesystem;
  const fs::path sequence = directory_ / "two_places";
  const SimulatedRgbd* const places[] = {&corridor(), &room()};
  std::size_t number = 0;
  for (const char* const kind : {"rgb", "depth"}) fs::create_directories(sequence / kind);
  fs::copy(fs::path(room().path()) / "calib.yaml", sequence / "calib.yaml");
  for (const SimulatedRgbd* const place : places) {
    for (int i = 0; i < 3; ++i, ++number) {
      for (const char* const kind : {"rgb", "depth"}) {
        const auto name = [](std::size_t k) {
          char text[16];
          std::snprintf(text, sizeof(text), "%06zu.png", k);
          return std::string(text);
        };
        fs::copy(fs::path(place->path()) / kind / name(static_cast<std::size_t>(i)),
                 sequence / kind / name(number));
      }
    }
  }
  const std::vector<std::string> arguments = {"run", sequence, "-o", directory_ / "out", "--force"};
  fs::create_directories(directory_ / "out");
  write("out/trajectory_tum.7.txt", "of an earlier run");
  const ProgramResult result = expectExit(0, planarMap(arguments));
  EXPECT_NE(std::string::npos, result.err.find("3 of 6 frames are not in this map")) << result.err;
  EXPECT_EQ(2u, info(directory_ / "out/map.atlas")["components"].size());
  EXPECT_EQ(3u, io::readTumPoses(directory_ / "out/trajectory_tum.txt").size());
  EXPECT_EQ(3u, io::readTumPoses(directory_ / "out/trajectory_tum.1.txt").size());
  EXPECT_FALSE(exists("out/trajectory_tum.7.txt"));
  const std::string rows = read("out/frames.csv");
  EXPECT_EQ(",1,1\n", rows.substr(rows.size() - 5)) << rows;
}

TEST_F(AtlasRuns, ThreadsChangeNothing) {
  expectExit(0, run("one", {"--atlas", directory_ / "one.atlas", "-j", "1"}));
  expectExit(0, run("two", {"--atlas", directory_ / "two.atlas", "-j", "2"}));
  EXPECT_TRUE(read("one/map.pmap") == read("two/map.pmap"));
  EXPECT_TRUE(exported("one.atlas") == exported("two.atlas"));
  AtlasData one = loadAtlas(directory_ / "one.atlas"), two = loadAtlas(directory_ / "two.atlas");
  ASSERT_EQ(one.links.size(), two.links.size());
  for (std::size_t i = 0; i < one.links.size(); ++i) {
    EXPECT_EQ(one.links[i].T_to_from.matrix(), two.links[i].T_to_from.matrix());
    EXPECT_EQ(one.links[i].state, two.links[i].state);
  }
}

TEST_F(AtlasRuns, AFileThatCannotBeWrittenIsOneSentenceAndNothingIsLost) {
  expectExit(1, run("out", {"--frames", ":2", "--atlas", directory_ / "none/a.atlas"}), "none");
  EXPECT_FALSE(exists("none"));
  const std::string file = building();
  const Json before = info(file);
  ProgramOptions small;
  small.file_size_limit = 300000;
  const ProgramResult full = run("more", {"--frames", "12:", "--atlas", file}, small);
  EXPECT_EQ(1, full.exit_code) << full.err;
  EXPECT_EQ(before["sessions"][0], info(file)["sessions"][0]);
}

TEST_F(AtlasRuns, AKilledRunLeavesTheSubmapsThatWereClosed) {
  ProgramOptions killed;
  killed.while_running = [this](pid_t program, const std::string&) {
    std::error_code none_yet;
    const auto size = std::filesystem::file_size(file_ + "-wal", none_yet);
    // Three submaps: the keyframes of one take some 130 kB.
    if (!none_yet && size > 400000) ::kill(program, SIGKILL);
  };
  const ProgramResult result = run("out", {"--atlas", file_}, killed);
  ASSERT_EQ(SIGKILL, result.signal);
  EXPECT_FALSE(exists("out/map.pmap"));
  const AtlasData left = loadAtlas(file_);
  ASSERT_GE(left.submaps.size(), 1u);
  for (const Submap& submap : left.submaps) EXPECT_EQ(5u, submap.map->frames());
  EXPECT_EQ(5 * left.submaps.size(), left.keyframes.size());
  // The next run goes on in what is there.
  expectExit(0, run("again", {"--atlas", file_}));
  EXPECT_EQ(1u, info(file_)["components"].size());
  EXPECT_EQ(left.submaps.size() + 5, info(file_)["submaps"]);
}

TEST_F(AtlasRuns, AReadOnlyFolderKeepsItsAtlas) {
  if (::geteuid() == 0) GTEST_SKIP() << "the superuser may write everywhere";
  const std::string file = building();
  const std::string before = read("building.atlas");
  std::filesystem::permissions(
      directory_.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  TemporaryDirectory output;
  const ProgramResult result = planarMap(
      {"run", room().path(), "-o", output / "out", "-q", "--frames", "12:", "--atlas", file});
  std::filesystem::permissions(directory_.path(), std::filesystem::perms::owner_all);
  expectExit(1, result, "building.atlas");
  EXPECT_TRUE(before == read("building.atlas"));
}

TEST_F(AtlasRuns, WhatIsNoAtlasIsLeftAlone) {
  std::string other = read((building(), "building.atlas"));
  other[63] = 9;  // PRAGMA user_version
  const std::vector<std::pair<std::string, std::string>> files = {
      {write("other.atlas", other), "version"},
      {write("text.atlas", "no database"), "is no atlas"},
      {write("short.atlas", other.substr(0, other.size() / 2)), ""}};
  for (const auto& [file, problem] : files) {
    SCOPED_TRACE(file);
    const std::string name = file.substr(file.rfind('/') + 1);
    const std::string before = read(name);
    expectExit(4, run("out", {"--atlas", file}), name);
    if (!problem.empty()) expectExit(4, run("out", {"--atlas", file}), problem);
    EXPECT_TRUE(before == read(name));
    EXPECT_FALSE(exists("out/map.pmap"));
  }
}

TEST_F(AtlasRuns, WrongUsesAreCodeTwo) {
  for (const char* frames : {"0", "-3", "many"})
    expectExit(2, run("out", {"--atlas", file_, "--submap-frames", frames}), "--submap-frames");
  EXPECT_FALSE(exists("a.atlas"));
}

/// Transactions in the log beside a database: its frames that end one
/// (https://www.sqlite.org/fileformat2.html#walformat).
std::size_t transactionsIn(const std::string& log) {
  std::ifstream in(log, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const auto number = [&bytes](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i)
      value = value << 8 | static_cast<std::uint8_t>(bytes[i]);
    return value;
  };
  constexpr std::size_t kHeader = 32, kFrameHeader = 24;
  if (bytes.size() < kHeader) return 0;
  const std::size_t frame = kFrameHeader + number(8);
  std::size_t count = 0;
  for (std::size_t at = kHeader; at + frame <= bytes.size(); at += frame)
    if (number(at + 4) != 0) ++count;
  return count;
}

/// Killed as soon as so many submaps were committed.
ProgramOptions killedAfter(const std::string& file, std::size_t submaps) {
  ProgramOptions killed;
  killed.while_running = [=](pid_t program, const std::string&) {
    if (transactionsIn(file + "-wal") >= submaps) ::kill(program, SIGKILL);
  };
  return killed;
}

/// A second session that moves what the first one left, killed twice.
TEST_F(AtlasRuns, AKilledRunIsResumedAsIfNothingHadHappened) {
  const std::string whole = building();
  const std::string bytes = read("building.atlas");
  const std::vector<std::string> more = {"--frames", "12:", "--set",
                                         "motion_estimation.poses=ignore"};
  expectExit(0, run("whole", joined(more, {"--atlas", whole})));
  const std::string file = write("killed.atlas", bytes);
  std::size_t left = 0;
  for (const std::size_t submaps : {1, 2}) {
    const ProgramResult killed =
        run("out", joined(more, {"--atlas", file, "--resume"}), killedAfter(file, submaps));
    ASSERT_EQ(SIGKILL, killed.signal) << killed.err;
    const AtlasData found = loadAtlas(file);
    ASSERT_EQ(2u, found.sessions.size());
    EXPECT_GE(found.submaps.size(), left) << "what was committed stays";
    left = found.submaps.size();
  }
  expectExit(0, run("out", joined(more, {"--atlas", file, "--resume", "-j", "1"})));
  EXPECT_TRUE(read("whole/map.pmap") == read("out/map.pmap"));
  EXPECT_TRUE(read("whole/trajectory_tum.txt") == read("out/trajectory_tum.txt"));
  test::expectSame(loadAtlas(whole), loadAtlas(file));
  EXPECT_NE(std::string::npos,
            expectExit(0, run("out", joined(more, {"--atlas", file, "--resume"})))
                .err.find("is finished; nothing was done"));
}

TEST_F(AtlasRuns, AResumedRunKeepsItsOwnAtlasUntilItHasAsMuch) {
  const std::vector<std::string> found = {"--set", "motion_estimation.poses=ignore", "--resume"};
  expectExit(0, run("whole", found));
  const std::string file = directory_ / "out/map.atlas";
  ASSERT_EQ(SIGKILL, run("out", found, killedAfter(file, 2)).signal);
  const std::size_t left = loadAtlas(file).submaps.size();
  ASSERT_GE(left, 2u);
  ProgramOptions early;
  early.while_running = [](pid_t program, const std::string& err) {
    if (err.find("\"done\":6") != std::string::npos) ::kill(program, SIGKILL);
  };
  ASSERT_EQ(SIGKILL, run("out", joined(found, {"--progress", "jsonl"}), early).signal);
  EXPECT_EQ(left, loadAtlas(file).submaps.size());
  expectExit(0, run("out", found));
  EXPECT_TRUE(read("whole/map.pmap") == read("out/map.pmap"));
  test::expectSame(loadAtlas(directory_ / "whole/map.atlas"), loadAtlas(file));
}

/// The result in the folder is that of the earlier run.
TEST_F(AtlasRuns, ARunThatWasKilledBeforeItReplacedAnEarlierResultIsNotFinished) {
  const std::vector<std::string> found = {"--set", "motion_estimation.poses=ignore"};
  expectExit(0, run("out", found));
  const std::string map = read("out/map.pmap");
  const std::string file = directory_ / "out/map.atlas";
  const AtlasData whole = loadAtlas(file);
  ASSERT_EQ(SIGKILL, run("out", joined(found, {"--force"}), killedAfter(file, 1)).signal);
  ASSERT_LT(loadAtlas(file).submaps.size(), whole.submaps.size());
  expectExit(0, run("out", joined(found, {"--resume"})));
  test::expectSame(whole, loadAtlas(file));
  EXPECT_TRUE(map == read("out/map.pmap"));
}

TEST_F(AtlasRuns, ACompleteSessionIsNotResumed) {
  const std::string file = building();
  expectExit(0, run("other", {"--frames", ":12", "--atlas", file, "--resume"}));
  EXPECT_EQ(2u, info(file)["sessions"].size());
}

/// Another session is added to those that are there.
TEST_F(AtlasRuns, ResumingDoesNotReplaceASessionOfAnotherInput) {
  const std::string file = building();
  expectExit(0, run("out", {"--frames", "12:", "--atlas", file, "--resume"}));
  EXPECT_EQ(2u, info(file)["sessions"].size());
}

TEST_F(AtlasRuns, AFrameIsLocalized) {
  const std::string file = building();
  const Json rows = Json::parse(
      expectExit(0, localize(file, {room().path(), "--frames", "13:16", "--json"})).out);
  ASSERT_EQ(3u, rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Json& row = rows[i];
    EXPECT_EQ(13 + i, row["frame"]);
    EXPECT_EQ(true, row["found"]);
    const Pose& truth = room().poses[13 + i].pose;
    const Vector3 position(row["position_m"][0], row["position_m"][1], row["position_m"][2]);
    EXPECT_LT((position - truth.translation()).norm(), 0.02);
    const Quaternion turn(row["quaternion_xyzw"][3], row["quaternion_xyzw"][0],
                          row["quaternion_xyzw"][1], row["quaternion_xyzw"][2]);
    EXPECT_LT(turn.angularDistance(Quaternion(truth.linear())), 0.01);
    ASSERT_EQ(6u, row["covariance"].size());
    EXPECT_GT(row["covariance"][5][5], 0.0);
    EXPECT_GE(row["inliers"], 12);
    EXPECT_EQ(0, row["component"]);
    EXPECT_EQ(0, row["session"]);
    EXPECT_LT(row["keyframe_frame"], 12);
  }
  const std::string line = expectExit(0, localize(file, {room().path(), "--frames", "13"})).out;
  for (const char* part : {"frame 13 ", "position ", "quaternion xyzw ", "deviations ",
                           "component 0, session 0, submap ", "keyframe ", " features, agreement "})
    EXPECT_NE(std::string::npos, line.find(part)) << part << " in " << line;
  EXPECT_EQ(1, std::count(line.begin(), line.end(), '\n'));
}

TEST_F(AtlasRuns, AFrameOfElsewhereIsNotFoundAndThatIsCodeEight) {
  const std::string file = building();
  const ProgramResult one = expectExit(8, localize(file, {corridor().path(), "--frames", "1"}),
                                       "frame 1 of " + corridor().path() + " is not found");
  EXPECT_NE(std::string::npos, one.out.find(": not found: ")) << one.out;
  const ProgramResult all =
      expectExit(8, localize(file, {corridor().path(), "--json"}), "in all 4 of 4 frames");
  for (const Json& row : Json::parse(all.out)) {
    EXPECT_EQ(false, row["found"]);
    EXPECT_FALSE(row["reason"].get<std::string>().empty());
  }
}

TEST_F(AtlasRuns, AScanIsNoImageOfTheBuilding) {
  write("clouds/0.pcd", binaryPcd(roomPoints(2000)));
  expectExit(8, localize(building(), {directory_ / "clouds"}),
             "too little agrees with what the atlas knows");
}

TEST_F(AtlasRuns, WhatCannotBeLocalizedIsSaid) {
  const std::string file = building();
  expectExit(2, localize(file, {}), "input is required");
  expectExit(2, localize(file, {room().path(), "--frames", "5:5"}), "--frames");
  expectExit(4, localize(file, {room().path(), "--frames", "900"}), "select none");
  expectExit(4, localize(file, {directory_ / "none"}), "none");
  expectExit(4, localize(directory_ / "none.atlas", {room().path()}), "no such file");
}

}  // namespace
}  // namespace planar_mapping
