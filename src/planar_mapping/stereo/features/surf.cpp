// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "planar_mapping/base/simd.h"
#include "planar_mapping/stereo/features/feature_detection.h"
#include "planar_mapping/stereo/features/surf_descriptor.h"

// SURF (Bay, Tuytelaars, Van Gool, 2006): maxima of the determinant of the Hessian over place and
// scale.
namespace planar_mapping::detail {
namespace {

constexpr int kOctaves = 3;
constexpr int kIntervals = 4;
constexpr int kStep = 2;  // pixels between samples of the first octave

/// Sum over a rectangle that moves along the rows.
struct Box {
  const std::int32_t *top, *bottom;  ///< sums over the rows before it, and to its last one
  int before, end;                   ///< columns from the middle
  PLANAR_MAPPING_INLINE std::int32_t operator()(int column) const {
    const std::int32_t* upper = top + column;
    const std::int32_t* lower = bottom + column;
    return static_cast<std::int32_t>(
        static_cast<std::uint32_t>(lower[end]) - static_cast<std::uint32_t>(lower[before]) -
        static_cast<std::uint32_t>(upper[end]) + static_cast<std::uint32_t>(upper[before]));
  }
};

/// The rectangles of the three box filters about the pixels of one row.
struct HessianFilter {
  Box across_all, across_middle, down_all, down_middle;
  Box upper_left, upper_right, lower_left, lower_right;
};

PLANAR_MAPPING_MULTIVERSION
void determinants(const HessianFilter& filter, int step, int first, int last, float per_area,
                  float* __restrict out) {
  const HessianFilter f = filter;
  // Sums of a filter are below 2^24, exact as floats.
  for (int i = first; i < last; ++i) {
    const int column = i * step;
    const std::int32_t sum_xx = f.across_all(column) - f.across_middle(column) * 3;
    const std::int32_t sum_yy = f.down_all(column) - f.down_middle(column) * 3;
    const std::int32_t sum_xy =
        f.lower_left(column) + f.upper_right(column) - f.upper_left(column) - f.lower_right(column);
    const float xx = static_cast<float>(sum_xx) * per_area;
    const float yy = static_cast<float>(sum_yy) * per_area;
    const float xy = static_cast<float>(sum_xy) * per_area;
    out[i] = std::max(xx * yy - 0.81f * xy * xy, 0.0f);
  }
}

/// Determinants of the Hessian of one octave; 0 at the rim and where negative.
class Octave {
 public:
  Octave(const IntegralImage& image, int octave)
      : step_(kStep << octave), rows_(image.height() / step_), columns_(image.width() / step_) {
    responses_.assign(indexOf(kIntervals, 0, 0), 0.0f);
    for (int interval = 0; interval < kIntervals; ++interval) {
      const int lobe = step_ * (interval + 1) + 1;
      const int half = lobe / 2;     // of a lobe
      const int wide = lobe + half;  // from the middle of three lobes to their end
      const int flank = lobe - 1;    // half of a filter's other side
      const int apart = half + 1;    // from the middle to that of a quarter
      const auto per_area = static_cast<float>(1.0 / std::pow(3.0 * lobe, 2.0));
      const int border = borderOf(interval);
      for (int row = border; row < rows_ - border; ++row) {
        const int y = row * step_;
        // Rows and columns from the middle, both ends included.
        const auto box = [&](int first_row, int last_row, int first, int last) {
          return Box{image.before(y + first_row), image.before(y + last_row + 1), first, last + 1};
        };
        const HessianFilter filter{box(-flank, flank, -wide, wide),
                                   box(-flank, flank, -half, half),
                                   box(-wide, wide, -flank, flank),
                                   box(-half, half, -flank, flank),
                                   box(-apart - half, -apart + half, -apart - half, -apart + half),
                                   box(-apart - half, -apart + half, apart - half, apart + half),
                                   box(apart - half, apart + half, -apart - half, -apart + half),
                                   box(apart - half, apart + half, apart - half, apart + half)};
        determinants(filter, step_, border, columns_ - border, per_area,
                     &responses_[indexOf(interval, row, 0)]);
      }
    }
  }

  double step() const { return step_; }
  double determinant(int interval, int row, int column) const {
    return responses_[indexOf(interval, row, column)];
  }
  /// Calls add(interval, row, column) for each local maximum of at least the threshold.
  template <typename Add>
  void visitMaxima(double threshold, Add&& add) const {
    for (int interval = 1; interval + 1 < kIntervals; ++interval) {
      const int border = borderOf(interval + 1) + 1;
      for (int row = border; row < rows_ - border; ++row)
        for (int column = border; column < columns_ - border; ++column)
          if (determinant(interval, row, column) >= threshold && isMaximum(interval, row, column))
            add(interval, row, column);
    }
  }

