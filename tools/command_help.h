// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "commands.h"
#include "planar_mapping/core/base/types.h"

// What several commands do alike.
namespace planar_mapping::tools {

inline nlohmann::ordered_json toJson(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

/// \throws UsageError if there is a file and it must not be overwritten
inline void requireNew(const std::string& path, bool force) {
  std::error_code ignored;
  if (!force && std::filesystem::exists(path, ignored)) {
    throw UsageError("'" + path + "' exists; --force overwrites it");
  }
}

}  // namespace planar_mapping::tools
