// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/run_summary.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "planar_mapping/base/spelling.h"
#include "planar_mapping/pipeline/rounded.h"

namespace planar_mapping::detail {
namespace {

using Json = nlohmann::ordered_json;

std::string percent(double fraction) {
  return rounded(100.0 * fraction, 1) + " %";
}

/// "--set STAGE.KEY=VALUE", with the value of the configuration times a factor; where the stage has
/// no such number, the option that switches it off.
std::string command(const Configuration& configuration, const std::string& stage,
                    const std::string& key, double factor) {
  for (const ConfiguredStage& one : configuration.stages) {
    const Parameter* parameter = one.name == stage ? one.parameters.find(key) : nullptr;
    if (parameter == nullptr) continue;
    const ParameterValue value = parameter->get();
    std::string start = "--set ";
    start.append(stage).append(".").append(key).append("=");
    if (const auto* number = std::get_if<double>(&value))
      return start + rounded(factor * *number, 3);
    if (const auto* number = std::get_if<std::int64_t>(&value))
      return start +
             std::to_string(std::max(std::int64_t{1}, static_cast<std::int64_t>(std::round(
                                                          factor * static_cast<double>(*number)))));
  }
  return "--set " + stage + ".enabled=false";
}

std::string nameOf(const Configuration& configuration, StageKind kind) {
  for (const ConfiguredStage& stage : configuration.stages)
    if (stage.kind == kind && stage.enabled) return stage.name;
  return "";
}

/// Which stage lost the points that are not in the map, and what keeps more of them.
std::string lossOf(const Configuration& configuration, const Json& metrics) {
  static const std::map<std::string, std::string> kKeys = {
      {"pass_through", "max_m"},
      {"depth_error_limit", "max_error_m"},
      {"statistical_outlier_removal", "deviations"},
      {"radius_outlier_removal", "radius_m"}};
  const double points = std::max(1.0, metrics["coverage_points"]["valid"].get<double>());
  const double lost = points - metrics["coverage_points"]["covered"].get<double>();
  const auto& removed = metrics["points"]["removed_by"];
  const auto most = std::max_element(removed.begin(), removed.end());
  if (most == removed.end() || 2.0 * most->get<double>() < lost) {
    const std::string map = nameOf(configuration, StageKind::Map);
    return "most of the others are in cells of too few points or too little belief: " +
           command(configuration, map, "min_points_per_cell", 0.5) + " or " +
           command(configuration, map, "min_probability", 0.5) + " keeps more";
  }
  const auto key = kKeys.find(most.key());
  return most.key() + " removed " + percent(most->get<double>() / points) + ": " +
         command(configuration, most.key(), key == kKeys.end() ? "" : key->second, 2.0) +
         " keeps more";
}

}  // namespace

std::string summaryOf(const Configuration& configuration, const Json& metrics) {
  constexpr double kUsualCoverage = 0.95;
  const std::size_t frames = metrics["frames"], left_out = metrics["frames_skipped"];
  std::string text = (left_out > 0 ? std::to_string(frames - left_out) + " of " : "") +
                     counted(frames, "frame") + ", " + metrics["points"]["valid"].dump() +
                     " points -> " + counted(metrics["planes"], "plane") + ", " +
                     counted(metrics["cuboids"]["total"], "cuboid") + " (" +
                     metrics["standard_cells"].dump() + " cells of a standard grid of " +
                     metrics["resolution_m"].dump() + " m)";
  if (!metrics["coverage"].is_number()) return text;
  const double coverage = metrics["coverage"];
  return text + "\n" + percent(coverage) +
         " of the points lie in a cuboid or within half a cell of one" +
         (coverage < kUsualCoverage ? "; " + lossOf(configuration, metrics) : "");
}

std::vector<std::string> warningsOn(const Pipeline& pipeline, const RunStatistics& statistics,
                                    const Json& metrics) {
  const Configuration& configuration = pipeline.configuration();
  std::vector<std::string> warnings;
  if (const std::size_t left_out = metrics["frames_skipped"]; left_out > 0) {
    const auto first =
        std::find_if(statistics.reports().begin(), statistics.reports().end(),
                     [](const FrameReport& report) { return !report.skip_reason.empty(); });
    const bool is_found = pipeline.map().params().frame == MapFrame::Start;
    warnings.push_back(std::to_string(left_out) + " of " + std::to_string(statistics.frames()) +
                       " frames left out (see frames.csv), the first: frame " +
                       std::to_string(first->number) + ", " + first->skip_reason +
                       (is_found ? "; frames closer together help, or poses: --poses FILE" : ""));
  }
  if (const std::size_t apart = metrics["frames_elsewhere"]; apart > 0)
    warnings.push_back(std::to_string(apart) + " of " + std::to_string(statistics.frames()) +
                       " frames are not in this map: nothing tells how they lie to the first one. "
                       "The atlas has them as components of their own (frames.csv), paths of which "
                       "are in trajectory_tum.N.txt; frames closer together help, or poses: "
                       "--poses FILE");
  if (const std::size_t beyond = metrics["points"]["beyond"]; beyond > 0)
    warnings.push_back(
        std::to_string(beyond) +
        " points were dropped: the map reaches 2^20 cells from its origin along each axis; " +
        command(configuration, nameOf(configuration, StageKind::Map), "resolution_m", 2.0) +
        " reaches twice as far");
  if (metrics["cuboids"]["total"] == 0) {
    warnings.push_back("the map holds no cuboid; " + lossOf(configuration, metrics));
  } else if (metrics["planes"] == 0) {
    warnings.push_back(
        "no plane was found; " +
        command(configuration, nameOf(configuration, StageKind::Planes), "min_inliers", 0.5) +
        " finds smaller ones, unless the points were lost before: " +
        lossOf(configuration, metrics));
  }
  return warnings;
}

void remarkOnFirst(Frame& frame, const CloudScale& scale) {
  constexpr double kMaxSpacing = 1.0;  // metres between points that a robot uses
  constexpr double kMaxRange = 100.0;  // metres
  if (!scale.stereo && scale.spacing > kMaxSpacing && scale.max_range > kMaxRange)
    frame.warnings.push_back(frame.source + ": the points are " + rounded(scale.spacing, 1) +
                             " apart and up to " + rounded(scale.max_range, 1) +
                             " from the sensor; if they are in millimetres: " + "--scale 0.001");
  if (!frame.pose_assumed) return;
  if (scale.has_sensor) {
    frame.notes.push_back(frame.source +
                          ": no VIEWPOINT; the sensor is taken to be at the origin of the cloud");
  } else {
    frame.warnings.push_back(
        frame.source +
        ": no VIEWPOINT, and its points cannot have been seen from its origin: taken as merged of "
        "many scans, of which no space is known to be free; if one sensor saw them from another "
        "place: --origin x,y,z; if from there: --set "
        "planar_cuboid_approximation.unknown_space=true");
  }
}

}  // namespace planar_mapping::detail
