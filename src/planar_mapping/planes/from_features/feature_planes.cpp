// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/planes/multi_plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping {
namespace {

/// Multi-RANSAC over the features alone. Where the noise of a stereo camera is known it runs in
/// disparity space (column, row, disparity): planes are planes there as well, and the noise is the
/// same near and far.
std::vector<Plane> planesOf(const std::vector<KeyFeature>& features, const MultiPlaneParams& params,
                            const Vector3& sensor, FeaturePlaneDiagnostics& diagnostics) {
  const bool by_disparity = params.noise && sensor.isZero();
  const StereoNoise camera = params.noise.value_or(StereoNoise());
  const double f = camera.focal_length;
  const double factor = camera.baseline * f;
  std::vector<float> xyz;
  xyz.reserve(3 * features.size());
  for (const KeyFeature& feature : features) {
    const Vector3& at = feature.position;
    if (!at.allFinite() || (by_disparity && !(at.z() > 0.0))) {
      ++diagnostics.features_not_finite;
      continue;
    }
    const Vector3 point =
        by_disparity ? Vector3(f * at.x() / at.z(), f * at.y() / at.z(), factor / at.z()) : at;
    for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(point[axis]));
  }
  diagnostics.features_considered = features.size();
  MultiPlaneParams sparse = params;
  sparse.method = PlaneSearchMethod::MultiRansac;
  sparse.min_inliers = params.features.min_features;
  sparse.max_planes = 0;
  if (by_disparity) {
    constexpr double kMinThreshold = 1e-3;  // pixels
    sparse.noise.reset();
    sparse.distance_threshold =
        std::max(kMinThreshold, params.features.feature_error_factor * camera.disparity_error);
  }
  const PlaneSet found =
      findPlanes(PointsView(xyz.data(), xyz.size() / 3), nullptr, sparse, Vector3::Zero());
  std::vector<Plane> planes;
  for (const PlaneSegment& segment : found.planes) {
    if (!by_disparity) {
      planes.push_back(segment.plane);
      continue;
    }
    // a X + b Y + c D + d = 0 times z.
    const Vector3& n = segment.plane.normal;
    const Vector3 normal(n.x() * f, n.y() * f, segment.plane.offset);
    const double length = normal.norm();
    if (!(length > 0.0) || !std::isfinite(length)) continue;
    planes.push_back({normal / length, n.z() * factor / length});
  }
  diagnostics.planes_of_features = planes.size();
  return planes;
}

/// Whether a plane of the dense search lies on one of features: the same direction, and its middle
/// within the band.
bool continues(const PlaneSegment& dense, const PlaneSegment& of_features, double joining_angle,
               const detail::DistanceBand& band) {
  const double cosine = std::fabs(dense.plane.normal.dot(of_features.plane.normal));
  if (cosine < std::cos(joining_angle)) return false;
  const Vector3& middle = dense.moments.mean();
  const Vector3& other = of_features.moments.mean();
  return std::fabs(of_features.plane.signedDistance(middle)) <= band.at(middle.z()) &&
         std::fabs(dense.plane.signedDistance(other)) <= band.at(other.z());
}

/// Whether a plane holds more points than the slabs beside it; \p indices are sampled.
bool isSurface(const Plane& plane, const PointsView& points, const Indices& indices,
               const MultiPlaneParams& params) {
  constexpr std::size_t kSample = 32768;
  const detail::DistanceBand band(params);
  double on = 0.0, above = 0.0, below = 0.0;
  for (std::size_t k = 0; k < indices.size(); k += 1 + indices.size() / kSample) {
    const Vector3 p = points.point(static_cast<std::size_t>(indices[k]));
    const double distance = plane.signedDistance(p) / band.at(p.z());
    if (!(std::fabs(distance) <= 3.0)) continue;
    (distance > 1.0 ? above : distance < -1.0 ? below : on) += 1.0;
  }
  return on >= params.features.min_dominance * std::max(above, below);
}

