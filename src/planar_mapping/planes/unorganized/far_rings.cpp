// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/unorganized/cell_assignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace planar_mapping::detail {

namespace {

constexpr double kMinPoints = 3.0;
// Points of a piece spread so many times as far along the plane as off it.
constexpr double kMinElongation = 4.0;
// Half the width of the view in bins: a bin is 0.45 to 0.9 degrees wide.
constexpr int kHalfView = 256;
// Neighbours in the view are at most so many bins apart, twice the gap of 16 rings.
constexpr int kMaxBins = 8;

/// The cells as the sensor sees them, by direction.
class View {
 public:
  View() : occupied_(kBins, 0), first_(kBins, -1) {}

  /// By ratios in place of angles.
  static std::int32_t binOf(const Vector3& ray) {
    const double x = ray.x(), y = ray.y(), flat = std::abs(x) + std::abs(y);
    const double across = flat > 0.0 ? y / flat : 0.0;  // -1 to 1 in each half
    const double azimuth = x >= 0.0 ? across : (y >= 0.0 ? 2.0 - across : -2.0 - across);
    const double length = std::abs(ray.z()) + std::sqrt(x * x + y * y);
    const double elevation = length > 0.0 ? ray.z() / length : 0.0;
    const auto binAt = [](double part, int bins) {
      return std::min(bins - 1, static_cast<int>(part * bins));
    };
    return binAt(0.5 * (elevation + 1.0), kHalfView) * 2 * kHalfView +
           binAt(0.25 * (azimuth + 2.0), 2 * kHalfView);
  }
  /// The bin itself and the first occupied one in each of eight directions, -1 where there is none
  /// near.
  std::array<std::int32_t, 9> around(std::int32_t bin) const {
    constexpr int kWidth = 2 * kHalfView;
    std::array<std::int32_t, 9> result;
    for (int direction = 0; direction < 9; ++direction) {
      const int step_a = direction % 3 - 1, step_e = direction / 3 - 1;
      std::int32_t& found = result[static_cast<std::size_t>(direction)];
      found = -1;
      for (int step = 1; step <= kMaxBins && found < 0; ++step) {
        const int elevation = bin / kWidth + step * step_e;
        if (elevation < 0 || elevation >= kHalfView) break;
        // There is a seam behind the sensor.
        const int other = elevation * kWidth + ((bin + step * step_a) & (kWidth - 1));
        if (isOccupied(other)) found = other;
      }
    }
    return result;
  }
  void occupy(std::int32_t bin) { occupied_[static_cast<std::size_t>(bin)] = 1; }
  bool isOccupied(std::int32_t bin) const { return occupied_[static_cast<std::size_t>(bin)] != 0; }
  void add(std::int32_t bin, std::int32_t plane) {
    if (holds(bin, plane)) return;
    std::int32_t& first = first_[static_cast<std::size_t>(bin)];
    entries_.push_back({plane, first});
    first = static_cast<std::int32_t>(entries_.size()) - 1;
  }
  bool holds(std::int32_t bin, std::int32_t plane) const {
    for (std::int32_t i = first_[static_cast<std::size_t>(bin)]; i >= 0;
         i = entries_[static_cast<std::size_t>(i)].next) {
      if (entries_[static_cast<std::size_t>(i)].plane == plane) return true;
    }
    return false;
  }

 private:
  struct Entry {
    std::int32_t plane;
    std::int32_t next;
  };
  static constexpr std::size_t kBins = std::size_t{2} * kHalfView * kHalfView;
  std::vector<char> occupied_;
  std::vector<std::int32_t> first_;  ///< by bin, into entries_
  std::vector<Entry> entries_;
};

/// A piece of a ring that may be on a plane.
struct Piece {
  std::int32_t cell;
  std::int32_t plane;
  Vector3 mean;
  std::array<std::int32_t, 9> around;  ///< bins, its own in the middle
};

/// Whether points with the sums \p s about \p centre are a line in it.
bool isLineIn(const Plane& plane, const PointSums& s, const Vector3& centre, double threshold) {
  const Vector3& n = plane.normal;
  const auto& o = s.outer;
  const Vector3 mean = Vector3(s.sum[0], s.sum[1], s.sum[2]) / s.n;
  const double squares = n[0] * (n[0] * o[0] + 2.0 * (n[1] * o[1] + n[2] * o[2])) +
                         n[1] * (n[1] * o[3] + 2.0 * n[2] * o[4]) + n[2] * n[2] * o[5];
  const double along_normal = n.dot(mean);
  const double off = std::max(0.0, squares / s.n - along_normal * along_normal);
  const double in_plane = (o[0] + o[3] + o[5]) / s.n - mean.squaredNorm() - off;
  const double distance = std::abs(plane.signedDistance(centre) + along_normal);
  return distance + 2.0 * std::sqrt(off) <= threshold &&
         in_plane >= kMinElongation * kMinElongation * off;
}

}  // namespace

