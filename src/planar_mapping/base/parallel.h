// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

#include "planar_mapping/base/export.h"

namespace planar_mapping {

/// Calls body(chunk) for chunk = 0 .. chunks - 1 on up to \p threads threads (0 = all cores, 1 =
/// the calling thread only), fewer where the system refuses them. How work is cut into chunks must
/// not depend on the thread count, and results are combined in chunk order: then any thread count
/// gives the same bytes. An exception of a chunk is rethrown in the caller, the one of the lowest
/// chunk first.
PLANAR_MAPPING_EXPORT void parallelFor(std::size_t chunks, int threads,
                                       const std::function<void(std::size_t)>& body);

/// 0 -> number of cores, else the number itself.
PLANAR_MAPPING_EXPORT int resolveThreads(int threads);

}  // namespace planar_mapping
