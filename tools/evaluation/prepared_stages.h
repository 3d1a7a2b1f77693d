// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/pipeline/configuration.h"

namespace planar_mapping::tools {

/// The stages that prepare a frame for any method: those before the first that finds planes,
/// judges points or makes a map. The others are taken out.
void keepPreparingStages(Configuration& configuration);
/// The others alone.
void keepMappingStages(Configuration& configuration);
/// Stages that need images or find poses; simulated clouds come with poses.
void dropSensingStages(Configuration& configuration);

}  // namespace planar_mapping::tools
