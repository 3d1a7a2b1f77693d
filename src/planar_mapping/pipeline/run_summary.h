// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/run_statistics.h"

namespace planar_mapping::detail {

/// What a person reads at the end of a run: what came out, how much of the measured points it
/// holds, and, if that is little, which stage lost the others and what to type.
std::string summaryOf(const Configuration& configuration, const nlohmann::ordered_json& metrics);

/// What is wrong with a finished result, a sentence each, with what to type.
/// \pre a frame was used
std::vector<std::string> warningsOn(const Pipeline& pipeline, const RunStatistics& statistics,
                                    const nlohmann::ordered_json& metrics);

/// What is odd about the first cloud: its unit, or where its sensor stood (Frame::warnings).
void remarkOnFirst(Frame& frame, const CloudScale& scale);

}  // namespace planar_mapping::detail
