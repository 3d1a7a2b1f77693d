// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Every bad configuration: exit code 3, file:line:col, nothing run.
#include "cli_fixture.h"

namespace planar_mapping {
namespace {

class BadConfiguration : public CliTest {
 protected:
  /// validate and run must both report exactly these lines, without the file's name.
  void expectProblems(const std::string& yaml, const std::vector<std::string>& problems) const {
    const std::string path = write("bad.yaml", yaml);
    std::string expected;
    for (const std::string& problem : problems) expected += path + ":" + problem + "\n";
    const ProgramResult validated = expectExit(3, planarMap({"validate", path}));
    EXPECT_EQ(expected, validated.err);
    EXPECT_EQ("", validated.out);
    const ProgramResult run = expectExit(
        3, planarMap({"run", path, "-i", directory_ / "x.pcd", "-o", directory_ / "out"}));
    EXPECT_EQ(expected, run.err);
    EXPECT_FALSE(exists("out"));
  }
};

TEST_F(BadConfiguration, TextThatTheParserDoesNotEndOnEndsAtOnce) {
  expectProblems(",", {"1:1: the configuration is empty; it starts with 'version: 1'"});
  const std::string path = write("bad.yaml", "version: 1\n---\n,");
  const ProgramResult second = expectExit(3, planarMap({"validate", path}));
  EXPECT_NE(std::string::npos, second.err.find("a configuration is one YAML document"));
}

TEST_F(BadConfiguration, GiantsAreRefusedBeforeTheyAreBuilt) {
  const auto refuses = [this](const std::string& yaml, const std::string& part) {
    const ProgramResult result = expectExit(3, planarMap({"validate", write("bad.yaml", yaml)}));
    EXPECT_NE(std::string::npos, result.err.find(part)) << result.err;
#ifndef PLANAR_MAPPING_SANITIZED
    EXPECT_LT(result.peak_kilobytes, 300000);
#endif
  };
  refuses("version: " + std::string(2000000, '1'), "larger than 1 MiB");
  refuses("a: " + std::string(40, '[') + std::string(40, ']'), "32 levels");
  refuses(std::string(100000, '['), "");
  std::string many = "a: [";
  for (int i = 0; i < 150000; ++i) many += "1,";
  refuses(many + "1]", "more than 100,000 values");
}

TEST_F(BadConfiguration, IsReportedWithItsPlace) {
  const std::string planes = "version: 1\nstages:\n  - stage: multi_plane_segmentation\n";
  const std::string grid = "version: 1\nstages:\n  - stage: voxel_grid\n";
  const std::string head = "version: 1\nstages:\n";
  const std::string empty = "1:1: the configuration is empty; it starts with 'version: 1'";
  const std::vector<std::pair<std::string, std::vector<std::string>>> rows = {
      {"version: 1\nstages:\n  - stage: multi_plane_segmentatoin\n",
       {"3:12: there is no stage 'multi_plane_segmentatoin'; did you mean "
        "'multi_plane_segmentation'?"}},
      {planes + "    distance_treshold_m: 0.1\n",
       {"4:5: stage 'multi_plane_segmentation' has no key 'distance_treshold_m'; did you "
        "mean 'distance_threshold_m'?"}},
      {grid + "    leaf_size_m: 0.05 m\n",
       {"4:18: stage 'voxel_grid': leaf_size_m must be a finite number, not '0.05 m'; "
        "allowed: > 0 m; default 0.05"}},
      {grid + "    leaf_size_m: -1\n",
       {"4:18: stage 'voxel_grid': leaf_size_m = -1 is out of range; allowed: > 0 m; "
        "default 0.05"}},
      {grid + "    leaf_size_m: .nan\n",
       {"4:18: stage 'voxel_grid': leaf_size_m must be a finite number, not '.nan'; "
        "allowed: > 0 m; default 0.05"}},
      {grid + "    leaf_size_m: 1\n    leaf_size_m: 2\n",
       {"5:5: this stage: key 'leaf_size_m' stands here a second time; the first is in line 4"}},
      {"version: 1\nseed: 1\nseed: 2\nstages: [{stage: voxel_grid}]\n",
       {"3:1: the configuration: key 'seed' stands here a second time; the first is in line 2"}},
      {"", {empty}},
      {"# only a comment\n", {empty}},
      {"- a\n- b\n",
       {"1:1: a configuration is a mapping of keys, not a list; it starts with 'version: 1'"}},
      {"stages:\n  - stage: voxel_grid\n", {"1:1: key 'version' is missing; write 'version: 1'"}},
      {"version: 2\nstages:\n  - stage: voxel_grid\n",
       {"1:10: version = 2 is out of range; allowed: an integer [1, 1]; default 1; this "
        "program reads version 1"}},
      {planes + "    method: organised\n",
       {"4:13: stage 'multi_plane_segmentation': method cannot be 'organised'; did you "
        "mean 'organized'? allowed: automatic, multi_ransac, sequential, organized or "
        "disparity; default automatic"}},
      {"version: 1\nprofile: papr\nstages:\n  - stage: voxel_grid\n",
       {"2:10: profile cannot be 'papr'; did you mean 'paper'? allowed: paper or "
        "compact; default compact"}},
      {planes + "  - stage: voxel_grid\n",
       {"4:12: stage 'voxel_grid' works on points and so must stand before "
        "'multi_plane_segmentation', which finds planes"}},
      {head + "  - stage: crop_box\n    frame: world\n  - stage: motion_estimation\n",
       {"5:12: stage 'motion_estimation' finds the pose and so must stand before 'crop_box', "
        "which works on points"}},
      {head + "  - stage: crop_box\n  - stage: key_features\n  - stage: motion_estimation\n",
       {"4:12: stage 'key_features' finds key features and so must stand before 'crop_box', which "
        "works on points"}},
      {head + "  - stage: motion_estimation\n  - stage: crop_box\n  - stage: motion_estimation\n",
       {"5:12: stage 'motion_estimation' finds the pose and so must stand before 'crop_box', "
        "which works on points"}},
      // All problems at once, in the order of the file.
      {"version: one\nsed: 3\nstages:\n  - stage: voxel_gird\n  - leaf: 3\n  - stage: "
       "crop_box\n    negative: maybe\n",
       {"1:10: version must be an integer, not 'one'; allowed: an integer [1, 1]; "
        "default 1; this program reads version 1",
        "2:1: there is no key 'sed' here; did you mean 'seed'?",
        "4:12: there is no stage 'voxel_gird'; did you mean 'voxel_grid'?",
        "5:5: key 'stage', the name of the stage, is missing here",
        "7:15: stage 'crop_box': negative must be true or false, not 'maybe'; allowed: "
        "true or false; default false"}}};
  for (const auto& [yaml, problems] : rows) {
    SCOPED_TRACE(yaml);
    expectProblems(yaml, problems);
  }
}

TEST_F(BadConfiguration, NoYaml) {
  const ProgramResult result =
      expectExit(3, planarMap({"validate", write("bad.yaml", "version: [1\n")}));
  EXPECT_NE(std::string::npos, result.err.find("bad.yaml:2:1: this is no YAML")) << result.err;
}

TEST_F(BadConfiguration, MissingFileDirectoryAndHugeFile) {
  std::filesystem::create_directory(directory_ / "folder.yaml");
  for (const std::string& path : {directory_ / "nowhere.yaml", directory_ / "folder.yaml",
                                  write("huge.yaml", std::string(2u << 20u, '#'))}) {
    const ProgramResult result = planarMap({"validate", path});
    EXPECT_EQ(3, result.exit_code) << path;
    EXPECT_EQ(0u, result.err.find(path + ":1:1: ")) << result.err;
  }
}

TEST_F(BadConfiguration, SetIsCheckedLikeTheFile) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"multi_plane_segmentation.distance_treshold_m=0.1",
       "--set multi_plane_segmentation.distance_treshold_m=0.1: stage 'multi_plane_segmentation' "
       "has no key 'distance_treshold_m'; did you mean 'distance_threshold_m'?\n"},
      {"multi_plane_segmentation.min_inliers=2",
       "--set multi_plane_segmentation.min_inliers=2: min_inliers = 2 is out of range; allowed: an "
       "integer >= 3, or auto; default auto\n"},
      {"planar_cuboid_approximation.up=[0, 1]",
       "--set planar_cuboid_approximation.up=[0, 1]: up must be three numbers [x, y, z], not a "
       "list of 2; allowed: three numbers [x, y, z], not all zero, or auto; default auto\n"},
      {"planar_cuboid_approximation.up=[0, 0, 0]",
       "--set planar_cuboid_approximation.up=[0, 0, 0]: up = [0, 0, 0] is out of range; allowed: "
       "three numbers [x, y, z], not all zero, or auto; default auto\n"},
      {"voxel_grid.leaf_size_m=1",
       "--set voxel_grid.leaf_size_m=1: there is no stage 'voxel_grid' "
       "in " +
           config("single_pcd.yaml") + "\n"},
      {"seed=9007199254740992",
       "--set seed=9007199254740992: seed = 9007199254740992 is out of range; allowed: an integer "
       "[0, 9007199254740991]; default 12345\n"},
      {"nonsense", "--set nonsense: is not of the form stage.key=value\n"},
      {"sed=4",
       "--set sed=4: there is no such key; did you mean 'seed'?; a stage's key is written "
       "stage.key=value\n"}};
  for (const auto& [assignment, message] : cases) {
    const ProgramResult result =
        expectExit(3, planarMap({"validate", config("single_pcd.yaml"), "--set", assignment}));
    EXPECT_EQ(message, result.err);
  }
}

