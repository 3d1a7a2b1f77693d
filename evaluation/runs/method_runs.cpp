// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include "evaluation/baselines/octree_grid.h"
#include "evaluation/baselines/rectangular_approximation.h"
#include "evaluation/baselines/standard_grid.h"
#include "evaluation/runs/evaluation_run.h"

namespace planar_mapping::tools {
namespace {

using evaluation::Figures;

constexpr double kBoxDensity = 0.5;      ///< occupied cells of a box of RA_density
constexpr std::size_t kMaxRays = 20000;  ///< of a place, on which the surface is looked for

using DistanceToTruth = std::function<double(const Vector3&)>;

/// Where the true surface is not known as such, the nearest checked point stands for it.
DistanceToTruth distanceToTruth(const Place& place) {
  if (place.truth) {
    return [truth = place.truth](const Vector3& point) { return truth->distance(point); };
  }
  std::vector<Cuboid> points(place.checked.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].center = place.checked[i];
    points[i].size = Vector3::Zero();
  }
  const auto index = std::make_shared<CuboidDistance>(points);
  return [index](const Vector3& point) { return index->distance(point); };
}

/// The cells of a lattice that boxes along its axes cover.
std::vector<evaluation::GridCell> cellsIn(const std::vector<Cuboid>& boxes, double s) {
  std::vector<evaluation::GridCell> cells;
  for (const Cuboid& box : boxes) {
    Eigen::Vector3i low;
    Eigen::Vector3i high;
    for (int k = 0; k < 3; ++k) {
      low[k] = static_cast<int>(std::lround((box.center[k] - 0.5 * box.size[k]) / s));
      high[k] = static_cast<int>(std::lround((box.center[k] + 0.5 * box.size[k]) / s));
    }
    for (int z = low.z(); z < high.z(); ++z)
      for (int y = low.y(); y < high.y(); ++y)
        for (int x = low.x(); x < high.x(); ++x) cells.push_back({x, y, z});
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

/// What all methods at one place and cell size are evaluated with.
class MapEvaluator {
 public:
  MapEvaluator(const Place& place, double s, const DistanceToTruth& to_truth)
      : place_(place), s_(s), to_truth_(to_truth), crossed_(0.25 * s, 2.0 * s, 64) {
    crossed_.add(place.rays);
    if (!place.truth) return;
    visible_ = place.truth->visibleCells(s);
    for (const evaluation::MeasuredRay& ray : place.rays) measured_.push_back(ray.end);
  }

  void setStandardCells(std::size_t cells) { standard_cells_ = cells; }

  Figures figures(const std::vector<Cuboid>& cuboids) const {
    Figures f;
    f.cells = static_cast<double>(cuboids.size());
    f.standard_cells = static_cast<double>(standard_cells_);
    f.combination_efficiency = evaluation::combinationEfficiency(cuboids.size(), standard_cells_);
    const CuboidDistance index(cuboids);
    if (place_.truth) {
      const evaluation::MappingError error =
          evaluation::mappingError(cuboids, index, *place_.truth, s_, standard_cells_);
      f.error_percent = error.percent;
      f.wrong_fraction = error.wrongFraction();
      f.completeness = evaluation::completeness(index, visible_, s_);
      f.completeness_half = evaluation::completeness(index, visible_, 0.5 * s_);
      f.completeness_quarter = evaluation::completeness(index, visible_, 0.25 * s_);
    }
    const evaluation::HeldBackDistance held_back =
        evaluation::heldBackDistance(index, place_.checked, 0.5 * s_);
    f.coverage = held_back.fraction_within;
    f.coverage_quarter = held_back.fraction_within_half;
    f.coverage_inside = held_back.fraction_inside;
    f.measured_coverage =
        place_.truth ? evaluation::coverage(index, measured_, 0.5 * s_) : held_back.fraction_within;
    if (std::isfinite(held_back.median)) f.held_back_median_m = held_back.median;
    const evaluation::SurfaceDistance surface = evaluation::surfaceDistance(
        index, place_.rays, 1 + place_.rays.size() / kMaxRays, to_truth_);
    if (std::isfinite(surface.median)) f.surface_median_m = surface.median;
    if (std::isfinite(surface.percentile_95)) f.surface_p95_m = surface.percentile_95;
    f.free_space_violation = evaluation::freeSpaceViolation(index, crossed_);
    f.frames = static_cast<double>(place_.frames.size());
    if (!place_.position_errors.empty()) {
      double sum = 0.0;
      for (const double error : place_.position_errors) sum += error * error;
      f.position_rms_m = std::sqrt(sum / *f.frames);
    }
    return f;
  }
  /// Fraction of the space that rays crossed that is not known to be free.
  double notKnown(const std::function<bool(const Vector3&)>& is_free) const {
    if (crossed_.pieces() == 0) return 0.0;
    return 1.0 -
           static_cast<double>(crossed_.count(is_free)) / static_cast<double>(crossed_.pieces());
  }

 private:
  const Place& place_;
  double s_;
  const DistanceToTruth& to_truth_;
  evaluation::CrossedSpace crossed_;
  // Where there is truth:
  std::vector<evaluation::VisibleCell> visible_;
  std::vector<Vector3> measured_;  ///< points to look for, with their noise
  std::size_t standard_cells_ = 0;
};

/// The methods at one cell size, one after the other.
class CellRun {
 public:
  CellRun(const Place& place, const MethodOptions& options, double s, PlanarRuns& planar,
          const DistanceToTruth& to_truth)
      : place_(place), options_(options), s_(s), planar_(planar), evaluator_(place, s, to_truth) {}

  /// \return false if it was stopped

  bool execute(const std::function<bool()>& done) {
    if (!options_.planar.empty()) min_points_ = minPointsPerCell(options_.planar.back().load(s_));
    if (!standardGrid()) return true;
    if (!done()) return false;
    octreeGrid();
    if (!done()) return false;
    rectangularApproximation();
    if (!done()) return false;
    for (const PlanarMethod& method : options_.planar) {
      planarMap(method);
      if (!done()) return false;
    }
    return true;
  }

  std::vector<evaluation::PlaceResult> takeResults() { return std::move(results_); }

 private:
  /// The frames of the place in a grid of either kind.
  template <typename Grid>
  void fill(Grid& grid) const {
    for (const PreparedFrame& frame : place_.frames)
      grid.insert(frame.obstacles, frame.ground, frame.frame.T_world_sensor.translation());
  }
  /// \return false if there is not a cell
  bool standardGrid() {
    const StopWatch watch;
    evaluation::StandardGrid grid(s_, min_points_);
    fill(grid);
    std::vector<Cuboid> cuboids = grid.cuboids();
    const double ms = watch.milliseconds();
    if (grid.size() == 0) return false;
    evaluator_.setStandardCells(grid.size());
    Figures figures = evaluator_.figures(cuboids);
    figures.memory_bytes = static_cast<double>(grid.memoryBytes());
    figures.file_bytes = static_cast<double>(grid.fileBytes());
    figures.time_ms_per_frame = perFrame(ms);
    add("SG", std::move(figures));
    return true;
  }

  void octreeGrid() {
    const StopWatch watch;
    const std::unique_ptr<evaluation::OctreeGrid> grid =
        evaluation::makeOctreeGrid(s_, min_points_);
    if (!grid) return;
    fill(*grid);
    const auto ot_bytes = static_cast<double>(grid->otBytes());  // finish() takes the beliefs
    grid->finish();
    std::vector<Cuboid> cuboids = grid->cuboids();
    const double ms = watch.milliseconds();
    Figures figures = evaluator_.figures(cuboids);
    figures.memory_bytes = static_cast<double>(grid->heapBytes());
    figures.free_not_known =
        evaluator_.notKnown([&grid](const Vector3& point) { return grid->isFree(point); });
    figures.file_bytes = static_cast<double>(grid->fileBytes());
    figures.compressed_bytes = static_cast<double>(grid->compressedFileBytes());
    figures.ot_bytes = ot_bytes;
    figures.time_ms_per_frame = perFrame(ms);
    add("OG", std::move(figures));
  }

  void rectangularApproximation() {
    const StopWatch watch;
    evaluation::StandardGrid grid(s_, min_points_);
    fill(grid);
    const evaluation::RectangularApproximation boxes(s_, grid.cells());
    std::vector<Cuboid> cuboids = boxes.cuboids();
    const double ms = watch.milliseconds();
    Figures figures = evaluator_.figures(cuboids);
    figures.memory_bytes = static_cast<double>(boxes.memoryBytes());
    figures.file_bytes = static_cast<double>(boxes.fileBytes());
    figures.time_ms_per_frame = perFrame(ms);
    add("RA", std::move(figures));
    if (!options_.filtered_by.empty()) ofDensity("RA_density", grid.cells());
  }

  void planarMap(const PlanarMethod& method) {
    PlanarRun run = planar_.make(method.load(s_));
    Figures figures = evaluator_.figures(run.map.cuboids());
    figures.memory_bytes = static_cast<double>(run.map.memoryBytes());
    figures.file_bytes = static_cast<double>(run.map.serialize().size());
    figures.free_not_known =
        evaluator_.notKnown([&run](const Vector3& point) { return run.map.isFree(point); });
    figures.finished_bytes = static_cast<double>(run.map.finished().serialize().size());
    figures.time_ms_per_frame = perFrame(run.time_ms);
    add(method.name, std::move(figures));
    if (method.name == options_.filtered_by) ofFilteredCells(cellsIn(run.map.cuboids(), s_));
  }

  void ofFilteredCells(const std::vector<evaluation::GridCell>& cells) {
    const std::vector<Cuboid> cubes = evaluation::cuboidsOf(cells, s_);
    if (const std::unique_ptr<evaluation::OctreeGrid> tree = evaluation::makeOctreeGrid(s_)) {
      for (const Cuboid& cube : cubes) tree->insert({cube.center}, {}, cube.center);
      tree->finish();
      add("OG_filtered", evaluator_.figures(tree->cuboids()));
    }
    const evaluation::RectangularApproximation boxes(s_, cells);
    add("RA_filtered", evaluator_.figures(boxes.cuboids()));
    ofDensity("RA_density_filtered", cells);
    add("SG_filtered", evaluator_.figures(cubes));
  }

  void ofDensity(const std::string& name, const std::vector<evaluation::GridCell>& cells) {
    const std::vector<Cuboid> boxes =
        evaluation::cuboidsOf(evaluation::boxesByDensity(cells, kBoxDensity), s_);
    add(name, evaluator_.figures(boxes));
  }

  void add(const std::string& method, Figures figures) {
    results_.push_back(
        {"", place_.truth != nullptr, place_.number, s_, method, std::move(figures)});
  }

  double perFrame(double ms) const { return ms / static_cast<double>(place_.frames.size()); }

  const Place& place_;
  const MethodOptions& options_;
  double s_;
  PlanarRuns& planar_;
  MapEvaluator evaluator_;
  int min_points_ = 1;
  std::vector<evaluation::PlaceResult> results_;
};
}  // namespace

std::vector<evaluation::PlaceResult> evaluateMethods(const Place& place,
                                                     const MethodOptions& options,
                                                     const std::function<bool()>& done) {
  PlanarRuns planar(place);
  const DistanceToTruth to_truth = distanceToTruth(place);
  std::vector<evaluation::PlaceResult> results;
  for (const double s : options.cells) {
    CellRun run(place, options, s, planar, to_truth);
    const bool complete = run.execute(done);
    for (evaluation::PlaceResult& result : run.takeResults()) results.push_back(std::move(result));
    if (!complete) break;
  }
  return results;
}

}  // namespace planar_mapping::tools
