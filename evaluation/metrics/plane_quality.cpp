// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/plane_quality.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/plane_moments.h"

namespace planar_mapping::evaluation {
namespace {

/// Where the planes \p moments belong: the index of a coplanar plane with as many points or more,
/// or their own.
std::vector<std::size_t> coplanarTargets(const std::vector<PlaneMoments>& moments,
                                         const CoplanarParams& params) {
  std::vector<PlaneMoments::Fit> fits;
  fits.reserve(moments.size());
  for (const PlaneMoments& m : moments) fits.push_back(m.fit());
  std::vector<std::size_t> order(moments.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return moments[a].weight() > moments[b].weight();
  });
  const double min_cosine = std::cos(params.max_angle);
  const auto coplanar = [&](std::size_t large, std::size_t small) {
    if (!fits[large].valid || !fits[small].valid) return false;
    const Plane& plane = fits[large].plane;
    if (std::fabs(plane.normal.dot(fits[small].plane.normal)) < min_cosine) return false;
    const double centre = plane.signedDistance(moments[small].mean());
    const double square =
        plane.normal.dot(moments[small].scatter() * plane.normal) / moments[small].weight() +
        centre * centre;
    return square - fits[small].rms * fits[small].rms <= params.max_distance * params.max_distance;
  };
  std::vector<std::size_t> target(moments.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    target[order[i]] = order[i];
    for (std::size_t j = 0; j < i; ++j) {
      if (target[order[j]] != order[j] || !coplanar(order[j], order[i])) continue;
      target[order[i]] = order[j];
      break;
    }
  }
  return target;
}

/// The plane m . p = 1 of least squares of 1 / r = m . direction, of directions that are exact.
struct RayFit {
  static constexpr double kMinSpread = 1e-12;  ///< of directions that span a plane, squared
  Matrix3 squares = Matrix3::Zero();
  Vector3 products = Vector3::Zero();
  int points = 0;

  void add(const Vector3& point) {
    const double range = point.norm();
    if (!(range > 0.0)) return;
    const Vector3 direction = point / range;
    squares += direction * direction.transpose();
    products += direction / range;
    ++points;
  }
  /// \return false if there are too few points or all lie on a line
  bool fit(Plane& plane) const {
    if (points < 3) return false;
    Eigen::FullPivLU<Matrix3> decomposition(squares);
    decomposition.setThreshold(kMinSpread);
    if (decomposition.rank() < 3) return false;
    const Vector3 m = decomposition.solve(products);
    const double length = m.norm();
    if (!m.allFinite() || !(length > 0.0)) return false;
    plane = {m / length, -1.0 / length};
    return true;
  }
};

void requireSameSize(const PointsView& points, const std::vector<int>& labels) {
  if (labels.size() != points.size) {
    throw InputError(std::to_string(labels.size()) + " labels for " + std::to_string(points.size) +
                     " points");
  }
}

void requireKnownLabels(const PlaneTruth& truth) {
  for (const int label : truth.labels) {
    if (label < kNotJudged ||
        (label >= 0 && static_cast<std::size_t>(label) >= truth.planes.size())) {
      throw InputError("label " + std::to_string(label) + " of " +
                       std::to_string(truth.planes.size()) + " planes");
    }
  }
}

std::size_t checkedInlier(int inlier, std::size_t size) {
  if (inlier < 0 || static_cast<std::size_t>(inlier) >= size) {
    throw InputError("inlier " + std::to_string(inlier) + " is outside the cloud of " +
                     std::to_string(size) + " points");
  }
  return static_cast<std::size_t>(inlier);
}

/// Points that segments and true planes share; only of segments that are judged.
struct Overlaps {
  std::vector<std::vector<double>> shared;  ///< [segment][plane]
  std::vector<double> segment_sizes;        ///< judged points
  std::vector<double> plane_sizes;
  std::vector<std::size_t> index;  ///< of each segment that is judged
};

Overlaps overlapsOf(const PlaneTruth& truth, const std::vector<PlaneSegment>& segments) {
  Overlaps result;
  for (const std::size_t size : truth.sizes())
    result.plane_sizes.push_back(static_cast<double>(size));
  std::vector<char> taken(truth.labels.size(), 0);
  for (std::size_t s = 0; s < segments.size(); ++s) {
    std::vector<double> shared(truth.planes.size(), 0.0);
    double judged = 0.0;
    for (const int inlier : segments[s].inliers) {
      const std::size_t i = checkedInlier(inlier, truth.labels.size());
      if (taken[i]) throw InputError("point " + std::to_string(i) + " is in two segments");
      taken[i] = 1;
      const int label = truth.labels[i];
      if (label != kNotJudged) judged += 1.0;
      if (label >= 0) shared[static_cast<std::size_t>(label)] += 1.0;
    }
    if (judged == 0.0 || judged < 0.5 * static_cast<double>(segments[s].inliers.size())) continue;
    result.shared.push_back(shared);
    result.segment_sizes.push_back(judged);
    result.index.push_back(s);
  }
  return result;
}

double angleBetween(const Plane& a, const Plane& b) {
  // The sine keeps small angles exact.
  return std::atan2(a.normal.cross(b.normal).norm(), std::fabs(a.normal.dot(b.normal)));
}

}  // namespace

