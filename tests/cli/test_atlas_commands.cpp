// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// planar_map atlas: what it tells, what it writes, and what it refuses.
#include <sys/mount.h>

#include <nlohmann/json.hpp>

#include "cli_fixture.h"
#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/pose_file.h"
#include "tests/unit/atlas/atlas_scene.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

class AtlasCommands : public CliTest {
 protected:
  void SetUp() override {
    data_.submaps[2].T_world_submap.translation().x() = 0.1;
    saveAtlas(data_, file_);
  }
  ProgramResult atlas(const std::vector<std::string>& arguments,
                      const ProgramOptions& options = {}) const {
    return planarMap(joined({"atlas"}, arguments), options);
  }
  /// A second walk, in a component of its own.
  AtlasData apart() const { return mergeAtlases({data_, test::walkedAtlas(2, 0.2)}); }

  AtlasData data_ = test::walkedAtlas(3, 0.2);
  const std::string file_ = directory_ / "a.atlas";
};

TEST_F(AtlasCommands, InfoTellsWhatItHolds) {
  saveAtlas(apart(), file_, io::Overwrite::Allow);
  const Json info = Json::parse(expectExit(0, atlas({"info", file_, "--json"})).out);
  EXPECT_EQ("atlas", info["type"]);
  EXPECT_EQ(5, info["submaps"]);
  EXPECT_EQ(10, info["keyframes"]);
  EXPECT_EQ(3, info["links"]["neighbour"]);
  EXPECT_EQ(1, info["links"]["loop"]);
  EXPECT_EQ(4, info["links"]["used"]);
  ASSERT_EQ(2u, info["sessions"].size());
  EXPECT_EQ("walk", info["sessions"][1]["source"]);
  EXPECT_EQ(2, info["sessions"][1]["submaps"]);
  ASSERT_EQ(2u, info["components"].size());
  EXPECT_EQ(3, info["components"][1]["component"]);
  EXPECT_EQ(6, info["components"][0]["keyframes"]);
  Vector3 low, high;
  ASSERT_TRUE(data_.submaps[2].map->bounds(low, high));
  EXPECT_NEAR(high.x() + 0.1, info["components"][0]["bounds_m"]["high"][0].get<double>(), 0.05);
  EXPECT_EQ(std::filesystem::file_size(file_), info["file_bytes"]);
  const std::string lines = expectExit(0, atlas({"info", file_})).out;
  EXPECT_NE(std::string::npos, lines.find("session 1, source walk, submaps 2, keyframes 4\n"))
      << lines;
}

TEST_F(AtlasCommands, LoopsAreListedWithTheirEvidence) {
  const Json loops = Json::parse(expectExit(0, atlas({"loops", file_, "--json"})).out);
  ASSERT_EQ(1u, loops.size());  // neighbours are none
  EXPECT_EQ(2, loops[0]["loop"]);
  EXPECT_EQ("loop", loops[0]["kind"]);
  EXPECT_EQ(0, loops[0]["from_submap"]);
  EXPECT_EQ(2, loops[0]["to_submap"]);
  EXPECT_EQ(20, loops[0]["to_frame"]);
  EXPECT_EQ(60, loops[0]["inliers"]);
  EXPECT_EQ(80, loops[0]["matches"]);
  EXPECT_EQ("used", loops[0]["state"]);
  EXPECT_EQ(
      "loop 2: submap 0 (frame 0) to submap 2 (frame 20), loop, 60 of 80 features, agreement 0.9, "
      "seen through 0.01, residual 0.3333333333333333, used\n",
      expectExit(0, atlas({"loops", file_})).out);
  saveAtlas(test::walkedAtlas(1, 0.3), file_, io::Overwrite::Allow);
  EXPECT_EQ("no loops\n", expectExit(0, atlas({"loops", file_})).out);
}

TEST_F(AtlasCommands, ARefusedLoopStaysRefusedUntilItIsTakenBack) {
  expectExit(0, atlas({"solve", file_, "--without-loop", "2"}));
  EXPECT_EQ(LinkState::Refused, loadAtlas(file_).links[2].state);
  const Json answer = Json::parse(expectExit(0, atlas({"solve", file_, "--json"})).out);
  EXPECT_EQ("refused", answer["loops"][0]["state"]);
  EXPECT_EQ(LinkState::Refused, loadAtlas(file_).links[2].state);
  expectExit(0, atlas({"solve", file_, "--with-loop", "2"}));
  EXPECT_NE(LinkState::Refused, loadAtlas(file_).links[2].state);
  // A neighbour is no loop.
  for (const char* number : {"0", "17", "-1"})
    expectExit(2, atlas({"solve", file_, "--without-loop", number}), "there is no loop");
}

