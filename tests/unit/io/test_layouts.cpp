// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Public data sets of pairs and scans, and what holds for all layouts.
#include <ctime>

#include "layout_folders.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::io {
namespace {

namespace fs = std::filesystem;

TEST_F(LayoutFolders, KittiPairsHaveCameraTimesAndPoses) {
  const std::string folder = kitti();
  const Sequence gray({folder}, stereo());
  EXPECT_EQ("KITTI odometry (gray)", gray.layout());
  ASSERT_EQ(3u, gray.size());
  EXPECT_DOUBLE_EQ(0.5, *gray.calibration()->baseline);
  EXPECT_EQ(1.5, gray.calibration()->camera.cx);
  EXPECT_EQ(4, gray.calibration()->camera.width);
  EXPECT_DOUBLE_EQ(0.25, gray.read(2).timestamp);
  EXPECT_EQ(Vector3(0, 0, 2), gray.read(2).T_world_sensor->translation());

  // Poses are of camera 0; camera 2 is 0.2 m to its left.
  fs::remove_all(folder + "/image_0");
  const Sequence colour({folder}, stereo());
  EXPECT_EQ("KITTI odometry (colour)", colour.layout());
  EXPECT_DOUBLE_EQ(0.5, *colour.calibration()->baseline);
  EXPECT_LT((colour.read(1).T_world_sensor->translation() - Vector3(-0.2, 0, 1)).norm(), 1e-12);
}

TEST_F(LayoutFolders, KittiScansArePosedThroughTheCamera) {
  const Sequence scans({kitti()});
  EXPECT_EQ("KITTI odometry (velodyne)", scans.layout());
  EXPECT_EQ(SequenceKind::Clouds, scans.kind());
  const Frame frame = scans.read(1);
  ASSERT_EQ(2u, frame.cloud.size());
  EXPECT_EQ(0.25f, frame.cloud.intensities[1]);
  // One metre ahead of the scanner is one metre ahead of the camera, which stands 0.3 m ahead.
  EXPECT_LT((*frame.T_world_sensor * Vector3(1, 0, 0) - Vector3(0, 0, 1.7)).norm(), 1e-12);
}

TEST_F(LayoutFolders, PartOfAKittiSequenceKeepsItsPoses) {
  const std::string folder = kitti();
  for (const char* camera : {"image_0", "image_1"})
    fs::remove(folder + "/" + camera + "/000000.png");
  const Sequence part({folder}, stereo());
  ASSERT_EQ(2u, part.size());
  EXPECT_EQ(1.0, part.read(0).T_world_sensor->translation().z());
  EXPECT_DOUBLE_EQ(0.15, part.read(0).timestamp);
}

TEST_F(LayoutFolders, KittiSaysWhatIsMissing) {
  const std::string folder = kitti();
  fs::remove_all(folder + "/velodyne");
  write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  expectProblem(folder, "holds 1 poses, but none of frame 1");
  write("poses/07.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n");
  expectProblem(folder, "no rotation matrix");
  write("sequences/07/times.txt", "0\n");
  expectProblem(folder, "holds 1 times");
  write("sequences/07/calib.txt", "P0: 2 0 1.5 0 0 2 1 0 0 0 1 0\n");
  fs::remove(folder + "/times.txt");
  expectProblem(folder, "no line 'P1: '");
  fs::remove(folder + "/calib.txt");
  expectProblem(folder, "calib.txt: no such file");
  for (const char* camera : {"image_1", "image_2", "image_3"})
    fs::remove_all(folder + "/" + camera);
  expectProblem(folder, "image_1: no such directory");
}

TEST_F(LayoutFolders, EurocPairsAreRectifiedAndPosedThroughTheBody) {
  const std::string folder = euroc();
  for (const std::string& input : {folder, folder + "/mav0"}) {
    const Sequence sequence({input});
    EXPECT_EQ("EuRoC (ASL)", sequence.layout());
    ASSERT_EQ(1u, sequence.size());
    const UnrectifiedPair& pair = *sequence.calibration()->unrectified;
    EXPECT_EQ(-0.28, pair.left.k1);
    EXPECT_EQ(1.8e-05, pair.right.p2);
    EXPECT_LT((pair.T_right_left.translation() - Vector3(-0.1, 0, 0)).norm(), 1e-12);
    EXPECT_NEAR(1403636579.7635556, sequence.describe(0).timestamp, 1e-6);
    const Pose pose = *sequence.describe(0).T_world_sensor;
    EXPECT_LT((pose.translation() - Vector3(1.2, 2.05, 3)).norm(), 1e-12);
    EXPECT_LT((pose.linear() * Vector3::UnitZ() - Vector3::UnitX()).norm(), 1e-12);
  }
}

TEST_F(LayoutFolders, EurocSaysWhatIsMissing) {
  const std::string folder = euroc();
  write("V1/mav0/cam1/data.csv", "#t,f\n1403636579900000000,a.png\n");
  expectProblem(folder, "cam1/ has no image within 20 ms");
  const std::string sensor = folder + "/mav0/cam1/sensor.yaml";
  write("V1/mav0/cam1/data.csv", "#t,f\n1403636579763555584,a.png\n");
  write("V1/mav0/cam1/sensor.yaml", "resolution: [4, 3]\n");
  expectProblem(folder, "has no 'distortion_coefficients' of 4 numbers");
  write("V1/mav0/cam1/sensor.yaml", "T_BS: [");
  expectProblem(folder, "sensor.yaml: line ");
  fs::remove(sensor);
  expectProblem(folder, "sensor.yaml: no such file");
  fs::remove_all(folder + "/mav0/cam1");
  expectProblem(folder, "cam1: no such directory");
}

TEST_F(LayoutFolders, MiddleburyIsAPair) {
  const std::string folder = middlebury();
  const Sequence sequence({folder});
  EXPECT_EQ(1u, sequence.size());
  EXPECT_EQ(PoseSource::None, sequence.poseSource());
  EXPECT_DOUBLE_EQ(0.193001, *sequence.calibration()->baseline);
  EXPECT_EQ(1.75, sequence.calibration()->cx_right);
  write("Shelves/calib.txt",
        "cam0=[4 0 3; 0 4 2; 0 0 1]\ncam1=[4 0 3.5; 0 4 2; 0 0 "
        "1]\nbaseline=193\nwidth=8\nheight=6\n");
  expectProblem(folder, "is for images of another size: width is not the 4 pixels of the images");
  write("Shelves/calib.txt", "cam0=[2 0 1.5; 0 2 1; 0 0 1]\n");
  expectProblem(folder, "no line 'cam1='");
  fs::remove(folder + "/im1.png");
  expectProblem(folder, "im1.png: no such file");
}

TEST_F(LayoutFolders, MixedLayoutsAreRefused) {
  const std::string folder = kitti();
  image("sequences/07/left/000000.png");
  expectProblem(folder, "looks like KITTI odometry and a sequence folder");
  fs::remove_all(folder + "/left");
  image("sequences/07/im0.png");
  expectProblem(folder, "looks like KITTI odometry and Middlebury");
}

TEST_F(LayoutFolders, PosesGivenByFileMayBeOfKittiAndOfOtherTimes) {
  SequenceOptions options;
  options.poses_file = write("kitti_poses.txt", "1 0 0 7 0 1 0 0 0 0 1 0\n");
  EXPECT_EQ(7.0, Sequence({middlebury()}, options).describe(0).T_world_sensor->translation().x());
  options.poses_file = write("by_time.txt", "10.09 5 0 0 0 0 0 1\n10.11 7 0 0 0 0 0 1\n");
  const Sequence by_time({tum()}, options);
  ASSERT_EQ(1u, by_time.size());
  EXPECT_NEAR(6.0, by_time.describe(0).T_world_sensor->translation().x(), 1e-9);
}

TEST_F(LayoutFolders, PairsWithoutLeadingZerosAreInNumberOrder) {
  const std::vector<std::string> in_order = {"1", "001b", "00001ba", "1bq", "2", "10"};
  for (const std::string& name : in_order) {
    image("seq/left/" + name + ".png");
    image("seq/right/" + name + ".png");
  }
  write("seq/calib.yaml",
        "image_width: 4\nimage_height: 3\nfx: 2\nfy: 2\ncx: 1.5\ncy: 1\nbaseline_m: 0.1\n");
  const Sequence sequence({dir_ / "seq"});
  ASSERT_EQ(in_order.size(), sequence.size());
  for (std::size_t i = 0; i < in_order.size(); ++i)
    EXPECT_NE(std::string::npos, sequence.path(i).find("/" + in_order[i] + ".png")) << i;
}

TEST_F(LayoutFolders, AGrowingSequenceEndsAtItsLastPose) {
  for (int i = 0; i < 3; ++i) {
    image("seq/left/" + numbered(i) + ".png");
    image("seq/right/" + numbered(i) + ".png");
  }
  write("seq/calib.yaml",
        "image_width: 4\nimage_height: 3\nfx: 2\nfy: 2\ncx: 1.5\ncy: 1\nbaseline_m: 0.1\n");
  write("seq/poses.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n");
  expectProblem(dir_ / "seq", "2 poses for 3 frames");
  SequenceOptions options;
  options.growing = true;
  EXPECT_EQ(2u, Sequence({dir_ / "seq"}, options).size());
}

TEST_F(LayoutFolders, BinFilesAreOfFourNumbersAPointOrOfFiveWithTheRing) {
  const auto scan = [this](const std::string& name, int numbers, int points) {
    std::vector<float> values;
    for (int i = 0; i < points; ++i) {
      const auto k = static_cast<float>(i);
      values.insert(values.end(), {1.5f + k, -0.25f * k, 0.125f, 7.5f});
      if (numbers > 4) values.push_back(static_cast<float>(i % 32));
      if (numbers > 5) values.push_back(-0.5f);
    }
    return floats(name, values);
  };
  for (const int numbers : {4, 5}) {  // 80 points: both sizes can be divided by both
    const std::string path = scan("scan" + std::to_string(numbers) + ".bin", numbers, 80);
    const CloudData cloud = readCloudFile(path);
    ASSERT_EQ(80u, cloud.size()) << numbers;
    EXPECT_EQ(Vector3(80.5, -19.75, 0.125), cloud.view().point(79));
    EXPECT_EQ(80u, cloud.intensities.size());
    EXPECT_EQ(7.5f, cloud.intensities[79]);
    EXPECT_EQ(numbers == 5, readCloudFileInfo(path).fields.back() == "ring");
  }
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(scan("six.bin", 6, 80)));
  std::vector<float> even;  // of one intensity that no float has exactly, three layers in turn
  for (int i = 0; i < 400; ++i) {
    const auto k = static_cast<float>(i / 3);
    even.insert(even.end(), {5.0f + k, -k, -0.5f * static_cast<float>(i % 3), 0.1f});
  }
  EXPECT_EQ(CloudFormat::Velodyne, recognizeCloudFile(floats("even.bin", even)));
  // With colours, as some data sets of rooms have them: no number but x and y below zero.
  std::vector<float> room;
  for (int i = 0; i < 400; ++i) {
    const auto k = static_cast<float>(i % 20);
    room.insert(room.end(), {0.1f * k, 2.0f, 0.05f * k, 120.0f + k, 90.0f, 60.0f - k});
  }
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(floats("room.bin", room)));
}

