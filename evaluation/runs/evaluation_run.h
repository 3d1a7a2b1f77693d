// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "evaluation/metrics/evaluation_report.h"
#include "evaluation/runs/place_source.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::tools {

/// A configuration of the planar map under a name, for any cell size.
struct PlanarMethod {
  std::string name;
  std::function<Configuration(double cell)> load;
};

/// What to measure at each place.
struct MethodOptions {
  std::vector<double> cells;  ///< s, metres
  std::vector<PlanarMethod> planar;
  /// Also SG, OG and RA of the cells that the map of this name occupies, an exact cover with boxes
  /// alone: the filters of the planar map for all methods. Empty = without.
  std::string filtered_by;
};

/// Makes a map of the place with each method at each cell size, and evaluates all maps alike.
/// Without a single occupied cell there is nothing to evaluate, and no result. \param done  called
/// after each map; returns false to stop, then what was done so far comes back
std::vector<evaluation::PlaceResult> evaluateMethods(const Place& place,
                                                     const MethodOptions& options,
                                                     const std::function<bool()>& done);

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

class StopWatch {
 public:
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// A map made of a place, and what it took.
struct PlanarRun {
  PlanarMap map;
  /// Planes, beliefs, insertion of all frames, counts of cuboids on the way, and their list.
  double time_ms = 0.0;
};

/// Points that make a cell, as the map stage of the configuration says.
int minPointsPerCell(const Configuration& configuration);

/// Makes maps of one place with many configurations, each as a run of its own makes it. Planes are
/// found once for all configurations whose stages for them are alike.
class PlanarRuns {
 public:
  /// \p place must outlive this object.
  explicit PlanarRuns(const Place& place) : place_(place) {}
  PlanarRun make(Configuration configuration);

 private:
  struct Planes {
    std::vector<Frame> frames;  ///< as the stages for planes left them
    double time_ms = 0.0;
  };

  const Place& place_;
  std::map<std::string, Planes> planes_;  ///< by the text of the stages that found them
};

/// A planar map under a name: a profile and assignments on top of the configuration.
struct Variant {
  std::string name;
  std::vector<std::string> assignments;  ///< stage.key=value
  std::string profile = "compact";
};

/// The compact profile without one idea each: what is its fraction?
std::vector<Variant> ablationVariants();

/// Exact and tolerant covers, with planes and without, with the filters of the planar map and
/// without (METHOD: IV-B). `boxes` is without planes, `raw` without filters.
std::vector<Variant> regimeVariants();
/// The one of them whose boxes cover exactly the cells that pass the filters.
constexpr const char* kFilteredCells = "boxes_exact";

/// The results of all other methods.
std::vector<evaluation::PlaceResult> withoutMethods(
    const std::vector<evaluation::PlaceResult>& results, const std::vector<std::string>& methods);

}  // namespace planar_mapping::tools
