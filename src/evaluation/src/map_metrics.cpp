// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/map_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/core/error.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr double kPartsPerCell = 4.0;  ///< along each axis, of the mapping error
constexpr double kStepsPerCell = 2.0;  ///< along a ray
constexpr double kClearanceInCells = 2.0;
constexpr double kLongestRay = 1e4;  ///< metres
constexpr double kMostParts = 1e9;   ///< of one cuboid

void requireStandardCells(std::size_t standard_cells) {
  if (standard_cells == 0) throw InputError("there are no standard cells to divide by");
}

double nearestRank(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  const double position = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(position, 1.0)) - 1];
}

/// How a cuboid is cut into parts.
struct Parts {
  int count[3];
  Vector3 step;
  double weight = 1.0;  ///< of each, in standard cells

  Parts(const Cuboid& cuboid, double s) {
    for (int k = 0; k < 3; ++k) {
      // A length that is a multiple but for rounding must not get one part more.
      const double parts = std::ceil(cuboid.size[k] * kPartsPerCell / s - 1e-6);
      count[k] = static_cast<int>(std::clamp(parts, 1.0, kMostParts));
      step[k] = cuboid.size[k] / count[k];
      weight *= std::max(cuboid.size[k], s) / (s * count[k]);
    }
  }
};

}  // namespace

double combinationEfficiency(std::size_t cells, std::size_t standard_cells) {
  requireStandardCells(standard_cells);
  return 1.0 - static_cast<double>(cells) / static_cast<double>(standard_cells);
}

MappingError mappingError(const std::vector<Cuboid>& cuboids, const SurfaceTruth& truth, double s,
                          std::size_t standard_cells) {
  return mappingError(cuboids, CuboidDistance(cuboids), truth, s, standard_cells);
}

MappingError mappingError(const std::vector<Cuboid>& cuboids, const CuboidDistance& index,
                          const SurfaceTruth& truth, double s, std::size_t standard_cells) {
  requirePositive("s", s, "m");
  requireStandardCells(standard_cells);
  MappingError error;
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& cuboid = cuboids[i];
    const Parts parts(cuboid, s);
    const Matrix3 R = cuboid.orientation.toRotationMatrix();
    const Vector3 low = -0.5 * cuboid.size + 0.5 * parts.step;
    std::size_t marked = 0;
    std::size_t wrong = 0;
    for (int z = 0; z < parts.count[2]; ++z) {
      for (int y = 0; y < parts.count[1]; ++y) {
        for (int x = 0; x < parts.count[0]; ++x) {
          const Vector3 point =
              cuboid.center + R * (low + parts.step.cwiseProduct(Vector3(x, y, z)));
          if (index.isInsideOneBefore(point, i)) continue;
          ++marked;
          if (!truth.isNear(point, s)) ++wrong;
        }
      }
    }
    error.marked_cells += static_cast<double>(marked) * parts.weight;
    error.wrong_cells += static_cast<double>(wrong) * parts.weight;
  }
  error.percent = 100.0 * error.wrong_cells / static_cast<double>(standard_cells);
  return error;
}

double completeness(const std::vector<Cuboid>& cuboids, const SurfaceTruth& truth, double s) {
  return completeness(CuboidDistance(cuboids), truth.visibleCells(s), s);
}

double completeness(const CuboidDistance& index, const std::vector<VisibleCell>& visible,
                    double s) {
  requirePositive("s", s, "m");
  if (visible.empty()) return 1.0;
  const auto found = std::count_if(visible.begin(), visible.end(), [&](const VisibleCell& cell) {
    return index.isWithin(cell.point, s);
  });
  return static_cast<double>(found) / static_cast<double>(visible.size());
}

double coverage(const std::vector<Cuboid>& cuboids, const std::vector<Vector3>& points,
                double margin) {
  return coverage(CuboidDistance(cuboids), points, margin);
}

double coverage(const CuboidDistance& index, const std::vector<Vector3>& points, double margin) {
  requireInRange("margin", margin, 0.0, std::numeric_limits<double>::max(), "m");
  std::size_t finite = 0;
  std::size_t covered = 0;
  for (const Vector3& point : points) {
    if (!point.allFinite()) continue;
    ++finite;
    covered += index.isWithin(point, margin) ? 1 : 0;
  }
  return finite == 0 ? 1.0 : static_cast<double>(covered) / static_cast<double>(finite);
}

HeldBackDistance heldBackDistance(const std::vector<Cuboid>& cuboids,
                                  const std::vector<Vector3>& points, double margin) {
  return heldBackDistance(CuboidDistance(cuboids), points, margin);
}

HeldBackDistance heldBackDistance(const CuboidDistance& index, const std::vector<Vector3>& points,
                                  double margin) {
  requireInRange("margin", margin, 0.0, std::numeric_limits<double>::max(), "m");
  std::vector<double> distances;
  distances.reserve(points.size());
  double sum = 0.0;
  std::size_t within = 0;
  for (const Vector3& point : points) {
    if (!point.allFinite()) continue;
    distances.push_back(index.distance(point));
    sum += distances.back();
    within += distances.back() <= margin ? 1 : 0;
  }
  HeldBackDistance result;
  result.points = distances.size();
  if (distances.empty()) return result;
  std::sort(distances.begin(), distances.end());
  result.median = nearestRank(distances, 0.5);
  result.percentile_95 = nearestRank(distances, 0.95);
  result.mean = sum / static_cast<double>(distances.size());
  result.share_within = static_cast<double>(within) / static_cast<double>(distances.size());
  return result;
}

CrossedSpace::CrossedSpace(double s, double clearance) : side_(s), clearance_(clearance) {
  requirePositive("s", s, "m");
  requireInRange("clearance", clearance, 0.0, std::numeric_limits<double>::max(), "m");
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
      if (!detail::cellKeyOf(point, side_, key)) continue;
      Sample& sample = samples_[key];
      if (sample.offset[0] >= 0.0f) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const double low = detail::unpackCell(key, axis) * side_;
        sample.offset[axis] = static_cast<float>(std::max(point[axis] - low, 0.0));
      }
    }
  }
}

std::size_t CrossedSpace::markedCells(const CuboidDistance& index) const {
  std::size_t marked = 0;
  samples_.forEach([&](std::uint64_t key, const Sample& sample) {
    Vector3 point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] =
          detail::unpackCell(key, axis) * side_ + static_cast<double>(sample.offset[axis]);
    marked += index.isWithin(point, 0.0) ? 1 : 0;
  });
  return marked;
}

FreeSpaceViolation freeSpaceViolation(const std::vector<Cuboid>& cuboids,
                                      const std::vector<MeasuredRay>& rays, double s) {
  CrossedSpace crossed(s, kClearanceInCells * s);
  crossed.add(rays);
  return freeSpaceViolation(CuboidDistance(cuboids), crossed);
}

FreeSpaceViolation freeSpaceViolation(const CuboidDistance& index, const CrossedSpace& crossed) {
  FreeSpaceViolation violation;
  if (crossed.cells() == 0) return violation;
  const double volume = crossed.side() * crossed.side() * crossed.side();
  const auto marked = static_cast<double>(crossed.markedCells(index));
  violation.share = marked / static_cast<double>(crossed.cells());
  violation.crossed_volume = volume * static_cast<double>(crossed.cells());
  violation.marked_volume = volume * marked;
  return violation;
}

}  // namespace evaluation
}  // namespace planar_mapping
