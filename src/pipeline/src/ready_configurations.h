// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace planar_mapping {
namespace detail {

/// For a message: "; ready: a.yaml, b.yaml", empty if there are none.
std::string listReadyConfigurations();

}  // namespace detail
}  // namespace planar_mapping
