// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace planar_mapping {

/// Version of the interface between the pipeline and stages in shared libraries. It is raised when
/// stage.h, frame.h, parameter.h or what they hold changes.
inline constexpr int kPluginInterface = 10;

/// Adds the stages of a shared library, which stays loaded to the end of the program.
/// \throws IoError if it is missing, no such library, made for another version, or brings a stage
///         whose name is taken; the table is then as it was
PLANAR_MAPPING_EXPORT void loadPlugin(const std::string& path, StageTable& table);

}  // namespace planar_mapping

/// Put once into the library, after your stages:
///
///     PLANAR_MAPPING_STAGES(table) { table.add<MyStage>(); }
#define PLANAR_MAPPING_STAGES(table)                                       \
  extern "C" PLANAR_MAPPING_EXPORT int planar_mapping_plugin_interface() { \
    return ::planar_mapping::kPluginInterface;                             \
  }                                                                        \
  static void planarMappingAddStages(::planar_mapping::StageTable& table); \
  extern "C" PLANAR_MAPPING_EXPORT void planar_mapping_plugin_stages(      \
      ::planar_mapping::StageTable* stages) {                              \
    planarMappingAddStages(*stages);                                       \
  }                                                                        \
  static void planarMappingAddStages(::planar_mapping::StageTable& table)
