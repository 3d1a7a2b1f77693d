// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/pipeline/frame_source.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "run_statistics.h"

namespace planar_mapping::detail {

/// What a finished run has to say of its result, a sentence each, and what helps.
/// \pre a frame was used
std::vector<std::string> adviceOn(const Pipeline& pipeline, const RunStatistics& statistics,
                                  const FrameSource& source);

}  // namespace planar_mapping::detail
