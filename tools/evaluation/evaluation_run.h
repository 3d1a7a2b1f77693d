// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "method_runs.h"

namespace planar_mapping::tools {

/// How far an evaluation is.
struct EvaluationProgress {
  std::size_t done = 0;  ///< maps made and judged
  std::size_t all = 0;
  std::string scene;
  std::size_t place = 0;
};

/// What the map of one place looks like, for the picture of wrong cells.
struct PlaceMaps {
  std::size_t place = 0;
  double cell = 0.0;  ///< 0 = none wanted
  std::vector<MethodMap> maps;
  std::shared_ptr<const evaluation::SurfaceTruth> truth;
  std::vector<Pose> poses;  ///< T_world_sensor of the place's frames
};

struct EvaluationJob {
  MethodOptions methods;
  int threads = 1;
  const std::atomic<bool>* stop = nullptr;
  /// Called after each map, from one thread at a time.
  std::function<void(const EvaluationProgress&)> progress;
};

/// All places of a source, judged with all methods; the result does not depend on the threads but
/// for times. Places where there is nothing to be mapped have no results. Stopped, it returns the
/// maps judged so far.
/// \param maps  may be null
/// \throws InputError if there is nothing to be mapped at any place
std::vector<evaluation::PlaceResult> evaluatePlaces(PlaceSource& source, const std::string& scene,
                                                    const EvaluationJob& job, PlaceMaps* maps);

/// The maps of SG and of ours at one place, cut into what is right and what is wrong, as JSON for
/// the picture (the paper, Fig. 9). Cuboids with anything wrong about them are cut into parts of at
/// most a cell; a part is wrong if its centre is farther than a cell from the true surface.
/// \param maps  with truth
std::string artefactJson(const PlaceMaps& maps, const std::string& scene);

}  // namespace planar_mapping::tools
