// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Images that belong together by a number in their names.
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

}  // namespace
}  // namespace planar_mapping::io
