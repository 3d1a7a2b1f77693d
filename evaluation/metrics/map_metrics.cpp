// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/map_metrics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kPartsPerCell = 4.0;  ///< along each axis, of the mapping error
constexpr double kStepsPerCell = 2.0;  ///< along a ray
constexpr double kLongestRay = 1e4;    ///< metres
constexpr double kLostBehind = 2.0;    ///< metres
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTouched = 1e-4;        ///< metres from a cuboid, along a ray
constexpr double kMaxParts = 1e6;        ///< of one cuboid, along each axis
constexpr std::int64_t kBlockParts = 4;  ///< along each axis, decided together

/// Neighbours are not neighbours any more.
std::uint64_t shuffled(std::uint64_t key) {
  return ((key ^ (key >> 32u)) * 0x9E3779B97F4A7C15ULL) >> 32u;
}

void requireStandardCells(std::size_t standard_cells) {
  if (standard_cells == 0) throw InputError("there are no standard cells to divide by");
}

/// Counts the parts of cuboids. Blocks of parts are decided as one where that is possible: a
/// distance changes by no more than the way one goes.
class PartCount {
 public:
  PartCount(const CuboidDistance& index, const SurfaceTruth& truth, double s)
      : index_(index), truth_(truth), s_(s) {}

  /// The cuboid with the given number in the list of the index.
  void add(const Cuboid& cuboid, std::size_t number, MappingError& error) {
    std::int64_t count[3];
    double weight = 1.0;
    R_ = cuboid.orientation.toRotationMatrix();
    for (int k = 0; k < 3; ++k) {
      // A length that is a multiple but for rounding must not get one part more.
      const double parts = std::ceil(cuboid.size[k] * kPartsPerCell / s_ - 1e-6);
      count[k] = static_cast<std::int64_t>(std::clamp(parts, 1.0, kMaxParts));
      step_[k] = cuboid.size[k] / static_cast<double>(count[k]);
      weight *= std::max(cuboid.size[k], s_) / (s_ * static_cast<double>(count[k]));
    }
    origin_ = cuboid.center - R_ * (0.5 * cuboid.size);
    marked_ = wrong_ = 0;
    Block block;
    const auto next = [&](int k) {
      block.low[k] = block.high[k];
      block.high[k] = std::min(block.low[k] + kBlockParts, count[k]);
      return block.low[k] < count[k];
    };
    for (block.high[2] = 0; next(2);)
      for (block.high[1] = 0; next(1);)
        for (block.high[0] = 0; next(0);) addBlock(block, number);
    error.marked_cells += static_cast<double>(marked_) * weight;
    error.wrong_cells += static_cast<double>(wrong_) * weight;
  }

 private:
  struct Block {
    std::int64_t low[3];
    std::int64_t high[3];

