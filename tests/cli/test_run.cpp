// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "cli_fixture.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

class Run : public CliTest {
 protected:
  /// Three clouds of one room, the sensor moved along x; poses in poses.txt.
  std::string sequence() const {
    std::string poses;
    for (int i = 0; i < 3; ++i) {
      std::vector<float> xyz = roomPoints(20000, static_cast<std::uint64_t>(i));
      const float x = 0.2f * static_cast<float>(i);
      for (std::size_t k = 0; k < xyz.size(); k += 3) xyz[k] -= x;
      write("seq/clouds/" + std::to_string(i) + ".pcd", binaryPcd(xyz));
      poses += std::to_string(i) + " " + std::to_string(x) + " 0 0 0 0 0 1\n";
    }
    write("seq/poses.txt", poses);
    return directory_ / "seq";
  }
  ProgramResult runSequence(const std::string& output,
                            const std::vector<std::string>& more = {}) const {
    return planarMap(joined(
        {"run", config("pcd_sequence.yaml"), "-i", sequence(), "-o", directory_ / output, "-q"},
        more));
  }
};

TEST_F(Run, LeavesTheFilesItPromises) {
  ASSERT_EQ(0, runOn(room()).exit_code);
  EXPECT_EQ((std::vector<std::string>{"config.resolved.yaml", "frames.csv", "map.json", "map.pmap",
                                      "metrics.json", "run.log", "trajectory_tum.txt"}),
            list("out"));
}

TEST_F(Run, MetricsHaveEveryPromisedKeyAndAddUp) {
  ASSERT_EQ(0, runOn(room()).exit_code);
  const Json metrics = Json::parse(read("out/metrics.json"));
  EXPECT_EQ(1, metrics["frames"]);
  const Json& points = metrics["points"];
  EXPECT_EQ(20000, points["input"]);
  EXPECT_EQ(20000, points["valid"]);
  EXPECT_EQ(points["valid"], points["ground"].get<int>() + points["planar"].get<int>() +
                                 points["non_planar"].get<int>() + points["rejected"].get<int>());
  EXPECT_GE(metrics["planes"], 4);
  const Json& cuboids = metrics["cuboids"];
  EXPECT_EQ(cuboids["total"], cuboids["planar"].get<int>() + cuboids["non_planar"].get<int>());
  EXPECT_GT(cuboids["total"], 0);
  EXPECT_GT(metrics["standard_cells"], 500);
  EXPECT_NEAR(metrics["combination_efficiency"].get<double>(),
              1.0 - cuboids["total"].get<double>() / metrics["standard_cells"].get<double>(),
              1e-12);
  EXPECT_GT(metrics["coverage"], 0.9);
  EXPECT_LE(metrics["coverage"], 1.0);
  EXPECT_GE(metrics["unknown_cells"], 0);
  EXPECT_GT(metrics["memory_bytes"], 0);
  EXPECT_EQ(read("out/map.pmap").size(), metrics["file_bytes"]);
  for (const char* stage : {"multi_plane_segmentation", "planar_cuboid_approximation", "frame"}) {
    for (const char* figure : {"median", "p95", "total"})
      EXPECT_GT(metrics["time_ms"][stage][figure], 0.0) << stage << figure;
  }
  EXPECT_EQ(12345, metrics["seed"]);
  EXPECT_EQ(std::max(1u, std::thread::hardware_concurrency()), metrics["threads"]);
  EXPECT_TRUE(metrics["version"].is_string());
}

TEST_F(Run, AnyNumberOfThreadsGivesTheSameMap) {
  ASSERT_EQ(0, runSequence("one", {"-j", "1"}).exit_code);
  ASSERT_EQ(0, runSequence("four", {"-j", "4"}).exit_code);
  EXPECT_EQ(read("one/map.pmap"), read("four/map.pmap"));
  EXPECT_EQ(read("one/map.json"), read("four/map.json"));
}

