// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Cloud files, directories of them and our own sequence folders.
#include "planar_mapping/io/layouts/sequence.h"

#include "layout_folders.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping::io {
namespace {

namespace fs = std::filesystem;

/// A cloud of 4 x 3 equal points, seen from a place along x.
std::string cloudAt(const std::string& x) {
  std::string text =
      "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nWIDTH 4\nHEIGHT 3\n"
      "VIEWPOINT " +
      x + " 0 0 1 0 0 0\nPOINTS 12\nDATA ascii\n";
  for (int i = 0; i < 12; ++i) text += x + " " + x + " " + x + " 1122867\n";
  return text;
}

/// Times 10, 11 ..., along z.
std::string posesOf(int count) {
  std::string text;
  for (int i = 0; i < count; ++i)
    text += std::to_string(10 + i) + " 0 0 " + std::to_string(i) + " 0 0 0 1\n";
  return text;
}

const Files kScans = {{"scans/b.pcd", cloudAt("2")},
                      {"scans/a.pcd", cloudAt("1")},
                      {"scans/c.pcd", cloudAt("3")},
                      {"scans/readme.txt", "not a cloud"}};
const Files kClouds = {{"run/clouds/b.pcd", cloudAt("2")},
                       {"run/clouds/a.pcd", cloudAt("1")},
                       {"run/poses.txt", posesOf(2)},
                       {"run/calib.yaml", kDepthCamera}};
const Files kRgbd = {{"rgbd/depth/1.png", "@depth"},
                     {"rgbd/depth/0.png", "@depth"},
                     {"rgbd/rgb/1.png", "@image"},
                     {"rgbd/rgb/0.png", "@image"},
                     {"rgbd/calib.yaml", kDepthCamera}};
const Files kPairs = {{"pairs/left/1.png", "@image"},
                      {"pairs/left/0.png", "@image"},
                      {"pairs/right/1.png", "@image"},
                      {"pairs/right/0.png", "@image"},
                      {"pairs/calib.yaml", kPairCamera}};

class SequenceInputs : public LayoutFolders {
 protected:
  void addImage(const std::string& name, int width, int height, std::uint8_t value) const {
    const auto pixels = static_cast<std::size_t>(width * height);
    writeImage(path(name), Image{width, height, 1, std::vector<std::uint8_t>(pixels, value)},
               Overwrite::Allow);
  }
  std::string partnerOf(const std::string& folder, std::size_t index) const {
    return fs::path(Sequence({path(folder)}).files(index).at(1)).filename().string();
  }
};

TEST_F(SequenceInputs, DirectoryOfCloudsIsReadInNameOrderWithViewpoints) {
  add(kScans);
  const Sequence sequence({path("scans")});
  EXPECT_EQ(sequence.kind(), SequenceKind::Clouds);
  EXPECT_EQ(sequence.poseSource(), PoseSource::Viewpoint);
  ASSERT_EQ(sequence.size(), 3u);
  const char* const names[] = {"a.pcd", "b.pcd", "c.pcd"};
  for (std::size_t i = 0; i < 3; ++i) {
    const Frame frame = sequence.read(i);
    EXPECT_EQ(frame.index, i);
    EXPECT_EQ(frame.name, names[i]);
    EXPECT_EQ(frame.timestamp, static_cast<double>(i));
    EXPECT_EQ(frame.cloud.xyz[0], static_cast<float>(i + 1));
    ASSERT_TRUE(frame.T_world_sensor);
    EXPECT_EQ(frame.T_world_sensor->translation().x(), static_cast<double>(i + 1));
    EXPECT_FALSE(frame.camera);
  }
  EXPECT_THROW(sequence.read(3), InputError);
  EXPECT_THROW(sequence.path(3), InputError);
  EXPECT_THROW(sequence.describe(3), InputError);
  EXPECT_THROW(Sequence(std::vector<std::string>{}), InputError);
}

TEST_F(SequenceInputs, NumbersInNamesAreInTheOrderOfTheirValues) {
  const std::vector<std::string> in_order = {"1.25",   "1.5",     "2",        "007", "10",
                                             "scan_2", "scan_10", "scan_011", "t.2", "t.10"};
  for (auto name = in_order.rbegin(); name != in_order.rend(); ++name)
    add({{"scans/" + *name + ".pcd", cloudAt("1")}});
  const std::vector<std::string> images = {"1", "001b", "00001ba", "1bq", "2", "10"};
  for (const std::string& name : images)
    add({{"seq/left/" + name + ".png", "@image"}, {"seq/right/" + name + ".png", "@image"}});
  add({{"seq/calib.yaml", kPairCamera}});
  const Sequence clouds({path("scans")}), pairs({path("seq")});
  ASSERT_EQ(clouds.size(), in_order.size());
  for (std::size_t i = 0; i < in_order.size(); ++i)
    EXPECT_EQ(fs::path(clouds.path(i)).stem(), in_order[i]);
  ASSERT_EQ(pairs.size(), images.size());
  for (std::size_t i = 0; i < images.size(); ++i)
    EXPECT_EQ(fs::path(pairs.path(i)).stem(), images[i]);
}

TEST_F(SequenceInputs, FilesKeepTheOrderGivenAndTakePosesFromAFile) {
  add(kScans + Files{{"poses.txt", posesOf(2)}});
  SequenceOptions options;
  options.poses_file = path("poses.txt");
  const Sequence sequence({path("scans/c.pcd"), path("scans/a.pcd")}, options);
  EXPECT_EQ(sequence.poseSource(), PoseSource::File);
  ASSERT_EQ(sequence.size(), 2u);
  EXPECT_EQ(sequence.read(0).cloud.xyz[0], 3.0f);
  EXPECT_EQ(sequence.read(1).timestamp, 11.0);
  EXPECT_EQ(sequence.read(1).T_world_sensor->translation().z(), 1.0);
  EXPECT_TRUE(sequence.read(0, CloudChannels::none()).cloud.colors.empty());
}

TEST_F(SequenceInputs, FolderOfCloudsTakesItsOwnPosesAndCalibration) {
  add(kClouds);
  const Sequence sequence({path("run")});
  EXPECT_EQ(sequence.poseSource(), PoseSource::File);
  const Frame frame = sequence.read(1);
  EXPECT_EQ(frame.timestamp, 11.0);
  ASSERT_TRUE(frame.camera);
  EXPECT_EQ(frame.camera->fx, 2.0);
  EXPECT_EQ(sequence.calibration()->depth_scale, 1000.0);
  std::string wide = kDepthCamera;  // is no camera of these clouds
  wide.replace(wide.find("image_width: 4"), 14, "image_width: 8");
  add({{"run/calib.yaml", wide}});
  EXPECT_FALSE(Sequence({path("run")}).read(0).camera);
}

TEST_F(SequenceInputs, RgbdFolderGivesOrganizedColouredClouds) {
  add(kRgbd);
  EXPECT_EQ(Sequence({path("rgbd")}).poseSource(), PoseSource::None);
  EXPECT_FALSE(Sequence({path("rgbd")}).read(0).T_world_sensor);
  add({{"rgbd/poses.txt", posesOf(2)}});
  const Sequence sequence({path("rgbd")});
  EXPECT_EQ(sequence.kind(), SequenceKind::Rgbd);
  ASSERT_EQ(sequence.size(), 2u);
  const Frame frame = sequence.read(1);
  EXPECT_EQ(frame.name, "1.png");
  EXPECT_TRUE(frame.cloud.view().isOrganized());
  EXPECT_FLOAT_EQ(frame.cloud.xyz[2], 1.5f);
  EXPECT_FLOAT_EQ(frame.cloud.xyz[0], -1.5f * 1.5f / 2.0f);
  EXPECT_EQ(frame.cloud.colors, std::vector<std::uint32_t>(12, 0x070707));
  EXPECT_EQ(frame.left.pixels, std::vector<std::uint8_t>(12, 7));
  EXPECT_EQ(frame.T_world_sensor->translation().z(), 1.0);
  EXPECT_TRUE(sequence.read(0, CloudChannels::none()).cloud.colors.empty());
  EXPECT_TRUE(sequence.read(0, CloudChannels::none(), false).left.empty());
}

TEST_F(SequenceInputs, StereoFolderGivesPairsWithoutACloud) {
  add(kPairs + Files{{"pairs/poses.txt", posesOf(2)}});
  addImage("pairs/right/1.png", 4, 3, 21);
  const Sequence sequence({path("pairs")});
  EXPECT_EQ(sequence.kind(), SequenceKind::Stereo);
  ASSERT_EQ(sequence.size(), 2u);
  EXPECT_EQ(sequence.path(1), path("pairs/left/1.png"));
  const Frame frame = sequence.read(1);
  EXPECT_EQ(frame.left.pixels, std::vector<std::uint8_t>(12, 7));
  EXPECT_EQ(frame.right.pixels, std::vector<std::uint8_t>(12, 21));
  EXPECT_EQ(frame.cloud.size(), 0u);
  EXPECT_EQ(frame.camera->fx, 2.0);
  EXPECT_EQ(sequence.calibration()->baseline, 0.1);
  EXPECT_EQ(frame.timestamp, 11.0);
  EXPECT_EQ(frame.T_world_sensor->translation().z(), 1.0);
}

TEST_F(SequenceInputs, FrameWithASingleImageKeepsItsPlaceInTheSequence) {
  add(kPairs + Files{{"pairs/poses.txt", posesOf(3)}, {"pairs/left/2.png", "@image"}});
  const Sequence no_right({path("pairs")});
  ASSERT_EQ(no_right.size(), 3u);
  EXPECT_NO_THROW(no_right.read(1));
  EXPECT_EQ(no_right.describe(2).timestamp, 12.0);  // known without its images
  expectProblem(path("pairs"), "2.png: has no right image of the same name");
  add({{"pairs/left/2.png", "@none"}, {"pairs/right/2.png", "@image"}});
  EXPECT_EQ(Sequence({path("pairs")}).size(), 3u);
  expectProblem(path("pairs"), "left/2.png: no such file");
}

TEST_F(SequenceInputs, CloudsThatCannotBeReadKeepTheirPlace) {
  add(kScans + Files{{"scans/b.pcd", ""}});
  const Sequence sequence({path("scans")});
  ASSERT_EQ(3u, sequence.size());
  EXPECT_EQ("b.pcd", sequence.describe(1).name);
}

TEST_F(SequenceInputs, PreferredKindIsTakenOfAFolderWithSeveral) {
  add(kRgbd + Files{{"rgbd/left/0.png", "@image"}, {"rgbd/right/0.png", "@image"}});
  add({{"rgbd/calib.yaml", kDepthCamera + "baseline_m: 0.1\n"}});
  SequenceOptions options;
  EXPECT_EQ(Sequence({path("rgbd")}, options).kind(), SequenceKind::Rgbd);
  options.preferred = SequenceKind::Stereo;
  EXPECT_EQ(Sequence({path("rgbd")}, options).kind(), SequenceKind::Stereo);
  options.preferred = SequenceKind::Clouds;  // there are none
  EXPECT_EQ(Sequence({path("rgbd")}, options).kind(), SequenceKind::Rgbd);
}

TEST_F(SequenceInputs, ImagesArePairedByTheNumbersInTheirNames) {
  add({{"d/calib.yaml", kDepthCamera},
       {"redwood/calib.yaml", kDepthCamera},
       {"lr/calib.yaml", kPairCamera},
       {"one/calib.yaml", kPairCamera},
       {"one/left/cam0_0007.png", "@image"},
       {"one/right/cam1_0007.png", "@image"}});
  for (const std::string i : {"8", "9", "10"}) {
    add({{"d/depth/depth_" + i + ".png", "@depth"},
         {"d/rgb/rgb_00" + i + ".png", "@image"},
         {"redwood/depth/" + i + "-0005" + i + ".png", "@depth"},
         {"redwood/color/" + i + "-0001" + i + ".png", "@image"},
         {"lr/left/left_" + i + ".png", "@image"},
         {"lr/right/right_" + i + ".png", "@image"}});
  }
  EXPECT_EQ("rgb_0010.png", partnerOf("d", 2));
  EXPECT_EQ("9-00019.png", partnerOf("redwood", 1));
  EXPECT_EQ("right_8.png", partnerOf("lr", 0));
  EXPECT_EQ("cam1_0007.png", partnerOf("one", 0));
}

TEST_F(SequenceInputs, PosesMayBeTooFewWhereASequenceGrowsOrTheyAreNotUsed) {
  add(kScans + Files{{"scans/poses.txt", posesOf(2)}});
  expectProblem(path("scans"), "2 poses for 3 frames");
  SequenceOptions options;
  options.ignore_poses = true;
  const Sequence sequence({path("scans")}, options);
  EXPECT_EQ(sequence.size(), 3u);
  EXPECT_NE(sequence.poseSource(), PoseSource::File);
  ASSERT_EQ(sequence.notes().size(), 1u);
  EXPECT_NE(sequence.notes()[0].find("2 poses for 3 frames"), std::string::npos);
  options = SequenceOptions();
  options.growing = true;
  EXPECT_EQ(2u, Sequence({path("scans")}, options).size());
}

TEST_F(SequenceInputs, ColourOfTheSameShapeIsScaledToTheDepth) {
  add(kRgbd);
  Image color{8, 6, 3, {}};
  for (int i = 0; i < 48; ++i) {
    const std::uint8_t value = i % 8 < 4 ? 40 : 80;
    color.pixels.insert(color.pixels.end(), {value, value, value});
  }
  writeImage(path("rgbd/rgb/0.png"), color, Overwrite::Allow);
  const Frame frame = Sequence({path("rgbd")}).read(0);
  EXPECT_EQ(frame.left.width, 4);
  EXPECT_EQ(frame.left.height, 3);
  EXPECT_EQ(frame.left.pixels[3], 40);
  EXPECT_EQ(frame.left.pixels[6], 80);
  EXPECT_EQ(frame.cloud.size(), 12u);
}

TEST_F(SequenceInputs, ScansWithoutAHeaderAreToldByTheirNames) {
  add({{"scan.bin", floats({1, 2, 3, 0.5f, 4, 5, 6, 0.25f})},
       {"scan.pcd.bin", floats({1, 2, 3, 0.5f, 7, 4, 5, 6, 0.25f, 8})},
       {"odd.bin", "0123456789"},
       {"scan.dat", std::string(160, '\0')},
       {"empty.bin", ""}});
  for (const char* name : {"scan.bin", "scan.pcd.bin"}) {
    const CloudData cloud = readCloudFile(path(name));
    ASSERT_EQ(2u, cloud.size()) << name;
    EXPECT_EQ(Vector3(4, 5, 6), cloud.view().point(1));
    EXPECT_EQ(0.25f, cloud.intensities[1]);
  }
  EXPECT_EQ(5u, readCloudFileInfo(path("scan.pcd.bin")).fields.size());
  expectProblem(path("odd.bin"), "its size is no multiple of 16 bytes");
  expectProblem(path("scan.dat"), "neither a PCD nor a PLY file");
  expectProblem(path("empty.bin"), "is empty");
}

TEST_F(SequenceInputs, CloudsOfAnotherUnitAreScaledWithTheirViewpoint) {
  add(kScans);
  SequenceOptions options;
  options.scale = 0.001;
  const Frame frame = Sequence({path("scans/c.pcd")}, options).read(0);
  EXPECT_FLOAT_EQ(0.003f, frame.cloud.xyz[0]);
  EXPECT_DOUBLE_EQ(0.003, frame.T_world_sensor->translation().x());
}

TEST_F(SequenceInputs, SaysWhatIsWrong) {
  struct Case {
    Files files;
    const char* input;
    const char* sentence;
  };
  std::string no_scale = kDepthCamera;
  no_scale.resize(no_scale.find("depth_scale"));
  const Case problems[] = {
      {{}, "missing", "no such file or directory"},
      {kScans, "scans/readme.txt", "neither a PCD nor a PLY file"},
      {{{"empty/.hidden", ""}}, "empty", "holds neither PCD or PLY files nor a sequence"},
      {{{"bare/calib.yaml", kDepthCamera}}, "bare", "neither clouds/ nor depth/"},
      {{{"run/clouds/notes.txt", ""}}, "run", "holds no PCD or PLY files"},
      {{{"far/0.pcd", cloudAt("1e30")}}, "far/0.pcd", "0.pcd: its pose is farther than 1e9 m"},
      {kPairs + Files{{"pairs/right", "@none"}}, "pairs", "right: no such directory"},
      {kPairs + Files{{"pairs/left", "@none"}}, "pairs", "has right/ but no left/"},
      {kPairs + Files{{"pairs/right", "@none"}, {"pairs/right/a.png", "@image"}}, "pairs",
       "left/ (2 images) and right/ (1) have no file name or number in common"},
      {kPairs + Files{{"pairs/calib.yaml", kDepthCamera}}, "pairs", "has no key 'baseline_m'"},
      {kPairs + Files{{"pairs/calib.yaml", "@none"}}, "pairs", "fx, fy, cx, cy, baseline_m"},
      {kPairs + Files{{"pairs/left/0.jpg", "@image"}}, "pairs", "another image of this name"},
      {kRgbd + Files{{"rgbd/calib.yaml", no_scale}}, "rgbd", "no key 'depth_scale'"},
      {kRgbd + Files{{"rgbd/calib.yaml", "@none"}}, "rgbd", "fx, fy, cx, cy, depth_scale"},
      {kRgbd + Files{{"rgbd/depth/0.png", "@image"}}, "rgbd", "not gray of 16 bits"},
      {kRgbd + Files{{"rgbd/rgb/1.png", "@none"}}, "rgbd", "1.png: has no image of the same name"},
      {kRgbd + Files{{"rgbd/rgb", "@none"}, {"rgbd/rgb/a.png", "@image"}}, "rgbd",
       "depth/ (2 images) and rgb/ (1) have no file name or number in common"},
      {kRgbd + Files{{"rgbd/depth", "@none"}, {"rgbd/depth/0.npy", ""}}, "rgbd",
       "written as PNG of 16 bits, metres times depth_scale"},
      {{{"one/left_0.png", "@image"}, {"one/right_0.png", "@image"}},
       "one",
       "left_0.png and right_0.png are a pair"},
      {{{"r3d/metadata", "{}"}, {"r3d/rgbd/0.depth", "bvx"}},
       "r3d",
       "write them as PNG images of 16 bits"},
      {{{"tartan/depth_left/0.npy", ""}}, "tartan", "write depth_left/*.npy (metres) as PNG"},
      {{{"room0/results/depth0.png", "@depth"}, {"room0/traj.txt", ""}},
       "room0",
       "move results/depth*.png to depth/"}};
  for (const Case& c : problems) {
    fs::remove_all(dir_.path());
    add(c.files);
    expectProblem(path(c.input), c.sentence);
  }
  add(kRgbd + kPairs + kScans + Files{{"two_poses.txt", posesOf(2)}});
  EXPECT_NE(std::string::npos,
            problemOf({path("rgbd"), path("scans")}).find("must be the only input"));
  SequenceOptions options;
  options.poses_file = path("two_poses.txt");
  expectProblem(path("scans"), "2 poses for 3 frames", options);
  options.poses_file = path("nowhere.txt");
  expectProblem(path("scans"), "no such file", options);
  addImage("rgbd/rgb/0.png", 2, 3, 0);
  expectProblem(path("rgbd"), "is 2 x 3, another shape than its depth image");
  addImage("pairs/right/1.png", 5, 3, 0);
  expectProblem(path("pairs"), "1.png: is 5 x 3, its left image 4 x 3");
  addImage("pairs/left/1.png", 5, 3, 0);
  expectProblem(path("pairs"), "is 5 x 3, but its calibration says 4 x 3");
  writeDepthPng(path("rgbd/depth/0.png"), DepthImage{5, 3, std::vector<std::uint16_t>(15, 1)},
                Overwrite::Allow);
  expectProblem(path("rgbd"), "5 x 3");
}

TEST_F(SequenceInputs, RealSequencesOpenAndRead) {
  const std::string data = std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/";
  if (!fs::exists(data)) GTEST_SKIP() << "no real data beside the sources";
  const Sequence cabinet({data + "rgbd_tum_cabinet"});
  EXPECT_EQ(cabinet.size(), 58u);
  EXPECT_EQ(cabinet.poseSource(), PoseSource::File);
  const Frame frame = cabinet.read(5);
  std::size_t valid = 0;
  for (std::size_t i = 0; i < frame.cloud.size(); ++i) valid += frame.cloud.view().isMeasured(i);
  EXPECT_GT(valid, 200000u);
  EXPECT_FALSE(Sequence({data + "rgbd_icl_five"}).read(0).cloud.colors.empty());
  EXPECT_EQ(Sequence({data + "clouds_steps"}).size(), 2u);
  const Sequence street({data + "stereo_kitti_street"});
  EXPECT_EQ(street.kind(), SequenceKind::Stereo);
  EXPECT_EQ(street.size(), 28u);
  EXPECT_EQ(street.read(27).right.width, 1226);
  EXPECT_EQ(cabinet.read(0, CloudChannels::none()).left.channels, 3);  // JPEG
}

}  // namespace
}  // namespace planar_mapping::io
