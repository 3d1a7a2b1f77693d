// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/run_statistics.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/trajectory_error.h"
#include "planar_mapping/map/cuboids/cuboid_distance.h"

namespace planar_mapping::detail {
namespace {

using Json = nlohmann::ordered_json;

/// Median, 95th percentile (nearest rank) and sum, over the frames that were used.
template <typename Get>
Json timesOf(const std::vector<FrameReport>& reports, const Get& get) {
  std::vector<double> values;
  for (const FrameReport& report : reports)
    if (report.skip_reason.empty()) values.push_back(get(report));
  const double total = std::accumulate(values.begin(), values.end(), 0.0);
  if (values.empty()) values.push_back(0.0);
  return {
      {"median", nearestRank(values, 0.5)}, {"p95", nearestRank(values, 0.95)}, {"total", total}};
}

/// Over the frames that were used.
template <typename Get>
std::size_t sumOf(const std::vector<FrameReport>& reports, const Get& get) {
  std::size_t sum = 0;
  for (const FrameReport& report : reports)
    if (report.skip_reason.empty()) sum += get(report);
  return sum;
}

/// Null where there is nothing to divide by: 0 and 1 would both be claims.
Json ratio(std::size_t part, std::size_t whole) {
  return whole > 0 ? Json(static_cast<double>(part) / static_cast<double>(whole)) : Json();
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

/// Statistics of the stages of all frames, each name once, in the order they first came.
std::vector<std::string> statisticNames(const std::vector<FrameReport>& reports) {
  std::vector<std::string> names;
  for (const FrameReport& report : reports)
    for (const FrameStatistic& statistic : report.statistics)
      if (std::find(names.begin(), names.end(), statistic.name) == names.end())
        names.push_back(statistic.name);
  return names;
}

/// Empty where the frame has none of that name.
std::string statisticText(const FrameReport& report, const std::string& name) {
  for (const FrameStatistic& statistic : report.statistics)
    if (statistic.name == name) return formatNumber(statistic.value);
  return "";
}

/// The place of a map; null where it is not in any.
const MapPlace* placeOf(const std::vector<MapPlace>& places, const PlanarMap* map) {
  const auto place = std::find_if(places.begin(), places.end(),
                                  [&](const MapPlace& one) { return one.map == map; });
  return place == places.end() ? nullptr : &*place;
}

}  // namespace

void StandardCells::add(const Vector3& point) {
  std::uint64_t key = 0;
  if (!cellKeyOf(point, resolution_, key)) return;
  Cell& cell = cells_[key];
  ++cell.points;
  if ((cell.points & (cell.points - 1)) != 0) return;
  for (int axis = 0; axis < 3; ++axis) cell.point[axis] = static_cast<float>(point[axis]);
}

void StandardCells::add(const StandardCells& other, const Pose& T_this_other) {
  for (const std::uint64_t other_key : other.cells_.sortedKeys()) {
    const Cell& from = *other.cells_.find(other_key);
    const Vector3 point = T_this_other * Vector3(from.point[0], from.point[1], from.point[2]);
    std::uint64_t key = 0;
    if (!cellKeyOf(point, resolution_, key)) continue;
    Cell& cell = cells_[key];
    cell.points += from.points;
    for (int axis = 0; axis < 3; ++axis) cell.point[axis] = static_cast<float>(point[axis]);
  }
}

std::pair<std::size_t, std::size_t> StandardCells::coveredBy(const PlanarMap& map) const {
  std::size_t covered = 0;
  std::size_t all = 0;
  const CuboidDistance index(map.cuboids());
  std::uint32_t hint = 0;
  for (const std::uint64_t key : cells_.sortedKeys()) {
    const Cell& cell = *cells_.find(key);
    all += cell.points;
    if (index.isWithin(Vector3(cell.point[0], cell.point[1], cell.point[2]), 0.5 * resolution_,
                       hint))
      covered += cell.points;
  }
  return {covered, all};
}

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

void RunStatistics::add(const FrameReport& report, const Frame& frame, const PlanarMap& map) {
  reports_.push_back(report);
  maps_.push_back(frame.skip_reason.empty() ? &map : nullptr);
  count(frame, map);
}

void RunStatistics::count(const Frame& frame, const PlanarMap& map) {
  if (!frame.skip_reason.empty()) return;
  ++used_;
  if (frame.given_pose) {
    estimates_.push_back({&map, frame.T_world_sensor, *frame.given_pose});
    has_true_poses_ = has_true_poses_ || (!frame.pose_assumed && frame.given_pose->matrix() !=
                                                                     frame.T_world_sensor.matrix());
  }
  StandardCells& cells = cellsFor(map);
  std::vector<std::uint8_t> is_ground(frame.cloud->size(), 0);
  for (const int i : frame.ground) is_ground[static_cast<std::size_t>(i)] = 1;
  const PointsView points = pointsOf(*frame.cloud);
  for (std::size_t i = 0; i < points.size; ++i) {
    if (is_ground[i] == 0 && points.isMeasured(i))
      cells.add(frame.T_world_sensor * points.point(i));
  }
}

StandardCells& RunStatistics::cellsFor(const PlanarMap& map) {
  for (auto part = parts_.rbegin(); part != parts_.rend(); ++part)
    if (part->map == &map) return part->cells;
  parts_.push_back({&map, StandardCells(map.params().approximation.resolution)});
  return parts_.back().cells;
}

StandardCells RunStatistics::joinedCells(const std::vector<MapPlace>& places) const {
  StandardCells all(parts_.front().cells.resolution());
  for (const MapPlace& place : places) {
    if (place.component != places.front().component) continue;
    for (const Part& part : parts_)
      if (part.map == place.map) all.add(part.cells, place.T_world_map);
  }
  return all;
}

/// Of the frames in the world of the first one, against the poses that were given and not used.
Json RunStatistics::motionError(const std::vector<MapPlace>& places) const {
  std::vector<Pose> estimated;
  std::vector<Pose> given;
  for (const Estimate& one : estimates_) {
    const MapPlace* const place = placeOf(places, one.map);
    if (place != nullptr && place->component != places.front().component) continue;
    estimated.push_back(place != nullptr ? place->T_world_map * one.T_map_sensor
                                         : one.T_map_sensor);
    given.push_back(one.given);
  }
  const TrajectoryError error = trajectoryError(estimated, given);
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

std::string RunStatistics::framesCsv(const Configuration& configuration,
                                     const std::vector<MapPlace>& places) const {
  const std::vector<std::string> names = statisticNames(reports_);
  std::string csv = "frame,source,timestamp,read_ms";
  for (const std::string& key : stageKeys(configuration)) csv += "," + key + "_ms";
  csv += ",frame_ms";
  for (const CountColumn& column : kCounts) csv += std::string(",") + column.name;
  csv += ",skipped";
  for (const std::string& name : names) csv += "," + quotedForCsv(name);
  if (!places.empty()) csv += ",submap,component";
  csv += "\n";
  for (std::size_t row = 0; row < reports_.size(); ++row) {
    const FrameReport& r = reports_[row];
    csv += std::to_string(r.number) + "," + quotedForCsv(r.source) + "," +
           formatNumber(r.timestamp) + "," + formatNumber(r.read_ms);
    for (const double ms : r.stage_ms) csv += "," + formatNumber(ms);
    csv += "," + formatNumber(r.frame_ms);
    for (const CountColumn& column : kCounts) csv += "," + std::to_string(r.*column.value);
    csv += "," + quotedForCsv(r.skip_reason);
    for (const std::string& name : names) csv += "," + statisticText(r, name);
    if (!places.empty()) {
      const MapPlace* const place = placeOf(places, maps_[row]);
      csv += place == nullptr
                 ? ",,"
                 : "," + std::to_string(place->submap) + "," + std::to_string(place->component);
    }
    csv += "\n";
  }
  return csv;
}

Json RunStatistics::metrics(const Configuration& configuration, const PlanarMap& map,
                            const std::vector<MapPlace>& places) const {
  const std::vector<std::string> keys = stageKeys(configuration);
  const std::size_t cuboids = map.cuboids().size();
  const auto planar = static_cast<std::size_t>(
      std::count_if(map.cuboids().begin(), map.cuboids().end(),
                    [](const Cuboid& cuboid) { return cuboid.plane_id >= 0; }));
  std::optional<StandardCells> joined;
  if (!places.empty() && !parts_.empty()) joined = joinedCells(places);
  const StandardCells* const standard_cells =
      joined ? &*joined : (parts_.empty() ? nullptr : &parts_.front().cells);
  const std::size_t cells = standard_cells != nullptr ? standard_cells->size() : 0;
  const auto [covered, all] = standard_cells != nullptr ? standard_cells->coveredBy(map)
                                                        : std::pair<std::size_t, std::size_t>();
  Json json;
  json["version"] = PLANAR_MAPPING_VERSION;
  json["profile"] = configuration.settings.profile == Profile::Paper ? "paper" : "compact";
  json["seed"] = configuration.settings.seed;
  json["threads"] = resolveThreads(configuration.settings.threads);
  json["frames"] = reports_.size();
  json["frames_skipped"] = reports_.size() - used_;
  json["frames_elsewhere"] = std::count_if(maps_.begin(), maps_.end(), [&](const PlanarMap* one) {
    const MapPlace* const place = placeOf(places, one);
    return place != nullptr && place->component != places.front().component;
  });
  for (const auto& [name, field] : {std::pair("input", &FrameReport::points_input),
                                    std::pair("valid", &FrameReport::points_valid),
                                    std::pair("ground", &FrameReport::points_ground),
                                    std::pair("planar", &FrameReport::points_planar),
                                    std::pair("non_planar", &FrameReport::points_non_planar),
                                    std::pair("rejected", &FrameReport::points_rejected),
                                    std::pair("beyond", &FrameReport::points_beyond)}) {
    json["points"][name] =
        sumOf(reports_, [field = field](const FrameReport& r) { return r.*field; });
  }
  json["points"]["removed_by"] = Json::object();
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::size_t removed =
        sumOf(reports_, [i](const FrameReport& r) { return r.stage_removed[i]; });
    if (removed > 0) json["points"]["removed_by"][keys[i]] = removed;
  }
  json["planes"] = map.planes().size();
  json["cuboids"] = {{"planar", planar}, {"non_planar", cuboids - planar}, {"total", cuboids}};
  json["cluttered_regions"] = map.clutteredRegions();
  const Vector3& origin = map.params().origin;
  json["origin_m"] = {origin.x(), origin.y(), origin.z()};
  json["resolution_m"] = map.params().approximation.resolution;
  json["standard_cells"] = cells;
  json["combination_efficiency"] = nullptr;
  if (cells > 0)
    json["combination_efficiency"] =
        1.0 - static_cast<double>(cuboids) / static_cast<double>(cells);
  json["coverage"] = ratio(covered, all);
  json["coverage_points"] = {{"valid", all}, {"covered", covered}};
  json["unknown_cells"] = map.unknownCells();
  json["memory_bytes"] = map.memoryBytes();
  // Null where there is nothing to compare with.
  json["motion_error"] = nullptr;
  if (hasStage(configuration, StageKind::Motion) && has_true_poses_)
    json["motion_error"] = motionError(places);
  json["time_ms"]["read"] = timesOf(reports_, [](const FrameReport& r) { return r.read_ms; });
  for (std::size_t i = 0; i < keys.size(); ++i)
    json["time_ms"][keys[i]] =
        timesOf(reports_, [i](const FrameReport& r) { return r.stage_ms[i]; });
  json["time_ms"]["frame"] = timesOf(reports_, [](const FrameReport& r) { return r.frame_ms; });
  return json;
}

}  // namespace planar_mapping::detail
