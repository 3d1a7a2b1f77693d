// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/layouts/sequence.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/pose_file.h"
#include "temporary_directory.h"

namespace planar_mapping::io {
namespace {

namespace fs = std::filesystem;

const char* const kCamera =
    "image_width: 4\nimage_height: 3\nfx: 2\nfy: 2\ncx: 1.5\ncy: 1\ndepth_scale: 1000\n";

CloudData cloudAt(float x) {
  CloudData cloud;
  cloud.width = 4;
  cloud.height = 3;
  cloud.xyz.assign(36, x);
  cloud.colors.assign(12, 0x112233);
  cloud.T_world_sensor.translation() = Vector3(x, 0, 0);
  return cloud;
}

std::vector<StampedPose> posesOf(std::size_t count) {
  std::vector<StampedPose> poses(count);
  for (std::size_t i = 0; i < count; ++i) {
    poses[i].timestamp = 10.0 + static_cast<double>(i);
    poses[i].pose.translation() = Vector3(0, 0, static_cast<double>(i));
  }
  return poses;
}

class SequenceInputs : public ::testing::Test {
 protected:
  std::string folder(const std::string& name) {
    fs::create_directories(dir_ / name);
    return dir_ / name;
  }
  void addClouds(const std::string& name) {
    folder(name);
    writePcd(dir_ / (name + "/b.pcd"), cloudAt(2.0f));
    writePcd(dir_ / (name + "/a.pcd"), cloudAt(1.0f));
    writePcd(dir_ / (name + "/c.pcd"), cloudAt(3.0f));
    writeFileAtomically(dir_ / (name + "/readme.txt"), "not a cloud");
  }
  void addRgbd(const std::string& name, std::uint32_t width = 4) {
    folder(name + "/depth");
    folder(name + "/rgb");
    DepthImage depth;
    depth.width = width;
    depth.height = 3;
    depth.values.assign(std::size_t{width} * 3, 1500);
    Image color{4, 3, 3, {}};
    for (int i = 0; i < 12; ++i) color.pixels.insert(color.pixels.end(), {0x44, 0x55, 0x66});
    for (const char* frame : {"/000001.png", "/000000.png"}) {
      writeDepthPng(dir_ / (name + "/depth" + frame), depth);
      writeImage(dir_ / (name + "/rgb" + frame), color);
    }
    writeFileAtomically(dir_ / (name + "/calib.yaml"), kCamera);
  }
  static Image grayImage(int width, std::uint8_t value) {
    Image image;
    image.width = width;
    image.height = 3;
    image.channels = 1;
    image.pixels.assign(static_cast<std::size_t>(width) * 3, value);
    return image;
  }
  /// Two pairs, 000000 and 000001, whose pixels are 10, 11 on the left and 20, 21 on the right.
  void addStereo(const std::string& name) {
    folder(name + "/left");
    folder(name + "/right");
    for (const char* frame : {"000000", "000001"}) {
      const auto offset = static_cast<std::uint8_t>(frame[5] - '0');
      writeImage(dir_ / (name + "/left/" + frame + ".png"), grayImage(4, 10 + offset));
      writeImage(dir_ / (name + "/right/" + frame + ".png"), grayImage(4, 20 + offset));
    }
    writeFileAtomically(dir_ / (name + "/calib.yaml"), std::string(kCamera) + "baseline_m: 0.1\n");
  }
  void expectProblem(const std::vector<std::string>& inputs, const std::string& part,
                     const std::string& poses = "") {
    try {
      SequenceOptions options;
      options.poses_file = poses;
      Sequence sequence(inputs, options);
      for (std::size_t i = 0; i < sequence.size(); ++i) sequence.read(i);
      FAIL() << "no problem, expected: " << part;
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  TemporaryDirectory dir_;
};

TEST_F(SequenceInputs, DirectoryOfCloudsIsReadInNameOrderWithViewpoints) {
  addClouds("scans");
  const Sequence sequence({dir_ / "scans"});
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
}

TEST_F(SequenceInputs, NumbersInNamesAreInTheOrderOfTheirValues) {
  const std::vector<std::string> names = {"1.5.pcd",      "1.25.pcd",   "2.pcd",
                                          "10.pcd",       "scan_2.pcd", "scan_10.pcd",
                                          "scan_011.pcd", "t.2.pcd",    "t.10.pcd"};
  folder("scans");
  for (const std::string& name : names) writePcd(dir_ / ("scans/" + name), cloudAt(1.0f));
  const Sequence sequence({dir_ / "scans"});
  const std::vector<std::string> expected = {"1.25.pcd",     "1.5.pcd",    "2.pcd",
                                             "10.pcd",       "scan_2.pcd", "scan_10.pcd",
                                             "scan_011.pcd", "t.2.pcd",    "t.10.pcd"};
  ASSERT_EQ(sequence.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(std::filesystem::path(sequence.path(i)).filename(), expected[i]);
}

TEST_F(SequenceInputs, FilesKeepTheOrderGivenAndTakePosesFromAFile) {
  addClouds("scans");
  writeTumPoses(dir_ / "poses.txt", posesOf(2));
  SequenceOptions options;
  options.poses_file = dir_ / "poses.txt";
  const Sequence sequence({dir_ / "scans/c.pcd", dir_ / "scans/a.pcd"}, options);
  EXPECT_EQ(sequence.poseSource(), PoseSource::File);
  ASSERT_EQ(sequence.size(), 2u);
  EXPECT_EQ(sequence.read(0).cloud.xyz[0], 3.0f);
  EXPECT_EQ(sequence.read(1).timestamp, 11.0);
  EXPECT_EQ(sequence.read(1).T_world_sensor->translation().z(), 1.0);
  EXPECT_TRUE(sequence.read(0, CloudChannels::none()).cloud.colors.empty());
}

TEST_F(SequenceInputs, FolderOfCloudsTakesItsOwnPosesAndCalibration) {
  addClouds("run/clouds");
  writeTumPoses(dir_ / "run/poses.txt", posesOf(3));
  writeFileAtomically(dir_ / "run/calib.yaml", kCamera);
  const Sequence sequence({dir_ / "run"});
  EXPECT_EQ(sequence.kind(), SequenceKind::Clouds);
  EXPECT_EQ(sequence.poseSource(), PoseSource::File);
  const Frame frame = sequence.read(2);
  EXPECT_EQ(frame.timestamp, 12.0);
  ASSERT_TRUE(frame.camera);
  EXPECT_EQ(frame.camera->fx, 2.0);
  EXPECT_EQ(sequence.calibration()->depth_scale, 1000.0);
}

TEST_F(SequenceInputs, CalibrationOfAnotherSizeIsNoCameraOfTheCloud) {
  addClouds("run/clouds");
  std::string calibration = kCamera;
  calibration.replace(calibration.find("image_width: 4"), 14, "image_width: 8");
  writeFileAtomically(dir_ / "run/calib.yaml", calibration);
  EXPECT_FALSE(Sequence({dir_ / "run"}).read(0).camera);
}

TEST_F(SequenceInputs, RgbdFolderGivesOrganizedColouredClouds) {
  addRgbd("rgbd");
  const Sequence without({dir_ / "rgbd"});
  EXPECT_EQ(without.kind(), SequenceKind::Rgbd);
  EXPECT_EQ(without.poseSource(), PoseSource::None);
  EXPECT_FALSE(without.read(0).T_world_sensor);
  writeTumPoses(dir_ / "rgbd/poses.txt", posesOf(2));
  const Sequence sequence({dir_ / "rgbd"});
  ASSERT_EQ(sequence.size(), 2u);
  const Frame frame = sequence.read(1);
  EXPECT_EQ(frame.name, "000001.png");
  EXPECT_TRUE(frame.cloud.view().isOrganized());
  EXPECT_FLOAT_EQ(frame.cloud.xyz[2], 1.5f);
  EXPECT_FLOAT_EQ(frame.cloud.xyz[0], -1.5f * 1.5f / 2.0f);
  EXPECT_EQ(frame.cloud.colors, std::vector<std::uint32_t>(12, 0x445566));
  EXPECT_EQ(frame.T_world_sensor->translation().z(), 1.0);
}

TEST_F(SequenceInputs, RgbdFolderGivesItsColourImagesOnRequest) {
  addRgbd("rgbd");
  const Sequence sequence({dir_ / "rgbd"});
  const Frame frame = sequence.read(0, CloudChannels::none());
  EXPECT_EQ(frame.left.channels, 3);
  EXPECT_EQ(frame.left.width, 4);
  ASSERT_EQ(frame.left.pixels.size(), 36u);
  EXPECT_EQ(frame.left.pixels[0], 0x44);
  EXPECT_EQ(frame.left.pixels[2], 0x66);
  EXPECT_TRUE(frame.right.empty());
  EXPECT_TRUE(frame.cloud.colors.empty());
  EXPECT_TRUE(sequence.read(0, CloudChannels::none(), false).left.empty());
}

TEST_F(SequenceInputs, StereoFolderGivesPairsWithoutACloud) {
  addStereo("stereo");
  const Sequence sequence({dir_ / "stereo"});
  EXPECT_EQ(sequence.kind(), SequenceKind::Stereo);
  EXPECT_EQ(sequence.poseSource(), PoseSource::None);
  ASSERT_EQ(sequence.size(), 2u);
  EXPECT_EQ(sequence.path(1), dir_ / "stereo/left/000001.png");
  const Frame frame = sequence.read(1);
  EXPECT_EQ(frame.left.pixels, std::vector<std::uint8_t>(12, 11));
  EXPECT_EQ(frame.right.pixels, std::vector<std::uint8_t>(12, 21));
  EXPECT_EQ(frame.cloud.size(), 0u);
  EXPECT_FALSE(frame.T_world_sensor);
  ASSERT_TRUE(frame.camera);
  EXPECT_EQ(frame.camera->fx, 2.0);
  EXPECT_EQ(sequence.calibration()->baseline, 0.1);

  writeTumPoses(dir_ / "stereo/poses.txt", posesOf(2));
  const Frame posed = Sequence({dir_ / "stereo"}).read(1);
  EXPECT_EQ(posed.timestamp, 11.0);
  EXPECT_EQ(posed.T_world_sensor->translation().z(), 1.0);
}

TEST_F(SequenceInputs, FrameWithASingleImageKeepsItsPlaceInTheSequence) {
  addStereo("stereo");
  writeTumPoses(dir_ / "stereo/poses.txt", posesOf(3));
  writeImage(dir_ / "stereo/left/000002.png", grayImage(4, 12));
  const Sequence no_right({dir_ / "stereo"});
  ASSERT_EQ(no_right.size(), 3u);
  EXPECT_NO_THROW(no_right.read(1));
  EXPECT_THROW(no_right.read(2), IoError);
  // What is known of it without its images.
  EXPECT_EQ(no_right.describe(2).timestamp, 12.0);
  EXPECT_EQ(no_right.describe(2).name, "000002.png");
  EXPECT_THROW(no_right.describe(3), InputError);
  expectProblem({dir_ / "stereo"}, "000002.png: has no right image of the same name");

  fs::rename(dir_ / "stereo/left/000002.png", dir_ / "stereo/right/000002.png");
  const Sequence no_left({dir_ / "stereo"});
  ASSERT_EQ(no_left.size(), 3u);
  expectProblem({dir_ / "stereo"}, "left/000002.png: no such file");
}

TEST_F(SequenceInputs, PreferredKindIsTakenOfAFolderWithSeveral) {
  addRgbd("all");
  addStereo("pairs");
  fs::rename(dir_ / "pairs/left", dir_ / "all/left");
  fs::rename(dir_ / "pairs/right", dir_ / "all/right");
  writeFileAtomically(dir_ / "all/calib.yaml", std::string(kCamera) + "baseline_m: 0.1\n",
                      Overwrite::Allow);
  SequenceOptions options;
  EXPECT_EQ(Sequence({dir_ / "all"}, options).kind(), SequenceKind::Rgbd);
  options.preferred = SequenceKind::Stereo;
  EXPECT_EQ(Sequence({dir_ / "all"}, options).kind(), SequenceKind::Stereo);
  options.preferred = SequenceKind::Clouds;  // there are none
  EXPECT_EQ(Sequence({dir_ / "all"}, options).kind(), SequenceKind::Rgbd);
}

TEST_F(SequenceInputs, SaysWhatIsWrongWithStereo) {
  addStereo("a");
  fs::remove_all(dir_ / "a/right");
  expectProblem({dir_ / "a"}, "right: no such directory; a stereo sequence needs it");
  folder("a/right");
  expectProblem({dir_ / "a"},
                "left/ (2 images) and right/ (0) have no file name or number in common");
  fs::rename(dir_ / "a/left", dir_ / "a/links");
  expectProblem({dir_ / "a"}, "has right/ but no left/");

  addStereo("calibration");
  writeFileAtomically(dir_ / "calibration/calib.yaml", kCamera, Overwrite::Allow);
  expectProblem({dir_ / "calibration"}, "calib.yaml: has no key 'baseline_m'");
  fs::remove(dir_ / "calibration/calib.yaml");
  expectProblem({dir_ / "calibration"}, "calib.yaml: no such file; a stereo sequence needs it");

  addStereo("sizes");
  fs::remove(dir_ / "sizes/right/000001.png");
  writeImage(dir_ / "sizes/right/000001.png", grayImage(5, 0));
  expectProblem({dir_ / "sizes"}, "000001.png: is 5 x 3, its left image 4 x 3");
  fs::remove(dir_ / "sizes/left/000001.png");
  writeImage(dir_ / "sizes/left/000001.png", grayImage(5, 0));
  expectProblem({dir_ / "sizes"}, "is 5 x 3, but its calibration says 4 x 3");

  addStereo("twice");
  fs::copy_file(dir_ / "twice/left/000000.png", dir_ / "twice/left/000000.jpg");
  expectProblem({dir_ / "twice"}, "another image of this name");
}

TEST_F(SequenceInputs, PosesThatNobodyUsesNeedNotFitTheFrames) {
  addClouds("scans");
  writeTumPoses(dir_ / "scans/poses.txt", posesOf(2));
  EXPECT_THROW(Sequence({dir_ / "scans"}), IoError);
  SequenceOptions options;
  options.ignore_poses = true;
  const Sequence sequence({dir_ / "scans"}, options);
  EXPECT_EQ(sequence.size(), 3u);
  EXPECT_NE(sequence.poseSource(), PoseSource::File);
  ASSERT_EQ(sequence.notes().size(), 1u);
  EXPECT_NE(sequence.notes()[0].find("2 poses for 3 frames"), std::string::npos);
}

TEST_F(SequenceInputs, SaysWhatIsWrong) {
  addClouds("scans");
  EXPECT_THROW(Sequence(std::vector<std::string>{}), InputError);
  expectProblem({dir_ / "missing"}, "no such file or directory");
  expectProblem({dir_ / "scans/readme.txt"}, "neither a PCD nor a PLY file");
  expectProblem({folder("empty")}, "holds neither PCD or PLY files nor a sequence");
  writeTumPoses(dir_ / "poses.txt", posesOf(2));
  expectProblem({dir_ / "scans"}, "2 poses for 3 frames", dir_ / "poses.txt");
  expectProblem({dir_ / "scans"}, "no such file", dir_ / "nowhere.txt");

  folder("bare");
  writeFileAtomically(dir_ / "bare/calib.yaml", kCamera);
  expectProblem({dir_ / "bare"}, "neither clouds/ nor depth/");
  expectProblem({dir_ / "bare", dir_ / "scans"}, "must be the only input");
  folder("no_clouds/clouds");
  expectProblem({dir_ / "no_clouds"}, "holds no PCD or PLY files");
  folder("no_calib/depth");
  expectProblem({dir_ / "no_calib"}, "needs it");
}

TEST_F(SequenceInputs, ColourOfTheSameShapeIsScaledToTheDepth) {
  addRgbd("large_colour");
  Image color{8, 6, 3, {}};
  for (int i = 0; i < 48; ++i) {
    const std::uint8_t value = i % 8 < 4 ? 40 : 80;
    color.pixels.insert(color.pixels.end(), {value, value, value});
  }
  writeImage(dir_ / "large_colour/rgb/000000.png", color, Overwrite::Allow);
  const Frame frame = Sequence({dir_ / "large_colour"}).read(0);
  EXPECT_EQ(frame.left.width, 4);
  EXPECT_EQ(frame.left.height, 3);
  EXPECT_EQ(frame.left.pixels[3], 40);
  EXPECT_EQ(frame.left.pixels[6], 80);
  EXPECT_EQ(frame.cloud.size(), 12u);
}

TEST_F(SequenceInputs, SaysWhatIsWrongWithRgbd) {
  addRgbd("wide", 5);
  expectProblem({dir_ / "wide"}, "5 x 3");
  addRgbd("odd");
  fs::rename(dir_ / "odd/rgb/000001.png", dir_ / "odd/rgb/000007.png");
  expectProblem({dir_ / "odd"}, "000001.png: has no image of the same name in rgb/");
  EXPECT_FALSE(Sequence({dir_ / "odd"}).read(0).left.empty());
  EXPECT_EQ(Sequence({dir_ / "odd"}).read(1, CloudChannels::none(), false).cloud.size(), 12u);
  fs::rename(dir_ / "odd/rgb/000000.png", dir_ / "odd/rgb/000008.png");
  expectProblem({dir_ / "odd"}, "do not match by file name");
  addRgbd("narrow_colour");
  writeImage(dir_ / "narrow_colour/rgb/000002.png", grayImage(2, 0));
  fs::rename(dir_ / "narrow_colour/rgb/000002.png", dir_ / "narrow_colour/rgb/000000.png");
  expectProblem({dir_ / "narrow_colour"}, "is 2 x 3, another shape than its depth image");
  addRgbd("gray");
  fs::copy_file(dir_ / "gray/rgb/000000.png", dir_ / "gray/depth/000000.png",
                fs::copy_options::overwrite_existing);
  expectProblem({dir_ / "gray"}, "not gray of 16 bits");
  addRgbd("arrays");
  for (const int frame : {0, 1}) {
    const std::string file = dir_ / ("arrays/depth/00000" + std::to_string(frame));
    fs::rename(file + ".png", file + ".npy");
  }
  expectProblem({dir_ / "arrays"}, "written as PNG of 16 bits, metres times depth_scale");
  addRgbd("scale");
  std::string calibration = kCamera;
  calibration.resize(calibration.find("depth_scale"));
  writeFileAtomically(dir_ / "scale/calib.yaml", calibration, Overwrite::Allow);
  expectProblem({dir_ / "scale"}, "no key 'depth_scale'");
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
