// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/features/feature_detection.h"

namespace planar_mapping::detail {
namespace {

constexpr int kFineCells = 160;       // across an image
constexpr int kContrastWindow = 11;   // cells whose mean and contrast are taken away
constexpr float kMinContrast = 4.0F;  // gray levels: what is less is noise
constexpr int kFeatures = 1000;       // at most, spread over the image
constexpr double kSiftContrast = 0.01;
constexpr int kCorners = 400;              // at most
constexpr double kCornerQuality = 0.01;    // of the best one
constexpr double kCornerDistance = 0.012;  // of the width
// Inverse depths of one surface lie within so much of each other, of their median.
constexpr double kSameSurface = 0.1;

template <typename Values>
double medianOf(Values begin, Values end) {
  const auto middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end);
  return *middle;
}

/// Gray values freed of local mean and contrast, and what one gray level is in them.
void normaliseGray(const cv::Mat& gray, double sigma, ViewCells& cells) {
  cv::Mat mean_gray, values, mean, squares;
  cv::resize(gray, mean_gray, cv::Size(cells.across, cells.down), 0, 0, cv::INTER_AREA);
  mean_gray.convertTo(values, CV_32F);
  const cv::Size window(kContrastWindow, kContrastWindow);
  cv::boxFilter(values, mean, CV_32F, window);
  cv::boxFilter(values.mul(values), squares, CV_32F, window);
  for (int row = 0; row < cells.down; ++row) {
    for (int column = 0; column < cells.across; ++column) {
      const float m = mean.at<float>(row, column);
      const float variance = squares.at<float>(row, column) - m * m;
      const float contrast = std::max(kMinContrast, std::sqrt(std::max(0.0F, variance)));
      ViewCell& cell = cells.cells[static_cast<std::size_t>(row * cells.across + column)];
      cell.gray = (values.at<float>(row, column) - m) / contrast;
      cell.gray_sigma = static_cast<float>(sigma) / contrast;
    }
  }
}

/// Median inverse depth of the pixels of a cell that are measured.
void measureCell(const cv::Mat& inverse_depth, const SensorNoise& noise, int first_column,
                 int first_row, int side, ViewCell& cell) {
  constexpr int kMostSamples = 4;  // a side
  const int step = std::max(1, side / kMostSamples);
  std::array<float, 64> depths{};
  std::size_t count = 0;
  for (int v = first_row + step / 2; v < first_row + side; v += step) {
    const float* row = inverse_depth.ptr<float>(v);
    for (int u = first_column + step / 2; u < first_column + side; u += step) {
      if (row[u] > 0.0F && count < depths.size()) depths[count++] = row[u];
    }
  }
  if (3 * count < static_cast<std::size_t>((side / step) * (side / step))) return;
  const auto end = depths.begin() + static_cast<std::ptrdiff_t>(count);
  cell.inverse_depth = static_cast<float>(medianOf(depths.begin(), end));
  const auto [least, most] = std::minmax_element(depths.begin(), end);
  const double spread = std::min(0.5 * (*most - *least), kSameSurface * double{cell.inverse_depth});
  const double sigma = noise.depthSigma(double{cell.inverse_depth});
  cell.sigma = static_cast<float>(std::sqrt(sigma * sigma + 0.25 * spread * spread));
}

void addNormals(ViewCells& cells) {
  for (int row = 1; row + 1 < cells.down; ++row) {
    for (int column = 1; column + 1 < cells.across; ++column) {
      const std::size_t i = static_cast<std::size_t>(row * cells.across + column);
      ViewCell& cell = cells.cells[i];
      if (!cell.hasDepth()) continue;
      const std::array<const ViewCell*, 4> around = {&cells.cells[i - 1], &cells.cells[i + 1],
                                                     &cells.at(column, row - 1),
                                                     &cells.at(column, row + 1)};
      const bool flat = std::all_of(around.begin(), around.end(), [&](const ViewCell* other) {
        return other->hasDepth() && std::abs(other->inverse_depth - cell.inverse_depth) <=
                                        static_cast<float>(kSameSurface) * cell.inverse_depth;
      });
      if (!flat) continue;
      const Eigen::Vector3f normal =
          (around[1]->point - around[0]->point).cross(around[3]->point - around[2]->point);
      const float length = normal.norm();
      if (!(length > 0.0F)) continue;
      cell.normal = normal / (normal.dot(cell.point) > 0.0F ? -length : length);
    }
  }
}

ViewCells cellsOf(const View& view, const PinholeCamera& camera, const cv::Mat& gray, int side) {
  ViewCells cells;
  cells.side = side;
  cells.across = view.width / side;
  cells.down = view.height / side;
  cells.cells.resize(static_cast<std::size_t>(cells.across * cells.down));
  normaliseGray(gray(cv::Rect(0, 0, cells.across * side, cells.down * side)), view.noise.gray,
                cells);
  for (int row = 0; row < cells.down; ++row) {
    for (int column = 0; column < cells.across; ++column) {
      ViewCell& cell = cells.cells[static_cast<std::size_t>(row * cells.across + column)];
      measureCell(view.inverse_depth, view.noise, column * side, row * side, side, cell);
      if (!cell.hasDepth()) continue;
      const Vector3 ray = camera.rayOf((column + 0.5) * side - 0.5, (row + 0.5) * side - 0.5);
      cell.point = ray.cast<float>() / cell.inverse_depth;
    }
  }
  addNormals(cells);
  return cells;
}

}  // namespace

