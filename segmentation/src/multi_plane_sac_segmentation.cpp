// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

namespace planar_mapping {

PLANAR_MAPPING_FOR_POINT_TYPES(template class, MultiPlaneSACSegmentation)

}  // namespace planar_mapping
