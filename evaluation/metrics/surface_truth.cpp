// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/surface_truth.h"

#include <algorithm>
#include <cmath>

#include "evaluation/simulation/object_view.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kSeenSide = 0.01;  ///< metres; seen surface is thinned to cubes of this side
constexpr double kBehind = 1e-4;    ///< metres

/// To the surface of a box or, with an extent in the plane of (distance from the axis, z), of a
/// cylinder: N coordinates with half lengths.
template <typename Point>
double toFaces(const Point& point, const Point& half) {
  const Point beyond = point.cwiseAbs() - half;
  const double deepest = beyond.maxCoeff();
  return deepest <= 0.0 ? -deepest : beyond.cwiseMax(0.0).norm();
}

}  // namespace

void VisibleSurfaceParams::validate() const {
  requirePositive("max_depth", max_depth, "m");
  requireInRange("ground_height", ground_height, -1e9, 1e9, "m");
  requireInRange("min_incidence", min_incidence, 0.0, 1.0);
}

SurfaceTruth::SurfaceTruth(const Scene& scene, int first_frame, int last_frame) {
  if (first_frame > last_frame) throw InputError("the first frame is after the last one");
  for (const SceneObject& object : scene.objects) {
    requireSound(object);
    if (object.first_frame > last_frame || object.last_frame < first_frame) continue;
    Solid solid;
    solid.shape = object.shape;
    solid.center = object.T_world_object.translation();
    solid.to_local = object.T_world_object.linear().transpose();
    solid.half = 0.5 * object.size;
    solid.reach = solid.to_local.transpose().cwiseAbs() * solid.half;
    solids_.push_back(solid);
  }
}

double SurfaceTruth::surfaceDistance(const Solid& solid, const Vector3& point) {
  const Vector3 p = solid.to_local * (point - solid.center);
  switch (solid.shape) {
    case Shape::Box:
      return toFaces<Vector3>(p, solid.half);
    case Shape::Cylinder:
      return toFaces<Vector2>(Vector2(p.head<2>().norm(), p.z()),
                              Vector2(solid.half.x(), solid.half.z()));
    case Shape::Sphere:
      break;
  }
  return std::abs(p.norm() - solid.half.x());
}

double SurfaceTruth::distance(const Vector3& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Solid& solid : solids_) {
    const Vector3 outside =
        ((point - solid.center).cwiseAbs() - solid.reach).cwiseMax(Vector3::Zero());
    if (outside.squaredNorm() >= nearest * nearest) continue;
    nearest = std::min(nearest, surfaceDistance(solid, point));
  }
  return nearest;
}

bool SurfaceTruth::isNear(const Vector3& point, double margin) const {
  for (const Solid& solid : solids_) {
    const Vector3 outside = (point - solid.center).cwiseAbs() - solid.reach;
    if (outside.maxCoeff() > margin) continue;
    if (surfaceDistance(solid, point) <= margin) return true;
  }
  return false;
}

void SurfaceTruth::addView(const Rendering& view, const Pose& T_world_camera,
                           const VisibleSurfaceParams& params) {
  params.validate();
  const PinholeCamera& camera = view.camera;
  const double pixels = static_cast<double>(camera.width) * camera.height;
  for (const std::size_t size : {view.depth.size(), view.object.size(), view.incidence.size()})
    if (camera.width < 0 || static_cast<double>(size) != pixels)
      throw InputError("the view does not have the pixels of its camera");
  std::size_t i = 0;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column, ++i) {
      const auto depth = static_cast<double>(view.depth[i]);
      if (view.object[i] < 0 || depth > params.max_depth ||
          static_cast<double>(view.incidence[i]) < params.min_incidence)
        continue;
      const Vector3 direction = camera.rayOf(column, row);
      const Vector3 point = T_world_camera * (depth * direction + kBehind * direction.normalized());
      std::uint64_t key = 0;
      if (point.z() <= params.ground_height ||
          !planar_mapping::detail::cellKeyOf(point, kSeenSide, key))
        continue;
      Seen& seen = seen_[key];
      seen.sum += point;
      ++seen.pixels;
    }
  }
}

std::vector<VisibleCell> SurfaceTruth::visibleCells(double s) const {
  requirePositive("s", s, "m");
  struct Sum {
    Vector3 points = Vector3::Zero();
    std::size_t count = 0;
    std::size_t pixels = 0;
  };
  planar_mapping::detail::KeyMap<Sum> table;
  for (const std::uint64_t seen_key : seen_.sortedKeys()) {
    const Seen& seen = *seen_.find(seen_key);
    const Vector3 point = seen.sum / static_cast<double>(seen.pixels);
    std::uint64_t key = 0;
    if (!planar_mapping::detail::cellKeyOf(point, s, key)) continue;
    Sum& sum = table[key];
    sum.points += point;
    sum.pixels += seen.pixels;
    ++sum.count;
  }
  std::vector<VisibleCell> cells;
  for (const std::uint64_t key : table.sortedKeys()) {
    const Sum& sum = *table.find(key);
    cells.push_back({planar_mapping::detail::unpackKey(key),
                     sum.points / static_cast<double>(sum.count), sum.pixels});
  }
  return cells;
}

}  // namespace planar_mapping::evaluation
