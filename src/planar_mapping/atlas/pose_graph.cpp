// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/pose_graph.h"

namespace planar_mapping {

PoseGraphResult solvePoseGraph(AtlasData& data) {
  (void)data;
  return {};
}

}  // namespace planar_mapping
