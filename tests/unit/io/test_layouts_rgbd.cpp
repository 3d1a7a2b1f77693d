// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Public data sets of depth images.
#include <cmath>

#include "layout_folders.h"

namespace planar_mapping::io {
namespace {

namespace fs = std::filesystem;

TEST_F(LayoutFolders, TumMatchesByTimeAndKnowsItsCameras) {
  const Sequence sequence({tum()});
  EXPECT_EQ("TUM RGB-D", sequence.layout());
  ASSERT_EQ(3u, sequence.size());
  EXPECT_EQ(520.9, sequence.calibration()->camera.fx);
  EXPECT_EQ(5000.0, *sequence.calibration()->depth_scale);
  EXPECT_EQ(10.1, sequence.describe(1).timestamp);
  EXPECT_NEAR(2.0, sequence.describe(1).T_world_sensor->translation().x(), 1e-9);
  EXPECT_TRUE(sequence.notes().empty());
}

TEST_F(LayoutFolders, TumPosesBetweenTwoAreInterpolated) {
  const std::string folder = tum();
  write("freiburg2_desk/groundtruth.txt",
        "9.96 0 0 0 0 0 0 1\n10.04 8 0 0 0 0 1 0\n10.3 9 0 0 0 0 0 1\n");
  const Sequence sequence({folder});
  ASSERT_EQ(1u, sequence.size());  // 10.1 and 10.2 are too far from any pose
  const Pose pose = *sequence.describe(0).T_world_sensor;
  EXPECT_NEAR(4.0, pose.translation().x(), 1e-9);
  EXPECT_NEAR(0.0, pose.linear()(0, 0), 1e-9);  // half of half a turn
  ASSERT_EQ(1u, sequence.notes().size());
  EXPECT_NE(std::string::npos, sequence.notes()[0].find("2 of 3 frames are left out"));
  SequenceOptions options;
  options.ignore_poses = true;
  const Sequence all({folder}, options);
  EXPECT_EQ(3u, all.size());
  EXPECT_FALSE(all.describe(2).T_world_sensor.has_value());
  EXPECT_TRUE(all.notes().empty());
}

TEST_F(LayoutFolders, TumLeavesOutWhatHasNoPartner) {
  const std::string folder = tum();
  write("freiburg2_desk/rgb.txt", "10.008 rgb/10.008.png\n10.15 rgb/10.108.png\n");
  const Sequence sequence({folder});
  EXPECT_EQ(1u, sequence.size());
  EXPECT_NE(std::string::npos, sequence.notes().at(0).find("2 of 3 depth images"));
  write("freiburg2_desk/rgb.txt", "99 rgb/10.008.png\n");
  expectProblem(folder, "rgb.txt has no image within 20 ms");
}

TEST_F(LayoutFolders, TumSaysWhereTimesDoNotIncrease) {
  const std::string folder = tum();
  write("freiburg2_desk/rgb.txt", "10.108 rgb/10.108.png\n10.008 rgb/10.008.png\n");
  const Sequence sequence({folder});
  ASSERT_FALSE(sequence.notes().empty());
  EXPECT_NE(std::string::npos, sequence.notes()[0].find("rgb.txt do not increase"));
}

TEST_F(LayoutFolders, TumSaysWhatIsMissing) {
  expectProblem(tum("desk"), "give its calib.yaml");
  const std::string folder = tum();
  write("freiburg2_desk/groundtruth.txt", "500 0 0 0 0 0 0 1\n");
  expectProblem(folder, "no pose within 20 ms of any of the 3 frames");
  write("freiburg2_desk/depth.txt", "10.0 ../../../etc/passwd\n");
  expectProblem(folder, "is no file of this folder");
  write("freiburg2_desk/depth.txt", "soon depth/10.0.png\n");
  expectProblem(folder, "line 1: 'soon' is no finite number");
  fs::remove(folder + "/depth.txt");
  expectProblem(folder, "depth.txt: no such file");
}

TEST_F(LayoutFolders, TumAssociationsMayComeInEitherOrder) {
  const std::string folder = tum();
  fs::remove(folder + "/rgb.txt");
  fs::remove(folder + "/depth.txt");
  const std::string list = "freiburg2_desk/associations.txt";
  write(list, "10.008 rgb/10.008.png 10.0 depth/10.0.png\n");
  EXPECT_EQ(10.0, Sequence({folder}).describe(0).timestamp);
  EXPECT_NE(std::string::npos, Sequence({folder}).path(0).find("/depth/"));
  write(list, "10.0 depth/10.0.png 10.008 rgb/10.008.png\n");
  EXPECT_EQ(10.0, Sequence({folder}).describe(0).timestamp);
  EXPECT_NE(std::string::npos, Sequence({folder}).files(0).at(1).find("/rgb/"));
}

TEST_F(LayoutFolders, Open3dTakesImagesInOrder) {
  const std::string folder = open3d();
  const Sequence sequence({folder});
  EXPECT_EQ("Open3D RGB-D", sequence.layout());
  ASSERT_EQ(2u, sequence.size());
  EXPECT_EQ(2.5, sequence.calibration()->camera.fy);
  EXPECT_EQ(1.5, sequence.calibration()->camera.cx);
  EXPECT_EQ(1000.0, *sequence.calibration()->depth_scale);
  EXPECT_EQ(0.5, sequence.describe(1).T_world_sensor->translation().x());
  EXPECT_DOUBLE_EQ(1.0 / 30.0, sequence.describe(1).timestamp);
  EXPECT_FALSE(sequence.read(1).left.empty());
  write("o3d/trajectory.log", "1 1 2\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  SequenceOptions options;
  EXPECT_EQ(1u, Sequence({folder}, options).size());
  options.ignore_poses = true;
  EXPECT_EQ(2u, Sequence({folder}, options).size());
  write("o3d/trajectory.log", "0 0 1\n1 0 0 0\n");
  expectProblem(folder, "is cut short");
  fs::remove(folder + "/trajectory.log");
  EXPECT_EQ(PoseSource::None, Sequence({folder}).poseSource());
  fs::remove(folder + "/camera_intrinsic.json");
  expectProblem(folder, "put Open3D's camera_intrinsic.json here");
  fs::remove(folder + "/color/000000-1234.jpg.png");
  fs::rename(folder + "/color/000001-1234.jpg.png", folder + "/color/0.5.png");
  expectProblem(folder, "holds 1 images for 2 depth images");
}

TEST_F(LayoutFolders, OfATelephoneOnlyWhatItIsSureOfCounts) {
  for (const char* name : {"000000", "000001", "000002"}) {
    depth(std::string("stray/depth/") + name + ".png");
    fs::create_directories(dir_ / "stray/confidence");
    const Image confidence{4, 3, 1, {0, 1, 2, 2, 0, 1, 2, 2, 0, 0, 0, 0}};
    writeImage(dir_ / (std::string("stray/confidence/") + name + ".png"), confidence);
  }
  write("stray/camera_matrix.csv", "1440.0, 0.0, 959.5\n0.0, 1440.0, 719.5\n0.0, 0.0, 1.0");
  const std::string header = "timestamp, frame, x, y, z, qx, qy, qz, qw\n";
  write("stray/odometry.csv",
        header +
            "7.5, 000000, 0.5, 1, 2, 0, 0, 0, 1\n"
            "7.6, 000001, 0.6, 1, 2, 0, 0, 0, 1, 1440.0, 1440.0, 959.5, 719.5\n");
  const std::string folder = dir_ / "stray";
  const Sequence sequence({folder});
  EXPECT_EQ("Stray Scanner", sequence.layout());
  EXPECT_EQ(PoseSource::File, sequence.poseSource());
  ASSERT_EQ(2u, sequence.size());
  EXPECT_NE(std::string::npos, sequence.notes().at(0).find("1 of 3 depth images are left out"));
  EXPECT_EQ(7.6, sequence.describe(1).timestamp);
  EXPECT_EQ(0.6, sequence.describe(1).T_world_sensor->translation().x());
  const Calibration& known = *sequence.calibration();
  EXPECT_EQ(1000.0, *known.depth_scale);
  EXPECT_DOUBLE_EQ(1440.0 * known.camera.width / 1920.0, known.camera.fx);
  EXPECT_DOUBLE_EQ(0.5 * (known.camera.width - 1), known.camera.cx);
  const auto measured = [&]() {
    const CloudData cloud = Sequence({folder}).read(0).cloud;
    std::size_t count = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i) count += cloud.view().isMeasured(i) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(4u, measured());
  fs::remove_all(folder + "/confidence");
  EXPECT_EQ(12u, measured());
  write("stray/camera_matrix.csv", "1440.0, 0.0, 959.5\n");
  expectProblem(folder, "is no camera matrix");
  write("stray/camera_matrix.csv", "2880.0, 0.0, 1919.5\n0.0, 2880.0, 1439.5\n0.0, 0.0, 1.0");
  expectProblem(folder, "is not of images of 1920 x 1440");
  write("stray/camera_matrix.csv", "1440.0, 0.0, 959.5\n0.0, 1440.0, 719.5\n0.0, 0.0, 1.0");
  write("stray/odometry.csv", header + "7.5, 000000, 0.5, 1\n");
  expectProblem(folder, "is cut short");
  write("stray/odometry.csv", header + "7.5, 000000, , 0, 0, 0, 0, 0, 1, 1440.0, 959.5\n");
  expectProblem(folder, "the quaternion is not of length 1");
  write("stray/odometry.csv", header + "7.5, 000000, 0.5, 1, 2, 0, 0, 0, 1\n");
  fs::create_directories(folder + "/confidence");
  writeImage(folder + "/confidence/000000.png", Image{3, 4, 1, std::vector<std::uint8_t>(12, 2)});
  EXPECT_EQ(2u, Sequence({folder}).files(0).size());
  EXPECT_THROW(Sequence({folder}).read(0), IoError);
}

TEST_F(LayoutFolders, FramesMayHaveAPoseFileEach) {
  const std::string pose = "1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  for (const char* name : {"frame-000000", "frame-000001", "frame-000002"}) {
    depth(std::string("seven/seq-01/") + name + ".depth.png");
    image(std::string("seven/seq-01/") + name + ".color.png");
    if (name[11] != '2') write(std::string("seven/seq-01/") + name + ".pose.txt", pose);
  }
  const std::string folder = dir_ / "seven/seq-01";
  expectProblem(folder, "the depth camera of 7-Scenes has fx = fy = 585");
  write("seven/camera-intrinsics.txt", "2 0 1.5\n0 2.5 1\n0 0 1\n");
  const Sequence sequence({folder});
  ASSERT_EQ(2u, sequence.size());  // the third has no pose
  EXPECT_NE(std::string::npos, sequence.notes().at(0).find("1 of 3 frames are left out"));
  EXPECT_EQ(2.5, sequence.calibration()->camera.fy);
  EXPECT_EQ(4, sequence.calibration()->camera.width);
  EXPECT_EQ(1000.0, *sequence.calibration()->depth_scale);
  EXPECT_EQ(0.5, sequence.describe(1).T_world_sensor->translation().x());
  EXPECT_EQ(1.0 / 30.0, sequence.describe(1).timestamp);
  EXPECT_FALSE(sequence.read(1).left.empty());
  SequenceOptions options;
  options.ignore_poses = true;
  EXPECT_EQ(3u, Sequence({folder}, options).size());
  write("seven/seq-01/frame-000000.pose.txt", "1 0 0\n");
  expectProblem(folder, "needs 4 numbers");
  write("seven/seq-01/frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n");
  expectProblem(folder, "needs 3 rows");
  write("seven/seq-01/frame-000000.pose.txt", "0 0 0 0\n0 0 0 0\n0 0 0 0\n");
  expectProblem(folder, "has no rotation matrix");
  const Sequence lenient({folder}, options);  // poses only measure
  EXPECT_EQ(3u, lenient.size());
  EXPECT_FALSE(lenient.describe(0).T_world_sensor.has_value());
  EXPECT_TRUE(lenient.describe(1).T_world_sensor.has_value());
}

TEST_F(LayoutFolders, ScannetLeavesOutWhatWasLost) {
  for (const char* name : {"0", "2", "10"}) {
    depth(std::string("scene/depth/") + name + ".png");
    image(std::string("scene/color/") + name + ".png");
    write(std::string("scene/pose/") + name + ".txt",
          name[0] == '2' ? "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n"
                         : "1 0 0 0\n0 1 0 " + std::string(name) + "\n0 0 1 0\n0 0 0 1\n");
  }
  write("scene/intrinsic/intrinsic_depth.txt", "2 0 1.5 0\n0 2 1 0\n0 0 1 0\n0 0 0 1\n");
  const Sequence sequence({dir_ / "scene"});
  EXPECT_EQ("ScanNet", sequence.layout());
  ASSERT_EQ(2u, sequence.size());
  EXPECT_EQ(10.0, sequence.describe(1).T_world_sensor->translation().y());
  EXPECT_EQ(10.0 / 30.0, sequence.describe(1).timestamp);
  EXPECT_EQ(1.5, sequence.calibration()->camera.cx);
}

TEST_F(LayoutFolders, IclIsMirroredAndInNumberOrder) {
  const Sequence sequence({icl()});
  EXPECT_EQ("ICL-NUIM", sequence.layout());
  ASSERT_EQ(3u, sequence.size());
  EXPECT_NE(std::string::npos, sequence.path(2).find("/10.png"));
  const PinholeCamera& camera = sequence.calibration()->camera;
  EXPECT_EQ(Eigen::Vector4d(481.2, 480.0, 319.5, 239.5),
            Eigen::Vector4d(camera.fx, camera.fy, camera.cx, camera.cy));
  EXPECT_EQ(5000.0, *sequence.calibration()->depth_scale);
  EXPECT_DOUBLE_EQ(9.0 / 30.0, sequence.describe(1).timestamp);
  const Pose pose = *sequence.describe(0).T_world_sensor;
  EXPECT_EQ(-1.0, pose.translation().y());
  // The given rotation takes x to y, y to z, z to x; mirrored in y on both sides.
  EXPECT_LT((pose.linear() * Vector3::UnitX() + Vector3::UnitY()).norm(), 1e-12);
  EXPECT_LT((pose.linear() * Vector3::UnitZ() - Vector3::UnitX()).norm(), 1e-12);
  EXPECT_NEAR(1.0, pose.linear().determinant(), 1e-12);
}

/// Pixels of a lens with distortion, made with an inverse of its own: a slanted wall, coloured by
/// where it is.
TEST_F(LayoutFolders, TumImagesOfALensWithDistortionAreUndistorted) {
  const std::string name = "freiburg1_wall";
  tum(name);
  const PinholeCamera camera{517.3, 516.5, 318.6, 255.3, 640, 480};
  DepthImage depth{640, 480, std::vector<std::uint16_t>(640 * 480)};
  Image image{640, 480, 1, std::vector<std::uint8_t>(640 * 480)};
  for (int row = 0; row < 480; ++row) {
    for (int column = 0; column < 640; ++column) {
      const double u = (column - camera.cx) / camera.fx, v = (row - camera.cy) / camera.fy;
      double x = u, y = v;
      for (int times = 0; times < 50; ++times) {
        const double r2 = x * x + y * y;
        const double radial = 1.0 + 0.2624 * r2 - 0.9531 * r2 * r2 + 1.1633 * r2 * r2 * r2;
        const double dx = -2.0 * 0.0054 * x * y + 0.0026 * (r2 + 2.0 * x * x);
        const double dy = -0.0054 * (r2 + 2.0 * y * y) + 2.0 * 0.0026 * x * y;
        x = (u - dx) / radial;
        y = (v - dy) / radial;
      }
      const auto i = static_cast<std::size_t>(row * 640 + column);
      depth.values[i] = static_cast<std::uint16_t>(std::lround(5000.0 * 2.0 / (1.0 - 0.5 * x)));
      image.pixels[i] = static_cast<std::uint8_t>(std::lround(128.0 + 150.0 * x));
    }
  }
  writeDepthPng(dir_ / (name + "/depth/10.0.png"), depth, Overwrite::Allow);
  writeImage(dir_ / (name + "/rgb/10.008.png"), image, Overwrite::Allow);
  const Frame frame = Sequence({dir_ / name}).read(0);
  std::size_t seen = 0;
  for (std::size_t i = 0; i < frame.cloud.size(); ++i) {
    if (!frame.cloud.view().isMeasured(i)) continue;
    ++seen;
    const float *const p = &frame.cloud.xyz[3 * i], x = p[0] / p[2];
    ASSERT_NEAR(p[2], 2.0 + 0.5 * p[0], 0.004) << i;  // half a pixel, 0.2 mm of the file
    ASSERT_NEAR(frame.left.pixels[i], 128.0 + 150.0 * x, 1.1) << i;
  }
  EXPECT_GT(seen, frame.cloud.size() * 9 / 10);
}

}  // namespace
}  // namespace planar_mapping::io