    std::int64_t parts() const {
      return (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]);
    }
  };

  Vector3 middleOf(const Block& block) const {
    Vector3 middle;
    for (int k = 0; k < 3; ++k)
      middle[k] = 0.5 * static_cast<double>(block.low[k] + block.high[k]) * step_[k];
    return origin_ + R_ * middle;
  }
  /// Half lengths of the box around the centres of the parts.
  Vector3 halfOf(const Block& block) const {
    Vector3 half;
    for (int k = 0; k < 3; ++k)
      half[k] = 0.5 * static_cast<double>(block.high[k] - block.low[k] - 1) * step_[k];
    return half;
  }

  void addBlock(const Block& block, std::size_t number) {
    index_.findBefore(number, middleOf(block), R_ * halfOf(block).asDiagonal(), overlap_);
    if (overlap_.is_whole) return;
    if (overlap_.cuboids.empty()) {
      marked_ += block.parts();
      addWrong(block);
      return;
    }
    forEachPart(block, [&](const Vector3& point) {
      for (const std::uint32_t other : overlap_.cuboids)
        if (index_.holds(other, point)) return;
      ++marked_;
      wrong_ += truth_.isNear(point, s_) ? 0 : 1;
    });
  }

  /// Parts of the block that are far from the surface, all of which count.
  void addWrong(const Block& block) {
    const double nearest = truth_.distance(middleOf(block));
    const double reach = halfOf(block).norm();
    if (nearest + reach <= s_) return;
    if (nearest - reach > s_) {
      wrong_ += block.parts();
      return;
    }
    // Only rounding gets a single part here.
    if (block.parts() == 1) {
      wrong_ += nearest > s_ ? 1 : 0;
      return;
    }
    int longest = 0;
    for (const int k : {1, 2})
      if ((block.high[k] - block.low[k]) > (block.high[longest] - block.low[longest])) longest = k;
    Block half = block;
    half.high[longest] = (block.low[longest] + block.high[longest]) / 2;
    addWrong(half);
    half.low[longest] = half.high[longest];
    half.high[longest] = block.high[longest];
    addWrong(half);
  }

  template <typename Visit>
  void forEachPart(const Block& block, const Visit& visit) const {
    for (std::int64_t z = block.low[2]; z < block.high[2]; ++z)
      for (std::int64_t y = block.low[1]; y < block.high[1]; ++y)
        for (std::int64_t x = block.low[0]; x < block.high[0]; ++x)
          visit(middleOf({{x, y, z}, {x + 1, y + 1, z + 1}}));
  }

  const CuboidDistance& index_;
  const SurfaceTruth& truth_;
  double s_;
  // Of the cuboid in work:
  Matrix3 R_ = Matrix3::Identity();
  Vector3 origin_ = Vector3::Zero();  ///< its corner where the parts begin
  Vector3 step_ = Vector3::Zero();
  std::int64_t marked_ = 0;
  std::int64_t wrong_ = 0;
  CuboidDistance::Overlap overlap_;
};

}  // namespace

double combinationEfficiency(std::size_t cells, std::size_t standard_cells) {
  requireStandardCells(standard_cells);
  return 1.0 - static_cast<double>(cells) / static_cast<double>(standard_cells);
}

MappingError mappingError(const std::vector<Cuboid>& cuboids, const CuboidDistance& index,
                          const SurfaceTruth& truth, double s, std::size_t standard_cells) {
  requirePositive("s", s, "m");
  requireStandardCells(standard_cells);
  if (index.size() != cuboids.size()) throw InputError("the index is of another list of cuboids");
  MappingError error;
  PartCount count(index, truth, s);
  for (std::size_t i = 0; i < cuboids.size(); ++i) count.add(cuboids[i], i, error);
  error.percent = 100.0 * error.wrong_cells / static_cast<double>(standard_cells);
  return error;
}

double completeness(const CuboidDistance& index, const std::vector<VisibleCell>& visible,
                    double margin) {
  requirePositive("margin", margin, "m");
  if (visible.empty()) return 1.0;
  std::uint32_t hint = 0;
  const auto found = std::count_if(visible.begin(), visible.end(), [&](const VisibleCell& cell) {
    return index.isWithin(cell.point, margin, hint);
  });
  return static_cast<double>(found) / static_cast<double>(visible.size());
}

double coverage(const CuboidDistance& index, const std::vector<Vector3>& points, double margin) {
  requireInRange("margin", margin, 0.0, std::numeric_limits<double>::max(), "m");
  std::size_t finite = 0;
  std::size_t covered = 0;
  std::uint32_t hint = 0;
  for (const Vector3& point : points) {
    if (!point.allFinite()) continue;
    ++finite;
    covered += index.isWithin(point, margin, hint) ? 1 : 0;
  }
  return finite == 0 ? 1.0 : static_cast<double>(covered) / static_cast<double>(finite);
}

