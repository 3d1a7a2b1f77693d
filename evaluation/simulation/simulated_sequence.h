// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "evaluation/simulation/simulation.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/io/layouts/sequence.h"

namespace planar_mapping::evaluation {

/// Writes a sequence folder without frames: calib.yaml, poses.txt, and simulation.json, from which
/// whoever reads the sequence makes its RGB-D frames (openSimulation()): measured points, and the
/// left image. \throws IoError as writeSequence()
PLANAR_MAPPING_EXPORT void writeDescription(const Simulation& simulation,
                                            const std::string& directory, bool overwrite);

/// For io::setFrameMaker(). \throws IoError for a file that is no such description
PLANAR_MAPPING_EXPORT std::unique_ptr<const io::FrameMaker> openSimulation(const std::string& path);

}  // namespace planar_mapping::evaluation
