// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/ground_removal.h"

namespace planar_mapping {

PLANAR_MAPPING_FOR_POINT_TYPES(template class, GroundRemoval)

}  // namespace planar_mapping
