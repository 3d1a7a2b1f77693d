// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace planar_mapping::test {

/// A file or folder of the real data: of the collection beside the sources where that is there,
/// else of the pieces that the repository ships. May be in neither.
inline std::string realData(const std::string& name) {
  const std::string collection = PLANAR_MAPPING_SOURCE_DIR "/../shared/data/" + name;
  if (std::filesystem::exists(collection)) return collection;
  return PLANAR_MAPPING_SOURCE_DIR "/examples/data/" + name;
}
inline bool isMissing(const std::string& name) {
  return !std::filesystem::exists(realData(name));
}

}  // namespace planar_mapping::test
