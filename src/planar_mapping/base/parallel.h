// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

#include "planar_mapping/base/export.h"

namespace planar_mapping {

/// Calls body(chunk) for chunk = 0 .. chunks - 1 on up to \p threads threads (0 = all cores, 1 =
/// the calling thread only), which are kept for later calls. Results combined in chunk order are
/// the same for any thread count if the chunks do not depend on it. An exception of a chunk is
/// rethrown in the caller, that of the lowest chunk first. Any thread may call it, also after
/// fork(); a call from inside a chunk runs in the thread of that chunk alone.
PLANAR_MAPPING_EXPORT void parallelFor(std::size_t chunks, int threads,
                                       const std::function<void(std::size_t)>& body);

/// 0 -> number of cores, else the number itself.
PLANAR_MAPPING_EXPORT int resolveThreads(int threads);

}  // namespace planar_mapping
