// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/core/base/export.h"

namespace planar_mapping::detail {

/// "; did you mean 'x'?" for the nearest of \p candidates, or "" if none is near.
PLANAR_MAPPING_EXPORT std::string didYouMean(const std::string& word,
                                             const std::vector<std::string>& candidates);

}  // namespace planar_mapping::detail
