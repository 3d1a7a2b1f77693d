// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/planes/detail/assumed_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

constexpr int kSide = kEvenTileSide;
constexpr float kStep = 3.0f;        // gray levels between neighbouring tiles that are an edge
constexpr float kEven = 3.0f;        // standard deviations of the noise within an even tile
constexpr float kLeastNoise = 2.0f;  // gray levels: saturated parts of an image have none
constexpr double kReach = 1.2;  // farthest assumed depth of a plane, in units of its measured ones
constexpr double kMinCosine = 0.1;  // between ray and normal: along a wall nothing can be said
constexpr int kNothing = -1;
constexpr int kLeastMeasured = kSide * kSide / 2;  // pixels of a tile at the end of a hole
constexpr double kBand = 2.0;                      // about a plane, in units of its residual
constexpr int kPasses = 4;                         // what is assumed in one is an end in the next

/// Opposite ones are four apart.
constexpr std::array<std::array<int, 2>, 8> kDirections = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

struct Tile {
  int measured = 0;
  int plane = kNothing;  ///< that most of its measured pixels belong to, or that is assumed
};

class Assumption {
 public:
  Assumption(const PointsView& cloud, const PinholeCamera& camera,
             const std::vector<std::uint8_t>& even, const std::vector<PlaneSegment>& planes)
      : cloud_(cloud),
        camera_(camera),
        even_(even),
        planes_(planes),
        width_(static_cast<int>(cloud.width) / kSide),
        height_(static_cast<int>(cloud.height) / kSide),
        tiles_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {
    labelTiles();
  }

  AssumedPoints run();

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  bool isHole(std::size_t tile) const { return tiles_[tile].measured == 0 && even_[tile] % 2 == 1; }
  void labelTiles();
  bool isBesideHole(int x, int y) const;
  /// The plane that most of what a tile measured lies on; pictures and base boards are too small
  /// to be found as its part.
  int planeUnder(int x, int y) const;
  /// What is measured at the end of the even tiles in a direction, of all tiles.
  std::vector<int> endsTowards(std::size_t direction) const;
  int planeAround(std::size_t tile, const std::array<std::vector<int>, 8>& ends) const;
  void addPoints(int x, int y, int plane, AssumedPoints& out) const;

  const PointsView& cloud_;
  const PinholeCamera& camera_;
  const std::vector<std::uint8_t>& even_;
  const std::vector<PlaneSegment>& planes_;
  int width_;
  int height_;
  std::vector<Tile> tiles_;
  std::vector<double> farthest_;  ///< measured depth of each plane
  std::vector<double> depth_;     ///< mean of the measured ones of each plane
};

void Assumption::labelTiles() {
  std::vector<std::uint8_t> votes(tiles_.size(), 0);
  const auto tileOf = [&](std::size_t i, std::size_t& tile) {
    const int x = static_cast<int>(i % cloud_.width) / kSide;
    const int y = static_cast<int>(i / cloud_.width) / kSide;
    tile = at(x, y);
    return x < width_ && y < height_;
  };
  std::size_t tile = 0;
  for (std::size_t i = 0; i < cloud_.size; ++i) {
    if (cloud_.isFinite(i) && tileOf(i, tile)) ++tiles_[tile].measured;
  }
  for (std::size_t plane = 0; plane < planes_.size(); ++plane) {
    std::fill(votes.begin(), votes.end(), std::uint8_t{0});
    double farthest = 0.0;
    double sum = 0.0;
    for (const int i : planes_[plane].inliers) {
      const double depth = cloud_[static_cast<std::size_t>(i)][2];
      farthest = std::max(farthest, depth);
      sum += depth;
      if (!tileOf(static_cast<std::size_t>(i), tile)) continue;
      if (2 * ++votes[tile] > tiles_[tile].measured) tiles_[tile].plane = static_cast<int>(plane);
    }
    farthest_.push_back(farthest);
    depth_.push_back(sum / static_cast<double>(planes_[plane].inliers.size()));
  }
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      Tile& own = tiles_[at(x, y)];
      if (own.plane == kNothing && own.measured >= kLeastMeasured && isBesideHole(x, y))
        own.plane = planeUnder(x, y);
    }
  }
}

bool Assumption::isBesideHole(int x, int y) const {
  for (const auto& [dx, dy] : kDirections) {
    const int u = x + dx;
    const int v = y + dy;
    if (u >= 0 && v >= 0 && u < width_ && v < height_ && isHole(at(u, v))) return true;
  }
  return false;
}

int Assumption::planeUnder(int x, int y) const {
  const int measured = tiles_[at(x, y)].measured;
  int best = kNothing;
  int most = measured / 2;
  for (std::size_t plane = 0; plane < planes_.size(); ++plane) {
    const Plane& fit = planes_[plane].plane;
    const double band = kBand * planes_[plane].rms;
    int count = 0;
    for (int row = kSide * y; row < kSide * (y + 1); ++row) {
      for (int column = kSide * x; column < kSide * (x + 1); ++column) {
        const std::size_t i =
            static_cast<std::size_t>(row) * cloud_.width + static_cast<std::size_t>(column);
        if (!cloud_.isFinite(i)) continue;
        const Vector3 point = cloud_.point(i);
        const double growth = point.z() / depth_[plane];  // a stereo camera's noise by its square
        count += std::abs(fit.signedDistance(point)) <= band * std::max(1.0, growth * growth);
      }
    }
    if (count <= most) continue;
    most = count;
    best = static_cast<int>(plane);
  }
  return best;
}