TEST_F(Run, ResolvedConfigurationGivesTheSameMap) {
  ASSERT_EQ(0, runSequence("first", {"--seed", "7", "--frames", "0:3:2"}).exit_code);
  const ProgramResult again =
      expectExit(0, planarMap({"run", directory_ / "first/config.resolved.yaml", "-o",
                               directory_ / "again", "-q"}));
  EXPECT_EQ(read("first/map.pmap"), read("again/map.pmap"));
  EXPECT_EQ(read("first/config.resolved.yaml"), read("again/config.resolved.yaml"));
}

TEST_F(Run, ResolvedConfigurationHasNoAutoLeft) {
  ASSERT_EQ(0, runOn(room()).exit_code);
  // The first stage is off, its values stay for --set ground_removal.enabled=true.
  const std::string resolved = read("out/config.resolved.yaml");
  const std::size_t planes = resolved.find("multi_plane_segmentation");
  ASSERT_NE(std::string::npos, planes) << resolved;
  EXPECT_EQ(std::string::npos, resolved.find(": auto\n", planes)) << resolved;
}

TEST_F(Run, FramesSelectsAndCountsRows) {
  ASSERT_EQ(0, runSequence("out", {"--frames", "1:3"}).exit_code);
  const std::string csv = read("out/frames.csv");
  EXPECT_EQ(3, std::count(csv.begin(), csv.end(), '\n'));
  EXPECT_NE(std::string::npos, csv.find("\n1,"));
  EXPECT_NE(std::string::npos, csv.find("\n2,"));
  const std::string trajectory = read("out/trajectory_tum.txt");
  double timestamp = 0.0;
  double x = 0.0;
  ASSERT_EQ(2,
            std::sscanf(trajectory.c_str() + trajectory.find("\n2 "), " %lf %lf", &timestamp, &x))
      << trajectory;
  EXPECT_NEAR(0.4, x, 0.5 / 4096.0);  // positions are kept in 1/4096 m
  ASSERT_EQ(0, runSequence("one", {"--frames", "1:3:9223372036854775807"}).exit_code);
  const std::string one = read("one/frames.csv");
  EXPECT_EQ(2, std::count(one.begin(), one.end(), '\n'));
  const ProgramResult none = expectExit(4, runSequence("none", {"--frames", "7:9"}), "3 frames");
  expectExit(2, runSequence("none", {"--frames", "3:1"}));
}

TEST_F(Run, DirectoryOfCloudsEqualsItsFiles) {
  sequence();
  const std::string clouds = directory_ / "seq/clouds";
  const std::string poses = directory_ / "seq/poses.txt";
  const std::vector<std::string> tail = {"--poses", poses, "-q", "-o"};
  std::vector<std::string> folder = {"run", config("pcd_sequence.yaml"), "-i", clouds};
  std::vector<std::string> files = {"run",
                                    config("pcd_sequence.yaml"),
                                    "-i",
                                    clouds + "/0.pcd",
                                    clouds + "/1.pcd",
                                    clouds + "/2.pcd"};
  for (auto* arguments : {&folder, &files}) {
    arguments->insert(arguments->end(), tail.begin(), tail.end());
    arguments->push_back(directory_ / (arguments == &folder ? "a" : "b"));
    ASSERT_EQ(0, planarMap(*arguments).exit_code);
  }
  EXPECT_EQ(read("a/map.pmap"), read("b/map.pmap"));
}

TEST_F(Run, AutomaticLengthsFollowTheResolutionThatIsSet) {
  expectExit(0, runOn(room(), {"--set", "planar_cuboid_approximation.resolution_m=0.3"}));
  const std::string yaml = read("out/config.resolved.yaml");
  EXPECT_NE(std::string::npos, yaml.find("distance_threshold_m: 0.15\n")) << yaml;
}

