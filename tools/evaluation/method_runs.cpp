// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "method_runs.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "heap_meter.h"
#include "planar_mapping/evaluation/octree_grid.h"
#include "planar_mapping/evaluation/rectangular_approximation.h"
#include "planar_mapping/evaluation/standard_grid.h"
#include "planar_runs.h"

namespace planar_mapping::tools {
namespace {

using evaluation::Figures;

class StopWatch {
 public:
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What all methods at one place and cell size are judged with.
class Judge {
 public:
  Judge(const Place& place, double s) : place_(place), s_(s), crossed_(s, 2.0 * s) {
    crossed_.add(place.rays);
    if (!place.truth) return;
    visible_ = place.truth->visibleCells(s);
    for (const evaluation::MeasuredRay& ray : place.rays) measured_.push_back(ray.end);
  }

  void setStandardCells(std::size_t cells) { standard_cells_ = cells; }

  Figures figures(const std::vector<Cuboid>& cuboids) const {
    Figures f;
    f.cells = static_cast<double>(cuboids.size());
    const auto planar = std::count_if(cuboids.begin(), cuboids.end(),
                                      [](const Cuboid& c) { return c.plane_id >= 0; });
    f.planar_cells = static_cast<double>(planar);
    f.non_planar_cells = *f.cells - *f.planar_cells;
    f.standard_cells = static_cast<double>(standard_cells_);
    f.combination_efficiency = evaluation::combinationEfficiency(cuboids.size(), standard_cells_);
    const evaluation::CuboidDistance index(cuboids);
    if (place_.truth) {
      f.error_percent =
          evaluation::mappingError(cuboids, index, *place_.truth, s_, standard_cells_).percent;
      f.completeness = evaluation::completeness(index, visible_, s_);
    }
    const evaluation::HeldBackDistance held_back =
        evaluation::heldBackDistance(index, place_.checked, 0.5 * s_);
    f.coverage = held_back.share_within;
    f.measured_coverage =
        place_.truth ? evaluation::coverage(index, measured_, 0.5 * s_) : held_back.share_within;
    if (std::isfinite(held_back.median)) f.held_back_median_m = held_back.median;
    if (std::isfinite(held_back.percentile_95)) f.held_back_p95_m = held_back.percentile_95;
    f.free_space_violation = evaluation::freeSpaceViolation(index, crossed_).share;
    return f;
  }

 private:
  const Place& place_;
  double s_;
  evaluation::CrossedSpace crossed_;
  // Where there is truth:
  std::vector<evaluation::VisibleCell> visible_;
  std::vector<Vector3> measured_;  ///< points to look for, with their noise
  std::size_t standard_cells_ = 0;
};

/// The methods at one cell size, one after the other.
class CellRun {
 public:
  CellRun(const Place& place, const MethodOptions& options, double s, PlanarRuns& planar)
      : place_(place), options_(options), s_(s), planar_(planar), judge_(place, s) {}

  /// \return false if it was stopped
  bool execute(const std::function<bool()>& done, std::vector<MethodMap>* maps);
  std::vector<evaluation::PlaceResult> takeResults() { return std::move(results_); }

 private:
  /// \return false if there is not a cell
  bool standardGrid();
  void octreeGrid();
  void rectangularApproximation();
  void planarMap(const PlanarMethod& method);
  void add(const std::string& method, Figures figures, std::vector<Cuboid> cuboids);
  double perFrame(double ms) const { return ms / static_cast<double>(place_.frames.size()); }

