// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/cuboid_approximation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "cell_index.h"
#include "planar_mapping/core/error.h"
#include "plane_cells.h"
#include "plane_cover.h"

namespace planar_mapping {
namespace {

constexpr double kLargestLength = 1e6;  ///< metres; more is a mistake of units

/// The point is placed in a cell of the common grid unless floats are coarser than cells there.
bool cellAt(const float* p, double inverse_resolution, detail::CellKey& cell) {
  constexpr double limit = 1 << 30;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = std::floor(p[axis] * inverse_resolution);
    if (!(std::abs(value) < limit)) return false;
    cell[axis] = static_cast<std::int32_t>(value);
  }
  return true;
}

struct KeyedPoint {
  detail::CellKey cell;
  int index;
};

std::vector<KeyedPoint> sortedByCell(const PointsView& points, const std::vector<char>& wanted,
                                     double resolution, std::size_t& dropped) {
  std::vector<KeyedPoint> keyed;
  for (std::size_t i = 0; i < points.size; ++i) {
    if (!wanted[i]) continue;
    KeyedPoint point{{}, static_cast<int>(i)};
    if (cellAt(points[i], 1.0 / resolution, point.cell)) {
      keyed.push_back(point);
    } else {
      ++dropped;
    }
  }
  std::sort(keyed.begin(), keyed.end(), [](const KeyedPoint& l, const KeyedPoint& r) {
    return l.cell != r.cell ? l.cell < r.cell : l.index < r.index;
  });
  return keyed;
}

void requireIndices(const Indices& indices, std::size_t size, const char* what) {
  for (const int i : indices) {
    if (i < 0 || static_cast<std::size_t>(i) >= size) {
      throw InputError(std::string(what) + " " + std::to_string(i) + " is outside the cloud of " +
                       std::to_string(size) + " points");
    }
  }
}

}  // namespace

void CuboidApproximationParams::validate() const {
  requireInRange("resolution", resolution, 1e-4, kLargestLength, "m");
  requireInRange("thickness", thickness, 0.0, kLargestLength, "m");
  requirePositive("density_threshold", density_threshold);
  requireInRange("density_threshold", density_threshold, 0.0, 1.0);
  requireInRange("min_width", min_width, 0.0, kLargestLength, "m");
  requireInRange("min_height", min_height, 0.0, kLargestLength, "m");
  requireInRange("min_points_per_cell", min_points_per_cell, 1, 1e9);
  requireInRange("hole_size", hole_size, 0.0, kLargestLength, "m");
  requireInRange("threads", threads, 0, 4096);
  if (!up.allFinite() || !(up.norm() > 0.0)) {
    throw ParameterError("up", up.norm(), "a finite vector of length > 0");
  }
}

std::vector<Cuboid> approximateCuboids(const PointsView& points, const Indices* indices,
                                       const std::vector<PlaneSegment>& planes,
                                       const CuboidApproximationParams& params,
                                       const Vector3& sensor,
                                       const std::vector<float>* point_probability,
                                       CuboidApproximationDiagnostics* diagnostics) {
  params.validate();
  if (!sensor.allFinite()) throw InputError("the sensor position is not finite");
  if (point_probability && point_probability->size() != points.size) {
    throw InputError("a cloud of " + std::to_string(points.size) + " points comes with " +
                     std::to_string(point_probability->size()) + " probabilities");
  }
  CuboidApproximationDiagnostics counts;
  std::vector<char> counted(points.size, indices ? 0 : 1);
  if (indices) {
    requireIndices(*indices, points.size, "index");
    for (const int i : *indices) counted[static_cast<std::size_t>(i)] = 1;
  }
  std::size_t unplaced = 0;
  if (diagnostics) {
    const std::vector<KeyedPoint> all = sortedByCell(points, counted, params.resolution, unplaced);
    for (std::size_t i = 0; i < all.size(); ++i) {
      counts.standard_cells += i == 0 || all[i].cell != all[i - 1].cell;
    }
  }

  std::vector<char> rest = counted;
  std::vector<Cuboid> cuboids;
  for (std::size_t id = 0; id < planes.size(); ++id) {
    requireIndices(planes[id].inliers, points.size, "inlier");
    Indices inliers;
    inliers.reserve(planes[id].inliers.size());
    for (const int i : planes[id].inliers) {
      if (!counted[static_cast<std::size_t>(i)]) continue;
      inliers.push_back(i);
      rest[static_cast<std::size_t>(i)] = 0;
    }
    counts.planar_points += inliers.size();
    for (const detail::PlanePatch& patch :
         detail::rasterizePlane(points, planes[id].plane, inliers, params, sensor,
                                point_probability, counts.dropped_points)) {
      const std::vector<Cuboid> of_patch = cuboidsOfPlane(
          patch.frame, patch.mask, patch.probability, static_cast<std::int32_t>(id), params);
      cuboids.insert(cuboids.end(), of_patch.begin(), of_patch.end());
    }
  }
  counts.planar_cuboids = cuboids.size();

  std::vector<NonPlanarCell> cells;
  const std::vector<KeyedPoint> keyed =
      sortedByCell(points, rest, params.resolution, counts.dropped_points);
  for (const KeyedPoint& point : keyed) {
    const Vector3 p = points.point(static_cast<std::size_t>(point.index));
    ++counts.non_planar_points;
    if (params.profile == Profile::Compact) {
      const double margin = 0.5 * params.resolution;
      if (std::any_of(cuboids.begin(), cuboids.end(),
                      [&](const Cuboid& c) { return contains(c, p, margin); })) {
        ++counts.absorbed_points;
        continue;
      }
    }
    const float probability =
        point_probability ? (*point_probability)[static_cast<std::size_t>(point.index)] : 1.0f;
    if (cells.empty() ||
        detail::CellKey{cells.back().x, cells.back().y, cells.back().z} != point.cell) {
      NonPlanarCell cell;
      cell.x = point.cell[0];
      cell.y = point.cell[1];
      cell.z = point.cell[2];
      cell.mean = p;
      cell.weight = 1.0f;
      cell.probability = probability;
      cells.push_back(cell);
      continue;
    }
    NonPlanarCell& cell = cells.back();
    cell.weight += 1.0f;
    cell.mean += (p - cell.mean) / static_cast<double>(cell.weight);
    cell.probability += (probability - cell.probability) / cell.weight;
  }
  for (const NonPlanarCell& cell : cells) {
    if (cell.weight < static_cast<float>(params.min_points_per_cell)) {
      counts.dropped_points += static_cast<std::size_t>(cell.weight);
    }
  }
  const std::vector<Cuboid> boxes = cuboidsOfCells(cells, params, sensor);
  cuboids.insert(cuboids.end(), boxes.begin(), boxes.end());
  counts.non_planar_cuboids = boxes.size();
  if (diagnostics) *diagnostics = counts;
  return cuboids;
}

}  // namespace planar_mapping
