// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include <sstream>

#include "cli_fixture.h"
#include "planar_mapping/io/depth_image.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

class Commands : public CliTest {
 protected:
  /// The program and its libraries copied or linked to a place without a viewer.
  std::string programAlone() const {
    std::filesystem::create_directory(directory_ / "bin");
    const std::string copy = directory_ / "bin/planar_map";
    std::filesystem::copy_file(program(), copy);
    return copy;
  }
};

TEST_F(Commands, ReadyConfigurationsAreValid) {
  for (const char* name : {"single_pcd.yaml", "pcd_sequence.yaml", "rgbd_indoor.yaml"}) {
    for (const char* profile : {"paper", "compact"}) {
      const ProgramResult result =
          planarMap({"config", "--effective", config(name), "--profile", profile});
      EXPECT_EQ(0, result.exit_code) << name << result.err;
    }
    const ProgramResult result = planarMap({"validate", config(name)});
    EXPECT_EQ(0, result.exit_code) << name << result.err;
    EXPECT_EQ("", result.err);
  }
}

TEST_F(Commands, DefaultsAreAConfigurationThatResolvesToItself) {
  for (const char* profile : {"paper", "compact"}) {
    const ProgramResult defaults =
        expectExit(0, planarMap({"config", "--defaults", "--profile", profile}));
    const ProgramResult effective =
        expectExit(0, planarMap({"config", "--effective", write("defaults.yaml", defaults.out)}));
    const ProgramResult again =
        planarMap({"config", "--effective", write("effective.yaml", effective.out)});
    EXPECT_EQ(effective.out, again.out);
  }
}

TEST_F(Commands, ExplainShowsUnitRangeDefaultAndMeaning) {
  const ProgramResult result = expectExit(
      0, planarMap({"config", "--explain", "multi_plane_segmentation.distance_threshold_m"}));
  for (const char* part : {"d_T", "> 0 m", "0.05 m"})
    EXPECT_NE(std::string::npos, result.out.find(part)) << result.out;
  const ProgramResult seed = expectExit(0, planarMap({"config", "--explain", "seed"}));
  EXPECT_NE(std::string::npos, seed.out.find("default 12345")) << seed.out;
  EXPECT_EQ(2, planarMap({"config", "--explain", "nonsense"}).exit_code);
  EXPECT_EQ(2, planarMap({"config"}).exit_code);
}

TEST_F(Commands, StagesAreListedAndDescribed) {
  const ProgramResult stages = expectExit(0, planarMap({"stages"}));
  for (const char* stage : {"voxel_grid", "pass_through", "crop_box", "statistical_outlier_removal",
                            "radius_outlier_removal", "ground_removal", "multi_plane_segmentation",
                            "kl_occupancy", "planar_cuboid_approximation"}) {
    EXPECT_NE(std::string::npos, stages.out.find(stage));
    const ProgramResult described = expectExit(0, planarMap({"stages", "--describe", stage}));
    EXPECT_NE(std::string::npos, described.out.find("default: "));
  }
  EXPECT_EQ(2, planarMap({"stages", "--describe", "nonsense"}).exit_code);
}

