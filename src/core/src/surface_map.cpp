// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/surface_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "planar_mapping/core/error.h"
#include "surface_edges.h"
#include "surface_registration.h"
#include "surface_shape.h"

namespace planar_mapping {

void SurfaceMapParams::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  requirePositive("cell", cell, "m");
  requireInRange("min_points", min_points, 4, kLargest);
  requirePositive("max_thickness", max_thickness);
  if (!(max_normal_angle > 0.0 && max_normal_angle < M_PI / 2.0)) {
    throw ParameterError("max_normal_angle", max_normal_angle, "(0, pi/2)", "rad");
  }
  requireInRange("max_range", max_range, 0.0, kLargest, "m");
  requireInRange("depth_error", depth_error, 0.0, kLargest, "m");
  requireInRange("depth_error_growth", depth_error_growth, 0.0, kLargest, "1/m");
  requireInRange("lateral_error", lateral_error, 0.0, kLargest, "m");
  requirePositive("depth_error + depth_error_growth", depth_error + depth_error_growth);
  if (!optical_axis.allFinite()) {
    throw ParameterError("optical_axis", optical_axis.sum(), "finite");
  }
  requireInRange("edge_depth", edge_depth, 0.0, kLargest);
  requirePositive("edge_error", edge_error, "m");
  requireInRange("sample_size", sample_size, 100, kLargest);
  requirePositive("reach", reach, "m");
  requirePositive("same_direction", same_direction, "rad");
  requireInRange("least_direction", least_direction, 0.0, 1.0);
  requireInRange("retry_rotation", retry_rotation, 0.0, M_PI, "rad");
  requireInRange("good_share", good_share, 0.0, 1.0);
  requireInRange("good_edges", good_edges, 0.0, 1.0);
  requireInRange("confirmed_share", confirmed_share, 0.0, 1.0);
  requireInRange("iterations", iterations, 1, kLargest);
  requireInRange("min_share", min_share, 0.0, 1.0);
  requireInRange("correlated_planes", correlated_planes, 1.0, kLargest);
  requireInRange("max_cells", max_cells, 1000, kLargest);
}

class SurfaceMap::Implementation {
 public:
  explicit Implementation(const SurfaceMapParams& params)
      : params_(params),
        fine_(params.cell),
        coarse_(2.0 * params.cell),
        edges_(2.0 * params.cell, detail::CellShape::Line) {
    params.validate();
  }

  void insert(const PointsView& cloud, const Pose& T_world_sensor) {
    ++frame_;
    const Vector3 sensor = T_world_sensor.translation();
    detail::forSample(cloud, params_, [&](const Vector3& p, double error) {
      const Vector3 q = T_world_sensor * p;
      fine_.add(q, sensor, error, frame_);
      coarse_.add(q, sensor, error, frame_);
    });
    for (const Vector3& p : detail::occludingEdges(cloud, params_)) {
      edges_.add(T_world_sensor * p, sensor, params_.edge_error, frame_);
    }
    for (detail::SurfaceCells* cells : {&fine_, &coarse_, &edges_}) {
      cells->fit(params_);
      cells->limit(static_cast<std::size_t>(params_.max_cells));
    }
  }

  CloudRegistration locate(const PointsView& cloud, const Pose& guess) const {
    const detail::CloudShape shape = detail::shapeOf(cloud, params_);
    double range = params_.reach;
    for (const detail::Surfel& plane : shape.coarse.planes) {
      range = std::max(range, plane.center.norm() + params_.reach);
    }
    const auto nearby = [&](const detail::SurfaceCells& cells, detail::CellShape kind) {
      std::vector<detail::Surfel> planes;
      for (const detail::Surfel& plane : cells.planes()) {
        if ((plane.center - guess.translation()).norm() < range) planes.push_back(plane);
      }
      return detail::PlaneNeighbours(std::move(planes), params_.reach, kind);
    };
    const detail::MappedSurfaces map{fine_, edges_, nearby(coarse_, detail::CellShape::Plane),
                                     nearby(edges_, detail::CellShape::Line)};
    const detail::SurfaceRegistration registration(params_, shape, map);
    return registration.resultOf(registration.run(guess));
  }

  const SurfaceMapParams& params() const { return params_; }
  std::size_t cells() const { return fine_.size(); }

 private:
  SurfaceMapParams params_;
  detail::SurfaceCells fine_;
  detail::SurfaceCells coarse_;
  detail::SurfaceCells edges_;
  std::int64_t frame_ = 0;
};

SurfaceMap::SurfaceMap(const SurfaceMapParams& params)
    : implementation_(std::make_unique<Implementation>(params)) {}
SurfaceMap::~SurfaceMap() = default;
SurfaceMap::SurfaceMap(const SurfaceMap& other)
    : implementation_(std::make_unique<Implementation>(*other.implementation_)) {}
SurfaceMap& SurfaceMap::operator=(const SurfaceMap& other) {
  if (this != &other) implementation_ = std::make_unique<Implementation>(*other.implementation_);
  return *this;
}
SurfaceMap::SurfaceMap(SurfaceMap&&) noexcept = default;
SurfaceMap& SurfaceMap::operator=(SurfaceMap&&) noexcept = default;

const SurfaceMapParams& SurfaceMap::params() const {
  return implementation_->params();
}

void SurfaceMap::insert(const PointsView& cloud, const Pose& T_world_sensor) {
  if (!T_world_sensor.matrix().allFinite()) throw InputError("the pose of a cloud is not finite");
  implementation_->insert(cloud, T_world_sensor);
}

CloudRegistration SurfaceMap::locate(const PointsView& cloud, const Pose& guess) const {
  if (!guess.matrix().allFinite()) throw InputError("the guessed pose of a cloud is not finite");
  return implementation_->locate(cloud, guess);
}

std::size_t SurfaceMap::cells() const {
  return implementation_->cells();
}

}  // namespace planar_mapping
