// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/base/export.h"

namespace planar_mapping::detail {

/// A number for a message, with six digits and a point in any locale.
PLANAR_MAPPING_EXPORT std::string numberText(double value);

}  // namespace planar_mapping::detail