TEST_F(Commands, ReferencePageIsUpToDate) {
  const ProgramResult page = planarMap({"stages", "--markdown"});
  std::ifstream in(std::string(PLANAR_MAPPING_SOURCE_DIR) + "/docs/parameters.md");
  const std::string stored{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(stored, page.out)
      << "write it again: planar_map stages --markdown > docs/parameters.md";
}

TEST_F(Commands, StandardOutputThatCannotBeWrittenIsAnError) {
  ASSERT_EQ(0, runOn(room()).exit_code);
  const std::string map = directory_ / "out/map.pmap";
  for (const std::string& command :
       {"info " + map, "info " + map + " --json", "query " + map + " --point 1,0,0",
        std::string("config --defaults"), std::string("stages"),
        "run " + config("single_pcd.yaml") + " -i " + directory_ / "room.pcd" + " --json -o " +
            directory_ / "again"}) {
    const ProgramResult result =
        runProgram({"/bin/sh", "-c", program() + " " + command + " > /dev/full"});
    EXPECT_EQ(1, result.exit_code) << command;
    expectOneSentence(result, "standard output");
  }
}

TEST_F(Commands, InfoOfACloud) {
  const ProgramResult result = expectExit(0, planarMap({"info", room(), "--json"}));
  const Json info = Json::parse(result.out);
  EXPECT_EQ("pcd", info["type"]);
  EXPECT_EQ(20000, info["points"]);
  EXPECT_NEAR(1.0, info["bounds_m"]["low"][0].get<double>(), 0.1);
}

TEST_F(Commands, InfoSaysWhatItKnows) {
  expectExit(4, planarMap({"info", write("a.yaml", "version: 1\n")}), "a.yaml: is neither a map");
  expectExit(4, planarMap({"info", directory_ / "none"}), "none: no such file");
}

TEST_F(Commands, InfoOfAMapAgreesWithTheRun) {
  ASSERT_EQ(0, runOn(room()).exit_code);
  const ProgramResult result =
      expectExit(0, planarMap({"info", directory_ / "out/map.pmap", "--json"}));
  const Json info = Json::parse(result.out);
  const Json metrics = Json::parse(read("out/metrics.json"));
  EXPECT_EQ(metrics["cuboids"], info["cuboids"]);
  EXPECT_EQ(metrics["planes"], info["planes"]);
  EXPECT_EQ(metrics["unknown_cells"], info["unknown_cells"]);
  EXPECT_EQ(metrics["file_bytes"], info["file_bytes"]);
}

TEST_F(Commands, AResultFolderIsItsMap) {
  ASSERT_EQ(0, runOn(room()).exit_code);
  const std::string folder = directory_ / "out", map = directory_ / "out/map.pmap";
  EXPECT_EQ(planarMap({"info", map}).out, expectExit(0, planarMap({"info", folder})).out);
  EXPECT_EQ(planarMap({"query", map, "--point", "1,0,0"}).out,
            expectExit(0, planarMap({"query", folder, "--point", "1,0,0"})).out);
  expectExit(0, planarMap({"convert", folder, directory_ / "a.csv"}));
  expectExit(0, planarMap({"convert", map, directory_ / "b.csv"}));
  EXPECT_EQ(read("a.csv"), read("b.csv"));
  expectExit(0, planarMap({"compare", folder, map}));
}

TEST_F(Commands, CloudsOfAnotherUnitAreScaled) {
  const auto lowX = [](const ProgramResult& result) {
    return Json::parse(result.out)["bounds_m"]["low"][0].get<double>();
  };
  const std::string cloud = room();
  const double low = lowX(planarMap({"info", cloud, "--json"}));
  EXPECT_NEAR(2.0 * low, lowX(planarMap({"info", cloud, "--json", "--scale", "2"})), 1e-5);
  expectExit(0, planarMap({"run", cloud, "--scale", "2", "-o", directory_ / "out", "-q"}));
  EXPECT_NEAR(2.0 * low, lowX(planarMap({"info", directory_ / "out", "--json"})), 0.3);
  EXPECT_NE(std::string::npos, read("out/config.resolved.yaml").find("scale: 2"));
  expectExit(2, planarMap({"run", cloud, "--scale", "0", "-o", directory_ / "out", "-q"}));
}

TEST_F(Commands, InfoTakesACalibration) {
  const io::DepthImage depth{4, 3, std::vector<std::uint16_t>(12, 1500)};
  write("seq/depth/note.txt", "");
  io::writeDepthPng(directory_ / "seq/depth/0.png", depth);
  const std::string camera =
      write("camera.yaml",
            "image_width: 4\nimage_height: 3\nfx: 2\nfy: 2\ncx: 1.5\ncy: 1\ndepth_scale: 1000\n");
  expectExit(4, planarMap({"info", directory_ / "seq"}), "--calib FILE");
  const ProgramResult result =
      expectExit(0, planarMap({"info", directory_ / "seq", "--calib", camera, "--json"}));
  EXPECT_EQ(4, Json::parse(result.out)["image"]["width"]);
}

TEST_F(Commands, InfoOfASequence) {
  room("seq/clouds/0.pcd");
  room("seq/clouds/1.pcd");
  const ProgramResult result = expectExit(0, planarMap({"info", directory_ / "seq", "--json"}));
  EXPECT_EQ(2, Json::parse(result.out)["frames"]);
}

TEST_F(Commands, ViewAndSnapshotWithoutViewerAreCodeSeven) {
  const std::string alone = programAlone();
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{alone, "view", "map.pmap"},
        std::vector<std::string>{alone, "snapshot", "map.pmap", "-o", "x.png"}}) {
    expectExit(7, runProgram(arguments), "planar_map_viewer");
  }
}

TEST_F(Commands, ViewerGetsTheArgumentsAndItsExitCodeIsPassedOn) {
  const std::string alone = programAlone();
  const std::string viewer = write("bin/planar_map_viewer", "#!/bin/sh\necho \"$@\"\nexit 6\n");
  std::filesystem::permissions(viewer, std::filesystem::perms::owner_all);
  const ProgramResult snapshot =
      expectExit(6, runProgram({alone, "snapshot", "map.pmap", "-o", "x.png", "--size", "64x48"}));
  EXPECT_EQ("map.pmap --snapshot x.png --size 64x48\n", snapshot.out);
  const ProgramResult view =
      expectExit(6, runProgram({alone, "view", "map.pmap", "cloud.pcd", "--color", "tilt"}));
  EXPECT_EQ("map.pmap cloud.pcd --color tilt\n", view.out);
}

TEST_F(Commands, SnapshotWithoutNameIsUsage) {
  expectExit(2, planarMap({"snapshot", "map.pmap"}), "-o");
}

