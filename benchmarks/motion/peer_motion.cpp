// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The peer of scripts/motion_table.py: the motion from each frame to the next by SIFT, ratio test
// and PnP in RANSAC, all of OpenCV, with nothing else around it.
//
//   peer_motion FOLDER [EVERY]
//
// prints "frame tx ty tz qx qy qz qw", T_before_now, for each step it finds.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/layouts/sequence.h"

namespace {

using namespace planar_mapping;

constexpr int kFeatures = 2000;
constexpr float kRatio = 0.8f;
constexpr float kPixels = 2.0f;
constexpr std::size_t kMinInliers = 12;
constexpr double kMinDepth = 0.2;  // metres

struct View {
  std::vector<cv::KeyPoint> keys;
  cv::Mat descriptors;
  std::vector<cv::Point3d> points;  ///< z = 0 without depth
};

cv::Mat grayOf(const io::Image& image) {
  const io::Image gray = io::toGray(image);
  return cv::Mat(gray.height, gray.width, CV_8U, const_cast<std::uint8_t*>(gray.pixels.data()))
      .clone();
}

/// Depths of places of a rectified pair by optical flow, there and back.
std::vector<double> pairDepths(const cv::Mat& left, const cv::Mat& right,
                               const std::vector<cv::Point2f>& places,
                               const io::Calibration& calibration) {
  const cv::Size window(21, 21);
  constexpr int kLevels = 4;
  std::vector<cv::Point2f> there, back;
  std::vector<std::uint8_t> found, returned;
  cv::calcOpticalFlowPyrLK(left, right, places, there, found, cv::noArray(), window, kLevels);
  cv::calcOpticalFlowPyrLK(right, left, there, back, returned, cv::noArray(), window, kLevels);
  const double infinity = calibration.camera.cx - calibration.cx_right;
  std::vector<double> depths(places.size(), 0.0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double disparity = double{places[i].x} - there[i].x - infinity;
    const bool good = found[i] != 0 && returned[i] != 0 && cv::norm(back[i] - places[i]) < 0.5 &&
                      std::abs(places[i].y - there[i].y) < 1.0f && disparity > 1.0;
    if (good) depths[i] = calibration.camera.fx * *calibration.baseline / disparity;
  }
  return depths;
}

View viewOf(const io::Frame& frame, const io::Calibration& calibration) {
  View view;
  const cv::Mat gray = grayOf(frame.left);
  cv::SIFT::create(kFeatures)->detectAndCompute(gray, cv::noArray(), view.keys, view.descriptors);
  if (view.keys.empty()) return view;
  std::vector<cv::Point2f> places;
  cv::KeyPoint::convert(view.keys, places);
  std::vector<double> depths(places.size(), 0.0);
  if (!frame.right.empty()) {
    depths = pairDepths(gray, grayOf(frame.right), places, calibration);
  } else {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto column = static_cast<std::size_t>(std::lround(places[i].x));
      const auto row = static_cast<std::size_t>(std::lround(places[i].y));
      if (column >= frame.cloud.width || row >= frame.cloud.height) continue;
      const double depth = frame.cloud.xyz[3 * (row * frame.cloud.width + column) + 2];
      if (depth > kMinDepth) depths[i] = depth;
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vector3 point =
        depths[i] * calibration.camera.rayOf(double{places[i].x}, double{places[i].y});
    view.points.emplace_back(point.x(), point.y(), point.z());
  }
  return view;
}

/// T_before_now. \return false if it is not found
bool findMotion(const View& before, const View& now, const cv::Mat& camera, Pose& motion) {
  if (before.keys.empty() || now.keys.size() < 2) return false;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher().knnMatch(before.descriptors, now.descriptors, nearest, 2);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const std::vector<cv::DMatch>& two : nearest) {
    if (two.size() < 2 || !(two[0].distance < kRatio * two[1].distance)) continue;
    const cv::Point3d& point = before.points[static_cast<std::size_t>(two[0].queryIdx)];
    if (!(point.z > 0.0)) continue;
    points.push_back(point);
    pixels.push_back(now.keys[static_cast<std::size_t>(two[0].trainIdx)].pt);
  }
  if (points.size() < 6) return false;
  cv::Mat turn, shift;
  std::vector<int> inliers;
  constexpr int kIterations = 1000;
  const bool found = cv::solvePnPRansac(points, pixels, camera, cv::noArray(), turn, shift, false,
                                        kIterations, kPixels, 0.99, inliers, cv::SOLVEPNP_P3P);
  if (!found || inliers.size() < kMinInliers) return false;
  std::vector<cv::Point3d> in_points;
  std::vector<cv::Point2d> in_pixels;
  for (const int i : inliers) {
    in_points.push_back(points[static_cast<std::size_t>(i)]);
    in_pixels.push_back(pixels[static_cast<std::size_t>(i)]);
  }
  cv::solvePnPRefineLM(in_points, in_pixels, camera, cv::noArray(), turn, shift);
  const Vector3 axis(turn.at<double>(0), turn.at<double>(1), turn.at<double>(2));
  Pose T_now_before = Pose::Identity();
  if (axis.norm() > 0.0) {
    T_now_before.linear() = Eigen::AngleAxisd(axis.norm(), axis.normalized()).toRotationMatrix();
  }
  T_now_before.translation() =
      Vector3(shift.at<double>(0), shift.at<double>(1), shift.at<double>(2));
  motion = T_now_before.inverse();
  return true;
}

void run(const std::string& folder, std::size_t every) {
  const io::Sequence sequence({folder});
  const io::Calibration& calibration = *sequence.calibration();
  const PinholeCamera& c = calibration.camera;
  const cv::Mat camera = (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  View before;
  for (std::size_t k = 0; k * every < sequence.size(); ++k) {
    View now = viewOf(sequence.read(k * every), calibration);
    Pose motion;
    if (k > 0 && findMotion(before, now, camera, motion)) {
      const Vector3 t = motion.translation();
      const Eigen::Quaterniond q(motion.linear());
      std::printf("%zu %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", k, t.x(), t.y(), t.z(), q.x(), q.y(),
                  q.z(), q.w());
    }
    before = std::move(now);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int every = argc > 2 ? std::atoi(argv[2]) : 1;
  if (argc < 2 || every < 1) {
    std::fprintf(stderr, "usage: peer_motion FOLDER [EVERY]\n");
    return 2;
  }
  try {
    cv::setRNGSeed(1);
    run(argv[1], static_cast<std::size_t>(every));
  } catch (const Error& error) {
    std::fprintf(stderr, "peer_motion: %s\n", error.what());
    return 4;
  }
  return 0;
}
