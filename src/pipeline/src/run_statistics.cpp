// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "run_statistics.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "coverage.h"
#include "planar_mapping/core/parallel.h"

namespace planar_mapping::detail {
namespace {

using Json = nlohmann::ordered_json;

/// Median, 95th percentile (nearest rank) and sum.
Json timesOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto rank = [&values](double share) {
    if (values.empty()) return 0.0;
    const double position = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(position, 1.0)) - 1];
  };
  return {{"median", rank(0.5)},
          {"p95", rank(0.95)},
          {"total", std::accumulate(values.begin(), values.end(), 0.0)}};
}

std::string quotedForCsv(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

/// A stage that occurs twice gets a number, so that no key stands for two.
std::vector<std::string> stageKeys(const Configuration& configuration) {
  std::vector<std::string> keys;
  for (const ConfiguredStage& stage : configuration.stages) {
    std::string key = stage.name;
    for (int n = 2; std::find(keys.begin(), keys.end(), key) != keys.end(); ++n) {
      key = stage.name + "_" + std::to_string(n);
    }
    keys.push_back(key);
  }
  return keys;
}

}  // namespace

void RunStatistics::add(const FrameReport& report, const Frame& frame, const PlanarMap& map) {
  reports_.push_back(report);
  if (frame.inserted) measureCoverage(frame, map);
}

void RunStatistics::measureCoverage(const Frame& frame, const PlanarMap& map) {
  const double resolution = map.params().approximation.resolution;
  if (standard_cells_.empty()) standard_cells_.emplace_back(resolution);
  constexpr double kGridCells = 2.0;  // of the index, in cells of the map
  const CoverageIndex index(map.cuboids(), 0.5 * resolution, kGridCells * resolution);
  std::vector<std::uint8_t> is_ground(frame.cloud->size(), 0);
  for (const int i : frame.ground) is_ground[static_cast<std::size_t>(i)] = 1;
  for (std::size_t i = 0; i < frame.cloud->size(); ++i) {
    const Vector3 p = (*frame.cloud)[i].getVector3fMap().cast<double>();
    if (is_ground[i] != 0 || !p.allFinite()) continue;
    const Vector3 world = frame.T_world_sensor * p;
    standard_cells_.front().add(world);
    ++coverage_points_;
    if (index.covers(world)) ++covered_points_;
  }
}

std::size_t RunStatistics::validPoints() const {
  std::size_t sum = 0;
  for (const FrameReport& report : reports_) sum += report.points_valid;
  return sum;
}

std::string RunStatistics::framesCsv(const Configuration& configuration) const {
  std::string csv = "frame,source,timestamp,read_ms";
  for (const std::string& key : stageKeys(configuration)) csv += "," + key + "_ms";
  csv +=
      ",frame_ms,points_input,points_valid,points_ground,points_planar,points_non_planar,"
      "points_rejected,features,matches,inliers,planes,planes_new,planes_matched,cuboids,"
      "map_bytes\n";
  for (const FrameReport& r : reports_) {
    csv += std::to_string(r.number) + "," + quotedForCsv(r.source) + "," +
           formatNumber(r.timestamp) + "," + formatNumber(r.read_ms);
    for (const double ms : r.stage_ms) csv += "," + formatNumber(ms);
    csv += "," + formatNumber(r.frame_ms);
    for (const std::size_t count :
         {r.points_input, r.points_valid, r.points_ground, r.points_planar, r.points_non_planar,
          r.points_rejected, r.features, r.matches, r.points_planar, r.planes, r.planes_new,
          r.planes_matched, r.cuboids, r.map_bytes}) {
      csv += "," + std::to_string(count);
    }
    csv += "\n";
  }
  return csv;
}

std::string RunStatistics::metricsJson(const Configuration& configuration, const PlanarMap& map,
                                       std::size_t file_bytes, bool interrupted) const {
  const auto sum = [this](std::size_t FrameReport::*field) {
    std::size_t total = 0;
    for (const FrameReport& report : reports_) total += report.*field;
    return total;
  };
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
  json["points"] = {{"input", sum(&FrameReport::points_input)},
                    {"valid", sum(&FrameReport::points_valid)},
                    {"ground", sum(&FrameReport::points_ground)},
                    {"planar", sum(&FrameReport::points_planar)},
                    {"non_planar", sum(&FrameReport::points_non_planar)},
                    {"rejected", sum(&FrameReport::points_rejected)}};
  json["planes"] = map.planes().size();
  json["cuboids"] = {
      {"planar", planar_cuboids}, {"non_planar", cuboids - planar_cuboids}, {"total", cuboids}};
  json["resolution_m"] = map.params().approximation.resolution;
  json["standard_cells"] = standard_cells;
  // Null where there is nothing to divide by: 0 and 1 would both be claims.
  json["combination_efficiency"] = nullptr;
  if (standard_cells > 0) {
    json["combination_efficiency"] =
        1.0 - static_cast<double>(cuboids) / static_cast<double>(standard_cells);
  }
  json["coverage"] = nullptr;
  if (coverage_points_ > 0) {
    json["coverage"] = static_cast<double>(covered_points_) / static_cast<double>(coverage_points_);
  }
  json["unknown_cells"] = map.unknownCells();
  json["memory_bytes"] = map.memoryBytes();
  json["file_bytes"] = file_bytes;
  const auto times = [this](const auto& of) {
    std::vector<double> values;
    for (const FrameReport& report : reports_) values.push_back(of(report));
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

}  // namespace planar_mapping::detail