TEST_F(Commands, ProgramLinksNoVtkAndNoPclIo) {
  const ProgramResult result = expectExit(0, runProgram({"/usr/bin/ldd", program()}));
  for (const char* library :
       {"libvtk", "libpcl_io", "libpcl_surface", "libpcl_visualization", "libGL."}) {
    EXPECT_EQ(std::string::npos, result.out.find(library)) << result.out;
  }
  // The packaged OpenCV brings libX11 along, for formats of images we do not read.
  if (result.out.find("libopencv") == std::string::npos) {
    EXPECT_EQ(std::string::npos, result.out.find("libX11")) << result.out;
  }
}

TEST_F(Commands, HelpAndVersionGoToStdout) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, std::vector<std::string>{"run", "--help"},
        std::vector<std::string>{"--version"}}) {
    const ProgramResult result = expectExit(0, planarMap(arguments));
    EXPECT_NE("", result.out);
    EXPECT_EQ("", result.err);
  }
}

TEST_F(Commands, MisspeltCommandsAndOptionsGetAProposal) {
  expectExit(2, planarMap({"simlate", "corridor"}), "did you mean 'simulate'?");
  expectExit(2, planarMap({"run", "room.pcd", "--ouput", "out"}), "did you mean '--output'?");
  const ProgramResult with_value = planarMap({"simulate", "corridor", "-o", "x", "--fames=3"});
  expectOneSentence(with_value, "did you mean '--frames'?");
  expectExit(2, planarMap({"xyzzyplugh"}), "see planar_map --help");
}

TEST_F(Commands, HelpHasExamplesThatParse) {
  const std::string all = planarMap({"--help"}).out;
  for (const std::string command :
       {"run", "frontend", "keys", "validate", "config", "stages", "info", "query", "convert",
        "merge", "compare", "simulate", "evaluate"}) {
    EXPECT_NE(std::string::npos, all.find("\n  " + command)) << command;
    std::istringstream lines(planarMap({command, "--help"}).out);
    std::size_t examples = 0;
    const std::string start = "  planar_map ";
    for (std::string line; std::getline(lines, line);) {
      if (line.compare(0, start.size(), start) != 0) continue;
      ++examples;
      std::istringstream words(line.substr(start.size()));
      std::vector<std::string> arguments;
      for (std::string word; words >> word;) arguments.push_back(word);
      EXPECT_EQ(command, arguments.front());
      // Inputs are missing here, but every word is known.
      ProgramOptions options;
      options.directory = directory_.path();
      if (command == "keys" || command == "simulate" || command == "evaluate") continue;
      EXPECT_NE(2, planarMap(arguments, options).exit_code) << line;
    }
    EXPECT_GE(examples, 1u) << command;
  }
}

TEST_F(Commands, UsageErrorsAreCodeTwo) {
  const std::string yaml = config("single_pcd.yaml");
  const std::vector<std::vector<std::string>> wrong = {
      {"run"},
      {"run", yaml, "--nonsense"},
      {"run", yaml, "-j", "-1"},
      {"run", yaml, "--checkpoint", "nan"},
      {"run", yaml, "--seed", "1e23"},
      {"simulate", "room", "--seed", "-1"},
      {"simulate", "room", "--seed", "1e23"},
      {"simulate", "room", "-o", "x", "--write", "0"},
      {"simulate", "room", "-o", "x", "--path", "1"},
      {"simulate", "room", "-o", "x", "--yaw-deg", "1e9"},
      {"run", "--watch", ".", "--idle", "nan"},
      {"nonsense"},
      {"run", yaml, "--profile", "papr"},
      {"run", yaml, "--progress", "maybe"},
      {"run", yaml, "--force", "--resume"}};
  for (const auto& arguments : wrong) {
    const ProgramResult result = planarMap(arguments);
    EXPECT_EQ(2, result.exit_code) << arguments.back();
    EXPECT_EQ("", result.out);
    EXPECT_EQ(1, std::count(result.err.begin(), result.err.end(), '\n')) << result.err;
  }
}

TEST_F(Commands, ReadyConfigurationsAreFoundByNameUnlessThereIsAFileOfThatName) {
  const std::string cloud = room();
  ProgramOptions here;
  here.directory = directory_ / "";
  const std::vector<std::string> run = {"run", "single_pcd.yaml", "-i", cloud, "-o", "out", "-q"};
  expectExit(0, planarMap(run, here));
  EXPECT_TRUE(exists("out/map.pmap"));
  write("single_pcd.yaml", "version: 1\n");
  const ProgramResult own = expectExit(3, planarMap(run, here));
  EXPECT_EQ(0u, own.err.find("single_pcd.yaml:1:1: ")) << own.err;
  const ProgramResult none = expectExit(3, planarMap({"validate", "single_pdc.yaml"}, here));
  EXPECT_NE(std::string::npos, none.err.find("there is no such file; ready: ")) << none.err;
  EXPECT_NE(std::string::npos, none.err.find(", single_pcd.yaml")) << none.err;
}

}  // namespace
}  // namespace planar_mapping
