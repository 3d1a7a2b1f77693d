// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/pipeline/stage_table.h"

// The parameter tables of stages as text for people.
namespace planar_mapping::tools {

/// Name, summary and one block per parameter.
std::string describeStage(const StageEntry& entry);
/// The line(s) of one parameter: name, default, allowed, meaning.
std::string describeParameter(const StageEntry& entry, const std::string& parameter);
/// A whole configuration with every stage, each key with its comment.
std::string defaultsYaml(const StageTable& table, Profile profile);
/// docs/parameters.md.
std::string referencePage(const StageTable& table);

}  // namespace planar_mapping::tools
