// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/localization/registration/surface_map.h"
#include "planar_mapping/localization/registration/surface_shape.h"

namespace planar_mapping {

SurfaceMapParams SurfaceMapParams::ofScanner() {
  SurfaceMapParams params;
  params.depth_error = 0.02;
  params.depth_error_growth = 0.001;
  params.optical_axis.setZero();
  params.min_fraction = 0.3;
  return params;
}

void SurfaceMapParams::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  requirePositive("cell", cell, "m");
  requireInRange("depth_error", depth_error, 0.0, kLargest, "m");
  requireInRange("depth_error_growth", depth_error_growth, 0.0, kLargest, "1/m");
  requirePositive("depth_error + depth_error_growth", depth_error + depth_error_growth);
  if (!optical_axis.allFinite()) {
    throw ParameterError("optical_axis", optical_axis.sum(), "finite");
  }
  requirePositive("reach", reach, "m");
  requireInRange("min_fraction", min_fraction, 0.0, 1.0);
  requireInRange("max_seen_through", max_seen_through, 0.0, 1.0);
  requireInRange("search_reach", search_reach, 0.0, kLargest, "m");
  requireInRange("max_cells", max_cells, 1000, kLargest);
}

double surfaceCellFor(const PointsView& cloud, const SurfaceMapParams& params) {
  constexpr double kEnough = 0.55;
  constexpr int kDoublings = 4;
  params.validate();
  double times = 1.0;
  for (int doublings = 0; doublings < kDoublings; ++doublings) {
    detail::SurfaceCells cells(times * params.cell);
    detail::forSample(cloud, params, [&](const Vector3& p, double error) {
      cells.add(p, Vector3::Zero(), error, 0);
    });
    cells.fit();
    double all = 0.0, planar = 0.0;
    detail::forSample(cloud, params, [&](const Vector3& p, double) {
      // The points of a scanner all around are even in angle: near walls have most of them.
      const double weight = params.optical_axis.isZero() ? p.squaredNorm() : 1.0;
      all += weight;
      planar += cells.hasPlaneAt(p) ? weight : 0.0;
    });
    if (all > 0.0 && planar >= kEnough * all) break;
    times *= 2.0;
  }
  return times * params.cell;
}

SurfaceMapParams surfaceParamsFor(const PointsView& cloud, SurfaceMapParams params) {
  const double times = surfaceCellFor(cloud, params) / params.cell;
  params.cell *= times;
  params.reach *= times;
  return params;
}

}  // namespace planar_mapping