/// Planes of features with their dense points, refitted; doubtful ones are let go.
PlaneSet densePlanesOf(std::vector<Plane> planes, const PointsView& points, const Indices& indices,
                       const MultiPlaneParams& params, const Vector3& sensor,
                       FeaturePlaneDiagnostics& diagnostics) {
  if (params.features.refine) {
    detail::eraseIf(planes,
                    [&](const Plane& plane) { return !isSurface(plane, points, indices, params); });
  }
  const std::vector<std::int32_t> labels = detail::clusterIndexed(points, &indices, planes, params);
  PlaneSet set = detail::assemblePlaneSet(points, labels, planes, params, sensor);
  diagnostics.rejected_too_small = set.diagnostics.rejected_too_small;
  const auto before = [&](const PlaneSegment& segment) {
    const auto first = static_cast<std::size_t>(segment.inliers.front());
    return planes[static_cast<std::size_t>(labels[first])];
  };
  if (!params.features.refine) {
    for (PlaneSegment& segment : set.planes) {
      segment.plane = orientedTowards(before(segment), sensor);
      segment.tilt = normalizedTilt(segment.plane);
    }
    return set;
  }
  const double min_cosine = std::cos(params.features.max_refit_turn);
  detail::eraseIf(set.planes, [&](const PlaneSegment& segment) {
    return std::fabs(before(segment).normal.dot(segment.plane.normal)) < min_cosine;
  });
  return set;
}

/// The points that count and are in no plane.
Indices pointsLeft(const PointsView& points, const Indices& indices,
                   const std::vector<PlaneSegment>& planes) {
  std::vector<char> taken(points.size, 0);
  for (const PlaneSegment& segment : planes) {
    for (const int i : segment.inliers) taken[static_cast<std::size_t>(i)] = 1;
  }
  Indices left;
  for (const int i : indices) {
    if (taken[static_cast<std::size_t>(i)] == 0) left.push_back(i);
  }
  return left;
}

/// Adds planes of the dense search, those that continue a plane of features to that one.
void addDense(const PointsView& points, std::vector<PlaneSegment> dense,
              const MultiPlaneParams& params, const Vector3& sensor,
              FeaturePlaneDiagnostics& diagnostics, PlaneSet& set) {
  const detail::DistanceBand band(params);
  const std::size_t number = set.planes.size();
  std::vector<std::vector<std::size_t>> joined(number);
  std::vector<PlaneSegment> planes;
  for (std::size_t i = 0; i < dense.size(); ++i) {
    std::size_t at = 0;
    while (at < number && !continues(dense[i], set.planes[at], params.features.joining_angle, band))
      ++at;
    if (at < number) {
      joined[at].push_back(i);
    } else {
      planes.push_back(dense[i]);
      ++diagnostics.planes_of_dense_points;
    }
  }
  for (std::size_t at = 0; at < number; ++at) {
    if (joined[at].empty()) {
      planes.push_back(std::move(set.planes[at]));
      continue;
    }
    std::vector<std::int32_t> labels(points.size, -1);
    const auto label = [&](const Indices& inliers) {
      for (const int i : inliers) labels[static_cast<std::size_t>(i)] = 0;
    };
    label(set.planes[at].inliers);
    for (const std::size_t i : joined[at]) label(dense[i].inliers);
    PlaneSet whole =
        detail::assemblePlaneSet(points, labels, {set.planes[at].plane}, params, sensor);
    for (PlaneSegment& segment : whole.planes) planes.push_back(std::move(segment));
  }
  set.planes = std::move(planes);
}

/// Points spread evenly over those that count.
std::vector<KeyFeature> sampled(const PointsView& points, const Indices& indices, int samples) {
  const std::size_t count = std::min(indices.size(), static_cast<std::size_t>(samples));
  std::vector<KeyFeature> features(count);
  for (std::size_t i = 0; i < count; ++i) {
    features[i].position =
        points.point(static_cast<std::size_t>(indices[i * indices.size() / count]));
  }
  return features;
}

