// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "method_runs.h"

namespace planar_mapping::tools {

/// How far an evaluation is.
struct EvaluationProgress {
  std::size_t done = 0;  ///< maps made and evaluated
  std::size_t all = 0;
  std::string scene;
  std::size_t place = 0;
};

struct EvaluationJob {
  MethodOptions methods;
  int threads = 1;
  const std::atomic<bool>* stop = nullptr;
  /// Called after each map, from one thread at a time.
  std::function<void(const EvaluationProgress&)> progress;
};

/// All places of a source, evaluated with all methods; the result does not depend on the threads
/// but for times. Places where there is nothing to be mapped have no results. Stopped, it returns
/// the maps evaluated so far. \throws InputError if there is nothing to be mapped at any place
std::vector<evaluation::PlaceResult> evaluatePlaces(PlaceSource& source, const std::string& scene,
                                                    const EvaluationJob& job);

}  // namespace planar_mapping::tools
