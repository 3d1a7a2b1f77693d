// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Images that belong together by a number in their names, layouts that are made of such names, and
// what is said of images that are laid out otherwise.

#include "layout_folders.h"

namespace planar_mapping::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDepthCamera =
    "image_width: 4\nimage_height: 3\nfx: 2\nfy: 2\ncx: 1.5\ncy: 1\ndepth_scale: 1000\n";
constexpr const char* kPairCamera =
    "image_width: 4\nimage_height: 3\nfx: 2\nfy: 2\ncx: 1.5\ncy: 1\nbaseline_m: 0.1\n";

std::string partnerOf(const Sequence& sequence, std::size_t index) {
  return fs::path(sequence.files(index).at(1)).filename().string();
}

TEST_F(LayoutFolders, NumbersInNamesPairImagesAndSayWhatHasNoPartner) {
  write("nn/calib.yaml", kDepthCamera);
  for (const char* i : {"0", "1", "2", "3", "5"})
    depth(std::string("nn/depth/depth0") + i + ".png");
  for (const char* i : {"0", "2", "3", "4", "5"})
    image(std::string("nn/image/image0") + i + ".png");
  write("nn/trajectory.log", "2 2 3\n1 0 0 7\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  SequenceOptions options;
  options.ignore_poses = true;
  const Sequence sequence({dir_ / "nn"}, options);
  ASSERT_EQ(4u, sequence.size());
  EXPECT_EQ("depth02.png", sequence.describe(1).name);
  EXPECT_EQ("image02.png", partnerOf(sequence, 1));
  EXPECT_EQ("image05.png", partnerOf(sequence, 3));
  ASSERT_TRUE(sequence.describe(1).T_world_sensor.has_value());  // counted among all depth images
  ASSERT_EQ(2u, sequence.notes().size());
  EXPECT_NE(std::string::npos, sequence.notes()[0].find("1 of 5 depth images are left out"));
  EXPECT_NE(std::string::npos, sequence.notes()[1].find("1 of 5 colour images are left out"));
  // So does a file of poses that is given.
  std::string poses;
  for (const char* x : {"0", "1", "2", "3", "4"})
    poses += std::string("1 0 0 ") + x + " 0 1 0 0 0 0 1 0\n";
  options = SequenceOptions();
  options.poses_file = write("poses.txt", poses);
  const Sequence posed({dir_ / "nn"}, options);
  ASSERT_EQ(4u, posed.size());
  EXPECT_EQ(2.0, posed.describe(1).T_world_sensor->translation().x());
  EXPECT_EQ(4.0, posed.describe(3).T_world_sensor->translation().x());
}

TEST_F(LayoutFolders, NamesThatHoldTimesPairByOrder) {
  write("times/calib.yaml", kDepthCamera);
  for (const char* time : {"10.01", "11.02", "12.03"}) {
    depth(std::string("times/depth/") + time + ".png");
    image(std::string("times/color/") + std::to_string(std::stod(time) + 0.995) + ".png");
  }
  const Sequence sequence({dir_ / "times"});
  ASSERT_EQ(3u, sequence.size());
  EXPECT_EQ("11.005000.png", partnerOf(sequence, 0));
  EXPECT_TRUE(sequence.notes().empty());
}

TEST_F(LayoutFolders, OnePairIsMatchedByTheNumberOfItsFrame) {
  write("one/calib.yaml", kPairCamera);
  image("one/left/cam0_0007.png");
  image("one/right/cam1_0007.png");
  const Sequence sequence({dir_ / "one"});
  ASSERT_EQ(1u, sequence.size());
  EXPECT_EQ("cam1_0007.png", partnerOf(sequence, 0));
}

TEST_F(LayoutFolders, OwnFoldersPairByNumberToo) {
  write("d/calib.yaml", kDepthCamera);
  write("redwood/calib.yaml", kDepthCamera);
  write("lr/calib.yaml", kPairCamera);
  for (const char* i : {"8", "9", "10"}) {
    depth(std::string("d/depth/depth_") + i + ".png");
    image(std::string("d/rgb/rgb_00") + i + ".png");
    depth(std::string("redwood/depth/") + i + "-0005" + i + ".png");
    image(std::string("redwood/rgb/") + i + "-0001" + i + ".png");
    image(std::string("lr/left/left_") + i + ".png");
    image(std::string("lr/right/right_") + i + ".png");
  }
  EXPECT_EQ("rgb_0010.png", partnerOf(Sequence({dir_ / "d"}), 2));
  EXPECT_EQ("9-00019.png", partnerOf(Sequence({dir_ / "redwood"}), 1));
  EXPECT_EQ("right_8.png", partnerOf(Sequence({dir_ / "lr"}), 0));
  EXPECT_FALSE(Sequence({dir_ / "lr"}).read(2).right.empty());
}

TEST_F(LayoutFolders, ReplicaIsReadWithItsCamera) {
  std::string poses;
  for (int i = 0; i < 3; ++i) {
    depth("room0/results/depth" + numbered(i) + ".png");
    image("room0/results/frame" + numbered(i) + ".png");
    poses += "0 -1 0 " + std::to_string(i) + " 1 0 0 0 0 0 1 0 0 0 0 1\n";
  }
  write("room0/traj.txt", poses);
  const std::string folder = dir_ / "room0";
  EXPECT_EQ(600.0, Sequence({folder}).calibration()->camera.fx);
  EXPECT_EQ(1200, Sequence({folder}).calibration()->camera.width);
  write("cam_params.json",
        R"({"camera": {"w": 4, "h": 3, "fx": 2, "fy": 2.5, "cx": 1.5, "cy": 1, "scale": 500}})");
  const Sequence sequence({folder});
  EXPECT_EQ("Replica", sequence.layout());
  EXPECT_EQ(2.5, sequence.calibration()->camera.fy);
  EXPECT_EQ(2.0, sequence.describe(2).T_world_sensor->translation().x());
  EXPECT_EQ(1.0, sequence.describe(2).T_world_sensor->linear()(1, 0));
  EXPECT_NEAR(3.0, sequence.read(0).cloud.xyz[2], 1e-6);
  fs::remove(folder + "/results/depth000000.png");
  EXPECT_EQ(1.0, Sequence({folder}).describe(0).T_world_sensor->translation().x());
  write("room0/traj.txt", poses.substr(0, poses.size() / 3));
  expectProblem(folder, "holds 1 poses, but none of frame 1");
  write("cam_params.json", R"({"camera": {"w": 4}})");
  expectProblem(folder, "needs w, h, fx, fy, cx, cy and scale");
}

TEST_F(LayoutFolders, ADriveOfKittiRawIsRead) {
  for (const char* i : {"0000000000", "0000000001"})
    for (const char* camera : {"image_00", "image_01"})
      image(std::string("day/drive/") + camera + "/data/" + i + ".png");
  write("day/drive/image_00/timestamps.txt",
        "2011-09-26 23:59:59.900000000\n2011-09-27 00:00:00.004000000\n");
  const std::string folder = dir_ / "day/drive";
  expectProblem(folder, "calib_cam_to_cam.txt: no such file, nor one folder up");
  const std::string projections =
      "calib_time: 09-Jan-2012 13:57:47\nP_rect_00: 2 0 1.5 0 0 2 1 0 0 0 1 0\n"
      "P_rect_01: 2 0 1.5 -1 0 2 1 0 0 0 1 0\n";
  write("day/calib_cam_to_cam.txt", projections + "S_rect_00: 4.0e+00 3.0e+00\n");
  const Sequence sequence({folder});
  EXPECT_EQ("KITTI raw (gray)", sequence.layout());
  ASSERT_EQ(2u, sequence.size());
  EXPECT_EQ(0.5, *sequence.calibration()->baseline);
  EXPECT_NEAR(0.104, sequence.describe(1).timestamp - sequence.describe(0).timestamp, 1e-9);
  write("day/calib_cam_to_cam.txt", projections + "S_rect_00: 3.0e+00 3.0e+00\n");
  expectProblem(folder, "take the 'synced+rectified data' of this drive");
  fs::remove_all(folder + "/image_01");
  expectProblem(folder, "without an image pair (image_00/data and image_01/data");
}

/// A cloud cut short by a copy must not vanish from the middle of a sequence.
TEST_F(LayoutFolders, CloudsThatCannotBeReadKeepTheirPlace) {
  const std::string cloud =
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n";
  write("cut/clouds/0.pcd", cloud);
  write("cut/clouds/1.pcd", "");
  write("cut/clouds/2.pcd", cloud);
  write("cut/clouds/notes.txt", "three scans");
  const Sequence sequence({dir_ / "cut"});
  ASSERT_EQ(3u, sequence.size());
  EXPECT_EQ("1.pcd", sequence.describe(1).name);
}

TEST_F(LayoutFolders, ImagesThatLieOtherwiseGetARemedy) {
  image("one/left_0.png");
  image("one/right_0.png");
  expectProblem(dir_ / "one", "left_0.png and right_0.png are a pair");
  write("one/calib.yaml", kPairCamera);
  expectProblem(dir_ / "one", "cut images that show both views side by side into halves");
  write("r3d/metadata", "{}");
  write("r3d/rgbd/0.depth", "bvx");
  expectProblem(dir_ / "r3d", "write them as PNG images of 16 bits");
  image("tartan/image_left/000000_left.png");
  write("tartan/depth_left/000000_left_depth.npy", "");
  expectProblem(dir_ / "tartan", "write depth_left/*.npy (metres) as PNG");
  image("two/left/0.png");
  image("two/right/0.png");
  expectProblem(dir_ / "two", "fx, fy, cx, cy, baseline_m");
  depth("three/depth/0.png");
  image("three/rgb/0.png");
  write("three/poses.txt", "");
  expectProblem(dir_ / "three", "fx, fy, cx, cy, depth_scale");
}

}  // namespace
}  // namespace planar_mapping::io