TEST_F(Run, SetAndProfileChangeWhatIsUsed) {
  ASSERT_EQ(0, runOn(room(), {"--set", "planar_cuboid_approximation.resolution_m=0.2", "--set",
                              "planar_cuboid_approximation.association_angle_deg=3.7", "--profile",
                              "paper", "--seed", "2147483648"})
                   .exit_code);
  const std::string yaml = read("out/config.resolved.yaml");
  EXPECT_NE(std::string::npos, yaml.find("profile: paper\n"));
  EXPECT_NE(std::string::npos, yaml.find("seed: 2147483648\n"));
  EXPECT_NE(std::string::npos, yaml.find("resolution_m: 0.2\n"));
  EXPECT_NE(std::string::npos, yaml.find("association_angle_deg: 3.7\n"));
  EXPECT_NE(std::string::npos, yaml.find("method: multi_ransac\n"));
}

TEST_F(Run, ClouldOfMillimetresHasTheSameShape) {
  std::vector<float> xyz = roomPoints(20000);
  ASSERT_EQ(0, runOn(write("m.pcd", binaryPcd(xyz))).exit_code);
  const Json metres = Json::parse(read("out/metrics.json"));
  for (float& value : xyz) value *= 1000.0f;
  ASSERT_EQ(0, runOn(write("mm.pcd", binaryPcd(xyz)), {"--force"}).exit_code);
  const Json millimetres = Json::parse(read("out/metrics.json"));
  EXPECT_EQ(metres["planes"], millimetres["planes"]);
  EXPECT_NEAR(millimetres["resolution_m"].get<double>(),
              1000.0 * metres["resolution_m"].get<double>(), 1e-9);
  EXPECT_NEAR(millimetres["standard_cells"].get<double>(), metres["standard_cells"].get<double>(),
              0.02 * metres["standard_cells"].get<double>());
}

TEST_F(Run, ProgressIsSilentWithoutATerminalAndSpeaksJsonOnRequest) {
  const std::string cloud = room();
  const ProgramResult silent =
      planarMap({"run", config("single_pcd.yaml"), "-i", cloud, "-o", directory_ / "a"});
  EXPECT_EQ("", silent.err);
  EXPECT_NE(std::string::npos, silent.out.find("map.pmap"));
  const ProgramResult spoken = planarMap({"run", config("single_pcd.yaml"), "-i", cloud, "-o",
                                          directory_ / "b", "--progress", "jsonl", "--json"});
  const Json line = Json::parse(spoken.err);
  EXPECT_EQ(1, line["done"]);
  EXPECT_EQ(1, line["frames"]);
  EXPECT_EQ(read("b/metrics.json"), spoken.out);
}

TEST_F(Run, WorksFromAnyDirectoryWithRelativePaths) {
  room();
  std::filesystem::create_directory(directory_ / "below");
  ProgramOptions options;
  options.directory = directory_ / "below";
  expectExit(
      0, planarMap({"run", config("single_pcd.yaml"), "-i", "../room.pcd", "-o", "results", "-q"},
                   options));
  EXPECT_TRUE(exists("below/results/map.pmap"));
}

TEST_F(Run, InputsOfTheFileAreRelativeToIt) {
  room("data/room.pcd");
  const std::string yaml = write("data/mine.yaml",
                                 "version: 1\ninputs: [room.pcd]\nstages:\n"
                                 "  - stage: multi_plane_segmentation\n"
                                 "  - stage: planar_cuboid_approximation\n");
  expectExit(0, planarMap({"run", yaml, "-o", directory_ / "out", "-q"}));
}

TEST_F(Run, ThreeHundredThousandPointsTakeWellUnderASecond) {
  const std::string cloud = write("big.pcd", binaryPcd(roomPoints(300000)));
  const ProgramResult result = expectExit(0, runOn(cloud));
  RecordProperty("seconds", std::to_string(result.seconds));
  // The aim is 0.4 s; sanitizers and busy machines get room.
  EXPECT_LT(result.seconds, 8.0);
}

