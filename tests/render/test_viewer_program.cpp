// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// planar_map_viewer as scripts call it: exit codes and messages of docs/command_line.md.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "map_scene.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/viewer/window/image.h"
#include "scenes.h"
#include "x_server.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

class ViewerProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("viewer_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    io::CloudData cloud;
    cloud.width = 40;
    cloud.height = 30;
    for (int row = 0; row < 30; ++row) {
      for (int column = 0; column < 40; ++column) {
        for (const float v : {0.05f * column, 0.05f * row, 0.01f * column}) cloud.xyz.push_back(v);
      }
    }
    io::writePcd(path("cloud.pcd"), cloud);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  // Runs it in an empty environment but for what is given; returns the exit code.
  int run(const std::string& arguments, const std::string& environment = "") {
    const std::string command = "env -i " + environment + " " + PLANAR_MAPPING_BIN_DIR +
                                "/planar_map_viewer " + arguments + " >" + path("out") + " 2>" +
                                path("err");
    const int status = std::system(command.c_str());
    std::ifstream file(path("err"));
    message_.assign(std::istreambuf_iterator<char>(file), {});
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + status;
  }
  fs::path folder_;
  std::string message_;
};

TEST_F(ViewerProgram, DrawsInAnEmptyEnvironment) {
  EXPECT_EQ(run(path("cloud.pcd") + " --snapshot " + path("a.png") + " --size 320x200"), 0)
      << message_;
  EXPECT_EQ(message_, "");
  EXPECT_EQ(readPng(path("a.png")).width, 320);
}

TEST_F(ViewerProgram, TakesEveryOption) {
  EXPECT_EQ(run(path("cloud.pcd") + " -o " + path("a.png") +
                " --size 320x200 --camera top --camera-position -1,-2,5 --focal-point 1,1,0 "
                "--view-up 0,1,0 --zoom 1.5 --color height --show cloud,axes,ground-grid "
                "--background dark --cutaway none --clip-above -0.5 --up 0,0,1 --point-size 3"),
            0)
      << message_;
}

TEST_F(ViewerProgram, RefusesBadUsage) {
  const std::string cloud = path("cloud.pcd") + " -o " + path("a.png");
  for (const char* bad :
       {"--size 10x10", "--size huge", "--camera isometric", "--color heigth", "--show edges,walls",
        "--zoom 0", "--zoom nan", "--background octarine", "--camera-position 1,2",
        "--camera-position 1,2,x", "--no-such-option", "--threshold 2", "--up 0,0,nan",
        "--up 0,0,0", "--point-size 99", "--cutaway some"}) {
    EXPECT_EQ(run(cloud + " " + bad), 2) << bad << ": " << message_;
    EXPECT_FALSE(message_.empty()) << bad;
    EXPECT_FALSE(fs::exists(path("a.png"))) << bad;
  }
  EXPECT_EQ(run(""), 2);
  EXPECT_EQ(run(path("cloud.pcd") + " --projection-2d"), 2);
  EXPECT_EQ(run("--help"), 0);
  EXPECT_EQ(run("--version"), 0);
}

TEST_F(ViewerProgram, RefusesBadInput) {
  const std::string out = " -o " + path("a.png");
  EXPECT_EQ(run(path("missing.pmap") + out), 4);
  EXPECT_NE(message_.find("missing.pmap"), std::string::npos) << message_;
  EXPECT_EQ(run(folder_.string() + out), 4);
  std::ofstream(path("empty.pmap"));
  EXPECT_EQ(run(path("empty.pmap") + out), 4);
  std::ofstream(path("noise.pmap")) << "this is not a map, whatever its name says, not at all";
  EXPECT_EQ(run(path("noise.pmap") + out), 4);
  EXPECT_EQ(run(path("cloud.pcd") + " " + path("missing.pcd") + out), 4);
  EXPECT_FALSE(fs::exists(path("a.png")));
}

TEST_F(ViewerProgram, SaysThatAnEmptyMapHasNothingToDraw) {
  io::saveMap(PlanarMap(), path("empty.pmap"));
  EXPECT_EQ(run(path("empty.pmap") + " -o " + path("a.png")), 4);
  EXPECT_NE(message_.find("empty"), std::string::npos) << message_;
}

TEST_F(ViewerProgram, DrawsAFinishedMapAsTheMapItCameFrom) {
  PlanarMap map;
  map.insert(test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.0})).frame());
  io::saveMap(map, path("m.pmap"));
  io::saveMap(map.finished(), path("finished.pmap"));
  const std::string view =
      " --size 320x200 --show occupied,unknown --up 0,0,1 --camera-position 3,-4,4"
      " --focal-point 0,2,1 --view-up 0,0,1";
  EXPECT_EQ(run(path("m.pmap") + view + " -o " + path("a.png")), 0) << message_;
  const std::string as_before = " --threshold 0.001 --reference " + path("a.png");
  EXPECT_EQ(run(path("finished.pmap") + view + as_before), 0) << message_;
}

