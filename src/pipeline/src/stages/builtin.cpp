// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "builtin.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace planar_mapping {

void registerBuiltinStages(StageTable& table) {
#ifdef PLANAR_MAPPING_HAS_STEREO
  detail::addStereoMatching(table);
  detail::addKeyFeatures(table);
#else
  table.addMissing("stereo_matching", "PLANAR_MAPPING_BUILD_STEREO");
  table.addMissing("key_features", "PLANAR_MAPPING_BUILD_STEREO");
#endif
  detail::addMotionEstimation(table);
  detail::addPclFilters(table);
  detail::addDepthErrorLimit(table);
  detail::addGroundRemoval(table);
  detail::addMultiPlaneSegmentation(table);
  detail::addKlOccupancy(table);
  detail::addPlanarCuboidApproximation(table);
}

namespace detail {

double automaticResolution(const CloudScale& scale) {
  constexpr double kExtentShare = 0.01;
  constexpr double kSpacings = 4.0;
  constexpr double kSinglePoint = 0.1;  // without any extent there is nothing to go by
  const double wanted = std::max(kExtentShare * scale.extent, kSpacings * scale.spacing);
  if (!(wanted > 0.0)) return kSinglePoint;
  const int exponent = static_cast<int>(std::floor(std::log10(wanted)));
  double best = 0.0;
  for (const char* digits : {"1e", "2e", "5e", "10e"}) {
    // From text, so that 0.02 is the very 0.02 that a person would write.
    const double candidate = std::stod(digits + std::to_string(exponent));
    const bool nearer = std::abs(std::log(wanted / candidate)) < std::abs(std::log(wanted / best));
    if (best == 0.0 || nearer) best = candidate;
  }
  return best;
}

}  // namespace detail
}  // namespace planar_mapping
