// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/run_statistics.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/map/cuboids/cuboid_distance.h"
#include "planar_mapping/localization/trajectory_error.h"

namespace planar_mapping::detail {
namespace {

using Json = nlohmann::ordered_json;

/// Median, 95th percentile (nearest rank) and sum.
Json timesOf(std::vector<double> values) {
  const double total = std::accumulate(values.begin(), values.end(), 0.0);
  if (values.empty()) values.push_back(0.0);
  return {
      {"median", nearestRank(values, 0.5)}, {"p95", nearestRank(values, 0.95)}, {"total", total}};
}

/// Of an estimated trajectory, against the poses that were given and not used.
Json motionErrorOf(const std::vector<Pose>& estimate, const std::vector<Pose>& given) {
  const TrajectoryError error = trajectoryError(estimate, given);
  return {{"frames", error.poses},
          {"path_m", error.path_length},
          {"absolute_rms_m", error.absolute_rms},
          {"absolute_max_m", error.absolute_max},
          {"relative_rms_m", error.relative_translation_rms},
          {"relative_rms_deg", error.relative_rotation_rms / kRadiansPerDegree},
          {"end_drift_m", error.end_translation},
          {"end_drift_deg", error.end_rotation / kRadiansPerDegree},
          {"end_drift_percent", error.endDriftPercent()}};
}

/// A stage that occurs twice gets a number, so that no key stands for two.
std::vector<std::string> stageKeys(const Configuration& configuration) {
  std::vector<std::string> keys;
  for (const ConfiguredStage& stage : configuration.stages) {
    std::string key = stage.name;
    for (int n = 2; std::find(keys.begin(), keys.end(), key) != keys.end(); ++n)
      key = stage.name + "_" + std::to_string(n);
    keys.push_back(key);
  }
  return keys;
}

/// World coordinates of the measured points that are no ground.
template <typename Visitor>
void forEachMappable(const Frame& frame, const Visitor& visit) {
  std::vector<std::uint8_t> is_ground(frame.cloud->size(), 0);
  for (const int i : frame.ground) is_ground[static_cast<std::size_t>(i)] = 1;
  const PointsView points = pointsOf(*frame.cloud);
  for (std::size_t i = 0; i < points.size; ++i) {
    if (is_ground[i] == 0 && points.isMeasured(i)) visit(frame.T_world_sensor * points.point(i));
  }
}

/// The counts of a row, in the order of the columns.
struct CountColumn {
  const char* name;
  std::size_t FrameReport::*value;
};
constexpr CountColumn kCounts[] = {{"points_input", &FrameReport::points_input},
                                   {"points_valid", &FrameReport::points_valid},
                                   {"points_ground", &FrameReport::points_ground},
                                   {"points_planar", &FrameReport::points_planar},
                                   {"points_non_planar", &FrameReport::points_non_planar},
                                   {"points_rejected", &FrameReport::points_rejected},
                                   {"features", &FrameReport::features},
                                   {"matches", &FrameReport::matches},
                                   {"planes", &FrameReport::planes},
                                   {"planes_new", &FrameReport::planes_new},
                                   {"planes_matched", &FrameReport::planes_matched},
                                   {"cuboids", &FrameReport::cuboids},
                                   {"map_bytes", &FrameReport::map_bytes},
                                   {"inliers", &FrameReport::inliers}};

/// The columns that every run of a configuration has; those of statistics follow.
std::string fixedCsvHeader(const Configuration& configuration) {
  std::string header = "frame,source,timestamp,read_ms";
  for (const std::string& key : stageKeys(configuration)) header += "," + key + "_ms";
  header += ",frame_ms";
  for (const CountColumn& column : kCounts) header += std::string(",") + column.name;
  return header + ",skipped";
}

/// Names of statistics in the order in which they first came: the columns of the whole file.
std::vector<std::string> statisticNames(const std::vector<FrameReport>& reports) {
  std::vector<std::string> names;
  for (const FrameReport& report : reports) {
    for (const FrameStatistic& statistic : report.statistics) {
      const bool is_new = std::find(names.begin(), names.end(), statistic.name) == names.end();
      if (is_new) names.push_back(statistic.name);
    }
  }
  return names;
}

/// Empty where the frame has none of that name.
std::string statisticText(const FrameReport& report, const std::string& name) {
  for (const FrameStatistic& statistic : report.statistics) {
    if (statistic.name == name) return formatNumber(statistic.value);
  }
  return "";
}

}  // namespace

void RunStatistics::add(const FrameReport& report, const Frame& frame, const PlanarMap& map) {
  reports_.push_back(report);
  count(frame, map);
}

void RunStatistics::addAgain(const FrameReport& report, const Frame& frame, const PlanarMap& map) {
  for (FrameReport& row : reports_) {
    if (row.number != report.number) continue;
    const double read_ms = row.read_ms;
    row = report;
    row.read_ms = read_ms;
  }
  count(frame, map);
}

void RunStatistics::count(const Frame& frame, const PlanarMap& map) {
  if (!frame.skip_reason.empty()) return;
  if (frame.given_pose) {
    estimated_poses_.push_back(frame.T_world_sensor);
    given_poses_.push_back(*frame.given_pose);
    all_assumed_ = all_assumed_ && frame.pose_assumed;
  }
  if (standard_cells_.empty()) standard_cells_.emplace_back(map.params().approximation.resolution);
  StandardCells& cells = standard_cells_.front();
  forEachMappable(frame, [&cells](const Vector3& world) { cells.add(world); });
}

bool RunStatistics::posesAreGivenOnes() const {
  for (std::size_t i = 0; i < given_poses_.size(); ++i) {
    if (given_poses_[i].matrix() != estimated_poses_[i].matrix()) return false;
  }
  return true;
}

/// Asked once, of the whole map: a point of each standard cell stands for all that fell into it,
/// so that a run takes time in proportion to its frames.
RunStatistics::Coverage RunStatistics::coverageOf(const PlanarMap& map) const {
  Coverage coverage;
  if (standard_cells_.empty()) return coverage;
  const double margin = 0.5 * map.params().approximation.resolution;
  const CuboidDistance index(map.cuboids());
  std::uint32_t hint = 0;
  standard_cells_.front().forEach([&](const StandardCells::Cell& cell) {
    coverage.points += cell.points;
    if (index.isWithin(Vector3(cell.point[0], cell.point[1], cell.point[2]), margin, hint))
      coverage.covered += cell.points;
  });
  return coverage;
}

std::size_t RunStatistics::usedFrames() const {
  return static_cast<std::size_t>(
      std::count_if(reports_.begin(), reports_.end(),
                    [](const FrameReport& report) { return report.skip_reason.empty(); }));
}

std::size_t RunStatistics::sum(std::size_t FrameReport::*field) const {
  std::size_t total = 0;
  for (const FrameReport& report : reports_) {
    if (report.skip_reason.empty()) total += report.*field;
  }
  return total;
}

std::size_t RunStatistics::pointsBeyond() const {
  return sum(&FrameReport::points_beyond);
}

double RunStatistics::removedFraction() const {
  const std::size_t all = sum(&FrameReport::points_valid);
  return all > 0
             ? static_cast<double>(sum(&FrameReport::points_rejected)) / static_cast<double>(all)
             : 0.0;
}

bool RunStatistics::hasGroundInMostFrames() const {
  const auto count = std::count_if(reports_.begin(), reports_.end(), [](const FrameReport& report) {
    return report.points_ground > 0;
  });
  return 2 * static_cast<std::size_t>(count) > usedFrames();
}

bool RunStatistics::mayBeUnregistered() const {
  const auto says = [this](const char* name, double least) {
    return std::any_of(reports_.begin(), reports_.end(), [&](const FrameReport& report) {
      return std::any_of(report.statistics.begin(), report.statistics.end(),
                         [&](const auto& one) { return one.name == name && one.value >= least; });
    });
  };
  return says("features_left", 0.0) && !says("colour_registered", 1.0);
}

bool RunStatistics::hasSkippedPoints() const {
  return std::any_of(reports_.begin(), reports_.end(), [](const FrameReport& report) {
    return !report.skip_reason.empty() && report.points_input > 0;
  });
}

std::vector<FrameReport> RunStatistics::skippedEnd() const {
  const auto end = std::find_if(reports_.rbegin(), reports_.rend(), [](const FrameReport& report) {
    return report.skip_reason.empty() || report.points_input == 0;
  });
  return {end.base(), reports_.end()};
}

const FrameReport& RunStatistics::firstSkipped() const {
  return *std::find_if(reports_.begin(), reports_.end(),
                       [](const FrameReport& report) { return !report.skip_reason.empty(); });
}

std::string RunStatistics::framesCsv(const Configuration& configuration) const {
  const std::vector<std::string> names = statisticNames(reports_);
  std::string csv = fixedCsvHeader(configuration);
  for (const std::string& name : names) csv += "," + detail::quotedForCsv(name);
  csv += "\n";
  for (const FrameReport& r : reports_) {
    csv += std::to_string(r.number) + "," + detail::quotedForCsv(r.source) + "," +
           formatNumber(r.timestamp) + "," + formatNumber(r.read_ms);
    for (const double ms : r.stage_ms) csv += "," + formatNumber(ms);
    csv += "," + formatNumber(r.frame_ms);
    for (const CountColumn& column : kCounts) csv += "," + std::to_string(r.*column.value);
    csv += "," + detail::quotedForCsv(r.skip_reason);
    for (const std::string& name : names) csv += "," + statisticText(r, name);
    csv += "\n";
  }
  return csv;
}

std::string RunStatistics::metricsJson(const Configuration& configuration, const PlanarMap& map,
                                       std::size_t file_bytes, bool interrupted) const {
  std::size_t planar_cuboids = 0;
  for (const Cuboid& cuboid : map.cuboids()) planar_cuboids += cuboid.plane_id >= 0 ? 1 : 0;
  const std::size_t cuboids = map.cuboids().size();
  const std::size_t standard_cells = standard_cells_.empty() ? 0 : standard_cells_.front().size();

  Json json;
  json["version"] = PLANAR_MAPPING_VERSION;
  json["profile"] = configuration.settings.profile == Profile::Paper ? "paper" : "compact";
  json["seed"] = configuration.settings.seed;
  json["threads"] = resolveThreads(configuration.settings.threads);
  json["interrupted"] = interrupted;
  json["frames"] = reports_.size();
  json["frames_skipped"] = reports_.size() - usedFrames();
  json["points"] = {{"input", sum(&FrameReport::points_input)},
                    {"valid", sum(&FrameReport::points_valid)},
                    {"ground", sum(&FrameReport::points_ground)},
                    {"planar", sum(&FrameReport::points_planar)},
                    {"non_planar", sum(&FrameReport::points_non_planar)},
                    {"rejected", sum(&FrameReport::points_rejected)},
                    {"beyond", sum(&FrameReport::points_beyond)}};
  json["planes"] = map.planes().size();
  json["cuboids"] = {
      {"planar", planar_cuboids}, {"non_planar", cuboids - planar_cuboids}, {"total", cuboids}};
  json["cluttered_regions"] = map.clutteredRegions();
  const Vector3& origin = map.params().origin;
  json["origin_m"] = {origin.x(), origin.y(), origin.z()};
  json["resolution_m"] = map.params().approximation.resolution;
  json["standard_cells"] = standard_cells;
  // Null where there is nothing to divide by: 0 and 1 would both be claims.
  json["combination_efficiency"] = nullptr;
  if (standard_cells > 0)
    json["combination_efficiency"] =
        1.0 - static_cast<double>(cuboids) / static_cast<double>(standard_cells);
  json["coverage"] = nullptr;
  const Coverage coverage = coverageOf(map);
  if (coverage.points > 0)
    json["coverage"] = static_cast<double>(coverage.covered) / static_cast<double>(coverage.points);
  json["coverage_points"] = {{"valid", coverage.points}, {"covered", coverage.covered}};
  json["unknown_cells"] = map.unknownCells();
  json["memory_bytes"] = map.memoryBytes();
  json["file_bytes"] = file_bytes;
  // Null where there is nothing to compare with (an assumed pose is none), or where the given poses
  // were taken as they are.
  json["motion_error"] = nullptr;
  if (hasStage(configuration, StageKind::Motion) && !all_assumed_ && !posesAreGivenOnes())
    json["motion_error"] = motionErrorOf(estimated_poses_, given_poses_);
  const auto times = [this](const auto& of) {
    std::vector<double> values;
    for (const FrameReport& report : reports_) {
      if (report.skip_reason.empty()) values.push_back(of(report));
    }
    return timesOf(std::move(values));
  };
  json["time_ms"]["read"] = times([](const FrameReport& report) { return report.read_ms; });
  const std::vector<std::string> keys = stageKeys(configuration);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    json["time_ms"][keys[i]] = times([i](const FrameReport& report) { return report.stage_ms[i]; });
  }
  json["time_ms"]["frame"] = times([](const FrameReport& report) { return report.frame_ms; });
  return json.dump(2) + "\n";
}

std::string savedText(const PlanarMap& map, std::size_t file_bytes) {
  std::string text = std::to_string(map.planes().size()) + " planes, " +
                     std::to_string(map.cuboids().size()) + " cuboids, " +
                     std::to_string(file_bytes) + " bytes";
  if (const std::size_t cluttered = map.clutteredRegions(); cluttered > 0)
    text += "; " + std::to_string(cluttered) +
            " regions are so cluttered that boxes cover them without a search for fewer";
  if (const std::size_t unknown = map.unknownCells(); unknown > kMostUnknownInJson)
    text += "; map.json does not list the " + std::to_string(unknown) +
            " unknown cells: planar_map convert does";
  return text;
}

}  // namespace planar_mapping::detail
