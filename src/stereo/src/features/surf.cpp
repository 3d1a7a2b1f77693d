// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "features/feature_detection.h"
#include "features/integral_image.h"

// SURF (Bay, Tuytelaars, Van Gool, 2006): maxima of the determinant of the Hessian over place and
// scale, described by sums of Haar wavelets in a square turned with the point.
namespace planar_mapping::detail {
namespace {

constexpr int kOctaves = 3;
constexpr int kIntervals = 4;
constexpr int kStep = 2;  // pixels between samples of the first octave

/// Determinants of the Hessian of one octave; 0 at the rim and where negative.
class Octave {
 public:
  Octave(const IntegralImage& image, int octave);

  double step() const { return step_; }
  double determinant(int interval, int row, int column) const {
    return responses_[indexOf(interval, row, column)];
  }
  /// Calls add(interval, row, column) for each local maximum of at least the threshold.
  template <typename Add>
  void visitMaxima(double threshold, Add&& add) const;
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
  bool isMaximum(int interval, int row, int column) const;

  int step_;
  int rows_;
  int columns_;
  std::vector<float> responses_;
};

Octave::Octave(const IntegralImage& image, int octave)
    : step_(kStep << octave), rows_(image.height() / step_), columns_(image.width() / step_) {
  responses_.assign(indexOf(kIntervals, 0, 0), 0.0f);
  const SteppedSums sums(image, step_);
  BoxRows across(sums), lobes(sums), middle(sums), upper(sums), lower(sums);
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
      across.set(y - flank, y + flank);
      lobes.set(y - wide, y + wide);
      middle.set(y - half, y + half);
      upper.set(y - apart - half, y - apart + half);
      lower.set(y + apart - half, y + apart + half);
      const BoxRows::Sum across_all = across.sum(-wide, wide);
      const BoxRows::Sum across_middle = across.sum(-half, half);
      const BoxRows::Sum down_all = lobes.sum(-flank, flank);
      const BoxRows::Sum down_middle = middle.sum(-flank, flank);
      const BoxRows::Sum upper_left = upper.sum(-apart - half, -apart + half);
      const BoxRows::Sum upper_right = upper.sum(apart - half, apart + half);
      const BoxRows::Sum lower_left = lower.sum(-apart - half, -apart + half);
      const BoxRows::Sum lower_right = lower.sum(apart - half, apart + half);
      float* out = &responses_[indexOf(interval, row, 0)];
      // Sums of a filter are below 2^24, exact as floats.
      for (int column = border; column < columns_ - border; ++column) {
        const std::int32_t sum_xx = across_all(column) - across_middle(column) * 3;
        const std::int32_t sum_yy = down_all(column) - down_middle(column) * 3;
        const std::int32_t sum_xy =
            lower_left(column) + upper_right(column) - upper_left(column) - lower_right(column);
        const float xx = static_cast<float>(sum_xx) * per_area;
        const float yy = static_cast<float>(sum_yy) * per_area;
        const float xy = static_cast<float>(sum_xy) * per_area;
        out[column] = std::max(xx * yy - 0.81f * xy * xy, 0.0f);
      }
    }
  }
}

bool Octave::isMaximum(int interval, int row, int column) const {
  const double value = determinant(interval, row, column);
  for (int i = interval - 1; i <= interval + 1; ++i)
    for (int r = row - 1; r <= row + 1; ++r)
      for (int c = column - 1; c <= column + 1; ++c)
        if (determinant(i, r, c) > value) return false;
  return true;
}

template <typename Add>
void Octave::visitMaxima(double threshold, Add&& add) const {
  for (int interval = 1; interval + 1 < kIntervals; ++interval) {
    const int border = borderOf(interval + 1) + 1;
    for (int row = border; row < rows_ - border; ++row)
      for (int column = border; column < columns_ - border; ++column)
        if (determinant(interval, row, column) >= threshold && isMaximum(interval, row, column))
          add(interval, row, column);
  }
}

struct BlobPoint {
  double column = 0.0;  ///< pixels
  double row = 0.0;
  double scale = 0.0;  ///< 1.2 for the smallest filter, of 9 pixels
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

/// Of a place inside the image: towards zero is down.
int nearest(double place) {
  return static_cast<int>(place + 0.5);
}

struct Gradient {
  double x = 0.0;
  double y = 0.0;
};

/// Like std::atan2, to 1e-5 radians, in a fifth of its time.
double angleOf(double x, double y) {
  const double across = std::abs(x);
  const double up = std::abs(y);
  const double longer = std::max(across, up);
  if (longer == 0.0) return 0.0;
  const double t = std::min(across, up) / longer;
  const double s = t * t;
  double angle =
      t * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))));
  if (up > across) angle = M_PI / 2.0 - angle;
  if (x < 0.0) angle = M_PI - angle;
  return y < 0.0 ? -angle : angle;
}

