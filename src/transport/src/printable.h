// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace planar_mapping::transport::detail {

/// A peer's text as one line of valid UTF-8: what would move the cursor, start a new line of a log
/// or break a JSON file becomes '?'.
std::string printable(const std::string& text);

}  // namespace planar_mapping::transport::detail