HeldBackDistance heldBackDistance(const CuboidDistance& index, const std::vector<Vector3>& points,
                                  double margin) {
  requireInRange("margin", margin, 0.0, std::numeric_limits<double>::max(), "m");
  std::vector<double> distances;
  distances.reserve(points.size());
  std::uint32_t hint = 0;
  for (const Vector3& point : points) {
    if (point.allFinite()) distances.push_back(index.distance(point, hint));
  }
  HeldBackDistance result;
  if (distances.empty()) return result;
  result.median = planar_mapping::detail::nearestRank(distances, 0.5);
  result.percentile_95 = planar_mapping::detail::nearestRank(distances, 0.95);
  const auto fractionWithin = [&distances](double most) {
    const auto within = std::count_if(distances.begin(), distances.end(),
                                      [most](double distance) { return distance <= most; });
    return static_cast<double>(within) / static_cast<double>(distances.size());
  };
  result.fraction_within = fractionWithin(margin);
  result.fraction_within_half = fractionWithin(0.5 * margin);
  result.fraction_inside = fractionWithin(0.0);
  return result;
}

SurfaceDistance surfaceDistance(const CuboidDistance& index, const std::vector<MeasuredRay>& rays,
                                std::size_t step,
                                const std::function<double(const Vector3&)>& to_truth) {
  requireInRange("step", static_cast<double>(step), 1.0, 1e9);
  std::vector<double> distances;
  std::uint32_t hint = 0;
  for (std::size_t i = 0; i < rays.size(); i += step) {
    const double length = (rays[i].end - rays[i].origin).norm();
    if (!(length > 0.0 && length <= kLongestRay)) continue;
    const Vector3 direction = (rays[i].end - rays[i].origin) / length;
    // No cuboid is nearer than the nearest one, in whatever direction.
    double at = 0.0;
    double clear = kInfinity;
    while (at <= length + kLostBehind) {
      clear = index.distance(rays[i].origin + at * direction, hint);
      if (clear < kTouched) break;
      at += clear;
    }
    const bool entered = clear < kTouched;
    distances.push_back(entered ? to_truth(rays[i].origin + at * direction) : kInfinity);
  }
  SurfaceDistance result;
  if (distances.empty()) return result;
  result.median = planar_mapping::detail::nearestRank(distances, 0.5);
  result.percentile_95 = planar_mapping::detail::nearestRank(distances, 0.95);
  return result;
}

CrossedSpace::CrossedSpace(double side, double clearance, std::uint64_t every)
    : side_(side), clearance_(clearance), every_(every) {
  requirePositive("side", side, "m");
  requireInRange("clearance", clearance, 0.0, std::numeric_limits<double>::max(), "m");
  requireInRange("every", static_cast<double>(every), 1.0, 1e9);
}

void CrossedSpace::add(const std::vector<MeasuredRay>& rays) {
  const double step = side_ / kStepsPerCell;
  for (const MeasuredRay& ray : rays) {
    const double length = (ray.end - ray.origin).norm();
    if (!(length > 0.0 && length <= kLongestRay)) continue;
    const Vector3 direction = (ray.end - ray.origin) / length;
    const double end = length - clearance_;
    for (int i = 0; (i + 0.5) * step <= end; ++i) {
      const Vector3 point = ray.origin + direction * ((i + 0.5) * step);
      std::uint64_t key = 0;
      if (!planar_mapping::detail::cellKeyOf(point, side_, key) || shuffled(key) % every_ != 0)
        continue;
      Sample& sample = samples_[key];
      if (sample.offset[0] >= 0.0f) continue;
      const Vector3 low = planar_mapping::detail::cornerOf(key) * side_;
      for (int axis = 0; axis < 3; ++axis)
        sample.offset[axis] = static_cast<float>(std::max(point[axis] - low[axis], 0.0));
    }
  }
}

std::size_t CrossedSpace::count(const std::function<bool(const Vector3&)>& holds) const {
  std::size_t counted = 0;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    Vector3 point = planar_mapping::detail::cornerOf(samples_.key(i)) * side_;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] += static_cast<double>(samples_.value(i).offset[axis]);
    counted += holds(point) ? 1 : 0;
  }
  return counted;
}

double freeSpaceViolation(const CuboidDistance& index, const CrossedSpace& crossed) {
  if (crossed.pieces() == 0) return 0.0;
  const std::size_t marked =
      crossed.count([&index](const Vector3& point) { return index.isWithin(point, 0.0); });
  return static_cast<double>(marked) / static_cast<double>(crossed.pieces());
}

}  // namespace planar_mapping::evaluation
