// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/evaluation/simulation.h"

namespace planar_mapping {
namespace evaluation {

std::string sceneJson(const SimulationParams& params, const Scene& scene,
                      const ScenePlanes& planes);

}  // namespace evaluation
}  // namespace planar_mapping