TEST_F(AtlasCommands, ExportsTheMapThePosesAndTheThumbnailsOfAComponent) {
  saveAtlas(apart(), file_, io::Overwrite::Allow);
  const ProgramResult first = expectExit(0, atlas({"export", file_, directory_ / "first.pmap"}));
  expectOneSentence(first, "has 2 components");
  EXPECT_EQ(joinSubmaps(data_, 0).serialize(), io::loadMap(directory_ / "first.pmap").serialize());
  expectExit(0, atlas({"export", file_, directory_ / "other.pmap", "--component", "3"}));
  EXPECT_EQ(joinSubmaps(apart(), 3).serialize(),
            io::loadMap(directory_ / "other.pmap").serialize());
  expectExit(0, atlas({"export", file_, directory_ / "poses.txt"}));
  const std::vector<io::StampedPose> poses = io::readTumPoses(directory_ / "poses.txt");
  ASSERT_EQ(6u, poses.size());
  EXPECT_NEAR(data_.keyframes[5].T_submap_keyframe.translation().x() + 0.1,
              poses[5].pose.translation().x(), 1e-9);
  expectExit(0, atlas({"export", file_, directory_ / "pictures/"}));
  EXPECT_EQ((std::vector<std::string>{"0.png", "2.png", "4.png", "6.png", "8.png"}),
            list("pictures"));
  EXPECT_EQ(std::string("\x89PNG\x01"), read("pictures/2.png"));
  expectExit(0, atlas({"export", file_, directory_ / "some/", "--component", "3"}));
  EXPECT_EQ(2u, list("some").size());
}

TEST_F(AtlasCommands, MergeNumbersOnAndSplitTakesApart) {
  const std::string other = directory_ / "b.atlas", both = directory_ / "both.atlas";
  const AtlasData second = test::walkedAtlas(2, 0.2);
  saveAtlas(second, other);
  expectExit(0, atlas({"merge", file_, other, "-o", both}));
  test::expectSame(mergeAtlases({data_, second}), loadAtlas(both));
  // One alone is copied row by row: the same bytes, whatever it grew from.
  expectExit(0, atlas({"merge", file_, "-o", directory_ / "copy.atlas"}));
  EXPECT_EQ(read("a.atlas"), read("copy.atlas"));
  for (const char* by : {"session", "component"}) {
    expectExit(0, atlas({"split", both, "-o", directory_ / "parts", "--by", by}));
    const std::string first = "parts/" + std::string(by) + "_0.atlas";
    EXPECT_EQ(read("a.atlas"), read(first));
  }
  EXPECT_EQ((std::vector<std::string>{"component_0.atlas", "component_3.atlas", "session_0.atlas",
                                      "session_1.atlas"}),
            list("parts"));
  EXPECT_EQ(2u, loadAtlas(directory_ / "parts/session_1.atlas").submaps.size());
}

TEST_F(AtlasCommands, NothingIsOverwrittenUnasked) {
  const std::vector<std::vector<std::string>> commands = {
      {"export", file_, directory_ / "x.pmap"},
      {"export", file_, directory_ / "x.txt"},
      {"export", file_, directory_ / "x/"},
      {"merge", file_, "-o", directory_ / "x.atlas"},
      {"split", file_, "-o", directory_ / "y"}};
  for (const std::vector<std::string>& command : commands) {
    SCOPED_TRACE(command.back());
    expectExit(0, atlas(command));
    expectExit(2, atlas(command), "exists; --force overwrites it");
    expectExit(0, atlas(joined(command, {"--force"})));
  }
}