TEST_F(ViewerProgram, OverwritesOnlyWhenForced) {
  const std::string call = path("cloud.pcd") + " --size 320x200 -o " + path("a.png");
  EXPECT_EQ(run(call), 0) << message_;
  EXPECT_EQ(run(call), 2);
  EXPECT_NE(message_.find("--force"), std::string::npos) << message_;
  EXPECT_EQ(run(call + " --force"), 0) << message_;
}

TEST_F(ViewerProgram, APictureThatCannotBeWrittenIsNoInput) {
  for (const std::string& name : {path("none/a.png"), std::string("/proc/sys/a.png")}) {
    EXPECT_EQ(run(path("cloud.pcd") + " -o " + name), 1) << name;
    EXPECT_NE(message_.find(name), std::string::npos) << message_;
  }
}

TEST_F(ViewerProgram, ComparesWithAReference) {
  const std::string call = path("cloud.pcd") + " --size 320x200 ";
  ASSERT_EQ(run(call + "-o " + path("a.png")), 0) << message_;
  EXPECT_EQ(run(call + "--reference " + path("a.png") + " --threshold 0.001"), 0) << message_;
  EXPECT_EQ(run(call + "--camera top --reference " + path("a.png") + " --threshold 0.001"), 6);
  EXPECT_EQ(run(call + "--camera top --reference " + path("a.png") + " --threshold 1"), 0);
  EXPECT_EQ(run(path("cloud.pcd") + " --size 300x200 --reference " + path("a.png")), 6);
  EXPECT_EQ(run(call + "--reference " + path("none.png")), 4);
}

TEST_F(ViewerProgram, SaysWhatToInstallWhereNothingCanDraw) {
  // GLVND finds no EGL driver in an empty list of them.
  const std::string blind = "__EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent.json";
  const std::string call = path("cloud.pcd") + " -o " + path("a.png");
  EXPECT_EQ(run(call, blind), 7) << message_;
  EXPECT_NE(message_.find("libgl1-mesa-dri"), std::string::npos) << message_;
  EXPECT_EQ(run(call, blind + " DISPLAY=:77"), 7) << message_;
  EXPECT_FALSE(fs::exists(path("a.png")));
}

TEST_F(ViewerProgram, FallsBackToTheXServer) {
  const testing::XServer server;
  if (!server.running()) GTEST_SKIP() << "no Xvfb (package xvfb)";
  EXPECT_EQ(run(path("cloud.pcd") + " --size 320x200 -o " + path("a.png"),
                "__EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent.json DISPLAY=" + server.display()),
            0)
      << message_;
}

TEST_F(ViewerProgram, OpensNoWindowWithoutADisplay) {
  for (const char* environment : {"", "DISPLAY=:77", "DISPLAY=nonsense"}) {
    EXPECT_EQ(run(path("cloud.pcd"), environment), 7) << message_;
    EXPECT_NE(message_.find("--snapshot"), std::string::npos) << message_;
  }
}

TEST_F(ViewerProgram, SaysNoToOtherKindsOfPictures) {
  for (const char* name : {"a.jpg", "a.JPEG", "a.tif"}) {
    EXPECT_EQ(run(path("cloud.pcd") + " -o " + path(name)), 2) << name;
    EXPECT_NE(message_.find("pictures are PNG files"), std::string::npos) << message_;
    EXPECT_FALSE(fs::exists(path(name)));
  }
}

TEST_F(ViewerProgram, ProposesTheOptionThatWasMeant) {
  EXPECT_EQ(run(path("cloud.pcd") + " -o " + path("a.png") + " --colour height"), 2);
  EXPECT_NE(message_.find("did you mean '--color'?"), std::string::npos) << message_;
}

TEST_F(ViewerProgram, FollowsAMapThatIsNotThereYet) {
  EXPECT_EQ(run(path("cloud.pcd") + " --follow -o " + path("a.png")), 2);
  EXPECT_NE(message_.find("--follow is for windows"), std::string::npos) << message_;
  const testing::XServer server;
  if (!server.running()) GTEST_SKIP() << "no Xvfb (package xvfb)";
  std::thread writer([this]() {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    PlanarMap map;
    map.insert(test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.0})).frame());
    io::saveMap(map, path("late.pmap"));
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    std::ofstream(path("late.pmap")) << "half a map";
  });
  const std::string command = "timeout 4 env -i DISPLAY=" + server.display() + " " +
                              PLANAR_MAPPING_BIN_DIR + "/planar_map_viewer --follow " +
                              path("late.pmap") + " >" + path("out") + " 2>" + path("err");
  const int status = std::system(command.c_str());
  writer.join();
  EXPECT_EQ(WEXITSTATUS(status), 124) << "it is at work until it is ended";
  std::ifstream file(path("err"));
  message_.assign(std::istreambuf_iterator<char>(file), {});
  EXPECT_NE(message_.find("waiting for"), std::string::npos) << message_;
}

}  // namespace
}  // namespace planar_mapping