TEST_F(Run, SaysHowMuchOfThePointsTheMapCovers) {
  const std::string cloud = room();
  const ProgramResult usual =
      expectExit(0, planarMap({"run", cloud, "-o", directory_ / "out", "-q", "--json"}));
  ASSERT_GT(Json::parse(usual.out)["coverage"].get<double>(), 0.95);
  const ProgramResult good = planarMap({"run", cloud, "-o", directory_ / "good"});
  EXPECT_NE(std::string::npos, good.out.find("% of the points lie in a cuboid")) << good.out;
  EXPECT_EQ(std::string::npos, good.out.find("most of the others")) << good.out;
  const ProgramResult few = planarMap({"run", cloud, "-o", directory_ / "few", "--set",
                                       "planar_cuboid_approximation.min_points_per_cell=60"});
  EXPECT_NE(std::string::npos, few.out.find("too few points")) << few.out;
  EXPECT_NE(std::string::npos,
            few.out.find("--set planar_cuboid_approximation.min_points_per_cell=30"))
      << few.out;
}

TEST_F(Run, ProgressHasTheSecondsLeft) {
  const ProgramResult result = expectExit(0, runSequence("out", {"--progress", "jsonl"}));
  std::istringstream lines(result.err);
  std::vector<Json> reports;
  for (std::string line; std::getline(lines, line);) reports.push_back(Json::parse(line));
  ASSERT_EQ(3u, reports.size());
  EXPECT_TRUE(reports[0]["seconds_left"].is_null());  // nothing tells yet
  EXPECT_GT(reports[1]["seconds_left"], 0.0);
  EXPECT_EQ(0.0, reports[2]["seconds_left"]);
}

TEST_F(Run, WithoutPlanesItSaysWhereThePointsWent) {
  const auto run = [&](double farthest, const char* planes) {
    const std::string yaml =
        write("few.yaml", "version: 1\nstages:\n  - stage: pass_through\n    axis: x\n    max_m: " +
                              std::to_string(farthest) +
                              "\n  - stage: multi_plane_segmentation\n    min_inliers: " + planes +
                              "\n  - stage: planar_cuboid_approximation\n");
    return planarMap({"run", yaml, "-i", room(), "-o", directory_ / "few", "-q", "--force"}).err;
  };
  EXPECT_NE(run(100.0, "1000000").find("min_inliers=500000 finds smaller ones"), std::string::npos);
  const std::string few = run(1.0, "1000000");
  EXPECT_NE(few.find("--set pass_through.max_m=2 keeps more"), std::string::npos) << few;
}

TEST_F(Run, CloudInMillimetresGetsASentence) {
  std::vector<float> xyz = roomPoints(5000);
  for (float& v : xyz) v *= 1000.0f;
  const ProgramResult result = expectExit(
      0, planarMap({"run", write("mm.pcd", binaryPcd(xyz)), "-o", directory_ / "out", "-q"}));
  expectOneSentence(result, "if they are in millimetres: --scale 0.001");
}

TEST_F(Run, MergedCloudMakesNoFreeOrUnknownSpaceUnlessTold) {
  std::vector<float> xyz = roomPoints(20000);
  const std::size_t one = xyz.size();
  for (std::size_t i = 0; i < one; i += 3)
    xyz.insert(xyz.end(), {-2.0f * xyz[i], -2.0f * xyz[i + 1], xyz[i + 2]});
  for (std::size_t i = 0; i < one; i += 3)
    xyz.insert(xyz.end(), {xyz[i] + 3.0f, xyz[i + 1], 2.0f * xyz[i + 2]});
  const std::string cloud = write("merged.pcd", binaryPcd(xyz));
  const ProgramResult result =
      expectExit(0, planarMap({"run", cloud, "-o", directory_ / "out", "-q"}));
  expectOneSentence(result, "taken as merged of many scans");
  EXPECT_NE(std::string::npos, read("out/config.resolved.yaml").find("unknown_space: \"false\""));
  const ProgramResult told =
      expectExit(0, planarMap({"run", cloud, "-o", directory_ / "told", "-q", "--set",
                               "planar_cuboid_approximation.unknown_space=true"}));
  EXPECT_NE(std::string::npos, read("told/config.resolved.yaml").find("unknown_space: \"true\""));
  const ProgramResult two = expectExit(0, planarMap({"run", config("single_pcd.yaml"), "-i", room(),
                                                     room(), "-o", directory_ / "two", "-q"}));
  expectOneSentence(two, "are taken to be seen from the same place");
  const ProgramResult single = planarMap({"run", room(), "-o", directory_ / "single", "-q"});
  EXPECT_EQ("", single.err);
  EXPECT_NE(std::string::npos, read("single/run.log").find("no VIEWPOINT"));
  EXPECT_NE(std::string::npos, read("single/config.resolved.yaml").find("unknown_space: \"true\""));
}

