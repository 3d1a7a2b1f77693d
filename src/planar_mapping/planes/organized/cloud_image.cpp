// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/cloud_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/planes/tiles/organized_tiles.h"

namespace planar_mapping::detail {
namespace {

constexpr double kMaxOff = 0.1;         // steps that a value may be off the lattice
constexpr double kMaxSize = 10000.0;    // pixels a side
constexpr std::size_t kMinFilled = 10;  // one pixel of so many has a point, at least
constexpr std::size_t kSample = 2048;   // points that tell most clouds from images

/// How an image says where a ray goes.
struct Projection {
  int along;       ///< axis of the rays that are looked along, or of the poles
  bool by_angles;  ///< by azimuth and elevation, as scanners do, not by ratios, as cameras do

  /// False for a ray that is not in front.
  bool place(const Vector3& ray, double sign, std::array<double, 2>& at) const {
    const double a = ray[(along + 1) % 3], b = ray[(along + 2) % 3], c = ray[along];
    if (by_angles) {
      at = {std::atan2(sign * b, sign * a), std::atan2(c, std::sqrt(a * a + b * b))};
      return true;
    }
    at = {a / c, b / c};
    return sign * c > 0.0;
  }
};

/// Columns or rows: values start + k * step for whole k.
struct Lattice {
  double start = 0.0;
  double step = 0.0;  ///< 0 = none
  int size = 0;

  bool find(double value, int& k) const {
    const double place = (value - start) / step + 0.5;
    if (!(place >= 0.0 && place < kMaxSize)) return false;
    k = static_cast<int>(place);
    return std::abs(place - k - 0.5) < kMaxOff;
  }
};

/// The lattice of some values, which are sorted: two that follow each other are in one place or
/// whole steps apart, with a gap between the least step and the largest error.
Lattice latticeOf(std::vector<double>& values) {
  constexpr double kLeastGap = (1.0 - 2.0 * kMaxOff) / (2.0 * kMaxOff);
  std::sort(values.begin(), values.end());
  const double range = values.back() - values.front();
  const double least = range * kMaxOff / kMaxSize;
  std::vector<double> apart{least};
  for (std::size_t i = 0; i + 1 < values.size(); ++i)
    apart.push_back(std::max(least, values[i + 1] - values[i]));
  std::sort(apart.begin(), apart.end());
  std::size_t first = 0;
  double widest = kLeastGap;
  for (std::size_t i = 1; i < apart.size(); ++i) {
    if (apart[i] < widest * apart[i - 1]) continue;
    widest = apart[i] / apart[i - 1];
    first = i;
  }
  Lattice lattice;
  if (first == 0) return lattice;
  const auto single = std::upper_bound(apart.begin() + static_cast<std::ptrdiff_t>(first),
                                       apart.end(), 1.5 * apart[first]);
  const double step = apart[(first + static_cast<std::size_t>(single - apart.begin())) / 2];
  // Least squares over the places that these steps lead to, one after the other.
  double n = 0.0, k = 0.0, kk = 0.0, v = 0.0, kv = 0.0, place = 0.0, before = values.front();
  for (const double value : values) {
    place += std::round((value - before) / step);
    before = value;
    n += 1.0;
    k += place;
    kk += place * place;
    v += value;
    kv += place * value;
  }
  const double spread = n * kk - k * k;
  if (!(spread > 0.0) || !(place < kMaxSize)) return lattice;
  lattice.step = (n * kv - k * v) / spread;
  lattice.start = (v - lattice.step * k) / n;
  lattice.size = static_cast<int>(place) + 1;
  int at = 0;
  for (const double value : values) {
    if (!lattice.find(value, at)) return {};
  }
  return lattice;
}

/// Makes the lattice as large as its values need, with the first of them at the place of a tile that
/// it has in an image whose middle is the axis, as that of most sensors: planes near the limits
/// depend on the tiles. \return by how much places move
int alignToTiles(int first, int last, Lattice& lattice) {
  const double axis = -lattice.start / lattice.step - first;  // from the first value
  const double farthest = std::max(axis, last - first - axis);
  const double half = kTileSide * std::ceil(farthest / kTileSide);
  const int before = axis >= 0.0 ? static_cast<int>(std::floor(half - axis)) % kTileSide : 0;
  lattice.size = last - first + before + 1;
  return before - first;
}

/// The points of the cloud that count, and the rays to them.
class Rays {
 public:
  Rays(const PointsView& points, const Indices* indices, const Vector3& sensor)
      : points_(points), indices_(indices), sensor_(sensor), size_(countOf(points, indices)) {}