/// As segmentPlanes(), of a source other than Dense. \p indices are checked.
PlaneSet planesFromFeatures(const PointsView& points, const Indices& indices,
                            const std::vector<KeyFeature>& features, const MultiPlaneParams& params,
                            const Vector3& sensor) {
  FeaturePlaneDiagnostics own;
  PlaneSet set;
  const std::vector<Plane> planes = planesOf(features, params, sensor, own);
  if (!planes.empty()) {
    set = densePlanesOf(planes, points, indices, params, sensor, own);
    for (const PlaneSegment& segment : set.planes) own.points_of_features += segment.inliers.size();
  }
  set.diagnostics.method = PlaneSearchMethod::MultiRansac;
  if (params.source == PlaneSource::Auto) {
    const Indices left = pointsLeft(points, indices, set.planes);
    MultiPlaneParams dense = params;
    dense.max_planes = 0;
    PlaneSet found = findPlanes(points, &left, dense, sensor);
    set.diagnostics = found.diagnostics;
    addDense(points, std::move(found.planes), params, sensor, own, set);
  }
  detail::sortBySize(set.planes);
  set.diagnostics.points_considered = indices.size();
  const auto most = static_cast<std::size_t>(params.max_planes);
  if (most > 0 && set.planes.size() > most) {
    set.planes.resize(most);
    set.diagnostics.stopped_by_itself = false;
  }
  set.diagnostics.features = own;
  return set;
}

}  // namespace

void FeaturePlaneParams::validate() const {
  constexpr double kMaxCount = std::numeric_limits<int>::max();
  requireInRange("samples", samples, 0, kMaxCount, "points");
  requireInRange("min_features", min_features, 3, kMaxCount, "features");
  requirePositive("feature_error_factor", feature_error_factor);
  requireInRange("min_dominance", min_dominance, 1.0, std::numeric_limits<double>::max());
  requirePositive("max_refit_turn", max_refit_turn, "rad");
  requireInRange("max_refit_turn", max_refit_turn, 0.0, M_PI_2, "rad");
  requireInRange("joining_angle", joining_angle, 0.0, M_PI_2, "rad");
}

PlaneSet segmentPlanes(const PointsView& points, const Indices* indices,
                       const std::vector<KeyFeature>& features, const MultiPlaneParams& params,
                       const Vector3& sensor) {
  params.validate();
  detail::checkView(points, sensor);
  if (indices == nullptr) {
    const Indices usable = usablePoints(points);
    PlaneSet set = segmentPlanes(points, &usable, features, params, sensor);
    set.diagnostics.points_considered = points.size;
    set.diagnostics.points_not_measured += points.size - usable.size();
    return set;
  }
  // Without the noise of a camera, whose errors far away may be metres.
  if (!params.noise) {
    requireMetres(points, indices, kMaxSpacingInThresholds * params.distance_threshold,
                  "distance_threshold (by default half of resolution_m)");
  }
  if (params.source == PlaneSource::Dense) return findPlanes(points, indices, params, sensor);
  Indices storage;
  indices = detail::checkedIndices(points, *indices, storage);
  if (!features.empty()) return planesFromFeatures(points, *indices, features, params, sensor);
  const std::vector<KeyFeature> samples = sampled(points, *indices, params.features.samples);
  // A plane large enough among all points holds its fraction of the samples.
  const double fraction = static_cast<double>(samples.size()) /
                          static_cast<double>(std::max<std::size_t>(1, indices->size()));
  MultiPlaneParams sparse = params;
  sparse.features.min_features =
      std::max(params.features.min_features, static_cast<int>(params.min_inliers * fraction));
  return planesFromFeatures(points, *indices, samples, sparse, sensor);
}

}  // namespace planar_mapping