TEST_F(LayoutFolders, BinFilesOfPointsWithColoursAreNotTaken) {
  // Of a room before the sensor, the colours from 0 to 1: no number is below zero.
  Random random(2);
  std::vector<float> points;
  for (int i = 0; i < 4000; ++i) {
    for (const double most : {1.5, 2.0, 1.5}) points.push_back(float(random.uniform(0.0, most)));
    const double gray = random.uniform(0.3, 0.6);
    for (const double tint : {0.0, 0.05, 0.1}) points.push_back(float(gray + tint));
  }
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(floats("rgb.bin", points)));
}

TEST_F(LayoutFolders, BinFilesThatAreNoScansAreNotTaken) {
  // Three numbers a point, of which the first hundreds are positive.
  Random random(1);
  std::vector<float> points;
  for (int i = 0; i < 12000; ++i)
    points.push_back(static_cast<float>(random.uniform(i < 1000 ? 0.0 : -1.0, 1.0)));
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(floats("xyz.bin", points)));
  // A scan may have a few points that are none.
  std::vector<float> scan;
  for (int i = 0; i < 3000; ++i) {
    const auto k = static_cast<float>(i);
    scan.insert(scan.end(), {5.0f + 0.01f * k, -k, -0.5f * static_cast<float>(i % 3), 0.1f});
  }
  for (const std::size_t bad : {1500, 2999}) scan[4 * bad] = NAN;
  EXPECT_EQ(CloudFormat::Velodyne, recognizeCloudFile(floats("some.bin", scan)));
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(write("odd.bin", "0123456789")));
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(write("text.bin", std::string(160, '\xff'))));
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(write("empty.bin", "")));
  EXPECT_EQ(CloudFormat::None, recognizeCloudFile(write("scan.dat", std::string(160, '\0'))));
  EXPECT_EQ(CloudFormat::Velodyne, recognizeCloudFile(write("scan.bin", std::string(160, '\0'))));
}

