// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Every bad input: an exit code, one sentence, nothing half written.
#include <limits>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

class BadInput : public CliTest {
 protected:
  /// The run must refuse the input and leave no result behind.
  void expectRefused(const std::string& input, const std::string& part) const {
    const ProgramResult result = runOn(input);
    EXPECT_EQ(4, result.exit_code) << result.err;
    expectOneSentence(result, part);
    EXPECT_NE(std::string::npos, result.err.find(input)) << result.err;
    EXPECT_TRUE(list("out").empty());
  }
  /// The run must get through, with all its files.
  ProgramResult expectMapped(const std::string& input) const {
    const ProgramResult result = runOn(input);
    EXPECT_EQ(0, result.exit_code) << result.err;
    EXPECT_EQ(9u, list("out").size());
    return result;
  }
};

TEST_F(BadInput, MissingFile) {
  expectRefused(directory_ / "nowhere.pcd", "nowhere.pcd");
}

TEST_F(BadInput, EmptyFile) {
  expectRefused(write("empty.pcd", ""), "empty.pcd");
}

TEST_F(BadInput, DirectoryWithoutClouds) {
  std::filesystem::create_directory(directory_ / "folder");
  expectRefused(directory_ / "folder", "folder");
}

TEST_F(BadInput, NoPcdFile) {
  expectRefused(write("picture.pcd", "\x89PNG\r\n\x1a\n not a cloud"), "picture.pcd");
}

TEST_F(BadInput, HeaderClaimsMorePointsThanTheFileHolds) {
  std::string pcd = binaryPcd({0, 0, 1, 0, 1, 1, 1, 0, 1});
  pcd.replace(pcd.find("WIDTH 3"), 7, "WIDTH 999999999");
  pcd.replace(pcd.find("POINTS 3"), 8, "POINTS 999999999");
  expectRefused(write("lie.pcd", pcd), "lie.pcd");
}

TEST_F(BadInput, HeaderSizesContradictEachOther) {
  std::string pcd = binaryPcd({0, 0, 1, 0, 1, 1, 1, 0, 1});
  pcd.replace(pcd.find("POINTS 3"), 8, "POINTS 2");
  expectRefused(write("lie.pcd", pcd), "lie.pcd");
}

TEST_F(BadInput, ZeroPoints) {
  expectRefused(write("none.pcd", binaryPcd({})), "none.pcd");
}

TEST_F(BadInput, AllNaN) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  expectRefused(write("nan.pcd", binaryPcd(std::vector<float>(300, nan))), "finite");
}

TEST_F(BadInput, AllInfinite) {
  const float inf = std::numeric_limits<float>::infinity();
  expectRefused(write("inf.pcd", binaryPcd(std::vector<float>(300, inf))), "finite");
}

TEST_F(BadInput, WrongFieldTypes) {
  std::string pcd = asciiPcd({"1 2 3", "4 5 6"});
  pcd.replace(pcd.find("TYPE F F F"), 10, "TYPE U U U");
  expectRefused(write("types.pcd", pcd), "types.pcd");
}

TEST_F(BadInput, NoCoordinates) {
  std::string pcd = asciiPcd({"1 2 3", "4 5 6"});
  pcd.replace(pcd.find("FIELDS x y z"), 12, "FIELDS a b c");
  expectRefused(write("fields.pcd", pcd), "fields.pcd");
}

TEST_F(BadInput, OnePointIsMapped) {
  const ProgramResult result = expectMapped(write("one.pcd", binaryPcd({1, 2, 3})));
  expectOneSentence(result, "no plane");
}

TEST_F(BadInput, CollinearPointsAreMapped) {
  std::vector<float> xyz;
  for (int i = 0; i < 1000; ++i) {
    const float t = 0.005f * static_cast<float>(i);
    xyz.insert(xyz.end(), {t, 2.0f * t, 1.0f + t});
  }
  const ProgramResult result = expectMapped(write("line.pcd", binaryPcd(xyz)));
  expectOneSentence(result, "no plane");
}

