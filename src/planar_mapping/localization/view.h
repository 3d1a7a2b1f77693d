// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/localization/localizer.h"

namespace planar_mapping::detail {

/// A place of the image that is found again in others.
struct ViewFeature {
  FeatureSighting seen;                ///< inverse depth 0 = not known
  Vector3 variance = Vector3::Zero();  ///< of column, row (px^2) and inverse depth (1/m^2)
  float size = 0.0F;                   ///< diameter of what is described, pixels

  bool hasDepth() const { return seen.inverse_depth > 0.0; }
};

/// A cell of the image: a piece of surface.
struct ViewCell {
  float inverse_depth = 0.0F;                        ///< median, 1/m; 0 = nothing measured
  float sigma = 0.0F;                                ///< of it
  Eigen::Vector3f point = Eigen::Vector3f::Zero();   ///< its middle, camera frame, metres
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< to the camera; zero = not known
  float gray = 0.0F;                                 ///< free of local mean and contrast
  float gray_sigma = 1.0F;                           ///< of it

  bool hasDepth() const { return inverse_depth > 0.0F; }
  bool hasNormal() const { return !normal.isZero(0.0F); }
};

/// Square cells of an image, row by row.
struct ViewCells {
  int side = 1;  ///< pixels
  int across = 0;
  int down = 0;
  std::vector<ViewCell> cells;

  const ViewCell& at(int column, int row) const {
    return cells[static_cast<std::size_t>(row * across + column)];
  }
  /// Place in cells of a pixel, middles of cells at whole numbers.
  double placeOf(double pixel) const { return (pixel + 0.5) / side - 0.5; }
};

/// What is kept of a frame to place others by it.
struct View {
  FeatureCamera camera;
  int width = 0;                     ///< pixels
  int height = 0;                    ///< pixels
  std::vector<ViewFeature> corners;  ///< of a keyframe, for optical flow
  std::vector<ViewFeature> features;
  cv::Mat descriptors;           ///< RootSIFT, a row of 128 floats of length 1 for each feature
  ViewCells fine;                ///< 4 x 4 pixels of a VGA image
  ViewCells coarse;              ///< 8 x 8
  std::vector<cv::Mat> pyramid;  ///< for optical flow, as cv::buildOpticalFlowPyramid() makes it
  cv::Mat inverse_depth;         ///< of each pixel, 1/m, 0 = none
  double median_depth = 0.0;     ///< metres; 0 = nothing measured

  bool has_features = false;
  SensorNoise noise;  ///< of its sensor

  bool contains(const FeatureSighting& place) const {
    return place.column >= 0.0 && place.row >= 0.0 && place.column <= width - 1 &&
           place.row <= height - 1;
  }
};

/// Cells, pyramid and depths of a frame, no features yet.
View makeView(const LocalizerFrame& frame, const SensorNoise& noise);
/// Finds the features, if that has not been done: SIFT places with their descriptors and depth.
void addFeatures(View& view);

/// Finds the corners, if that has not been done.
void addCorners(View& view);

/// Window of optical flow, pixels a side, and levels above the image.
constexpr int kFlowWindow = 15;
constexpr int kFlowLevels = 2;

/// Inverse depth around a pixel and its sigma.
struct DepthThere {
  double inverse_depth = 0.0;  ///< 0 = nothing measured, or more than one surface
  double sigma = 0.0;
};
DepthThere depthAt(const View& view, double column, double row);

}  // namespace planar_mapping::detail