TEST_F(Run, MapsOfFoundPosesHaveAFrameOfTheirOwnWhichOthersAreToldOf) {
  ASSERT_EQ(0, runSequence("given").exit_code);
  ASSERT_EQ(0, runSequence("found", {"--set", "motion_estimation.enabled=true"}).exit_code);
  const std::string given = directory_ / "given/map.pmap", found = directory_ / "found/map.pmap";
  EXPECT_EQ("its own (poses were found)",
            Json::parse(planarMap({"info", found, "--json"}).out)["frame"]);
  const std::string sentence = "where " + found + " lies to " + given + " is not known";
  const std::string merged = directory_ / "merged.pmap";
  EXPECT_NE(std::string::npos, planarMap({"compare", given, found}).err.find(sentence));
  EXPECT_NE(std::string::npos,
            planarMap({"merge", given, found, "-o", merged}).err.find(sentence + "; --poses"));
  const std::string poses = write("two.txt", "0 0 0 0 0 0 0 1\n1 0 0 -0.37 0 0 0 1\n");
  EXPECT_EQ("", planarMap({"merge", given, found, "-o", merged, "--force", "--poses", poses}).err);
  EXPECT_EQ("", planarMap({"compare", given, given}).err);
  EXPECT_EQ("", planarMap({"compare", found, found}).err);
}

TEST_F(Run, AssumedPosesAreNothingToCompareFoundOnesWith) {
  const std::vector<float> xyz = roomPoints(20000);
  std::vector<float> moved = xyz;
  for (std::size_t k = 0; k < moved.size(); k += 3) moved[k] -= 0.3f;
  const std::string first = write("a.pcd", binaryPcd(xyz));
  const std::string second = write("b.pcd", binaryPcd(moved));
  const std::string poses = write("poses.txt", "0 0 0 0 0 0 0 1\n1 0.3 0 0 0 0 0 1\n");
  for (const bool given : {false, true}) {
    std::vector<std::string> arguments = {"run",
                                          config("pcd_sequence.yaml"),
                                          "-i",
                                          first,
                                          second,
                                          "-o",
                                          directory_ / "out",
                                          "-q",
                                          "--force",
                                          "--set",
                                          "motion_estimation.enabled=true"};
    if (given) arguments.insert(arguments.end(), {"--poses", poses});
    expectExit(0, planarMap(arguments));
    const Json metrics = Json::parse(read("out/metrics.json"));
    EXPECT_EQ(0, metrics["frames_skipped"]);
    EXPECT_EQ(given, !metrics["motion_error"].is_null()) << metrics["motion_error"];
  }
}

TEST_F(Run, InfoHasFrameUpAxisAndRange) {
  ASSERT_EQ(0, runSequence("out").exit_code);
  const Json info = Json::parse(planarMap({"info", directory_ / "out/map.pmap", "--json"}).out);
  EXPECT_EQ("of the first frame", info["frame"]);
  EXPECT_EQ(Json({0.0, 0.0, 1.0}), info["up"]);
  EXPECT_GT(info["max_range_m"], 1.0);
  EXPECT_LT(info["bounds_m"]["low"][0], info["bounds_m"]["high"][0]);
}

