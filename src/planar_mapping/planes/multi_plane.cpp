// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/multi_plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/planes/cloud_image.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping {

namespace {
constexpr double kMaxInt = std::numeric_limits<int>::max();
}  // namespace

namespace detail {

void checkView(const PointsView& points, const Vector3& sensor) {
  if (points.size > 0 && points.data == nullptr) throw InputError("the cloud has no data");
  if (points.stride < 3) throw InputError("points must be at least three floats apart");
  requireIndices(points, nullptr);
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
  makeDistinct(storage);
  return &storage;
}

}  // namespace detail

namespace {

/// [ours] Automatic: up to this many points a cloud is features, not a surface.
constexpr std::size_t kMaxSparsePoints = 5000;
/// [ours] Automatic: sparse clouds with fewer points may fall back to multi-RANSAC, where less than
/// this fraction lies on planes that the search for surfaces finds.
constexpr std::size_t kMinDensePoints = 100000;
constexpr double kMinSurfaceFraction = 0.5;
/// [ours] ... and is taken anyway where surfaces hold fewer than these.
constexpr double kMinCertainFraction = 0.25;
/// [ours] Automatic: an image smaller than this, or used to a smaller fraction, has too few cells.
constexpr std::uint32_t kMinImageSide = 32;
constexpr std::size_t kImageDivisor = 4;
/// [ours] Automatic: in disparity space empty cells do no harm until there are too few others.
constexpr std::size_t kDisparityDivisor = 7;

/// A spinning scanner's rows and columns are those of its packets: neighbours there need not be
/// neighbours in space.
bool isSeenAllAround(const PointsView& points, const Vector3& sensor) {
  constexpr std::size_t kStep = 61;
  constexpr double kMaxMean = 0.5;  // length of the mean direction; of a view of 120 degrees 0.75
  Vector3 sum = Vector3::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < points.size; i += kStep) {
    if (!points.isMeasured(i)) continue;
    sum += (points.point(i) - sensor).normalized();
    count += 1.0;
  }
  return sum.norm() < kMaxMean * count;
}

PlaneSearchMethod chooseMethod(const PointsView& points, const MultiPlaneParams& params,
                               std::size_t considered, const Vector3& sensor) {
  if (considered <= kMaxSparsePoints) return PlaneSearchMethod::MultiRansac;
  if (points.width >= kMinImageSide && points.height >= kMinImageSide) {
    const bool stereo = params.noise && sensor.isZero();
    const std::size_t divisor = stereo ? kDisparityDivisor : kImageDivisor;
    if (considered * divisor >= points.size && !isSeenAllAround(points, sensor)) {
      return stereo ? PlaneSearchMethod::Disparity : PlaneSearchMethod::Organized;
    }
  }
  return PlaneSearchMethod::Sequential;
}

PlaneSet findPlanesBy(PlaneSearchMethod method, const PointsView& points, const Indices* indices,
                      const MultiPlaneParams& params, const Vector3& sensor) {
  switch (method) {
    case PlaneSearchMethod::MultiRansac:
      return detail::findPlanesMultiRansac(points, indices, params, sensor);
    case PlaneSearchMethod::Organized:
      return detail::findPlanesOrganized(points, indices, params, sensor);
    case PlaneSearchMethod::Disparity:
      if (!sensor.isZero()) throw InputError("disparity is that of a sensor at the origin");
      return detail::findPlanesDisparity(points, indices, params);
    default:
      return detail::findPlanesSequential(points, indices, params, sensor);
  }
}

/// Inliers that are pixels become the points there, ascending; patches follow.
/// \param points of each pixel, -1 = none
/// \param size   of the cloud
void takeInliers(const Indices& points, std::size_t size, std::vector<PlaneSegment>& segments) {
  struct Place {
    std::int32_t segment = -1;
    std::int32_t patch = 0;
  };
  std::vector<Place> places(size);
  for (std::size_t k = 0; k < segments.size(); ++k) {
    PlaneSegment& segment = segments[k];
    for (std::size_t i = 0; i < segment.inliers.size(); ++i) {
      const auto pixel = static_cast<std::size_t>(segment.inliers[i]);
      places[static_cast<std::size_t>(points[pixel])] = {
          static_cast<std::int32_t>(k), segment.patches.empty() ? 0 : segment.patches[i]};
    }
    segment.inliers.clear();
  }
  for (std::size_t i = 0; i < size; ++i) {
    if (places[i].segment < 0) continue;
    PlaneSegment& segment = segments[static_cast<std::size_t>(places[i].segment)];
    if (!segment.patches.empty()) segment.patches[segment.inliers.size()] = places[i].patch;
    segment.inliers.push_back(static_cast<int>(i));
  }
}

std::size_t inliersOf(const PlaneSet& set) {
  std::size_t count = 0;
  for (const PlaneSegment& segment : set.planes) count += segment.inliers.size();
  return count;
}

}  // namespace

void MultiPlaneParams::validate() const {
  requireInRange("method", static_cast<int>(method), 0,
                 static_cast<int>(PlaneSearchMethod::Disparity));
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
  requireInRange("source", static_cast<int>(source), 0, static_cast<int>(PlaneSource::Auto));
  features.validate();
}

PlaneSet findPlanes(const PointsView& points, const Indices* indices,
                    const MultiPlaneParams& params, const Vector3& sensor) {
  params.validate();
  detail::checkView(points, sensor);
  Indices storage;
  if (indices != nullptr) indices = detail::checkedIndices(points, *indices, storage);
  const std::size_t considered = detail::countOf(points, indices);

  const bool is_automatic = params.method == PlaneSearchMethod::Automatic;
  if (is_automatic && !points.isOrganized() && considered > kMaxSparsePoints) {
    const auto image = detail::imageOf(points, indices, sensor);
    if (image && chooseMethod(image->view(), params, image->measured, sensor) !=
                     PlaneSearchMethod::Sequential) {
      PlaneSet set = findPlanes(image->view(), nullptr, params, sensor);
      set.diagnostics.points_considered = considered;
      set.diagnostics.points_not_measured = considered - image->measured;
      takeInliers(image->points, points.size, set.planes);
      return set;
    }
  }
  PlaneSearchMethod method =
      is_automatic ? chooseMethod(points, params, considered, sensor) : params.method;
  PlaneSet set = findPlanesBy(method, points, indices, params, sensor);
  if (is_automatic && method == PlaneSearchMethod::Organized && set.planes.empty()) {
    // Neighbours in rows and columns may be none in space, as some drivers write them.
    method = PlaneSearchMethod::Sequential;
    set = findPlanesBy(method, points, indices, params, sensor);
  }
  // The rings of a scanner lie on surfaces, however wide the gaps between them; of sparse features
  // among clutter the search for surfaces finds few, and those few may be clutter.
  const auto on_surfaces = static_cast<double>(inliersOf(set));
  const auto count = static_cast<double>(considered);
  if (is_automatic && method == PlaneSearchMethod::Sequential && considered < kMinDensePoints &&
      on_surfaces < kMinSurfaceFraction * count && !detail::isDense(points, indices, params)) {
    PlaneSet models = findPlanesBy(PlaneSearchMethod::MultiRansac, points, indices, params, sensor);
    if (on_surfaces < kMinCertainFraction * count ||
        static_cast<double>(inliersOf(models)) > on_surfaces) {
      set = std::move(models);
      method = PlaneSearchMethod::MultiRansac;
    }
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
