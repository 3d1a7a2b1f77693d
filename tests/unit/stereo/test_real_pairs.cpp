// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Real pairs with ground truth, all with the default parameters.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/stereo/feature_tracker.h"
#include "planar_mapping/stereo/stereo_matcher.h"
#include "real_data.h"

namespace planar_mapping {
namespace {

using test::isMissing;
using test::realData;

struct RealPair {
  io::Image left;
  io::Image right;
  io::Calibration calibration;
};

RealPair readPair(const std::string& set, const std::string& number = "000000") {
  const auto read = [&](const std::string& side) {
    const std::string stem = realData(set) + "/" + side + "/" + number;
    return io::readImage(std::filesystem::exists(stem + ".png") ? stem + ".png" : stem + ".jpg");
  };
  return {read("left"), read("right"), io::readCalibration(realData(set) + "/calib.yaml")};
}

/// \param least  fraction of the pixels with truth that have a disparity
void expectRight(const DisparityImage& disparity, const io::DepthImage& truth, double least,
                 const std::string& name) {
  ASSERT_EQ(disparity.values.size(), truth.values.size());
  int known = 0;
  int found = 0;
  int bad = 0;
  int near = 0;
  double squares = 0.0;
  for (std::size_t i = 0; i < truth.values.size(); ++i) {
    if (truth.values[i] == 0) continue;
    ++known;
    if (std::isnan(disparity.values[i])) continue;
    ++found;
    const double error = std::abs(disparity.values[i] - truth.values[i] / 256.0);
    bad += error > 2.0 ? 1 : 0;
    near += error < 1.0 ? 1 : 0;
    squares += error < 1.0 ? error * error : 0.0;
  }
  std::cout << name << ": found " << static_cast<double>(found) / known << ", beyond 2 px "
            << static_cast<double>(bad) / found << ", rms below 1 px " << std::sqrt(squares / near)
            << std::endl;
  EXPECT_GT(found, least * known);
  EXPECT_LT(bad, found * 6 / 100);
}

class GroundTruth : public testing::TestWithParam<const char*> {};

TEST_P(GroundTruth, FewDisparitiesAreWrongAndMostAreThere) {
  const std::string set = GetParam();
  if (isMissing(set)) GTEST_SKIP() << "no " << set;
  RealPair pair = readPair(set);
  const io::DepthImage truth = io::readDepthPng(realData(set) + "/disp_gt/000000.png");
  expectRight(StereoMatcher().match(pair.left, pair.right, pair.calibration), truth, 0.9, set);
  // A camera that exposes half as long.
  for (std::uint8_t& value : pair.right.pixels) value /= 2;
  expectRight(StereoMatcher().match(pair.left, pair.right, pair.calibration), truth, 0.88,
              set + ", right image half as bright");
}

TEST_P(GroundTruth, FeaturesAreRightBelowThePixel) {
  const std::string set = GetParam();
  if (isMissing(set)) GTEST_SKIP() << "no " << set;
  const RealPair pair = readPair(set);
  const io::DepthImage truth = io::readDepthPng(realData(set) + "/disp_gt/000000.png");
  FeatureTracker tracker;
  std::vector<double> errors;
  for (const KeyFeature& feature : tracker.track(pair.left, pair.right, pair.calibration)) {
    const auto column = static_cast<std::size_t>(std::lround(feature.column));
    const auto row = static_cast<std::size_t>(std::lround(feature.row));
    const std::uint16_t value = truth.values[row * truth.width + column];
    if (value != 0) errors.push_back(std::abs(feature.disparity - value / 256.0));
  }
  ASSERT_GT(errors.size(), 100u);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.25);
}

INSTANTIATE_TEST_SUITE_P(Middlebury, GroundTruth,
                         testing::Values("stereo_middlebury_planar/barn2",
                                         "stereo_middlebury_planar/bull",
                                         "stereo_middlebury_planar/poster",
                                         "stereo_middlebury_2014/motorcycle"),
                         [](const auto& tested) {
                           const std::string name = tested.param;
                           return name.substr(name.find('/') + 1);
                         });

/// Plane through the points near the given one, by least squares, trimmed twice.
void fitPlane(const std::vector<Vector3>& points, Vector3& normal, double& offset) {
  for (const double band : {0.02, 0.01, 0.006}) {
    Vector3 mean = Vector3::Zero();
    Matrix3 moments = Matrix3::Zero();
    double count = 0.0;
    for (const Vector3& p : points) {
      if (std::abs(normal.dot(p) + offset) > band) continue;
      mean += p;
      moments += p * p.transpose();
      count += 1.0;
    }
    mean /= count;
    const Eigen::SelfAdjointEigenSolver<Matrix3> solver(moments / count - mean * mean.transpose());
    Vector3 fitted = solver.eigenvectors().col(0);
    if (fitted.dot(normal) < 0.0) fitted = -fitted;
    normal = fitted;
    offset = -normal.dot(mean);
  }
}

TEST(RealPairs, TheTableOfTheChessBoardIsWhereItIs) {
  const std::string set = "stereo_chess_table";
  std::ifstream file(realData(set) + "/planes_gt.txt");
  std::string line;
  int frames = 0;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    std::string number;
    Vector3 truth;
    double offset = 0.0;
    fields >> number >> truth.x() >> truth.y() >> truth.z() >> offset;
    const RealPair pair = readPair(set, number);
    const DisparityImage disparity = StereoMatcher().match(pair.left, pair.right, pair.calibration);
    std::vector<float> xyz;
    triangulate(disparity, pair.calibration, xyz);
    std::vector<Vector3> points;
    for (std::size_t i = 0; i < xyz.size(); i += 3) {
      if (!std::isnan(xyz[i])) points.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
    }
    Vector3 normal = truth;
    double found = offset;
    fitPlane(points, normal, found);
    const double angle = std::acos(std::min(1.0, normal.dot(truth))) * 180.0 / M_PI;
    // Where the optical axis meets the table, which is where the board lies.
    const Vector3 center = Vector3(0.0, 0.0, -offset / truth.z());
    const double distance = 1000.0 * std::abs(normal.dot(center) + found);
    EXPECT_LT(angle, 0.5) << number;
    EXPECT_LT(distance, 3.0) << number;
    RecordProperty("angle_deg_" + number, std::to_string(angle));
    RecordProperty("distance_mm_" + number, std::to_string(distance));
    ++frames;
  }
  EXPECT_GE(frames, 3);
}

TEST(RealPairs, FeaturesOfACameraAtRestKeepTheirNumberAndPlace) {
  const std::string set = "stereo_euroc_room";
  if (isMissing(set)) GTEST_SKIP() << "no " << set;
  FeatureTracker tracker;
  std::vector<KeyFeature> first;
  for (int frame = 0; frame < 4; ++frame) {
    const RealPair pair = readPair(set, "00000" + std::to_string(frame));
    const std::vector<KeyFeature> features = tracker.track(pair.left, pair.right, pair.calibration);
    EXPECT_GT(features.size(), 200u);
    if (frame == 0) {
      first = features;
      continue;
    }
    EXPECT_GT(tracker.report().tracked + tracker.report().reseen, features.size() / 2);
    std::vector<double> moves;
    for (const KeyFeature& feature : features) {
      for (const KeyFeature& before : first) {
        if (before.track == feature.track)
          moves.push_back(std::hypot(feature.column - before.column, feature.row - before.row));
      }
    }
    ASSERT_FALSE(moves.empty());
    std::sort(moves.begin(), moves.end());
    EXPECT_LT(moves[moves.size() / 2], 1.0);  // 3 mm, seen from 1.3 m
  }
}

}  // namespace
}  // namespace planar_mapping