TEST_F(BadInput, DuplicatePointsAreMapped) {
  std::vector<float> xyz;
  for (int i = 0; i < 3000; ++i) xyz.insert(xyz.end(), {1.0f, 2.0f, 3.0f});
  expectMapped(write("same.pcd", binaryPcd(xyz)));
}

TEST_F(BadInput, DegradedResultIsCodeFiveWithStrict) {
  const ProgramResult result = runOn(write("one.pcd", binaryPcd({1, 2, 3})), {"--strict"});
  EXPECT_EQ(5, result.exit_code) << result.err;
  EXPECT_TRUE(exists("out/map.pmap"));
}

TEST_F(BadInput, InfiniteValuesAmongSoundOnesAreSkipped) {
  std::vector<float> xyz = roomPoints(20000);
  for (std::size_t i = 0; i < xyz.size(); i += 30) {
    xyz[i] = std::numeric_limits<float>::infinity();
  }
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

TEST_F(BadInput, FloorThatLeansBelowACloudWithoutAPose) {
  std::vector<float> xyz;  // around a sensor 1.5 m above it, by 20 degrees
  for (double x = -3.0; x < 3.0; x += 0.05) {
    for (double y = -3.0; y < 3.0; y += 0.05) {
      xyz.insert(xyz.end(), {static_cast<float>(x), static_cast<float>(y),
                             static_cast<float>(std::tan(20.0 * M_PI / 180.0) * x - 1.5)});
    }
  }
  const ProgramResult result = runOn(write("leans.pcd", binaryPcd(xyz)));
  EXPECT_EQ(0, result.exit_code) << result.err;
  EXPECT_NE(std::string::npos, result.err.find("leans by 20 degrees")) << result.err;
  EXPECT_EQ(std::string::npos, result.err.find("given poses")) << result.err;
  EXPECT_NE(std::string::npos, result.err.find("set `up` of the stages to [-0.34, ")) << result.err;
  EXPECT_NE(std::string::npos, result.err.find(", 0.94]")) << result.err;
}

TEST_F(BadInput, FewerPosesThanClouds) {
  const std::string a = room("a.pcd");
  const std::string b = room("b.pcd", 2);
  const std::string poses = write("poses.txt", "0 0 0 0 0 0 0 1\n");
  const ProgramResult result = planarMap(
      {"run", config("pcd_sequence.yaml"), "-i", a, b, "--poses", poses, "-o", directory_ / "out"});
  EXPECT_EQ(4, result.exit_code);
  expectOneSentence(result, "poses.txt");
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
      planarMap({"run", yaml, "-i", directory_ / "seq", "-o", directory_ / "out"});
  EXPECT_EQ(4, result.exit_code);
  expectOneSentence(result, "there are no poses");
  EXPECT_NE(std::string::npos, result.err.find("motion_estimation")) << result.err;
  EXPECT_TRUE(list("out").empty());
}

TEST_F(BadInput, NoInputAtAll) {
  const ProgramResult result =
      planarMap({"run", config("single_pcd.yaml"), "-o", directory_ / "out"});
  EXPECT_EQ(4, result.exit_code);
  expectOneSentence(result, "-i");
}

TEST_F(BadInput, WhatWasDoneBeforeABadFrameIsSaved) {
  const std::string a = room("a.pcd");
  std::string cut = binaryPcd({1, 2, 3});
  cut.resize(cut.size() - 4);
  const std::string bad = write("b.pcd", cut);
  const ProgramResult result =
      planarMap({"run", config("pcd_sequence.yaml"), "-i", a, bad, "-o", directory_ / "out", "-q"});
  EXPECT_EQ(4, result.exit_code);
  expectOneSentence(result, "b.pcd");
  EXPECT_EQ(9u, list("out").size());
  EXPECT_NE(std::string::npos, read("out/metrics.json").find("\"frames\": 1"));
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

}  // namespace
}  // namespace planar_mapping
