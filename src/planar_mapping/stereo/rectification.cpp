// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/rectification.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/opencv_threads.h"

namespace planar_mapping {
namespace {

cv::Mat cameraMatrix(const PinholeCamera& camera) {
  return (cv::Mat_<double>(3, 3) << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0,
          1.0);
}

cv::Mat distortionOf(const io::LensDistortion& lens) {
  return (cv::Mat_<double>(1, 5) << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
}

}  // namespace

struct Rectifier::Maps {
  // Fixed-point source positions and their fractions, of the left and the right image.
  cv::Mat places[2];
  cv::Mat fractions[2];
};

Rectifier::Rectifier(const io::Calibration& calibration) : maps_(std::make_unique<Maps>()) {
  if (!calibration.unrectified) {
    throw InputError("the calibration is of a pair that is rectified already");
  }
  const io::UnrectifiedPair& pair = *calibration.unrectified;
  const PinholeCamera& camera = calibration.camera;
  cv::Mat R, t;
  cv::eigen2cv(Matrix3(pair.T_right_left.linear()), R);
  cv::eigen2cv(Vector3(pair.T_right_left.translation()), t);
  const cv::Size size(camera.width, camera.height);
  const cv::Mat K[2] = {cameraMatrix(camera), cameraMatrix(pair.right_camera)};
  const cv::Mat D[2] = {distortionOf(pair.left), distortionOf(pair.right)};
  cv::Mat turn[2];
  cv::Mat projection[2];
  cv::Mat unused;
  cv::stereoRectify(K[0], D[0], K[1], D[1], size, R, t, turn[0], turn[1], projection[0],
                    projection[1], unused, cv::CALIB_ZERO_DISPARITY, 0.0, size);
  const double fx = projection[1].at<double>(0, 0);
  const double shift = projection[1].at<double>(0, 3);
  if (!(std::isfinite(fx) && fx > 0.0) || !std::isfinite(shift)) {
    throw InputError("the pair cannot be rectified: its views have nothing in common");
  }
  if (std::abs(projection[1].at<double>(1, 3)) > std::abs(shift)) {
    throw InputError("the pair cannot be rectified: its cameras stand one above the other");
  }
  if (shift >= 0.0) {
    throw InputError(
        "translation_m puts the right camera to the left of the left one; left and right are "
        "exchanged, or the transformation is the inverse one");
  }
  for (int side = 0; side < 2; ++side) {
    cv::initUndistortRectifyMap(K[side], D[side], turn[side], projection[side], size, CV_16SC2,
                                maps_->places[side], maps_->fractions[side]);
  }
  rectified_.camera.width = camera.width;
  rectified_.camera.height = camera.height;
  rectified_.camera.fx = fx;
  rectified_.camera.fy = projection[0].at<double>(1, 1);
  rectified_.camera.cx = projection[0].at<double>(0, 2);
  rectified_.camera.cy = projection[0].at<double>(1, 2);
  rectified_.cx_right = projection[1].at<double>(0, 2);
  rectified_.baseline = -shift / fx;
  cv::cv2eigen(turn[0], rotation_);
}

Rectifier::~Rectifier() = default;
Rectifier::Rectifier(Rectifier&& other) noexcept = default;
Rectifier& Rectifier::operator=(Rectifier&& other) noexcept = default;

io::Image Rectifier::rectify(const io::Image& image, bool left) const {
  io::requireSound(image, left ? "left" : "right");
  const PinholeCamera& camera = rectified_.camera;
  if (image.width != camera.width || image.height != camera.height) {
    throw InputError("the images are " + detail::sizeText(image.width, image.height) +
                     " pixels, their calibration " + detail::sizeText(camera.width, camera.height));
  }
  const detail::OpenCvThreads threads;
  io::Image out = image;
  const int side = left ? 0 : 1;
  cv::Mat target = detail::matOf(out);
  cv::remap(detail::matOf(image), target, maps_->places[side], maps_->fractions[side],
            cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return out;
}

io::Image Rectifier::rectifyLeft(const io::Image& image) const {
  return rectify(image, true);
}

io::Image Rectifier::rectifyRight(const io::Image& image) const {
  return rectify(image, false);
}

}  // namespace planar_mapping