#ifndef PLANAR_MAPPING_SANITIZED
TEST_F(LayoutFolders, RecognitionOfALongSequenceIsFast) {
  constexpr int kFrames = 4541;  // KITTI 00
  std::string times;
  std::string poses;
  image("00/image_0/000000.png");
  fs::create_directories(dir_ / "00/image_1");
  for (int i = 0; i < kFrames; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "/%06d.png", i);
    std::ofstream(dir_ / ("00/image_0" + std::string(name)), std::ios::app);
    std::ofstream(dir_ / ("00/image_1" + std::string(name)), std::ios::app);
    times += std::to_string(0.1 * i) + "\n";
    poses += "1 0 0 0 0 1 0 0 0 0 1 1.234567e+00\n";
  }
  write("00/calib.txt", kKittiProjections);
  write("00/times.txt", times);
  write("00/poses.txt", poses);
  double best_ms = 1e9;
  for (int attempt = 0; attempt < 5; ++attempt) {
    const std::clock_t start = std::clock();  // of the processor: machines may be busy
    EXPECT_EQ(static_cast<std::size_t>(kFrames), Sequence({dir_ / "00"}).size());
    best_ms = std::min(best_ms, 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  RecordProperty("milliseconds", std::to_string(best_ms));
  EXPECT_LT(best_ms, 50.0);
}
#endif

TEST(RealLayouts, FolderOfKittiOpens) {
  // A public sequence in our own folder, laid out as KITTI has it, with links.
  const std::string data =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/stereo_kitti_street";
  if (!fs::exists(data)) GTEST_SKIP() << "no real data beside the sources";
  const TemporaryDirectory dir;
  const Sequence native({data});
  fs::create_directories(dir / "03");
  fs::create_directory_symlink(data + "/left", dir / "03/image_0");
  fs::create_directory_symlink(data + "/right", dir / "03/image_1");
  const PinholeCamera& camera = native.calibration()->camera;
  char text[256];
  std::snprintf(text, sizeof text, "P0: %.9g 0 %.9g 0 0 %.9g %.9g 0 0 0 1 0\n", camera.fx,
                camera.cx, camera.fy, camera.cy);
  std::string calib = text;
  std::snprintf(text, sizeof text, "P1: %.9g 0 %.9g %.9g 0 %.9g %.9g 0 0 0 1 0\n", camera.fx,
                camera.cx, -camera.fx * *native.calibration()->baseline, camera.fy, camera.cy);
  std::ofstream(dir / "03/calib.txt") << calib << text;
  const Sequence sequence({dir / "03"});
  EXPECT_EQ(native.size(), sequence.size());
  EXPECT_NEAR(*native.calibration()->baseline, *sequence.calibration()->baseline, 1e-6);
  EXPECT_EQ(camera.width, sequence.calibration()->camera.width);
  EXPECT_EQ(native.read(3).right.pixels, sequence.read(3).right.pixels);
}

}  // namespace
}  // namespace planar_mapping::io
