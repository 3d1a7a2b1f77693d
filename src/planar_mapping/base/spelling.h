// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"

namespace planar_mapping::detail {

/// "; did you mean 'x'?" for the nearest of \p candidates, or "" if none is near.
PLANAR_MAPPING_EXPORT std::string didYouMean(const std::string& word,
                                             const std::vector<std::string>& candidates);

/// "1 plane", "2 planes".
inline std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// A field of a CSV file, in quotes where it needs them.
PLANAR_MAPPING_EXPORT std::string quotedForCsv(const std::string& field);

}  // namespace planar_mapping::detail
