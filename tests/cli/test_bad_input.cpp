// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Every bad input: an exit code, one sentence, nothing half written.
#include <sys/mount.h>
#include <sys/stat.h>

#include <array>
#include <limits>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

class BadInput : public CliTest {
 protected:
  /// The run must refuse the input and leave no result behind.
  void expectRefused(const std::string& input, const std::string& part) const {
    const ProgramResult result = expectExit(4, runOn(input), part);
    EXPECT_NE(std::string::npos, result.err.find(input)) << result.err;
    EXPECT_TRUE(list("out").empty());
  }
  /// The run must get through, with all its files.
  ProgramResult expectMapped(const std::string& input,
                             const std::vector<std::string>& more = {}) const {
    const ProgramResult result = expectExit(0, runOn(input, more));
    EXPECT_EQ(7u, list("out").size());
    return result;
  }
};

TEST_F(BadInput, CloudsThatAreNoneAreRefused) {
  const auto with = [](std::string pcd, const std::string& old, const std::string& now) {
    return pcd.replace(pcd.find(old), old.size(), now);
  };
  const std::string sound = binaryPcd({0, 0, 1, 0, 1, 1, 1, 0, 1});
  const std::string text = asciiPcd({"1 2 3", "4 5 6"});
  const std::vector<float> nan(300, std::numeric_limits<float>::quiet_NaN());
  const std::vector<float> infinite(300, std::numeric_limits<float>::infinity());
  const std::vector<std::array<std::string, 3>> rows = {
      {"empty.pcd", "", "empty.pcd"},
      {"picture.pcd", "\x89PNG\r\n\x1a\n not a cloud", "picture.pcd"},
      {"more.pcd", with(with(sound, "WIDTH 3", "WIDTH 999999999"), "POINTS 3", "POINTS 999999999"),
       "more.pcd"},
      {"contradiction.pcd", with(sound, "POINTS 3", "POINTS 2"), "contradiction.pcd"},
      {"none.pcd", binaryPcd({}), "none.pcd"},
      {"nan.pcd", binaryPcd(nan), "finite"},
      {"infinite.pcd", binaryPcd(infinite), "finite"},
      {"types.pcd", with(text, "TYPE F F F", "TYPE U U U"), "types.pcd"},
      {"fields.pcd", with(text, "FIELDS x y z", "FIELDS a b c"), "fields.pcd"}};
  for (const auto& [name, bytes, part] : rows) {
    SCOPED_TRACE(name);
    expectRefused(write(name, bytes), part);
  }
  expectRefused(directory_ / "nowhere.pcd", "nowhere.pcd");
  std::filesystem::create_directory(directory_ / "folder");
  expectRefused(directory_ / "folder", "folder");
}

TEST_F(BadInput, PointsWithoutAPlaneAreMapped) {
  std::vector<float> line;
  for (int i = 0; i < 1000; ++i) {
    const float t = 0.005f * static_cast<float>(i);
    line.insert(line.end(), {t, 2.0f * t, 1.0f + t});
  }
  for (const std::vector<float>& xyz : {std::vector<float>{1, 2, 3}, line}) {
    const ProgramResult result = expectMapped(write("few.pcd", binaryPcd(xyz)), {"--force"});
    expectOneSentence(result, "no plane");
  }
  std::vector<float> same;
  for (int i = 0; i < 3000; ++i) same.insert(same.end(), {1.0f, 2.0f, 3.0f});
  expectMapped(write("same.pcd", binaryPcd(same)), {"--force"});
}

TEST_F(BadInput, DegradedResultIsCodeFiveWithStrict) {
  expectExit(5, runOn(write("one.pcd", binaryPcd({1, 2, 3})), {"--strict"}));
  EXPECT_TRUE(exists("out/map.pmap"));
}

TEST_F(BadInput, InfiniteValuesAmongSoundOnesAreSkipped) {
  std::vector<float> xyz = roomPoints(20000);
  for (std::size_t i = 0; i < xyz.size(); i += 30) xyz[i] = std::numeric_limits<float>::infinity();
  const ProgramResult result = expectMapped(write("some.pcd", binaryPcd(xyz)));
  EXPECT_EQ("", result.err);
  EXPECT_NE(std::string::npos, read("out/metrics.json").find("\"valid\": 18000"));
}

