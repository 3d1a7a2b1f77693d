// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/pose_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace io {
namespace {

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

TEST_F(PoseFile, ReadsRealTrajectories) {
  const std::string data = std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no real data beside the sources";
  EXPECT_EQ(readTumPoses(data + "rgbd_tum_cabinet/poses.txt").size(), 58u);
  EXPECT_EQ(readTumPoses(data + "stereo_kitti_street/poses.txt").size(), 28u);
}

}  // namespace
}  // namespace io
}  // namespace planar_mapping