void CoplanarParams::validate() const {
  requirePositive("max_distance", max_distance, "m");
  if (!(max_angle > 0.0 && max_angle <= M_PI_2)) {
    throw ParameterError("max_angle", max_angle, "(0, pi/2]", "rad");
  }
}

std::vector<std::size_t> PlaneTruth::sizes() const {
  std::vector<std::size_t> result(planes.size(), 0);
  for (const int label : labels) {
    if (label >= 0) ++result[static_cast<std::size_t>(label)];
  }
  return result;
}

PlaneTruth truthOf(const PointsView& points, const std::vector<int>& labels,
                   const std::vector<Plane>& planes, int min_points) {
  requireInRange("min_points", min_points, 3, 2147483647, "points");
  requireSameSize(points, labels);
  PlaneTruth all{labels, planes};
  requireKnownLabels(all);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (!points.isMeasured(i)) all.labels[i] = kNotJudged;
  }
  const std::vector<std::size_t> sizes = all.sizes();
  std::vector<int> number(planes.size(), kNotJudged);
  PlaneTruth truth;
  for (std::size_t t = 0; t < planes.size(); ++t) {
    if (sizes[t] < static_cast<std::size_t>(min_points)) continue;
    number[t] = static_cast<int>(truth.planes.size());
    truth.planes.push_back(planes[t]);
  }
  truth.labels = std::move(all.labels);
  for (int& label : truth.labels) {
    if (label >= 0) label = number[static_cast<std::size_t>(label)];
  }
  return truth;
}

PlaneTruth truthOfLabels(const PointsView& points, const std::vector<int>& labels, int min_points) {
  requireInRange("min_points", min_points, 3, 2147483647, "points");
  requireSameSize(points, labels);
  std::map<int, RayFit> fits;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] < kNotJudged) throw InputError("label " + std::to_string(labels[i]));
    if (labels[i] >= 0 && points.isMeasured(i)) fits[labels[i]].add(points.point(i));
  }
  std::map<int, int> number;
  std::vector<Plane> planes;
  for (const auto& [label, sums] : fits) {
    Plane plane;
    if (!sums.fit(plane)) continue;
    number[label] = static_cast<int>(planes.size());
    planes.push_back(plane);
  }
  std::vector<int> indices(labels.size(), kNotJudged);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto known = number.find(labels[i]);
    if (labels[i] == kOnNoPlane) indices[i] = kOnNoPlane;
    if (known != number.end()) indices[i] = known->second;
  }
  return truthOf(points, indices, planes, min_points);
}

PlaneTruth joinCoplanar(const PointsView& points, const PlaneTruth& truth,
                        const CoplanarParams& params) {
  params.validate();
  requireSameSize(points, truth.labels);
  requireKnownLabels(truth);
  std::vector<PlaneMoments> moments(truth.planes.size());
  for (std::size_t i = 0; i < truth.labels.size(); ++i) {
    if (truth.labels[i] < 0 || !points.isMeasured(i)) continue;
    moments[static_cast<std::size_t>(truth.labels[i])].add(points.point(i));
  }
  const std::vector<std::size_t> target = coplanarTargets(moments, params);
  std::vector<int> number(target.size(), -1);
  PlaneTruth joined;
  for (std::size_t i = 0; i < target.size(); ++i) {
    if (target[i] != i) continue;
    number[i] = static_cast<int>(joined.planes.size());
    joined.planes.push_back(truth.planes[i]);
  }
  joined.labels = truth.labels;
  for (int& label : joined.labels) {
    if (label >= 0) label = number[target[static_cast<std::size_t>(label)]];
  }
  return joined;
}

std::vector<PlaneSegment> joinCoplanar(const PointsView& points,
                                       const std::vector<PlaneSegment>& segments,
                                       const CoplanarParams& params) {
  params.validate();
  std::vector<PlaneMoments> moments(segments.size());
  for (std::size_t s = 0; s < segments.size(); ++s) {
    for (const int inlier : segments[s].inliers) {
      const std::size_t i = checkedInlier(inlier, points.size);
      if (points.isMeasured(i)) moments[s].add(points.point(i));
    }
  }
  const std::vector<std::size_t> target = coplanarTargets(moments, params);
  std::vector<PlaneSegment> joined;
  std::vector<std::size_t> number(target.size(), 0);
  for (std::size_t s = 0; s < target.size(); ++s) {
    if (target[s] != s) continue;
    number[s] = joined.size();
    joined.emplace_back();
    joined.back().plane = segments[s].plane;
  }
  for (std::size_t s = 0; s < target.size(); ++s) {
    Indices& inliers = joined[number[target[s]]].inliers;
    inliers.insert(inliers.end(), segments[s].inliers.begin(), segments[s].inliers.end());
  }
  for (PlaneSegment& segment : joined) std::sort(segment.inliers.begin(), segment.inliers.end());
  return joined;
}