  const Place& place_;
  const MethodOptions& options_;
  double s_;
  PlanarRuns& planar_;
  Judge judge_;
  int min_points_ = 1;
  std::vector<MethodMap>* maps_ = nullptr;
  std::vector<evaluation::PlaceResult> results_;
};

bool CellRun::execute(const std::function<bool()>& done, std::vector<MethodMap>* maps) {
  maps_ = maps;
  if (!options_.planar.empty()) {
    min_points_ = minPointsPerCell(options_.planar.back().load(s_));
  }
  if (!standardGrid()) return true;
  if (!done()) return false;
  if (options_.baselines) {
    octreeGrid();
    if (!done()) return false;
    rectangularApproximation();
    if (!done()) return false;
  }
  for (const PlanarMethod& method : options_.planar) {
    planarMap(method);
    if (!done()) return false;
  }
  return true;
}

void CellRun::add(const std::string& method, Figures figures, std::vector<Cuboid> cuboids) {
  evaluation::PlaceResult result;
  result.place = place_.number;
  result.simulated = place_.truth != nullptr;
  result.cell = s_;
  result.method = method;
  result.figures = std::move(figures);
  results_.push_back(std::move(result));
  if (maps_ != nullptr) maps_->push_back({method, std::move(cuboids)});
}

bool CellRun::standardGrid() {
  const StopWatch watch;
  evaluation::StandardGrid grid(s_, min_points_);
  for (const PreparedFrame& frame : place_.frames) grid.insert(frame.obstacles);
  std::vector<Cuboid> cuboids = grid.cuboids();
  const double ms = watch.milliseconds();
  if (grid.size() == 0) return false;
  judge_.setStandardCells(grid.size());
  Figures figures = judge_.figures(cuboids);
  figures.memory_bytes = static_cast<double>(grid.memoryBytes());
  if (options_.measure_heap) figures.heap_bytes = heapBytesOfCopy(grid);
  figures.file_bytes = static_cast<double>(grid.fileBytes());
  figures.time_ms_per_frame = perFrame(ms);
  add("SG", std::move(figures), std::move(cuboids));
  return true;
}

void CellRun::octreeGrid() {
  if (!evaluation::OctreeGrid::isAvailable()) return;
  const StopWatch watch;
  evaluation::OctreeGridParams params;
  params.resolution = s_;
  params.min_points = min_points_;
  evaluation::OctreeGrid grid(params);
  for (const PreparedFrame& frame : place_.frames) {
    grid.insert(frame.obstacles, frame.ground, frame.frame.T_world_sensor.translation());
  }
  const auto ot_bytes = static_cast<double>(grid.otBytes());  // finish() takes the beliefs
  grid.finish();
  std::vector<Cuboid> cuboids = grid.cuboids();
  const double ms = watch.milliseconds();
  Figures figures = judge_.figures(cuboids);
  figures.memory_bytes = static_cast<double>(grid.heapBytes());
  figures.heap_bytes = figures.memory_bytes;
  figures.reported_memory_bytes = static_cast<double>(grid.reportedBytes());
  figures.file_bytes = static_cast<double>(grid.fileBytes());
  figures.ot_bytes = ot_bytes;
  figures.time_ms_per_frame = perFrame(ms);
  add("OG", std::move(figures), std::move(cuboids));
}

void CellRun::rectangularApproximation() {
  const StopWatch watch;
  evaluation::RectangularApproximation boxes(s_, min_points_);
  for (const PreparedFrame& frame : place_.frames) {
    boxes.insert(frame.obstacles, frame.ground, frame.frame.T_world_sensor.translation());
  }
  boxes.finish();
  std::vector<Cuboid> cuboids = boxes.cuboids();
  const double ms = watch.milliseconds();
  Figures figures = judge_.figures(cuboids);
  figures.memory_bytes = static_cast<double>(boxes.memoryBytes());
  figures.file_bytes = static_cast<double>(boxes.fileBytes());
  figures.time_ms_per_frame = perFrame(ms);
  figures.fused_cells = static_cast<double>(boxes.fusedCount());
  figures.greedy_cells = static_cast<double>(boxes.coverCount());
  add("RA", std::move(figures), std::move(cuboids));
}

void CellRun::planarMap(const PlanarMethod& method) {
  PlanarRun run = planar_.make(method.load(s_));
  Figures figures = judge_.figures(run.map.cuboids());
  figures.memory_bytes = static_cast<double>(run.map.memoryBytes());
  if (options_.measure_heap) figures.heap_bytes = heapBytesOfCopy(run.map);
  figures.file_bytes = static_cast<double>(run.map.serialize().size());
  const PlanarMap finished = run.map.finished();
  figures.finished_bytes = static_cast<double>(finished.serialize().size());
  figures.finished_memory_bytes = static_cast<double>(finished.memoryBytes());
  figures.time_ms_per_frame = perFrame(run.time_ms);
  add(method.name, std::move(figures), run.map.cuboids());
}

}  // namespace

std::vector<evaluation::PlaceResult> judgeMethods(const Place& place, const MethodOptions& options,
                                                  const std::function<bool()>& done,
                                                  std::vector<MethodMap>* maps, double maps_cell) {
  PlanarRuns planar(place);
  std::vector<evaluation::PlaceResult> results;
  for (const double s : options.cells) {
    CellRun run(place, options, s, planar);
    const bool complete = run.execute(done, s == maps_cell ? maps : nullptr);
    for (evaluation::PlaceResult& result : run.takeResults()) results.push_back(std::move(result));
    if (!complete) break;
  }
  return results;
}

}  // namespace planar_mapping::tools
