// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace planar_mapping::tools {

/// What figures depend on beside the input: versions of ours, the compiler and the libraries, and
/// the machine.
std::vector<std::pair<std::string, std::string>> machineFacts();

}  // namespace planar_mapping::tools