double PlaneQuality::recall() const {
  return true_planes > 0 ? static_cast<double>(correct) / true_planes : 1.0;
}

double PlaneQuality::precision() const {
  return segments > 0 ? static_cast<double>(correct) / segments : 1.0;
}

double PlaneQuality::pointRecall() const {
  return points_on_planes > 0
             ? static_cast<double>(points_found) / static_cast<double>(points_on_planes)
             : 1.0;
}

double PlaneQuality::meanAngle() const {
  if (angles.empty()) return 0.0;
  return std::accumulate(angles.begin(), angles.end(), 0.0) / static_cast<double>(angles.size());
}

void PlaneQuality::add(const PlaneQuality& other) {
  true_planes += other.true_planes;
  segments += other.segments;
  correct += other.correct;
  over += other.over;
  under += other.under;
  missed += other.missed;
  noise += other.noise;
  angles.insert(angles.end(), other.angles.begin(), other.angles.end());
  points_on_planes += other.points_on_planes;
  points_found += other.points_found;
}

PlaneQuality judgePlanes(const PlaneTruth& truth, const std::vector<PlaneSegment>& segments,
                         double overlap) {
  if (!(overlap > 0.5 && overlap <= 1.0)) throw ParameterError("overlap", overlap, "(0.5, 1]");
  requireKnownLabels(truth);
  const Overlaps overlaps = overlapsOf(truth, segments);
  const std::size_t planes = truth.planes.size();
  const std::size_t found = overlaps.shared.size();
  PlaneQuality quality;
  quality.segments = static_cast<int>(found);
  const auto in_segment = [&](std::size_t s, std::size_t t) {
    return overlaps.shared[s][t] > 0.0 &&
           overlaps.shared[s][t] >= overlap * overlaps.segment_sizes[s];
  };
  const auto in_plane = [&](std::size_t s, std::size_t t) {
    return overlaps.shared[s][t] > 0.0 &&
           overlaps.shared[s][t] >= overlap * overlaps.plane_sizes[t];
  };
  std::vector<char> plane_done(planes, 0);
  std::vector<char> segment_done(found, 0);
  for (std::size_t t = 0; t < planes; ++t) {
    if (overlaps.plane_sizes[t] == 0.0) {
      plane_done[t] = 1;
      continue;
    }
    ++quality.true_planes;
    double most = 0.0;
    for (std::size_t s = 0; s < found; ++s) {
      most = std::max(most, overlaps.shared[s][t]);
      if (!in_segment(s, t) || !in_plane(s, t)) continue;
      ++quality.correct;
      plane_done[t] = segment_done[s] = 1;
      quality.angles.push_back(angleBetween(truth.planes[t], segments[overlaps.index[s]].plane));
    }
    quality.points_on_planes += static_cast<std::size_t>(overlaps.plane_sizes[t]);
    quality.points_found += static_cast<std::size_t>(most);
  }
  for (std::size_t t = 0; t < planes; ++t) {
    if (plane_done[t]) continue;
    std::vector<std::size_t> parts;
    double together = 0.0;
    for (std::size_t s = 0; s < found; ++s) {
      if (segment_done[s] || !in_segment(s, t)) continue;
      parts.push_back(s);
      together += overlaps.shared[s][t];
    }
    if (parts.size() < 2 || together < overlap * overlaps.plane_sizes[t]) continue;
    ++quality.over;
    plane_done[t] = 1;
    for (const std::size_t s : parts) segment_done[s] = 1;
  }
  for (std::size_t s = 0; s < found; ++s) {
    if (segment_done[s]) continue;
    std::vector<std::size_t> parts;
    double together = 0.0;
    for (std::size_t t = 0; t < planes; ++t) {
      if (plane_done[t] || !in_plane(s, t)) continue;
      parts.push_back(t);
      together += overlaps.shared[s][t];
    }
    if (parts.size() < 2 || together < overlap * overlaps.segment_sizes[s]) continue;
    ++quality.under;
    segment_done[s] = 1;
    for (const std::size_t t : parts) plane_done[t] = 1;
  }
  quality.missed = static_cast<int>(std::count(plane_done.begin(), plane_done.end(), 0));
  quality.noise = static_cast<int>(std::count(segment_done.begin(), segment_done.end(), 0));
  return quality;
}

}  // namespace planar_mapping::evaluation
