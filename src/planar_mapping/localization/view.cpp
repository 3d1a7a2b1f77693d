// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/features/feature_detection.h"

namespace planar_mapping::detail {
namespace {

constexpr int kFineCells = 160;      // across an image
constexpr int kContrastWindow = 11;  // cells whose mean and contrast are taken away
constexpr float kMinContrast = 4.0F;  // gray levels: what is less is noise
constexpr int kFeatures = 1000;      // at most, spread over the image
constexpr double kSiftContrast = 0.01;
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
void measureCell(const PointsView& cloud, const SensorNoise& noise, int first_column, int first_row,
                 int side, ViewCell& cell) {
  constexpr int kMostSamples = 4;  // a side
  const int step = std::max(1, side / kMostSamples);
  std::array<float, 64> depths{};
  std::size_t count = 0;
  for (int v = first_row + step / 2; v < std::min<int>(first_row + side, int(cloud.height));
       v += step) {
    for (int u = first_column + step / 2; u < std::min<int>(first_column + side, int(cloud.width));
         u += step) {
      const float z = cloud[static_cast<std::size_t>(v) * cloud.width + std::size_t(u)][2];
      if (z > 0.0F && std::isfinite(z) && count < depths.size()) depths[count++] = 1.0F / z;
    }
  }
  if (3 * count < static_cast<std::size_t>((side / step) * (side / step))) return;
  const auto end = depths.begin() + static_cast<std::ptrdiff_t>(count);
  cell.inverse_depth = static_cast<float>(medianOf(depths.begin(), end));
  const auto [least, most] = std::minmax_element(depths.begin(), end);
  const double spread = std::min(0.5 * (*most - *least), kSameSurface * double{cell.inverse_depth});
  cell.sigma = static_cast<float>(
      std::hypot(noise.depthSigma(double{cell.inverse_depth}), 0.5 * spread));
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

ViewCells cellsOf(const LocalizerFrame& frame, const cv::Mat& gray, const SensorNoise& noise,
                  int side) {
  ViewCells cells;
  cells.side = side;
  cells.across = frame.gray.width / side;
  cells.down = frame.gray.height / side;
  cells.cells.resize(static_cast<std::size_t>(cells.across * cells.down));
  normaliseGray(gray(cv::Rect(0, 0, cells.across * side, cells.down * side)), noise.gray, cells);
  for (int row = 0; row < cells.down; ++row) {
    for (int column = 0; column < cells.across; ++column) {
      ViewCell& cell = cells.cells[static_cast<std::size_t>(row * cells.across + column)];
      measureCell(frame.cloud, noise, column * side, row * side, side, cell);
      if (!cell.hasDepth()) continue;
      const Vector3 ray = frame.camera.rayOf((column + 0.5) * side - 0.5, (row + 0.5) * side - 0.5);
      cell.point = ray.cast<float>() / cell.inverse_depth;
    }
  }
  addNormals(cells);
  return cells;
}

}  // namespace

DepthThere depthAt(const PointsView& cloud, double column, double row, const SensorNoise& noise) {
  constexpr int kRadius = 2;  // pixels
  constexpr std::size_t kLeast = 5;
  std::array<double, (2 * kRadius + 1) * (2 * kRadius + 1)> around{};
  std::size_t count = 0;
  const auto x = static_cast<int>(std::lround(column));
  const auto y = static_cast<int>(std::lround(row));
  for (int v = std::max(0, y - kRadius); v <= std::min<int>(int(cloud.height) - 1, y + kRadius);
       ++v) {
    for (int u = std::max(0, x - kRadius); u <= std::min<int>(int(cloud.width) - 1, x + kRadius);
         ++u) {
      const float z = cloud[static_cast<std::size_t>(v) * cloud.width + std::size_t(u)][2];
      if (z > 0.0F && std::isfinite(z)) around[count++] = 1.0 / double{z};
    }
  }
  DepthThere there;
  if (count < kLeast) return there;
  const auto end = around.begin() + static_cast<std::ptrdiff_t>(count);
  const double median = medianOf(around.begin(), end);
  const auto [least, most] = std::minmax_element(around.begin(), end);
  if (*most - *least > 2.0 * kSameSurface * median) return there;
  there.inverse_depth = median;
  there.sigma = std::hypot(noise.depthSigma(median), 0.5 * (*most - *least));
  return there;
}

View makeView(const LocalizerFrame& frame, const SensorNoise& noise) {
  View view;
  view.camera.fx = frame.camera.fx;
  view.camera.fy = frame.camera.fy;
  view.camera.cx = frame.camera.cx;
  view.camera.cy = frame.camera.cy;
  view.camera.pixel_error = noise.pixel;
  view.width = frame.gray.width;
  view.height = frame.gray.height;
  view.timestamp = frame.timestamp;
  const cv::Mat gray = matOf(frame.gray);
  const int side = std::max(1, static_cast<int>(std::lround(double(view.width) / kFineCells)));
  view.fine = cellsOf(frame, gray, noise, side);
  view.coarse = cellsOf(frame, gray, noise, 2 * side);
  std::vector<float> depths;
  for (const ViewCell& cell : view.coarse.cells)
    if (cell.hasDepth()) depths.push_back(1.0F / cell.inverse_depth);
  if (!depths.empty()) view.median_depth = medianOf(depths.begin(), depths.end());
  return view;
}

void addFeatures(const LocalizerFrame& frame, const SensorNoise& noise, View& view) {
  const cv::Mat gray = matOf(frame.gray);
  std::vector<cv::KeyPoint> found;
  const auto sift = cv::SIFT::create(0, 3, std::getenv("SC") ? atof(std::getenv("SC")) : kSiftContrast);
  sift->detect(gray, found);
  std::vector<Detection> detections;
  detections.reserve(found.size());
  for (const cv::KeyPoint& point : found)
    detections.push_back({point.pt.x, point.pt.y, point.response});
  std::vector<cv::KeyPoint> chosen;
  for (const std::size_t i : spreadEvenly(detections, view.width, view.height, std::getenv("NF") ? atoi(std::getenv("NF")) : kFeatures))
    chosen.push_back(found[i]);
  cv::Mat rows;
  sift->compute(gray, chosen, rows);
  view.features.clear();
  view.features.reserve(chosen.size());
  for (int i = 0; i < rows.rows; ++i) {
    const cv::KeyPoint& point = chosen[static_cast<std::size_t>(i)];
    ViewFeature feature;
    const DepthThere there =
        depthAt(frame.cloud, double{point.pt.x}, double{point.pt.y}, noise);
    feature.seen = {double{point.pt.x}, double{point.pt.y}, there.inverse_depth};
    const double sigma = std::hypot(noise.pixel, noise.pixel_per_size * double{point.size});
    feature.variance = {sigma * sigma, sigma * sigma, there.sigma * there.sigma};
    feature.size = point.size;
    view.features.push_back(feature);
    float* row = rows.ptr<float>(i);
    float sum = 0.0F;
    for (int k = 0; k < rows.cols; ++k) sum += row[k];
    for (int k = 0; k < rows.cols; ++k) row[k] = std::sqrt(row[k] / std::max(1.0F, sum));
  }
  view.descriptors = rows;
}

}  // namespace planar_mapping::detail