/// A road 40 m long in 32 rings, 1.8 m below the scanner, between two walls, and a box on it.
std::vector<float> roadScan() {
  Random random(7);
  std::vector<float> xyz;
  for (int ring = 0; ring < 32; ++ring) {
    for (int column = 0; column < 1200; ++column) {
      const double up = (-24.0 + 0.85 * ring) * M_PI / 180.0, around = column * M_PI / 600.0;
      const Vector3 ray(std::cos(up) * std::cos(around), std::cos(up) * std::sin(around),
                        std::sin(up));
      double range = std::min(6.0 / std::abs(ray.y()), ray.z() < 0.0 ? 1.8 / -ray.z() : 60.0);
      const double at_box = 9.0 / ray.x();
      if (at_box > 0.0 && std::abs(at_box * ray.y()) < 0.5 && at_box * ray.z() < -1.3)
        range = std::min(range, at_box);
      if (range > 40.0) continue;
      const Vector3 p = (range + 0.015 * random.normal()) * ray;
      for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
    }
  }
  return xyz;
}

TEST_F(Run, LidarConfigurationTakesTheRoadAwayAndKeepsWhatStandsOnIt) {
  const std::vector<float> xyz = roadScan();
  write("scan.pcd", binaryPcd(xyz));
  expectExit(0, planarMap({"run", config("lidar.yaml"), "-i", directory_ / "scan.pcd", "-o",
                           directory_ / "road", "-q"}));
  int far_road = 0;
  for (std::size_t k = 0; k < xyz.size(); k += 3)
    far_road += xyz[k + 2] < -1.7f && std::hypot(xyz[k], xyz[k + 1]) > 20.0f ? 1 : 0;
  ASSERT_GT(far_road, 100);
  const Json map = Json::parse(read("road/map.json"));
  double far_cuboids = 0.0, on_box = 0.0;
  for (const Json& cuboid : map["cuboids"]) {
    if (cuboid["state"] != "occupied") continue;
    const double x = cuboid["center"][0], y = cuboid["center"][1], z = cuboid["center"][2];
    far_cuboids += std::abs(y) < 5.0 && std::abs(x) > 20.0 ? 1.0 : 0.0;
    on_box += std::abs(y) < 0.7 && std::abs(x - 9.0) < 0.5 && z < -1.2 ? 1.0 : 0.0;
  }
  EXPECT_LE(far_cuboids, 2.0);
  EXPECT_GE(on_box, 1.0);
}

TEST_F(Run, EveryReadyConfigurationTakesTheGroundAwayWhereItIsAsked) {
  for (const char* name : {"single_pcd.yaml", "pcd_sequence.yaml", "lidar.yaml", "rgbd_indoor.yaml",
                           "stereo_indoor.yaml", "stereo_outdoor.yaml", "evaluate.yaml"})
    expectExit(0, planarMap({"validate", config(name), "--set", "ground_removal.enabled=true"}));
  const std::string scan = write("scan.pcd", binaryPcd(roadScan()));
  for (const char* name : {"single_pcd.yaml", "pcd_sequence.yaml"}) {
    expectExit(0, planarMap({"run", config(name), "-i", scan, "-o", directory_ / "on", "--force",
                             "-q", "--set", "ground_removal.enabled=true"}));
    const Json points = Json::parse(read("on/metrics.json"))["points"];
    EXPECT_GT(points["ground"].get<double>(), 0.2 * points["valid"].get<double>()) << name;
  }
}

TEST_F(Run, UpIsThatOfTheCommandLineForAllStages) {
  const auto upWith = [&](const std::string& up) {
    expectExit(0, planarMap({"run", config("single_pcd.yaml"), "-i", room(), "-o",
                             directory_ / "up", "--force", "-q", "--up", up}));
    return Json::parse(read("up/map.json"))["up"];
  };
  EXPECT_EQ(Json({0.0, 0.0, 1.0}), upWith("auto"));
  EXPECT_EQ(Json({0.0, 1.0, 0.0}), upWith("y"));
  EXPECT_NE(std::string::npos, read("up/config.resolved.yaml").find("\nup: y\n"));
  expectExit(2, planarMap({"run", config("single_pcd.yaml"), "-i", room(), "--up", "w"}));
}

}  // namespace
}  // namespace planar_mapping
