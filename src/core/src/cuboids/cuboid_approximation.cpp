// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/cuboids/cuboid_approximation.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <string>
#include <tuple>

#include "grid/cell_numbering.h"
#include "planar_mapping/core/cuboids/detail/compact_cover.h"
#include "planar_mapping/core/base/error.h"
#include "cuboids/plane_cells.h"
#include "cuboids/plane_cover.h"
#include "cuboids/rest_cells.h"

namespace planar_mapping {
namespace {

constexpr double kLargestLength = 1e6;  ///< metres; more is a mistake of units

void requireIndices(const Indices& indices, std::size_t size, const char* what) {
  bool outside = false;
  for (const int i : indices) outside |= i < 0 || static_cast<std::size_t>(i) >= size;
  if (!outside) return;
  for (const int i : indices) {
    if (i < 0 || static_cast<std::size_t>(i) >= size) {
      throw InputError(std::string(what) + " " + std::to_string(i) + " is outside the cloud of " +
                       std::to_string(size) + " points");
    }
  }
}

/// Which points are left: first those that count, in the end those on no plane.
class RestFlags {
 public:
  RestFlags(std::size_t size, const Indices* indices) : flag_(size, indices ? kOut : kLeft) {
    if (!indices) return;
    for (const int i : *indices) flag_[static_cast<std::size_t>(i)] = kLeft;
  }

  /// Those of the inliers that count, kept in \p counted.
  const Indices& among(const Indices& inliers, Indices& counted) const {
    counted.clear();
    for (const int i : inliers) {
      if (flag_[static_cast<std::size_t>(i)] != kOut) counted.push_back(i);
    }
    return counted;
  }

  void remove(const Indices& inliers) {
    for (const int i : inliers) flag_[static_cast<std::size_t>(i)] = kPlanar;
  }

  Indices indices() const {
    Indices left;
    std::size_t i = 0;
    for (; i + 8 <= flag_.size(); i += 8) {
      // Long stretches lie on planes: eight flags at a time.
      std::uint64_t eight;
      std::memcpy(&eight, &flag_[i], 8);
      if ((eight & kLeftEight) == 0) continue;
      for (std::size_t k = i; k < i + 8; ++k) {
        if (flag_[k] == kLeft) left.push_back(static_cast<int>(k));
      }
    }
    for (; i < flag_.size(); ++i) {
      if (flag_[i] == kLeft) left.push_back(static_cast<int>(i));
    }
    return left;
  }

 private:
  static constexpr std::uint8_t kOut = 0;
  static constexpr std::uint8_t kLeft = 1;
  static constexpr std::uint8_t kPlanar = 2;
  static constexpr std::uint64_t kLeftEight = 0x0101010101010101ULL;

  std::vector<std::uint8_t> flag_;
};

/// Large planes take their cells first; the order in which planes are given must not matter.
std::vector<std::size_t> largestFirst(const std::vector<PlaneSegment>& planes) {
  std::vector<std::size_t> order(planes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto rank = [&](std::size_t i) {
    const PlaneSegment& p = planes[i];
    return std::make_tuple(-static_cast<std::int64_t>(p.inliers.size()), p.plane.normal.x(),
                           p.plane.normal.y(), p.plane.normal.z(), p.plane.offset);
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t l, std::size_t r) { return rank(l) < rank(r); });
  return order;
}

Vector3 directionOf(const std::vector<PlaneSegment>& segments, const Vector3& up) {
  std::vector<Plane> planes;
  std::vector<double> weights;
  for (const PlaneSegment& segment : segments) {
    planes.push_back(segment.plane);
    weights.push_back(static_cast<double>(segment.inliers.size()));
  }
  return dominantDirection(planes, weights, up);
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
  requireInRange("absorption", absorption, 0.0, 0.5, "cells");
  requireInRange("rectangle_cells", rectangle_cells, 0.0, 1e9, "cells");
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
  if (indices) requireIndices(*indices, points.size, "index");
  if (diagnostics) {
    counts.standard_cells = detail::countCells(points, indices, params.resolution);
  }

  RestFlags rest(points.size, indices);
  const bool compact = params.profile == Profile::Compact;
  const double half = 0.5 * params.resolution;
  detail::PlanarVolume volume(half, detail::thicknessOf(params),
                              params.absorption * params.resolution);
  std::vector<SurfacePiece> pieces;
  std::vector<std::vector<Cuboid>> of_plane(planes.size());
  const Vector3 along = compact ? directionOf(planes, params.up) : Vector3::Zero();
  Indices counted;
  for (const PlaneSegment& segment : planes) requireIndices(segment.inliers, points.size, "inlier");
  for (const std::size_t id : largestFirst(planes)) {
    const Indices& inliers = indices ? rest.among(planes[id].inliers, counted) : planes[id].inliers;
    rest.remove(inliers);
    counts.planar_points += inliers.size();
    const PlaneFrame frame =
        makePlaneFrame(orientedTowards(planes[id].plane, sensor), sensor, params.up, along);
    std::vector<detail::PlanePatch> patches = detail::rasterizePlane(
        {points, inliers, point_probability}, frame, params, counts.dropped_points);
    if (compact) {
      for (detail::PlanePatch& patch : patches) volume.clearCovered(patch, params.resolution);
    }
    for (const detail::PlanePatch& patch : patches) {
      const SurfaceCover cover =
          coverSurface(patch.mask, patch.quarters.data(), patch.probability, params);
      for (std::size_t i = 0; i < cover.rectangles.size(); ++i) {
        Cuboid cuboid = cuboidOf(cover.rectangles[i], patch.frame, params);
        cuboid.plane_id = static_cast<std::int32_t>(id);
        cuboid.probability = cover.probability[i];
        of_plane[id].push_back(cuboid);
      }
      for (const LooseQuarter& q : cover.loose) addPieces(q, patch.frame, params, pieces);
      if (compact) volume.add(patch.frame, cover.rectangles);
    }
  }
  std::vector<Cuboid> cuboids;
  for (const std::vector<Cuboid>& some : of_plane) {
    cuboids.insert(cuboids.end(), some.begin(), some.end());
  }
  counts.planar_cuboids = cuboids.size();

  const Indices rest_indices = rest.indices();
  detail::RestCells cells = detail::collectRest(points, &rest_indices, params.resolution,
                                                compact ? &volume : nullptr, point_probability);
  counts.non_planar_points = cells.points;
  counts.absorbed_points = cells.absorbed;
  counts.dropped_points += cells.dropped;
  for (const NonPlanarCell& cell : cells.cells) {
    if (cell.octants != 0 && cell.weight < static_cast<float>(params.min_points_per_cell)) {
      counts.dropped_points += static_cast<std::size_t>(cell.weight);
    }
  }
  const std::vector<Cuboid> boxes =
      compact ? coverRest(cells.cells, pieces, cuboids, {}, params, CoverEffort::Quick).boxes
              : cuboidsOfCells(cells.cells, params, sensor);
  cuboids.insert(cuboids.end(), boxes.begin(), boxes.end());
  counts.non_planar_cuboids = boxes.size();
  if (diagnostics) *diagnostics = counts;
  return cuboids;
}

}  // namespace planar_mapping