TEST_F(BadInput, CoordinatesOfABillionAreMappedOrRefusedInOneSentence) {
  std::vector<float> xyz = roomPoints(5000);
  for (float& value : xyz) value += 1e9f;
  const ProgramResult result = runOn(write("far.pcd", binaryPcd(xyz)));
  EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 4) << result.exit_code << result.err;
  EXPECT_LT(result.seconds, 20.0);
  EXPECT_LE(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_F(BadInput, ScaleWithoutUsableParametersIsTheFaultOfTheInput) {
  for (const double scale : {1e9, 1e-9}) {
    std::vector<float> xyz = roomPoints(2000);
    for (float& value : xyz) value = static_cast<float>(scale * value);
    const std::string cloud = write("scaled.pcd", binaryPcd(xyz));
    const ProgramResult result = runOn(cloud, {"--force"});
    if (result.exit_code == 0) continue;
    EXPECT_EQ(4, result.exit_code) << scale;
    expectOneSentence(result, "m across");
    EXPECT_NE(std::string::npos, result.err.find(cloud)) << result.err;
  }
}

TEST_F(BadInput, OnePointABillionMetresAwayDoesNotSpoilTheRest) {
  std::vector<float> xyz = roomPoints(20000);
  xyz.insert(xyz.end(), {1e9f, -1e9f, 1e9f});
  const ProgramResult result = expectMapped(write("outlier.pcd", binaryPcd(xyz)));
  EXPECT_NE(std::string::npos, read("out/config.resolved.yaml").find("resolution_m: 0.1\n"))
      << read("out/config.resolved.yaml");
  EXPECT_LT(result.seconds, 20.0);
}

TEST_F(BadInput, FewerPosesThanClouds) {
  const std::string a = room("a.pcd");
  const std::string b = room("b.pcd", 2);
  const std::string poses = write("poses.txt", "0 0 0 0 0 0 0 1\n");
  expectExit(4,
             planarMap({"run", config("pcd_sequence.yaml"), "-i", a, b, "--poses", poses, "-o",
                        directory_ / "out"}),
             "poses.txt");
  EXPECT_TRUE(list("out").empty());
}

TEST_F(BadInput, MalformedPoses) {
  const std::string cloud = room();
  for (const char* text : {"0 0 0 0 0 0 0\n", "0 0 0 zero 0 0 0 1\n", "0 0 0 0 0 0 0 0\n",
                           "0 0 nan 0 0 0 0 1\n", "0 0 0 0 0 0 0 1 9\n"}) {
    const std::string poses = write("poses.txt", text);
    const ProgramResult result = runOn(cloud, {"--poses", poses});
    EXPECT_EQ(4, result.exit_code) << text;
    expectOneSentence(result, "poses.txt");
    EXPECT_TRUE(list("out").empty());
  }
}

TEST_F(BadInput, RgbdFolderWithoutPosesSaysWhatIsMissing) {
  write("seq/calib.yaml",
        "image_width: 4\nimage_height: 4\nfx: 4\nfy: 4\ncx: 2\ncy: 2\ndepth_scale: 1000\n");
  write("seq/depth/000000.png", "not read");
  const std::string yaml = write("plain.yaml",
                                 "version: 1\nstages:\n  - stage: multi_plane_segmentation\n"
                                 "  - stage: planar_cuboid_approximation\n");
  const ProgramResult result =
      expectExit(4, planarMap({"run", yaml, "-i", directory_ / "seq", "-o", directory_ / "out"}),
                 "there are no poses");
  EXPECT_NE(std::string::npos, result.err.find("motion_estimation")) << result.err;
  EXPECT_TRUE(list("out").empty());
}

TEST_F(BadInput, NoInputAtAll) {
  expectExit(4, planarMap({"run", config("single_pcd.yaml"), "-o", directory_ / "out"}), "-i");
}

TEST_F(BadInput, WhatWasDoneBeforeABadFrameIsSaved) {
  const std::string a = room("a.pcd");
  std::string cut = binaryPcd({1, 2, 3});
  cut.resize(cut.size() - 4);
  const std::string bad = write("b.pcd", cut);
  expectExit(
      4,
      planarMap({"run", config("pcd_sequence.yaml"), "-i", a, bad, "-o", directory_ / "out", "-q"}),
      "b.pcd");
  EXPECT_EQ(7u, list("out").size());
  EXPECT_NE(std::string::npos, read("out/metrics.json").find("\"frames\": 1"));
}

TEST_F(BadInput, AViewpointBeyondAnyWorldIsOfItsFile) {
  const std::string far =
      write("far.pcd",
            "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 3\nHEIGHT 1\n"
            "VIEWPOINT 1e30 0 0 1 0 0 0\nPOINTS 3\nDATA ascii\n1 2 3\n1 2 4\n2 2 3\n");
  expectExit(4, planarMap({"run", far, "-o", directory_ / "out", "-q"}), "far.pcd: its pose");
}

TEST_F(BadInput, InfoRefusesWhatItCannotRead) {
  for (const std::string& path : {directory_ / "nowhere", write("noise", "some text"),
                                  write("cut.pmap", "PMAP"), write("bad.pcd", "VERSION 0.7\n")}) {
    const ProgramResult result = planarMap({"info", path});
    EXPECT_EQ(4, result.exit_code) << path;
    expectOneSentence(result, path);
    EXPECT_EQ("", result.out);
  }
}

// Output that cannot be written: an exit code, one sentence, what was there stays.

class BadOutput : public CliTest {
 protected:
  ProgramResult runTo(const std::string& output, const std::vector<std::string>& more = {},
                      const ProgramOptions& options = {}) const {
    return planarMap(
        joined({"run", config("single_pcd.yaml"), "-i", cloud_, "-o", output, "-q"}, more),
        options);
  }
  std::string cloud_ = room();
};

TEST_F(BadOutput, DirectoryBelowAFile) {
  const std::string file = write("file", "content");
  expectExit(1, runTo(file + "/out"), file + "/out");
  EXPECT_EQ("content", read("file"));
}

TEST_F(BadOutput, NameOfAFile) {
  const std::string file = write("file", "content");
  expectExit(1, runTo(file), "this is a file");
  EXPECT_EQ("content", read("file"));
}

TEST_F(BadOutput, ReadOnlyDirectory) {
  // Root may write anywhere but into the kernel's own directories.
  std::string output = "/proc/sys";
  if (::geteuid() != 0) {
    output = directory_ / "read_only";
    std::filesystem::create_directory(output);
    ::chmod(output.c_str(), 0555);
  }
  expectExit(1, runTo(output), output);
}

TEST_F(BadOutput, ExistingResultsAreKeptWithoutForce) {
  ASSERT_EQ(0, runTo(directory_ / "out").exit_code);
  const std::string map = read("out/map.pmap");
  expectExit(2, runTo(directory_ / "out"), "--force");
  EXPECT_EQ(map, read("out/map.pmap"));
  expectExit(0, runTo(directory_ / "out", {"--force"}));
  EXPECT_EQ(map, read("out/map.pmap"));
}

TEST_F(BadOutput, EachCommandHasTheSameCodes) {
  ASSERT_EQ(0, runTo(directory_ / "out").exit_code);
  const std::string map = directory_ / "out/map.pmap";
  const std::vector<std::string> commands[] = {
      {"simulate", "room", "--frames", "1", "--width", "8", "--height", "8", "-q", "-o"},
      {"merge", map, map, "-o"},
      {"convert", map}};
  for (std::vector<std::string> command : commands) {
    command.push_back(directory_ / command[0] + (command[0] == "convert" ? ".csv" : ".pmap"));
    ASSERT_EQ(0, planarMap(command).exit_code) << command[0];
    const ProgramResult exists = planarMap(command);
    EXPECT_EQ(2, exists.exit_code) << command[0];
    expectOneSentence(exists, "--force");
    command.back() = command[0] == "convert" ? "/proc/sys/none.csv" : "/proc/sys/none";
    const ProgramResult refused = planarMap(command);
    EXPECT_EQ(1, refused.exit_code) << command[0];
    expectOneSentence(refused, "/proc/sys/none");
  }
}

TEST_F(BadOutput, FilesOfOthersInTheDirectoryAreNoObstacle) {
  write("out/notes.txt", "mine");
  EXPECT_EQ(0, runTo(directory_ / "out").exit_code);
  EXPECT_EQ("mine", read("out/notes.txt"));
}

TEST_F(BadOutput, FileThatMayNotGrow) {
  ProgramOptions options;
  options.file_size_limit = 700;  // some files fit, the map does not
  expectExit(1, runTo(directory_ / "out", {}, options), directory_ / "out");
  EXPECT_FALSE(exists("out/map.pmap"));
  for (const std::string& name : list("out")) EXPECT_NE('.', name.front()) << name;
}

TEST_F(BadOutput, FullDiskLeavesTheEarlierMap) {
  const std::string disk = directory_ / "disk";
  std::filesystem::create_directory(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0) {
    GTEST_SKIP() << "a file system of its own cannot be mounted here";
  }
  std::ofstream(disk + "/filler") << std::string(60000, 'x');
  expectExit(1, runTo(disk + "/out"), "out/");
  EXPECT_FALSE(exists("disk/out/map.pmap"));
  for (const std::string& name : list("disk/out")) EXPECT_NE('.', name.front()) << name;
  ::umount(disk.c_str());
}

}  // namespace
}  // namespace planar_mapping
