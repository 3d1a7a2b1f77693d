// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/stages/builtin.h"

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
  detail::addPointFilters(table);
  detail::addGroundRemoval(table);
  detail::addMultiPlaneSegmentation(table);
  detail::addKlOccupancy(table);
  detail::addPlanarCuboidApproximation(table);
}

}  // namespace planar_mapping
