// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/planes/multi_plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/point_indices.h"
#include "planar_mapping/core/base/error.h"
#include "planes/plane_search.h"

namespace planar_mapping {

namespace {
constexpr double kMaxInt = std::numeric_limits<int>::max();
}  // namespace

namespace detail {

void checkView(const PointsView& points, const Vector3& sensor) {
  if (points.size > 0 && points.data == nullptr) throw InputError("the cloud has no data");
  if (points.stride < 3) throw InputError("points must be at least three floats apart");
  if (static_cast<double>(points.size) > kMaxInt) {
    throw InputError("a cloud of " + std::to_string(points.size) +
                     " points is more than an index can count");
  }
  if (points.isOrganized() &&
      static_cast<std::size_t>(points.width) * points.height != points.size) {
    throw InputError("width times height of the cloud is not its number of points");
  }
  if (!sensor.allFinite()) throw InputError("the position of the sensor is not finite");
}

const Indices* checkedIndices(const PointsView& points, const Indices& indices, Indices& storage) {
  requireIndices(points, &indices);
  // Without branches, as nearly all lists are as they should be.
  unsigned unordered = 0;
  for (std::size_t i = 1; i < indices.size(); ++i) {
    unordered |= indices[i] <= indices[i - 1] ? 1U : 0U;
  }
  if (unordered == 0) return &indices;
  storage = indices;
  std::sort(storage.begin(), storage.end());
  storage.erase(std::unique(storage.begin(), storage.end()), storage.end());
  return &storage;
}

}  // namespace detail

namespace {

/// [ours] Automatic: up to this many points a cloud is features, not a surface.
constexpr std::size_t kMostSparsePoints = 5000;
/// [ours] Automatic: up to this many points it depends on their density.
constexpr std::size_t kLeastDensePoints = 100000;
/// [ours] Automatic: an image smaller than this, or used to a smaller share, has too few cells.
constexpr std::uint32_t kLeastImageSide = 32;
constexpr std::size_t kLeastImageShare = 4;
/// [ours] Automatic: in disparity space empty cells do no harm until there are too few others.
constexpr std::size_t kLeastDisparityShare = 7;

PlaneSearchMethod chooseMethod(const PointsView& points, const Indices* indices,
                               const MultiPlaneParams& params, std::size_t considered,
                               const Vector3& sensor) {
  if (considered <= kMostSparsePoints) return PlaneSearchMethod::MultiRansac;
  if (points.width >= kLeastImageSide && points.height >= kLeastImageSide) {
    const bool stereo = params.noise && sensor.isZero();
    const std::size_t share = stereo ? kLeastDisparityShare : kLeastImageShare;
    if (considered * share >= points.size) {
      return stereo ? PlaneSearchMethod::Disparity : PlaneSearchMethod::Organized;
    }
  }
  if (considered < kLeastDensePoints && !detail::isDense(points, indices, params)) {
    return PlaneSearchMethod::MultiRansac;
  }
  return PlaneSearchMethod::Sequential;
}

}  // namespace

void MultiPlaneParams::validate() const {
  if (method != PlaneSearchMethod::Automatic && method != PlaneSearchMethod::MultiRansac &&
      method != PlaneSearchMethod::Sequential && method != PlaneSearchMethod::Organized &&
      method != PlaneSearchMethod::Disparity) {
    throw ParameterError("method", static_cast<double>(method), "one of PlaneSearchMethod");
  }
  if (method == PlaneSearchMethod::Disparity && !noise) {
    throw ParameterError("the search in disparity space needs the noise of the stereo camera");
  }
  requirePositive("distance_threshold", distance_threshold, "m");
  requireInRange("min_inliers", min_inliers, 3, kMaxInt, "points");
  requireInRange("max_planes", max_planes, 0, kMaxInt);
  if (noise) noise->validate();
  requireInRange("noise_factor", noise_factor, 0.0, std::numeric_limits<double>::max());
  requireInRange("patch_gap", patch_gap, 0.0, std::numeric_limits<double>::max(), "m");
  requireInRange("number_of_models", number_of_models, 0, kMaxInt);
  requireInRange("max_iterations", max_iterations, 0, kMaxInt);
  if (!(miss_probability > 0.0 && miss_probability < 1.0)) {
    throw ParameterError("miss_probability", miss_probability, "(0, 1)");
  }
  requireInRange("significance", significance, 0.0, std::numeric_limits<double>::max());
  if (!(max_normal_deviation > 0.0 && max_normal_deviation <= M_PI_2)) {
    throw ParameterError("max_normal_deviation", max_normal_deviation, "(0, pi/2]", "rad");
  }
  requireInRange("threads", threads, 0, kMaxInt);
  if (source != PlaneSource::Dense && source != PlaneSource::Features &&
      source != PlaneSource::Auto) {
    throw ParameterError("source", static_cast<double>(source), "one of PlaneSource");
  }
  features.validate();
}

PlaneSet findPlanes(const PointsView& points, const Indices* indices,
                    const MultiPlaneParams& params, const Vector3& sensor) {
  params.validate();
  detail::checkView(points, sensor);
  Indices storage;
  if (indices != nullptr) indices = detail::checkedIndices(points, *indices, storage);
  const std::size_t considered = detail::countOf(points, indices);

  const PlaneSearchMethod method = params.method == PlaneSearchMethod::Automatic
                                       ? chooseMethod(points, indices, params, considered, sensor)
                                       : params.method;
  PlaneSet set;
  switch (method) {
    case PlaneSearchMethod::MultiRansac:
      set = detail::findPlanesMultiRansac(points, indices, params, sensor);
      break;
    case PlaneSearchMethod::Organized:
      set = detail::findPlanesOrganized(points, indices, params, sensor);
      break;
    case PlaneSearchMethod::Disparity:
      if (!sensor.isZero()) throw InputError("disparity is that of a sensor at the origin");
      set = detail::findPlanesDisparity(points, indices, params);
      break;
    default:
      set = detail::findPlanesSequential(points, indices, params, sensor);
      break;
  }
  set.diagnostics.method = method;
  set.diagnostics.points_considered = considered;
  if (params.max_planes > 0 && set.planes.size() > static_cast<std::size_t>(params.max_planes)) {
    set.planes.resize(static_cast<std::size_t>(params.max_planes));
    set.diagnostics.stopped_by_itself = false;
  }
  return set;
}

}  // namespace planar_mapping
