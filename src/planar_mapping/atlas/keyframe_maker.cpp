// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/keyframe_maker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "planar_mapping/atlas/keyframe_cells.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/features/feature_detection.h"
#include "planar_mapping/stereo/opencv_threads.h"

namespace planar_mapping {
namespace {

// With the grid of depths, 30 kB: a feature takes 64 bytes and 24 of its sighting.
constexpr int kFeatures = 176;
constexpr int kCandidates = 3 * kFeatures;
constexpr int kDetectionWidth = 240;      // pixels; OpenCV's SIFT doubles the image first
constexpr double kContrast = 0.02;        // of SIFT's extrema
constexpr double kThumbnailWidth = 80.0;  // pixels, at most
constexpr double kThumbnailHeight = 60.0;
constexpr int kCell = 8;  // pixels
constexpr int kMaxCells = 4800;
constexpr int kDepthRadius = 2;        // pixels around a feature
constexpr double kSameSurface = 0.1;   // spread of inverse depths there, of the median
constexpr std::size_t kPoints = 4800;  // of a cloud without an image

/// Depths as cells: numbers that survive rounding to 16 bits.
std::uint16_t encoded(double inverse_depth) {
  return static_cast<std::uint16_t>(
      std::clamp(std::lround(inverse_depth * detail::kInverseDepthUnits), 1L, 65535L));
}

void requireGray(const io::Image& gray, const FeatureCamera& camera) {
  io::requireSound(gray, "key");
  if (gray.channels != 1) throw InputError("the image of a keyframe has to be gray");
  camera.validate();
}

/// Size and thumbnail, and a grid without depths.
Keyframe begin(const io::Image& gray, const FeatureCamera& camera) {
  Keyframe key;
  key.camera = camera;
  key.width = gray.width;
  key.height = gray.height;
  const double pixels = static_cast<double>(gray.width) * gray.height;
  const int side = std::max(kCell, static_cast<int>(std::ceil(std::sqrt(pixels / kMaxCells))));
  key.cells_across = (gray.width + side - 1) / side;
  const int down = (gray.height + side - 1) / side;
  key.inverse_depths.assign(static_cast<std::size_t>(key.cells_across * down), 0);
  const double scale =
      std::min({1.0, kThumbnailWidth / double(gray.width), kThumbnailHeight / double(gray.height)});
  const auto scaled = [&](int length) { return std::max(1, static_cast<int>(length * scale)); };
  key.thumbnail = io::encodePng(io::scaledTo(gray, scaled(gray.width), scaled(gray.height)));
  return key;
}

/// A smaller image, and pixels of the old one per pixel.
struct Reduced {
  explicit Reduced(const io::Image& gray) {
    const int width = std::min(kDetectionWidth, gray.width);
    const int height = std::max(1, gray.height * width / gray.width);
    across = static_cast<double>(gray.width) / width;
    down = static_cast<double>(gray.height) / height;
    cv::resize(detail::matOf(gray), image, cv::Size(width, height), 0, 0, cv::INTER_AREA);
  }
  Vector2 toFull(const cv::Point2f& place) const {
    return {(place.x + 0.5) * across - 0.5, (place.y + 0.5) * down - 0.5};
  }
  cv::Mat image;
  double across = 1.0;
  double down = 1.0;
};

/// RootSIFT, two values a byte.
void addDescriptor(const float* values, Keyframe& key) {
  constexpr int kLength = 128;
  constexpr double kLargest = 0.5;  // that is told apart; hardly any is larger
  double sum = 0.0;
  for (int i = 0; i < kLength; ++i) sum += values[i];
  const auto level = [&](int i) {
    const double root = std::sqrt(values[i] / std::max(sum, 1.0));
    return static_cast<unsigned>(std::clamp(std::lround(root * 15.0 / kLargest), 0L, 15L));
  };
  for (int i = 0; i < kLength; i += 2)
    key.descriptors.push_back(static_cast<std::uint8_t>(level(i) | level(i + 1) << 4u));
  key.descriptor_bytes = kLength / 2;
}

/// Describes places of the reduced image; sightings are those of the places.
void describe(const Reduced& reduced, std::vector<cv::KeyPoint> points,
              const std::vector<FeatureSighting>& sightings, Keyframe& key) {
  if (points.empty()) return;
  for (std::size_t i = 0; i < points.size(); ++i) points[i].class_id = static_cast<int>(i);
  cv::Mat rows;
  cv::SIFT::create()->compute(reduced.image, points, rows);
  for (int row = 0; row < rows.rows; ++row) {
    const auto origin = static_cast<std::size_t>(points[static_cast<std::size_t>(row)].class_id);
    key.sightings.push_back(sightings[origin]);
    addDescriptor(rows.ptr<float>(row), key);
  }
}

/// Inverse depth around a pixel; 0 where there is none or more than one surface.
double inverseDepthAt(const PointsView& cloud, double column, double row) {
  const auto x = static_cast<int>(std::lround(column));
  const auto y = static_cast<int>(std::lround(row));
  std::vector<double> around;
  for (int v = std::max(0, y - kDepthRadius);
       v <= std::min(static_cast<int>(cloud.height) - 1, y + kDepthRadius); ++v) {
    for (int u = std::max(0, x - kDepthRadius);
         u <= std::min(static_cast<int>(cloud.width) - 1, x + kDepthRadius); ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * cloud.width + static_cast<std::size_t>(u);
      if (cloud.isMeasured(i) && cloud[i][2] > 0.0F) around.push_back(1.0 / cloud[i][2]);
    }
  }
  constexpr std::size_t kLeast = 5;
  if (around.size() < kLeast) return 0.0;
  const double median = detail::ranked(around, around.size() / 2);
  const auto [least, most] = std::minmax_element(around.begin(), around.end());
  return *most - *least <= kSameSurface * median ? median : 0.0;
}

/// Median depth of 4 x 4 pixels of a cell; 0 where none was measured.
double sampledDepth(const PointsView& cloud, const detail::KeyframeCells& cells, int column,
                    int row) {
  constexpr int kSide = 4;
  std::array<float, kSide * kSide> depths{};
  std::ptrdiff_t count = 0;
  const auto pixel = [](int cell, int sample, int sides, std::uint32_t pixels) {
    return (static_cast<std::size_t>(kSide * cell + sample) * 2 + 1) * pixels /
           static_cast<std::size_t>(2 * kSide * sides);
  };
  for (int v = 0; v < kSide; ++v) {
    const std::size_t line = pixel(row, v, cells.down(), cloud.height) * cloud.width;
    for (int u = 0; u < kSide; ++u) {
      const std::size_t i = line + pixel(column, u, cells.across(), cloud.width);
      if (cloud.isMeasured(i) && cloud[i][2] > 0.0F)
        depths[static_cast<std::size_t>(count++)] = cloud[i][2];
    }
  }
  if (count == 0) return 0.0;
  std::nth_element(depths.begin(), depths.begin() + count / 2, depths.begin() + count);
  return depths[static_cast<std::size_t>(count / 2)];
}

/// Describes the strongest, spread over the image. Sightings are those of the points.
void describeStrongest(const Reduced& reduced, const std::vector<cv::KeyPoint>& points,
                       const std::vector<FeatureSighting>& sightings, Keyframe& key) {
  std::vector<detail::Detection> detections;
  detections.reserve(points.size());
  for (const cv::KeyPoint& point : points)
    detections.push_back({point.pt.x, point.pt.y, point.response});
  std::vector<cv::KeyPoint> chosen;
  std::vector<FeatureSighting> chosen_sightings;
  for (const std::size_t i :
       detail::spreadEvenly(detections, reduced.image.cols, reduced.image.rows, kFeatures)) {
    chosen.push_back(points[i]);
    chosen_sightings.push_back(sightings[i]);
  }
  describe(reduced, std::move(chosen), chosen_sightings, key);
}

}  // namespace

Keyframe makeKeyframe(const io::Image& gray, const PointsView& cloud, const FeatureCamera& camera) {
  requireGray(gray, camera);
  if (static_cast<int>(cloud.width) != gray.width || static_cast<int>(cloud.height) != gray.height)
    throw InputError("the cloud of a keyframe has to be as large as its image");
  const detail::OpenCvThreads threads;
  Keyframe key = begin(gray, camera);
  const detail::KeyframeCells cells(key);
  for (int row = 0; row < cells.down(); ++row) {
    for (int column = 0; column < cells.across(); ++column) {
      const double depth = sampledDepth(cloud, cells, column, row);
      if (depth > 0.0)
        key.inverse_depths[static_cast<std::size_t>(row * cells.across() + column)] =
            encoded(1.0 / depth);
    }
  }

  const Reduced reduced(gray);
  std::vector<cv::KeyPoint> found;
  cv::SIFT::create(kCandidates, 3, kContrast)->detect(reduced.image, found);
  std::vector<cv::KeyPoint> points;
  std::vector<FeatureSighting> sightings;
  for (const cv::KeyPoint& point : found) {
    const Vector2 place = reduced.toFull(point.pt);
    const double inverse_depth = inverseDepthAt(cloud, place.x(), place.y());
    if (inverse_depth <= 0.0) continue;
    points.push_back(point);
    sightings.push_back({place.x(), place.y(), inverse_depth});
  }
  describeStrongest(reduced, points, sightings, key);
  return key;
}

Keyframe makeKeyframe(const PointsView& cloud, bool is_scan) {
  std::vector<std::size_t> measured;
  for (std::size_t i = 0; i < cloud.size; ++i)
    if (cloud.isMeasured(i)) measured.push_back(i);
  const std::size_t count = std::min(kPoints, measured.size());
  const double apart = static_cast<double>(measured.size()) / static_cast<double>(count);
  Keyframe key;
  key.is_scan = is_scan;
  std::vector<Vector3> points;
  double farthest = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    // Not always of the same columns of an image.
    const double within = std::fmod(0.618034 * static_cast<double>(k), 1.0);
    points.push_back(
        cloud.point(measured[static_cast<std::size_t>((static_cast<double>(k) + within) * apart)]));
    farthest = std::max(farthest, points.back().cwiseAbs().maxCoeff());
  }
  constexpr double kLargest = std::numeric_limits<std::int16_t>::max();
  constexpr double kLeastStep = 1e-9;  // metres: all at the sensor
  key.point_step = std::max(farthest / kLargest, kLeastStep);
  for (const Vector3& point : points)
    for (int axis = 0; axis < 3; ++axis)
      key.points.push_back(static_cast<std::int16_t>(std::lround(point[axis] / key.point_step)));
  return key;
}

}  // namespace planar_mapping
