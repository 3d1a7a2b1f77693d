// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "distance_band.h"
#include "planar_mapping/core/random.h"
#include "plane_search.h"

namespace planar_mapping::detail {

PlaneSet findPlanesMultiRansac(const PointsView& points, const Indices* indices,
                               const MultiPlaneParams& params, const Vector3& sensor) {
  const DistanceBand band(params);
  Indices rest;
  std::size_t not_finite = 0;
  const std::size_t considered = indices != nullptr ? indices->size() : points.size;
  for (std::size_t k = 0; k < considered; ++k) {
    const int i = indices != nullptr ? (*indices)[k] : static_cast<int>(k);
    if (points.isFinite(static_cast<std::size_t>(i))) {
      rest.push_back(i);
    } else {
      ++not_finite;
    }
  }
  std::vector<std::int32_t> labels(points.size, -1);
  std::vector<Plane> planes;
  Random random(params.seed);
  const std::size_t least = static_cast<std::size_t>(params.min_inliers);
  while (rest.size() >= least) {
    Plane best;
    std::size_t best_score = 0;
    const std::size_t step = 1 + rest.size() / 2048;
    for (int hypothesis = 0; hypothesis < 1000; ++hypothesis) {
      Plane plane;
      const auto draw = [&] {
        return points.point(
            static_cast<std::size_t>(rest[random.below(static_cast<std::uint32_t>(rest.size()))]));
      };
      const Vector3 p = draw(), q = draw(), r = draw();
      if (!planeFromPoints(p, q, r, plane)) continue;
      std::size_t score = 0;
      for (std::size_t i = 0; i < rest.size(); i += step) {
        const Vector3 x = points.point(static_cast<std::size_t>(rest[i]));
        if (std::abs(plane.signedDistance(x)) <= band.at(x.z())) score += step;
      }
      if (score > best_score) {
        best_score = score;
        best = plane;
      }
    }
    Indices others;
    std::size_t inliers = 0;
    for (const int i : rest) {
      const Vector3 x = points.point(static_cast<std::size_t>(i));
      if (std::abs(best.signedDistance(x)) <= band.at(x.z())) {
        labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(planes.size());
        ++inliers;
      } else {
        others.push_back(i);
      }
    }
    if (best_score == 0 || inliers < least || inliers < considered / 50) {
      for (std::int32_t& label : labels) {
        if (label == static_cast<std::int32_t>(planes.size())) label = -1;
      }
      break;
    }
    planes.push_back(best);
    rest.swap(others);
  }
  PlaneSet set =
      assemblePlaneSet(points, labels, planes, params, sensor, InlierRule::WithinThreshold);
  set.diagnostics.points_not_finite = not_finite;
  return set;
}

}  // namespace planar_mapping::detail