TEST_F(AtlasCommands, WhatCannotBeReadIsCodeFour) {
  const std::string whole = read("a.atlas");
  AtlasData mixed = data_;
  mixed.submaps[1].map = test::walkedAtlas(2, 0.3).submaps[1].map;
  saveAtlas(mixed, directory_ / "mixed.atlas");
  saveAtlas(test::walkedAtlas(1, 0.3), directory_ / "coarse.atlas");
  saveAtlas({}, directory_ / "empty.atlas");
  const std::vector<std::pair<std::string, std::string>> files = {
      {directory_ / "none.atlas", "no such file"},
      {directory_.path(), "is a directory"},
      {write("text.atlas", "not a database"), "is no atlas"},
      {write("zero.atlas", ""), "is no atlas"},
      {write("short.atlas", whole.substr(0, whole.size() / 2)), "damaged or cut short"}};
  for (const auto& [file, problem] : files) {
    SCOPED_TRACE(file);
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"info", file},
          {"loops", file, "--json"},
          {"solve", file},
          {"export", file, directory_ / "out.pmap"},
          {"merge", file_, file, "-o", directory_ / "out.atlas"},
          {"split", file, "-o", directory_ / "out"}}) {
      const ProgramResult result = expectExit(4, atlas(command), problem);
      EXPECT_NE(std::string::npos, result.err.find(file)) << result.err;
      EXPECT_EQ("", result.out);
    }
  }
  expectExit(4, atlas({"export", directory_ / "empty.atlas", directory_ / "out.pmap"}),
             "has no submaps");
  expectExit(4, atlas({"export", directory_ / "mixed.atlas", directory_ / "out.pmap"}),
             "submap 1 does not fit to submap 0");
  const std::string coarse = directory_ / "coarse.atlas";
  expectExit(4, atlas({"merge", file_, coarse, "-o", directory_ / "out.atlas"}),
             coarse + ": submap 0 has cells of 0.3 m, not of 0.2 m as " + file_ + " has");
  expectExit(4, planarMap({"info", file_}), "planar_map atlas info");
  for (const char* name : {"out.pmap", "out.atlas", "out"}) EXPECT_FALSE(exists(name));
}

TEST_F(AtlasCommands, AFileOfARunIsLeftAlone) {
  AtlasStore run = AtlasStore::open(file_, AtlasAccess::Write);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"info", file_}, {"solve", file_, "--without-loop", "2"}})
    expectExit(4, atlas(command), "is open in another run");
  test::expectSame(data_, run.load());
}

TEST_F(AtlasCommands, WrongUsesAreCodeTwo) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> uses = {
      {{}, "what to do is missing"},
      {{"inof", file_}, "did you mean 'info'?"},
      {{"info"}, "file is required"},
      {{"info", file_, file_}, "not expected"},
      {{"info", file_, "--jason"}, "did you mean '--json'?"},
      {{"solve", file_, "--without-loop", "two"}, "two"},
      {{"export", file_}, "output is required"},
      {{"export", file_, directory_ / "x.ply"}, "planar_map convert"},
      {{"export", file_, directory_ / "x.pmap", "--component", "1"}, "has no component 1"},
      {{"export", file_, directory_ / "x/", "--component", "1"}, "has no component 1"},
      {{"merge", file_}, "--output is required"},
      {{"split", file_, "-o", directory_ / "x", "--by", "floor"}, "floor"}};
  for (const auto& [arguments, problem] : uses) expectExit(2, atlas(arguments), problem);
  EXPECT_FALSE(exists("x"));
  EXPECT_FALSE(exists("x.pmap"));
}

TEST_F(AtlasCommands, WhatCannotBeWrittenIsCodeOneAndNothingIsLeft) {
  const std::string before = read("a.atlas");
  ProgramOptions options;
  options.file_size_limit = 1000;
  expectExit(1, atlas({"merge", file_, "-o", directory_ / "x.atlas"}, options), "x.atlas");
  expectExit(1, atlas({"export", file_, directory_ / "x.pmap"}, options), "x.pmap");
  expectExit(1, atlas({"split", file_, "-o", directory_ / "a.atlas/x"}), "a.atlas/x");
  expectExit(1, atlas({"solve", file_, "--without-loop", "2"}, options), "a.atlas");
  EXPECT_EQ(LinkState::Used, loadAtlas(file_).links[2].state);
  EXPECT_EQ(before, read("a.atlas"));
  EXPECT_EQ((std::vector<std::string>{"a.atlas"}), list("."));
}

TEST_F(AtlasCommands, AFullDiskKeepsWhatWasThere) {
  const std::string disk = directory_ / "disk";
  std::filesystem::create_directory(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0)
    GTEST_SKIP() << "a file system of its own cannot be mounted here";
  write("disk/fill", std::string(60000, 'x'));
  expectExit(1, atlas({"merge", file_, "-o", disk + "/x.atlas"}), "x.atlas");
  EXPECT_EQ((std::vector<std::string>{"fill"}), list("disk"));
  ::umount(disk.c_str());
}

}  // namespace
}  // namespace planar_mapping