TEST_F(BadConfiguration, MissingPluginAndForeignLibrary) {
  const std::string head = "version: 1\nplugins: [libmine.so]\nstages:\n  - stage: voxel_grid\n";
  const std::string path = write("plugin.yaml", head);
  const std::vector<std::string> run = {"run", path, "-i", room(), "-o", directory_ / "out"};
  const ProgramResult missing = expectExit(3, planarMap(run));
  EXPECT_NE(std::string::npos, missing.err.find(path + ":2:11: plugin ")) << missing.err;
  EXPECT_NE(std::string::npos, missing.err.find("named by its absolute path")) << missing.err;
  write("libmine.so", "not a library");
  const ProgramResult foreign = expectExit(3, planarMap(run));
  EXPECT_NE(std::string::npos, foreign.err.find("cannot be loaded as a plugin")) << foreign.err;
}

TEST_F(BadConfiguration, PluginInAFolderIsNamedByAnAbsolutePath) {
  for (const char* name : {"plugins/libmine.so", "../libmine.so", "./libmine.so"}) {
    const std::string path = write("plugin.yaml", std::string("version: 1\nplugins: [") + name +
                                                      "]\nstages:\n  - stage: voxel_grid\n");
    const ProgramResult result = expectExit(3, planarMap({"validate", path}));
    EXPECT_NE(std::string::npos, result.err.find("has to be named by an absolute path")) << name;
  }
}

}  // namespace
}  // namespace planar_mapping
