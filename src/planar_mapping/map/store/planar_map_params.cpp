// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/planar_map_params.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/number_text.h"
#include "planar_mapping/map/store/unknown_space.h"

namespace planar_mapping {
namespace {

/// Coordinates are floats: far from 0 they are coarser than what is to be mapped.
void requirePrecision(const CloudScale& scale, double resolution) {
  constexpr double kSteps = 8.0;  // of a coordinate in a cell, at least
  const double step = scale.max_range * std::numeric_limits<float>::epsilon();
  if (kSteps * step <= resolution) return;
  using detail::numberText;
  throw InputError("coordinates reach " + numberText(scale.max_range) +
                   " m, where a float knows steps of " + numberText(step) +
                   " m, too coarse for cells of " + numberText(resolution) +
                   " m; take a larger resolution (resolution_m), or, where the file has floats, "
                   "save x, y, z as doubles (PCD: SIZE 8, PLY: double) before they are rounded");
}

}  // namespace

PlanarMapParams PlanarMapParams::of(Profile profile) {
  PlanarMapParams params;
  params.approximation.profile = profile;
  if (profile == Profile::Compact) return params;
  params.unseen = Unseen::Free;
  // The features' beliefs as they are; looking through a cell changes nothing.
  params.belief_gain = 1.0;
  params.miss_factor = 1.0;
  params.first_belief = 1.0;
  params.min_cell_fraction = 0.0;
  params.surface_factor = 0.0;
  return params;
}

void PlanarMapParams::setResolution(double metres) {
  constexpr double kCellsOfGap = 5.0;
  approximation.resolution = metres;
  association_offset = metres;
  association_gap = kCellsOfGap * metres;
}

PlanarMapParams PlanarMapParams::resolvedFor(const CloudScale& scale) const {
  constexpr double kFarthest = 1e6;  // metres
  const double resolution = approximation.resolution;
  const double cell = unknown_resolution > 0.0 ? unknown_resolution : resolution;
  const auto withinLimit = [cell](double range) {
    return std::clamp(range, cell, detail::kMaxRangeCells * cell);
  };
  requirePrecision(scale, resolution);
  const double farthest = scale.points > 0 ? scale.max_range : kFarthest;
  const double mapped = withinLimit(scale.depth_limit.value_or(farthest));
  PlanarMapParams resolved = *this;
  if (!(miss_range > 0.0)) resolved.miss_range = max_range > 0.0 ? max_range : mapped;
  // Free space ends where measurements do. What is hidden beyond what is mapped would be borders,
  // as noisy as the depths, of nothing in the map.
  if (max_range > 0.0) {
    resolved.max_range = std::min(max_range, withinLimit(kFarthest));
  } else {
    resolved.max_range =
        unseen == Unseen::Free ? mapped : withinLimit(detail::kMaxRangeCells * resolution);
  }
  resolved.approximation.up.normalize();
  resolved.unknown_space = unknown_space && scale.has_sensor;
  return resolved;
}

Vector3 originNear(const Vector3& place) {
  constexpr double kFar = 10000.0;  // metres
  constexpr double kStep = 1000.0;  // metres
  return (place.array().abs() > kFar).select(kStep * (place / kStep).array().round(), 0.0);
}

void PlanarMapParams::validate() const {
  approximation.validate();
  for (const double value : origin) requireInRange("origin", value, -1e9, 1e9, "m");
  requireInRange("association_angle", association_angle, 0.0, 0.5 * M_PI, "rad");
  requireInRange("association_offset", association_offset, 0.0, 1e6, "m");
  requireInRange("association_gap", association_gap, 0.0, 1e6, "m");
  requireInRange("unknown_resolution", unknown_resolution, 0.0, 1e6, "m");
  requireInRange("max_range", max_range, 0.0, 1e6, "m");
  requireInRange("miss_range", miss_range, 0.0, 1e6, "m");
  requireInRange("min_probability", min_probability, 0.0, 1.0);
  requirePositive("belief_gain", belief_gain);
  requireInRange("belief_gain", belief_gain, 0.0, 1.0);
  requireInRange("miss_factor", miss_factor, 0.0, 1.0);
  requireInRange("noise_factor", noise_factor, 0.0, 10.0);
  requireInRange("min_cell_fraction", min_cell_fraction, 0.0, 1.0);
  requireInRange("rim_pixels", rim_pixels, 0.0, 1e6, "px");
  requireInRange("surface_factor", surface_factor, 0.0, 10.0);
  requirePositive("first_belief", first_belief);
  requireInRange("first_belief", first_belief, 0.0, 1.0);
  requireInRange("refit_tolerance", refit_tolerance, 0.0, 1e6, "resolutions");
  requireInRange("range_image_step", range_image_step, 1e-3, 0.5, "rad");
  if (unknown_space) {
    // Beyond that one frame would ask for gigabytes of unknown space.
    const double cell = unknown_resolution > 0.0 ? unknown_resolution : approximation.resolution;
    requireInRange("max_range", max_range, 0.0, detail::kMaxRangeCells * cell, "m");
  }
}

}  // namespace planar_mapping
