// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/pose_file.h"
#include "temporary_directory.h"

namespace planar_mapping::io {
namespace {

const char* const kCamera =
    "# a camera\nimage_width: 640\nimage_height: 480\nfx: 481.2\nfy: 480\ncx: 319.5\ncy: 239.5\n";

class CalibrationFile : public ::testing::Test {
 protected:
  Calibration read(const std::string& text) {
    writeFileAtomically(dir_ / "calib.yaml", text, Overwrite::Allow);
    return readCalibration(dir_ / "calib.yaml");
  }
  void expectProblem(const std::string& text, const std::string& part) {
    try {
      read(text);
      FAIL() << "no problem with: " << text;
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  TemporaryDirectory dir_;
};

TEST_F(CalibrationFile, ReadsCameraStereoAndDepth) {
  const Calibration plain = read(kCamera);
  EXPECT_EQ(plain.camera.width, 640);
  EXPECT_EQ(plain.camera.height, 480);
  EXPECT_EQ(plain.camera.fx, 481.2);
  EXPECT_EQ(plain.camera.fy, 480.0);
  EXPECT_EQ(plain.camera.cx, 319.5);
  EXPECT_EQ(plain.camera.cy, 239.5);
  EXPECT_EQ(plain.cx_right, 319.5);
  EXPECT_FALSE(plain.baseline || plain.depth_scale);
  const Calibration all =
      read(std::string(kCamera) + "baseline_m: 0.12\ncx_right: 350\ndepth_scale: 5000\n");
  EXPECT_EQ(all.baseline, 0.12);
  EXPECT_EQ(all.cx_right, 350.0);
  EXPECT_EQ(all.depth_scale, 5000.0);
  EXPECT_FALSE(all.depth_along_ray);
  const std::string camera = std::string(kCamera) + "depth_scale: 5000\n";
  EXPECT_FALSE(read(camera + "depth_along: axis\n").depth_along_ray);
  EXPECT_TRUE(read(camera + "depth_along: ray\n").depth_along_ray);
}

TEST_F(CalibrationFile, WritesWhatItReads) {
  const std::string text = toYaml(
      read(std::string(kCamera) + "baseline_m: 0.1200505839\ncx_right: 350.1\ndepth_scale: 5000\n" +
           "depth_along: ray\n"));
  const Calibration back = read(text);
  EXPECT_EQ(back.baseline, 0.1200505839);
  EXPECT_EQ(back.cx_right, 350.1);
  EXPECT_EQ(toYaml(back), text);
}

TEST_F(CalibrationFile, NamesWhatIsWrong) {
  const std::string camera = kCamera;
  expectProblem("", "no calibration");
  expectProblem("- 1\n- 2\n", "no calibration");
  expectProblem("fx: [1\n", "line ");
  expectProblem("image_width: 640\n", "no key 'image_height'");
  expectProblem(camera + "fz: 1\n", "line 8: unknown key 'fz'; a calibration has image_width");
  expectProblem(camera + "fx: 1\n", "line 8: key 'fx' twice");
  expectProblem(camera + "depth_along: z\n", "depth_along is axis or ray");
  expectProblem(camera + "depth_scale: 0\n", "depth_scale = '0' is not in");
  expectProblem(camera + "depth_scale: .nan\n", "depth_scale is no number");
  expectProblem(camera + "depth_scale: nan\n", "is not in");
  expectProblem(camera + "baseline_m: 0.12 m\n", "baseline_m is no number");
  expectProblem(camera + "baseline_m: [1]\n", "baseline_m is no number");
  expectProblem(camera + "baseline_m: 1e9\n", "is not in");
  expectProblem("image_width: 640.5\nimage_height: 1\nfx: 1\nfy: 1\ncx: 1\ncy: 1\n",
                "no whole number");
  expectProblem("image_width: 1e9\nimage_height: 1\nfx: 1\nfy: 1\ncx: 1\ncy: 1\n", "is not in");
  expectProblem("image_width: 64\nimage_height: 1\nfx: -1\nfy: 1\ncx: 1\ncy: 1\n", "is not in");
  EXPECT_THROW(readCalibration(dir_ / "missing.yaml"), IoError);
  EXPECT_THROW(readCalibration(dir_.path()), IoError);
}

TEST_F(CalibrationFile, ReadsAPairThatIsNotRectified) {
  const std::string pair =
      std::string(kCamera) +
      "k1: -0.2\nk2: 0.05\np1: 0.001\np2: -0.002\nk3: 0.01\nk1_right: -0.1\nfx_right: 480\n"
      "cy_right: 241\nrotation: [1, 0, 0, 0, 0.8, -0.6, 0, 0.6, 0.8]\n"
      "translation_m: [-0.12, 0.01, 0]\n";
  const Calibration calibration = read(pair);
  ASSERT_TRUE(calibration.unrectified);
  const UnrectifiedPair& found = *calibration.unrectified;
  EXPECT_EQ(found.left.k1, -0.2);
  EXPECT_EQ(found.left.k3, 0.01);
  EXPECT_EQ(found.right.k1, -0.1);
  EXPECT_EQ(found.right.k2, 0.0);
  EXPECT_EQ(found.right_camera.fx, 480.0);
  EXPECT_EQ(found.right_camera.fy, 480.0);  // as the left one
  EXPECT_EQ(found.right_camera.cy, 241.0);
  EXPECT_EQ(found.right_camera.width, 640);
  // Row by row: y of the right camera is 0.8 y - 0.6 z of the left one.
  EXPECT_NEAR((found.T_right_left * Vector3(0.0, 1.0, 1.0)).y(), 0.21, 1e-12);
  EXPECT_NEAR(calibration.baseline.value_or(0.0), std::hypot(0.12, 0.01), 1e-12);

  const Calibration back = read(toYaml(calibration));
  ASSERT_TRUE(back.unrectified);
  EXPECT_TRUE(back.unrectified->T_right_left.isApprox(found.T_right_left, 1e-12));
  EXPECT_EQ(back.unrectified->left.p2, found.left.p2);
  EXPECT_EQ(back.unrectified->right_camera.cy, 241.0);
}

TEST_F(CalibrationFile, RgbdCameraMayHaveALensWithDistortion) {
  const Calibration calibration = read(std::string(kCamera) + "depth_scale: 1000\nk1: 0.2\n");
  EXPECT_EQ(calibration.distortion.value().k1, 0.2);
  EXPECT_EQ(calibration.distortion->k3, 0.0);
  EXPECT_FALSE(calibration.unrectified);
  EXPECT_EQ(read(toYaml(calibration)).distortion.value().k1, 0.2);
  EXPECT_FALSE(read(std::string(kCamera) + "depth_scale: 1000\n").distortion);
}

TEST_F(CalibrationFile, NamesWhatIsWrongWithAPairThatIsNotRectified) {
  const std::string camera = kCamera;
  const std::string rotation = "rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";
  const std::string translation = "translation_m: [-0.1, 0, 0]\n";
  expectProblem(camera + translation, "has no key 'rotation'");
  expectProblem(camera + rotation, "which also has rotation and translation_m");
  expectProblem(camera + "k1: 0.1\nbaseline_m: 0.1\n", "k1 belongs to a pair");
  expectProblem(camera + rotation + translation + "baseline_m: 0.1\n", "is translation_m");
  expectProblem(camera + rotation + "translation_m: [1, 2]\n", "no list of 3 numbers");
  expectProblem(camera + rotation + "translation_m: [1, 2, .nan]\n", "no list of 3 numbers");
  expectProblem(camera + rotation + "translation_m: 1\n", "no list of 3 numbers");
  expectProblem(camera + rotation + "translation_m: [0, 0, 0]\n", "is no baseline");
  expectProblem(camera + translation + "rotation: [1, 0, 0, 0, 1, 0, 0, 0, 2]\n",
                "is no rotation matrix");
  expectProblem(camera + translation + "rotation: [1, 0, 0, 0, 1, 0, 0, 0, -1]\n",
                "is no rotation matrix");
  expectProblem(camera + rotation + translation + "k1: x\n", "k1 is no number");
}

class PoseFile : public ::testing::Test {
 protected:
  std::string write(const std::string& text) {
    writeFileAtomically(dir_ / "poses.txt", text, Overwrite::Allow);
    return dir_ / "poses.txt";
  }
  void expectProblem(const std::string& text, const std::string& part) {
    const std::string path = write(text);
    try {
      readTumPoses(path);
      FAIL() << "no problem with: " << text;
    } catch (const IoError& error) {
      EXPECT_EQ(error.path(), path);
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  TemporaryDirectory dir_;
};

TEST_F(PoseFile, ReadsTum) {
  const double h = std::sqrt(0.5);
  const std::string half = std::to_string(h);
  const auto poses = readTumPoses(
      write("# comment\n\n1.5 1 2 3 0 0 0 1 # rest\r\n\t2.5  0 0 0 0 0 " + half + " " + half));
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].timestamp, 1.5);
  EXPECT_EQ(poses[0].pose * Vector3(1, 1, 1), Vector3(2, 3, 4));
  // 90 degrees about z: x becomes y. Six digits in the file, yet a rotation to the last one.
  EXPECT_TRUE((poses[1].pose * Vector3(1, 0, 0)).isApprox(Vector3(0, 1, 0), 1e-6));
  EXPECT_TRUE((poses[1].pose.linear() * poses[1].pose.linear().transpose())
                  .isApprox(Matrix3::Identity(), 1e-14));
}

TEST_F(PoseFile, ByteOrderMarkIsNoPartOfTheFirstLine) {
  EXPECT_EQ(readTumPoses(write("\xEF\xBB\xBF"
                               "0 1 2 3 0 0 0 1\n1 0 0 0 0 0 0 1\n"))
                .size(),
            2u);
}

TEST_F(PoseFile, EmptyFileHasNoPoses) {
  EXPECT_TRUE(readTumPoses(write("# nothing\n")).empty());
}

TEST_F(PoseFile, NamesTheMalformedLine) {
  const std::string good = "0 0 0 0 0 0 0 1\n";
  expectProblem(good + "1 2 3\n", "line 2: needs 8 numbers");
  expectProblem(good + "\n0 0 0 0 0 0 0 1 9\n", "line 3: needs 8 numbers");
  expectProblem("0 0 x 0 0 0 0 1\n", "line 1: 'x' is no finite number");
  expectProblem("0 nan 0 0 0 0 0 1\n", "'nan' is no finite number");
  expectProblem("0 1e999 0 0 0 0 0 1\n", "no finite number");
  expectProblem("0 0 0 0 0 0 0 0\n", "quaternion has length 0");
  expectProblem("0 0 0 0 0 0 0 1.1\n", "quaternion has length 1.1");
  expectProblem("0 0 0 0 1e200 1e200 0 1\n", "quaternion has length");
  expectProblem(std::string(10000, '1'), "longer than");
  EXPECT_THROW(readTumPoses(dir_ / "missing.txt"), IoError);
  EXPECT_THROW(readTumPoses(dir_.path()), IoError);
}

TEST_F(PoseFile, NormalisesQuaternionsWithinAThousandthAndRefusesOthers) {
  const auto poses = readTumPoses(write("0 1 2 3 0 0 0.7068 0.7068\n"));  // length 0.99956
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_TRUE((poses[0].pose.linear() * poses[0].pose.linear().transpose())
                  .isApprox(Matrix3::Identity(), 1e-14));
  EXPECT_TRUE((poses[0].pose * Vector3(1, 0, 0)).isApprox(Vector3(1, 3, 3), 1e-12));
  expectProblem("0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1.0011\n", "line 2: the quaternion has length");
  expectProblem("0 0 0 0 0 0 0 0.9989\n", "line 1: the quaternion has length 0.9989");
}

TEST_F(PoseFile, WritesWhatItReads) {
  Random random(3);
  std::vector<StampedPose> poses;
  for (int i = 0; i < 50; ++i) {
    StampedPose pose;
    pose.timestamp = 1341841278.8427 + i / 30.0;
    pose.pose.translation() =
        Vector3(random.normal(), 1e-7 * random.normal(), 1e6 * random.normal());
    Eigen::Quaterniond q(random.normal(), random.normal(), random.normal(), random.normal());
    pose.pose.linear() = q.normalized().toRotationMatrix();
    poses.push_back(pose);
  }
  writeTumPoses(dir_ / "out.txt", poses);
  const auto back = readTumPoses(dir_ / "out.txt");
  ASSERT_EQ(back.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(back[i].timestamp, poses[i].timestamp);
    EXPECT_EQ(back[i].pose.translation(), poses[i].pose.translation());
    EXPECT_TRUE(back[i].pose.linear().isApprox(poses[i].pose.linear(), 1e-14));
  }
  EXPECT_THROW(writeTumPoses(dir_ / "out.txt", poses), IoError);
}

TEST_F(PoseFile, WritesNothingThatItDoesNotRead) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<StampedPose> wrong(4);
  wrong[0].timestamp = nan;
  wrong[1].pose.translation().y() = nan;
  wrong[2].pose.linear()(0, 1) = nan;
  wrong[3].pose.linear() *= 2.0;
  for (const StampedPose& pose : wrong)
    EXPECT_THROW(writeTumPoses(dir_ / "out.txt", {StampedPose(), pose}), InputError);
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out.txt"));
}

}  // namespace
}  // namespace planar_mapping::io