std::vector<int> Assumption::endsTowards(std::size_t direction) const {
  const int dx = kDirections[direction][0];
  const int dy = kDirections[direction][1];
  std::vector<int> ends(tiles_.size(), kNothing);
  const auto visit = [&](int x, int y) {
    const int u = x + dx;
    const int v = y + dy;
    if (u < 0 || v < 0 || u >= width_ || v >= height_) return;
    const std::size_t own = at(x, y);
    const std::size_t next = at(u, v);
    if (!isHole(own)) return;
    const bool is_edge = direction < 4 ? (even_[own] >> (1 + direction)) % 2 == 1
                                       : (even_[next] >> (direction - 3)) % 2 == 1;
    if (tiles_[next].measured > 0) {
      ends[own] = tiles_[next].plane;
    } else if (isHole(next) && !is_edge) {
      ends[own] = tiles_[next].plane >= 0 ? tiles_[next].plane : ends[next];
    }
  };
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i)
      visit(dx > 0 ? width_ - 1 - i : i, dy > 0 ? height_ - 1 - j : j);
  }
  return ends;
}

void Assumption::addPoints(int x, int y, int plane, AssumedPoints& out) const {
  const auto number = static_cast<std::size_t>(plane);
  const Plane& fit = planes_[number].plane;
  for (int row = kSide * y; row < kSide * (y + 1); ++row) {
    for (int column = kSide * x; column < kSide * (x + 1); ++column) {
      const Vector3 ray = camera_.rayOf(column, row);
      const double toward = -fit.normal.dot(ray);
      if (!(toward > kMinCosine * ray.norm())) continue;
      const double depth = fit.offset / toward;
      if (!(depth > 0.0 && depth <= kReach * farthest_[number])) continue;
      out.of_plane[number].push_back(static_cast<int>(out.xyz.size() / 3));
      for (int k = 0; k < 3; ++k) out.xyz.push_back(static_cast<float>(depth * ray[k]));
    }
  }
}

/// The plane around a tile; kNothing if there is none, or others are as well.
int Assumption::planeAround(std::size_t tile, const std::array<std::vector<int>, 8>& ends) const {
  int best = kNothing;
  int most = 0;
  int found = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    const int plane = ends[k][tile];
    if (plane < 0) continue;
    ++found;
    int count = 0;
    bool is_around = false;  // directions of 135 degrees or more between them
    for (std::size_t j = 0; j < 8; ++j) {
      if (ends[j][tile] != plane) continue;
      ++count;
      for (std::size_t apart = 3; apart <= 5; ++apart)
        is_around |= ends[(j + apart) % 8][tile] == plane;
    }
    if (count <= most) continue;
    most = count;
    best = is_around ? plane : kNothing;
  }
  return 2 * most > found ? best : kNothing;
}

AssumedPoints Assumption::run() {
  AssumedPoints out;
  out.of_plane.resize(planes_.size());
  for (int pass = 0; pass < kPasses; ++pass) {
    std::array<std::vector<int>, 8> ends;
    for (std::size_t k = 0; k < 8; ++k) ends[k] = endsTowards(k);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        Tile& tile = tiles_[at(x, y)];
        if (!isHole(at(x, y)) || tile.plane >= 0) continue;
        tile.plane = planeAround(at(x, y), ends);
        if (tile.plane >= 0) addPoints(x, y, tile.plane, out);
      }
    }
  }
  return out;
}

}  // namespace

std::vector<std::uint8_t> evenTiles(const std::uint8_t* gray, int width, int height) {
  const int columns = width / kSide;
  const int rows = height / kSide;
  constexpr float kPixels = kSide * kSide;
  std::vector<float> means;
  std::vector<float> deviations;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      int sum = 0;
      int squares = 0;
      for (int row = kSide * y; row < kSide * (y + 1); ++row) {
        const std::uint8_t* values = gray + static_cast<std::ptrdiff_t>(row) * width + kSide * x;
        for (int column = 0; column < kSide; ++column) {
          sum += values[column];
          squares += values[column] * values[column];
        }
      }
      const float mean = static_cast<float>(sum) / kPixels;
      means.push_back(mean);
      deviations.push_back(
          std::sqrt(std::max(0.0f, static_cast<float>(squares) / kPixels - mean * mean)));
    }
  }
  std::vector<std::uint8_t> even(means.size(), 0);
  if (means.empty()) return even;
  // The evenest tenth shows the noise of the camera.
  std::vector<float> sorted = deviations;
  const auto tenth = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 10);
  std::nth_element(sorted.begin(), tenth, sorted.end());
  const float most = std::max(kEven * *tenth, kLeastNoise);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const auto i = static_cast<std::size_t>(y * columns + x);
      unsigned flags = deviations[i] <= most ? 1u : 0u;
      for (unsigned k = 0; k < 4; ++k) {
        const int u = x + kDirections[k][0];
        const int v = y + kDirections[k][1];
        if (u < 0 || u >= columns || v >= rows) continue;
        const float step = means[i] - means[static_cast<std::size_t>(v * columns + u)];
        flags |= std::fabs(step) > kStep ? 2u << k : 0u;
      }
      even[i] = static_cast<std::uint8_t>(flags);
    }
  }
  return even;
}

AssumedPoints assumePoints(const PointsView& cloud, const PinholeCamera& camera,
                           const std::vector<std::uint8_t>& even,
                           const std::vector<PlaneSegment>& planes) {
  const std::size_t tiles = std::size_t{cloud.width / kSide} * (cloud.height / kSide);
  if (!cloud.isOrganized() || static_cast<int>(cloud.width) != camera.width ||
      static_cast<int>(cloud.height) != camera.height || even.size() != tiles) {
    throw InputError("points are assumed for the pixels of an organized cloud of the camera only");
  }
  return Assumption(cloud, camera, even, planes).run();
}

}  // namespace planar_mapping