/// Direction of the strongest gradient around a point, radians: the sector of 60 degrees in which
/// they add up to most.
double dominantAngle(const IntegralImage& image, const BlobPoint& point) {
  constexpr int kRadius = 6;  // scales
  constexpr double kSigma = 2.5;
  constexpr int kSectors = 45;
  constexpr double kBetween = 2.0 * M_PI / kSectors;
  constexpr double kWidth = M_PI / 3.0;
  constexpr int kBefore = 8;  // sectors that begin before -pi and reach into the circle
  static const auto weights = [] {
    std::array<std::array<double, kRadius + 1>, kRadius + 1> table{};
    for (int r = 0; r <= kRadius; ++r)
      for (int c = 0; c <= kRadius; ++c)
        table[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
            std::exp(-(r * r + c * c) / (2.0 * kSigma * kSigma));
    return table;
  }();
  const int scale = nearest(point.scale);
  std::array<Gradient, kBefore + kSectors + 1> sums{};
  for (int r = -kRadius; r <= kRadius; ++r) {
    for (int c = -kRadius; c <= kRadius; ++c) {
      if (r * r + c * c >= kRadius * kRadius) continue;
      const double weight =
          weights[static_cast<std::size_t>(std::abs(r))][static_cast<std::size_t>(std::abs(c))];
      const HaarWavelets haar =
          image.haar(nearest(scale * c + point.column), nearest(scale * r + point.row), 2 * scale);
      const double x = weight * haar.x;
      const double y = weight * haar.y;
      // Sector k reaches from k * kBetween over kWidth.
      const double angle = angleOf(x, y) + M_PI;
      const int last = static_cast<int>(angle / kBetween);
      const int first = static_cast<int>((angle - kWidth) / kBetween + kBefore) - kBefore + 1;
      for (int k = first; k <= last; ++k) {
        Gradient& sum = sums[static_cast<std::size_t>(k + kBefore)];
        sum.x += x;
        sum.y += y;
      }
    }
  }
  for (std::size_t k = 0; k <= kBefore; ++k) {  // what begins before -pi begins before pi
    sums[k + kSectors].x += sums[k].x;
    sums[k + kSectors].y += sums[k].y;
  }
  double longest = 0.0;
  double angle = 0.0;
  for (std::size_t k = kBefore + 1; k < sums.size(); ++k) {
    const Gradient& sum = sums[k];
    const double length = sum.x * sum.x + sum.y * sum.y;
    if (length <= longest) continue;
    longest = length;
    angle = std::atan2(sum.y, sum.x);
  }
  return angle;
}

constexpr int kLength = 64;

/// Sums of wavelets and of their sizes in 4 x 4 squares of 5 x 5 samples and their neighbours, in
/// the frame of the point, of length 1.
void describe(const IntegralImage& image, const BlobPoint& point, double angle,
              std::array<float, kLength>& descriptor) {
  constexpr int kHalf = 10;  // samples
  constexpr int kSquare = 5;
  constexpr std::array kWeights{1. / 4, 1. / 5, 1. / 6, 1. / 7, 1. / 8, 1. / 9, 1. / 10};
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  const int scale = nearest(point.scale);
  using Sums = std::array<double, 4>;  // of x, y and their sizes
  std::array<Sums, 4 * kHalf * kHalf> samples;
  auto* sample = samples.data();
  for (int y = -kHalf; y < kHalf; ++y) {
    for (int x = -kHalf; x < kHalf; ++x) {
      const double u = x * point.scale;
      const double v = y * point.scale;
      const HaarWavelets haar = image.haar(nearest(cosine * u - sine * v + point.column),
                                           nearest(sine * u + cosine * v + point.row), scale);
      const double gx = cosine * haar.x + sine * haar.y;
      const double gy = cosine * haar.y - sine * haar.x;
      *sample++ = {gx, gy, std::abs(gx), std::abs(gy)};
    }
  }
  std::array<double, kLength> sums{};
  double square = 0.0;
  auto* out = sums.data();
  for (int row = 0; row < 2 * kHalf; row += kSquare) {
    for (int column = 0; column < 2 * kHalf; column += kSquare) {
      Sums sum{};
      for (int y = std::max(row - 1, 0); y < std::min(row + kSquare + 1, 2 * kHalf); ++y) {
        for (int x = std::max(column - 1, 0); x < std::min(column + kSquare + 1, 2 * kHalf); ++x) {
          const double weight = kWeights[static_cast<std::size_t>(
              std::abs(row + kSquare / 2 - y) + std::abs(column + kSquare / 2 - x))];
          const Sums& one = samples[static_cast<std::size_t>(y * 2 * kHalf + x)];
          for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += weight * one[k];
        }
      }
      for (const double value : sum) {
        square += value * value;
        *out++ = value;
      }
    }
  }
  const double length = std::sqrt(square) + 1e-7;  // 0 where the image is even
  for (std::size_t k = 0; k < kLength; ++k) descriptor[k] = static_cast<float>(sums[k] / length);
}

}  // namespace

DetectedFeatures detectSurf(const cv::Mat& gray, int count, double threshold) {
  constexpr float kUnit = 4096.0f;  // of descriptors of length 1
  constexpr int kSmallest = 64;     // pixels a side; the filters need room
  constexpr double kSide = 32.0;    // scales of the square about a point that wavelets may touch
  DetectedFeatures features;
  features.descriptors = Descriptors(false, kLength);
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
      const int left = nearest(point.column) - side / 2;
      const int top = nearest(point.row) - side / 2;
      if (left < 0 || top < 0 || left + side > gray.cols || top + side > gray.rows) return;
      points.push_back(point);
      detections.push_back({static_cast<float>(point.column), static_cast<float>(point.row),
                            static_cast<float>(octave.determinant(interval, row, column))});
    });
  }
  std::array<float, kLength> descriptor;
  for (const std::size_t i : spreadEvenly(detections, gray.cols, gray.rows, count)) {
    describe(image, points[i], dominantAngle(image, points[i]), descriptor);
    features.places.push_back(detections[i]);
    features.descriptors.addValues(descriptor.data(), kUnit);
  }
  return features;
}

}  // namespace planar_mapping::detail