DepthThere depthAt(const View& view, double column, double row) {
  constexpr int kRadius = 2;  // pixels
  constexpr std::size_t kLeast = 5;
  std::array<float, (2 * kRadius + 1) * (2 * kRadius + 1)> around{};
  std::size_t count = 0;
  const auto x = static_cast<int>(std::lround(column));
  const auto y = static_cast<int>(std::lround(row));
  for (int v = std::max(0, y - kRadius); v <= std::min(view.height - 1, y + kRadius); ++v) {
    const float* row_there = view.inverse_depth.ptr<float>(v);
    for (int u = std::max(0, x - kRadius); u <= std::min(view.width - 1, x + kRadius); ++u) {
      if (row_there[u] > 0.0F) around[count++] = row_there[u];
    }
  }
  DepthThere there;
  if (count < kLeast) return there;
  const auto end = around.begin() + static_cast<std::ptrdiff_t>(count);
  const double median = medianOf(around.begin(), end);
  const auto [least, most] = std::minmax_element(around.begin(), end);
  const double spread = 0.5 * double{*most - *least};
  if (spread > kSameSurface * median) return there;
  there.inverse_depth = median;
  there.sigma = std::hypot(view.noise.depthSigma(median), spread);
  return there;
}

View makeView(const LocalizerFrame& frame, const SensorNoise& noise) {
  View view;
  view.camera.setPinhole(frame.camera);
  view.camera.pixel_error = noise.pixel;
  view.width = frame.gray.width;
  view.height = frame.gray.height;
  view.noise = noise;
  const cv::Mat gray = matOf(frame.gray);
  cv::buildOpticalFlowPyramid(gray, view.pyramid, cv::Size(kFlowWindow, kFlowWindow), kFlowLevels,
                              true, cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
  view.inverse_depth.create(view.height, view.width, CV_32F);
  for (int row = 0; row < view.height; ++row) {
    float* there = view.inverse_depth.ptr<float>(row);
    for (int column = 0; column < view.width; ++column) {
      const float z = frame.cloud[static_cast<std::size_t>(row) * frame.cloud.width +
                                  static_cast<std::size_t>(column)][2];
      there[column] = z > 0.0F && std::isfinite(z) ? 1.0F / z : 0.0F;
    }
  }
  const int side = std::max(1, static_cast<int>(std::lround(double(view.width) / kFineCells)));
  view.fine = cellsOf(view, frame.camera, gray, side);
  view.coarse = cellsOf(view, frame.camera, gray, 2 * side);
  std::vector<float> depths;
  for (const ViewCell& cell : view.coarse.cells)
    if (cell.hasDepth()) depths.push_back(1.0F / cell.inverse_depth);
  if (!depths.empty()) view.median_depth = medianOf(depths.begin(), depths.end());
  return view;
}

void addCorners(View& view) {
  if (!view.corners.empty()) return;
  std::vector<cv::Point2f> found;
  cv::goodFeaturesToTrack(view.pyramid[0], found, kCorners, kCornerQuality,
                          kCornerDistance * view.width);
  for (const cv::Point2f& place : found) {
    const DepthThere there = depthAt(view, double{place.x}, double{place.y});
    if (!(there.inverse_depth > 0.0)) continue;
    ViewFeature corner;
    corner.seen = {double{place.x}, double{place.y}, there.inverse_depth};
    const double pixel = view.noise.pixel * view.noise.pixel;
    corner.variance = {pixel, pixel, there.sigma * there.sigma};
    view.corners.push_back(corner);
  }
}

void addFeatures(View& view) {
  if (view.has_features) return;
  view.has_features = true;
  std::vector<cv::KeyPoint> found;
  cv::Mat rows;
  cv::SIFT::create(kFeatures, 3, kSiftContrast)
      ->detectAndCompute(view.pyramid[0], cv::noArray(), found, rows);
  view.features.clear();
  view.features.reserve(found.size());
  for (int i = 0; i < rows.rows; ++i) {
    const cv::KeyPoint& point = found[static_cast<std::size_t>(i)];
    const double column = double{point.pt.x};
    const double line = double{point.pt.y};
    ViewFeature feature;
    const DepthThere there = depthAt(view, column, line);
    feature.seen = {column, line, there.inverse_depth};
    feature.size = point.size;
    const double sigma =
        std::hypot(view.noise.pixel, view.noise.pixel_per_size * double{feature.size});
    feature.variance = {sigma * sigma, sigma * sigma, there.sigma * there.sigma};
    view.features.push_back(feature);
    float* row = rows.ptr<float>(i);
    float sum = 0.0F;
    for (int k = 0; k < rows.cols; ++k) sum += row[k];
    for (int k = 0; k < rows.cols; ++k) row[k] = std::sqrt(row[k] / std::max(1.0F, sum));
  }
  view.descriptors = rows;
}

}  // namespace planar_mapping::detail