  /// Side of the filter's lobe at an interval that may lie between two.
  double lobeOf(double interval) const { return step_ * (interval + 1.0) + 1.0; }

 private:
  static int borderOf(int interval) { return (3 * (2 * interval + 3) + 1) / 2; }
  std::size_t indexOf(int interval, int row, int column) const {
    return (static_cast<std::size_t>(interval) * static_cast<std::size_t>(rows_) +
            static_cast<std::size_t>(row)) *
               static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  bool isMaximum(int interval, int row, int column) const {
    const double value = determinant(interval, row, column);
    for (int i = interval - 1; i <= interval + 1; ++i)
      for (int r = row - 1; r <= row + 1; ++r)
        for (int c = column - 1; c <= column + 1; ++c)
          if (determinant(i, r, c) > value) return false;
    return true;
  }

  int step_;
  int rows_;
  int columns_;
  std::vector<float> responses_;
};
/// Where the parabola through a maximum and its neighbours has its top; false where that is nearer
/// to a neighbour.
bool interpolate(const Octave& octave, int interval, int row, int column, BlobPoint& point) {
  const auto at = [&](int di, int dr, int dc) {
    return octave.determinant(interval + di, row + dr, column + dc);
  };
  const double value = at(0, 0, 0);
  const Vector3 gradient((at(0, 0, 1) - at(0, 0, -1)) / 2.0, (at(0, 1, 0) - at(0, -1, 0)) / 2.0,
                         (at(1, 0, 0) - at(-1, 0, 0)) / 2.0);
  const double cr = (at(0, 1, 1) + at(0, -1, -1) - at(0, -1, 1) - at(0, 1, -1)) / 4.0;
  const double ci = (at(1, 0, 1) + at(-1, 0, -1) - at(-1, 0, 1) - at(1, 0, -1)) / 4.0;
  const double ri = (at(1, 1, 0) + at(-1, -1, 0) - at(-1, 1, 0) - at(1, -1, 0)) / 4.0;
  Matrix3 hessian;
  hessian << at(0, 0, 1) + at(0, 0, -1) - 2.0 * value, cr, ci, cr,
      at(0, 1, 0) + at(0, -1, 0) - 2.0 * value, ri, ci, ri,
      at(1, 0, 0) + at(-1, 0, 0) - 2.0 * value;
  const Vector3 offset = -(hessian.inverse() * gradient);
  if (!(offset.cwiseAbs().maxCoeff() < 0.5)) return false;
  point.column = (column + offset.x()) * octave.step();
  point.row = (row + offset.y()) * octave.step();
  point.scale = 1.2 / 9.0 * 3.0 * octave.lobeOf(interval + offset.z());
  return true;
}

}  // namespace

DetectedFeatures detectSurf(const cv::Mat& gray, int count, double threshold) {
  constexpr float kUnit = 4096.0f;  // of descriptors of length 1
  constexpr int kSmallest = 64;     // pixels a side; the filters need room
  constexpr double kSide = 32.0;    // scales of the square about a point that wavelets may touch
  DetectedFeatures features;
  features.descriptors = Descriptors(false, kSurfLength);
  if (gray.cols < kSmallest || gray.rows < kSmallest) return features;

  const IntegralImage image(gray);
  std::vector<BlobPoint> points;
  std::vector<Detection> detections;
  for (int o = 0; o < kOctaves; ++o) {
    const Octave octave(image, o);
    octave.visitMaxima(threshold, [&](int interval, int row, int column) {
      BlobPoint point;
      if (!interpolate(octave, interval, row, column, point)) return;
      const int side = static_cast<int>(kSide * point.scale);
      const int left = static_cast<int>(point.column + 0.5) - side / 2;
      const int top = static_cast<int>(point.row + 0.5) - side / 2;
      if (left < 0 || top < 0 || left + side > gray.cols || top + side > gray.rows) return;
      points.push_back(point);
      detections.push_back({static_cast<float>(point.column), static_cast<float>(point.row),
                            static_cast<float>(octave.determinant(interval, row, column))});
    });
  }
  const SurfDescriptor describe(image);
  std::array<float, kSurfLength> descriptor;
  for (const std::size_t i : spreadEvenly(detections, gray.cols, gray.rows, count)) {
    describe(points[i], descriptor);
    features.places.push_back(detections[i]);
    features.descriptors.addValues(descriptor.data(), kUnit);
  }
  return features;
}

}  // namespace planar_mapping::detail
