// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "frame_command.h"
#include "planar_mapping/atlas/atlas_localizer.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/keyframe_maker.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/number_text.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/pipeline/keyframe_view.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/ready_configuration.h"
#include "planar_mapping/pipeline/sequence_source.h"

namespace planar_mapping::tools {
namespace {

using Json = nlohmann::ordered_json;

struct LocalizeArguments : FrameArguments {
  std::string atlas;
  std::string frames;
  double scale = 1.0;
};

/// How the ready configuration reads the input; given poses are not asked for.
Configuration configurationOf(const LocalizeArguments& arguments) {
  io::SequenceOptions options;
  options.calibration_file = arguments.calibration;
  options.scale = arguments.scale;
  const ReadyConfiguration ready = readyConfigurationFor(io::Sequence(arguments.inputs, options));
  FrameArguments read = arguments;
  read.configuration = planar_mapping::findConfiguration(ready.name);
  Configuration configuration =
      loadFor(read, "", {"scale=" + nlohmann::json(arguments.scale).dump()});
  selectFrames(arguments.frames, configuration);
  return configuration;
}

/// The place of a frame; else why there is none.
std::optional<Place> placeOf(const LocalizeArguments& arguments, const AtlasLocalizer& localizer,
                             Frame& frame, std::string& reason) {
  Pipeline(configurationOf(arguments)).prepare(frame);  // each frame alone, whatever was before it
  reason = frame.skip_reason;
  if (!reason.empty()) return std::nullopt;
  const std::optional<KeyframeView> view = keyframeViewOf(frame);
  const Keyframe key = view ? makeKeyframe(view->gray, view->cloud, view->camera)
                            : makeKeyframe(pointsOf(*frame.cloud), true);
  reason = view && key.sightings.empty()
               ? "its image has no features with a depth"
               : "too little agrees with what the atlas knows, or two places do";
  return localizer.find(key);
}

Json rowOf(const Frame& frame, const std::optional<Place>& place, const std::string& reason,
           const AtlasData& data) {
  Json row = {{"frame", frame.number},
              {"source", frame.source},
              {"timestamp", frame.timestamp},
              {"found", place.has_value()}};
  if (!place) {
    row["reason"] = reason;
    return row;
  }
  const Quaternion q(place->T_world_sensor.linear());
  row["component"] = place->component;
  row["position_m"] = toJson(place->T_world_sensor.translation());
  row["quaternion_xyzw"] = {q.x(), q.y(), q.z(), q.w()};
  row["covariance"] = Json::array();
  for (int i = 0; i < 6; ++i) {
    row["covariance"].push_back(Json::array());
    for (int j = 0; j < 6; ++j) row["covariance"].back().push_back(place->covariance(i, j));
  }
  row["session"] = place->session;
  row["submap"] = place->submap;
  row["keyframe"] = place->keyframe;
  for (const Keyframe& keyframe : data.keyframes) {
    if (keyframe.id != place->keyframe) continue;
    row["keyframe_frame"] = keyframe.frame;
    row["kind"] = wordOf(keyframe.points.empty() ? LinkKind::Loop : LinkKind::Surface);
  }
  row["inliers"] = place->evidence.inliers;
  row["matches"] = place->evidence.matches;
  row["off_plane"] = place->evidence.off_plane;
  row["agreement"] = place->evidence.agreement;
  row["seen_through"] = place->evidence.seen_through;
  row["log_odds"] = place->evidence.log_odds;
  return row;
}

std::string listOf(const std::vector<double>& numbers) {
  std::string text;
  for (const double number : numbers)
    text += (text.empty() ? "" : " ") + detail::numberText(number);
  return text;
}

void print(const Json& row) {
  std::cout << "frame " << row["frame"] << " " << row["source"].get<std::string>() << ": ";
  if (!row["found"].get<bool>()) {
    std::cout << "not found: " << row["reason"].get<std::string>() << '\n';
    return;
  }
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < 6; ++i) {
    const double sigma = std::sqrt(row["covariance"][i][i].get<double>());
    sigmas.push_back(i < 3 ? sigma : sigma / kRadiansPerDegree);
  }
  std::cout << "position " << listOf(row["position_m"].get<std::vector<double>>())
            << " m, quaternion xyzw " << listOf(row["quaternion_xyzw"].get<std::vector<double>>())
            << ", deviations " << listOf({sigmas[0], sigmas[1], sigmas[2]}) << " m "
            << listOf({sigmas[3], sigmas[4], sigmas[5]}) << " deg, component " << row["component"]
            << ", session " << row["session"] << ", submap " << row["submap"] << ", keyframe "
            << row["keyframe"] << " (frame " << row["keyframe_frame"] << "), " << row["inliers"]
            << " of " << row["matches"]
            << (row["kind"] == wordOf(LinkKind::Surface) ? " planes" : " features")
            << ", agreement " << detail::numberText(row["agreement"].get<double>())
            << ", seen through " << detail::numberText(row["seen_through"].get<double>()) << '\n';
}

int localize(const LocalizeArguments& arguments) {
  const AtlasData data = loadAtlas(arguments.atlas, 0);
  const AtlasLocalizer localizer(data);
  SequenceSource source(configurationOf(arguments));
  Json rows = Json::array();
  std::size_t missing = 0;
  std::string why;
  while (std::optional<Frame> frame = source.next()) {
    std::string reason;
    const std::optional<Place> place = placeOf(arguments, localizer, *frame, reason);
    rows.push_back(rowOf(*frame, place, reason, data));
    if (!place && missing++ == 0)
      why = "frame " + std::to_string(frame->number) + " of " + arguments.inputs.front() +
            " is not found: " + reason;
    if (!arguments.json) print(rows.back());
  }
  if (arguments.json) std::cout << rows.dump(2) << '\n';
  if (missing == 0) return kDone;
  std::cerr << "planar_map: " << arguments.atlas << ": " << why;
  if (missing > 1)
    std::cerr << "; in all " << missing << " of " << detail::counted(rows.size(), "frame");
  std::cerr << '\n';
  return kNotFound;
}

}  // namespace

void addLocalizeCommand(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("localize", "Where frames are in the building of an atlas");
  const auto arguments = std::make_shared<LocalizeArguments>();
  command->add_option("atlas", arguments->atlas, "Atlas (*.atlas)")->required();
  command
      ->add_option(
          "input", arguments->inputs,
          "Folder of image pairs, RGB-D images or scans, as of run; its poses are not read")
      ->required();
  command->add_option("--frames", arguments->frames, "N, or A:B:STEP, frames A to B - 1");
  command->add_option("--calib", arguments->calibration,
                      "Calibration (calib.yaml) in place of the folder's");
  addScaleOption(*command, arguments->scale);
  command->add_flag("--json", arguments->json, "For machines");
  command->footer("Exit code 8: the place of a frame was not found.");
  command->callback([arguments, &exit_code]() { exit_code = localize(*arguments); });
}

}  // namespace planar_mapping::tools