  /// Drawn at random, so that neither rows nor columns are left out.
  std::vector<Vector3> sample() const {
    Random random;
    std::vector<Vector3> rays;
    for (std::size_t i = 0; i < kSample; ++i) {
      const std::size_t index = at(indices_, random.below(static_cast<std::uint32_t>(size_)));
      if (points_.isMeasured(index)) rays.push_back(points_.point(index) - sensor_);
    }
    return rays;
  }
  std::size_t size() const { return size_; }
  /// Calls visit(index, ray) until it returns false. \return whether it never did
  template <typename Visit>
  bool visit(const Visit& visit) const {
    for (std::size_t i = 0; i < size_; ++i) {
      const std::size_t index = at(indices_, i);
      if (points_.isMeasured(index) &&
          !visit(static_cast<int>(index), points_.point(index) - sensor_)) {
        return false;
      }
    }
    return true;
  }

 private:
  const PointsView& points_;
  const Indices* indices_;
  const Vector3& sensor_;
  std::size_t size_;
};

/// The image of all rays by this projection, if they are pixels of one.
std::optional<CloudImage> imageBy(const Projection& by, const std::vector<Vector3>& sample,
                                  const Rays& rays, const PointsView& points) {
  double ahead = 0.0;
  for (const Vector3& ray : sample)
    ahead += by.by_angles ? ray[(by.along + 1) % 3] : ray[by.along];
  const double sign = ahead < 0.0 ? -1.0 : 1.0;
  std::array<Lattice, 2> lattices;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::vector<double> values;
    std::array<double, 2> at;
    for (const Vector3& ray : sample) {
      if (!by.place(ray, sign, at)) return std::nullopt;
      values.push_back(at[axis]);
    }
    lattices[axis] = latticeOf(values);
    if (!(lattices[axis].step > 0.0)) return std::nullopt;
  }

  struct Pixel {
    int index;
    std::array<std::int16_t, 2> at;
  };
  std::vector<Pixel> pixels;
  pixels.reserve(rays.size());
  std::array<int, 2> first{static_cast<int>(kMaxSize), static_cast<int>(kMaxSize)}, last{0, 0};
  // The sample need not have the first of them: places count from before.
  for (Lattice& lattice : lattices) lattice.start -= kTileSide * lattice.step;
  const bool all = rays.visit([&](int index, const Vector3& ray) {
    std::array<double, 2> at;
    Pixel pixel{index, {}};
    if (!by.place(ray, sign, at)) return false;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      int k = 0;
      if (!lattices[axis].find(at[axis], k)) return false;
      first[axis] = std::min(first[axis], k);
      last[axis] = std::max(last[axis], k);
      pixel.at[axis] = static_cast<std::int16_t>(k);
    }
    pixels.push_back(pixel);
    return true;
  });
  if (!all || pixels.empty()) return std::nullopt;
  std::array<int, 2> moved;
  for (std::size_t axis = 0; axis < 2; ++axis)
    moved[axis] = alignToTiles(first[axis], last[axis], lattices[axis]);
  CloudImage image;
  image.width = static_cast<std::uint32_t>(lattices[0].size);
  image.height = static_cast<std::uint32_t>(lattices[1].size);
  const std::size_t size = std::size_t{image.width} * image.height;
  if (size > kMinFilled * pixels.size()) return std::nullopt;
  image.xyz.assign(3 * size, std::numeric_limits<float>::quiet_NaN());
  image.points.assign(size, -1);
  for (const Pixel& pixel : pixels) {
    const std::size_t place =
        static_cast<std::size_t>(pixel.at[1] + moved[1]) * image.width +
        static_cast<std::size_t>(pixel.at[0] + moved[0]);
    if (image.points[place] >= 0) return std::nullopt;
    image.points[place] = pixel.index;
    std::copy_n(points[static_cast<std::size_t>(pixel.index)], 3, image.xyz.data() + 3 * place);
  }
  image.measured = pixels.size();
  return image;
}

}  // namespace

std::optional<CloudImage> imageOf(const PointsView& points, const Indices* indices,
                                  const Vector3& sensor) {
  const Rays rays(points, indices, sensor);
  const std::vector<Vector3> sample = rays.sample();
  if (sample.size() < 2) return std::nullopt;
  for (const bool by_angles : {false, true}) {
    for (const int along : {2, 0, 1}) {
      std::optional<CloudImage> image = imageBy({along, by_angles}, sample, rays, points);
      if (image) return image;
    }
  }
  return std::nullopt;
}

}  // namespace planar_mapping::detail
