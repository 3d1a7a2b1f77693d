// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/rectangular_approximation.h"

#include <algorithm>
#include <utility>

#include "baselines/packed_bits.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr std::size_t kHeaderBytes = 42;
constexpr std::size_t kBoxBytes = 20;

}  // namespace

RectangularApproximation::RectangularApproximation(double s, int min_points)
    : grid_(s, min_points) {}

void RectangularApproximation::insert(const std::vector<Vector3>& world_points) {
  grid_.insert(world_points);
}

void RectangularApproximation::insert(const std::vector<Vector3>& obstacles,
                                      const std::vector<Vector3>& ground, const Vector3& origin) {
  grid_.insert(obstacles, ground, origin);
}

void RectangularApproximation::approximate(const std::vector<GridCell>& cells) {
  std::vector<GridBox> fused = fuseCells(cells);
  std::vector<GridBox> cover = greedyCover(cells);
  fused_count_ = fused.size();
  cover_count_ = cover.size();
  boxes_ = fused_count_ < cover_count_ ? std::move(fused) : std::move(cover);
}

std::vector<Cuboid> RectangularApproximation::cuboids() const {
  return cuboidsOf(boxes_, side());
}

std::size_t RectangularApproximation::memoryBytes() const {
  return boxes_.size() * kBoxBytes;
}

std::size_t RectangularApproximation::fileBytes() const {
  if (boxes_.empty()) return kHeaderBytes;
  GridCell low = boxes_.front().low;
  GridCell high = low;  // of the low corners
  GridCell longest;
  for (const GridBox& box : boxes_) {
    low = {std::min(low.x, box.low.x), std::min(low.y, box.low.y), std::min(low.z, box.low.z)};
    high = {std::max(high.x, box.low.x), std::max(high.y, box.low.y), std::max(high.z, box.low.z)};
    longest = {std::max(longest.x, box.size.x), std::max(longest.y, box.size.y),
               std::max(longest.z, box.size.z)};
  }
  const double corners = (high.x - low.x + 1.0) * (high.y - low.y + 1.0) * (high.z - low.z + 1.0);
  const double sizes = static_cast<double>(longest.x) * longest.y * longest.z;
  return kHeaderBytes + bytesOfBits(boxes_.size(), bitsFor(corners) + bitsFor(sizes));
}

}  // namespace evaluation
}  // namespace planar_mapping
