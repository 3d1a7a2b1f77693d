// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A stage in a shared library; own_stage.yaml names it under `plugins`.
#include "planar_mapping/pipeline/plugin.h"
#include "range_limit.h"

PLANAR_MAPPING_STAGES(table) {
  table.add<RangeLimit>();
}