void addFarRings(const PointCells& grid, const std::vector<Plane>& planes, const DistanceBand& band,
                 const Vector3& sensor, CellCandidates& candidates) {
  // From far away all is next to each other: there is no sensor.
  Eigen::AlignedBox3d box;
  for (std::size_t cell = 0; cell < candidates.size(); ++cell) box.extend(grid.centre(cell));
  const Vector3 away = Vector3::Zero().cwiseMax(box.min() - sensor).cwiseMax(sensor - box.max());
  if (away.norm() > box.sizes().norm()) return;
  View view;
  std::vector<Piece> pieces;
  const auto propose = [&](std::size_t cell, const Vector3& mean, const PointSums& sums,
                           const Vector3& centre) {
    const double threshold = band.at(mean.z());
    for (std::size_t k = 0; k < planes.size(); ++k) {
      if (!(std::abs(planes[k].signedDistance(mean)) <= threshold)) continue;
      if (!isLineIn(planes[k], sums, centre, threshold)) continue;
      pieces.push_back({static_cast<std::int32_t>(cell), static_cast<std::int32_t>(k), mean, {}});
    }
  };
  // Cells that have too few points for themselves, with their means, and these points in blocks of
  // 4 cells a side.
  std::vector<std::pair<std::size_t, Vector3>> sparse;
  PointCells blocks;
  blocks.side = 4.0 * grid.side;
  const auto blockOf = [&](std::size_t cell) {
    return static_cast<std::size_t>(blocks.table.insert(grid.table.key(cell).parent().parent()));
  };
  for (std::size_t cell = 0; cell < candidates.size(); ++cell) {
    const PointSums& sums = grid.sums[cell];
    const Vector3 centre = grid.centre(cell);
    const Vector3 mean = centre + Vector3(sums.sum[0], sums.sum[1], sums.sum[2]) * (1.0 / sums.n);
    const double threshold = band.at(mean.z());
    const std::int32_t bin = View::binOf(mean - sensor);
    view.occupy(bin);
    bool on_any = false;
    for (const std::int32_t k : candidates[cell]) {
      if (k < 0) break;
      const Plane& plane = planes[static_cast<std::size_t>(k)];
      if (!(std::abs(plane.signedDistance(mean)) <= threshold)) continue;
      view.add(bin, k);
      on_any = true;
    }
    if (on_any) continue;
    if (sums.n >= kMinPoints) {
      propose(cell, mean, sums, centre);
    } else {
      const std::size_t block = blockOf(cell);
      if (block == blocks.sums.size()) blocks.sums.emplace_back();
      blocks.sums[block].add(sums, centre - blocks.centre(block));
      sparse.emplace_back(cell, mean);
    }
  }
  for (const auto& [cell, mean] : sparse) {
    const std::size_t block = blockOf(cell);
    const PointSums& sums = blocks.sums[block];
    if (sums.n >= kMinPoints) propose(cell, mean, sums, blocks.centre(block));
  }
  for (Piece& piece : pieces) piece.around = view.around(View::binOf(piece.mean - sensor));
  // Ring by ring: what was found in one round is a neighbour in the next.
  for (bool more = true; more;) {
    auto left = pieces.begin();
    for (Piece& piece : pieces) {
      const bool near = std::any_of(piece.around.begin(), piece.around.end(), [&](std::int32_t b) {
        return b >= 0 && view.holds(b, piece.plane);
      });
      if (!near) {
        *left++ = piece;
        continue;
      }
      addCandidate(candidates[static_cast<std::size_t>(piece.cell)], piece.plane);
      view.add(piece.around[4], piece.plane);
    }
    more = left != pieces.end();
    pieces.erase(left, pieces.end());
  }
}

}  // namespace planar_mapping::detail
