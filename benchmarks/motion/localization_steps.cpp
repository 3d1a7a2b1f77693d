// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Poses that the localizer finds in sequences, against their true ones:
//
//   localization_steps [--every N[,N...]] [--first N] [--clouds] [--verbose] FOLDER...
//
// With --clouds by depth alone, as without images.
// A step leads from a frame to the next one of its submap. It is right within 5 degrees and 10 cm +
// 5 % of the true motion. Prints a row per folder and thinning, and the sum.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/localization/localizer.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/trajectory_error.h"
#include "planar_mapping/pipeline/motion/frame_locator.h"
#include "planar_mapping/stereo/matching/stereo_matcher.h"

namespace {

using namespace planar_mapping;

struct Options {
  std::vector<std::size_t> every = {1, 2, 3, 5, 8};
  std::size_t first = 0;
  bool clouds = false;
  bool verbose = false;
  std::vector<std::string> folders;
};

/// A frame of a sequence, ready to be placed.
struct Input {
  io::Image gray;
  std::vector<float> xyz;
  std::uint32_t width = 0;
  std::uint32_t height = 1;
  Pose truth = Pose::Identity();
};

struct Row {
  std::size_t steps = 0;
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::size_t right_in_largest = 0;
  std::size_t submaps = 0;
  std::size_t keyframes = 0;
  double step_rms = 0.0;
  double turn_rms = 0.0;
  double ate = 0.0;    ///< of the largest submap
  double drift = 0.0;  ///< per cent, likewise
  double ms = 0.0;
  double most_ms = 0.0;
  double chi2 = 0.0;  ///< of right steps to the frame before, mean / 6
};

std::vector<Input> readInputs(const io::Sequence& sequence) {
  std::vector<Input> inputs;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    io::Frame frame = sequence.read(i);
    Input input;
    if (!frame.left.empty()) input.gray = io::toGray(frame.left);
    input.width = static_cast<std::uint32_t>(input.gray.width);
    input.height = static_cast<std::uint32_t>(input.gray.height);
    if (sequence.kind() == io::SequenceKind::Stereo) {
      const DisparityImage disparity =
          StereoMatcher().match(frame.left, frame.right, *sequence.calibration());
      triangulate(disparity, *sequence.calibration(), input.xyz);
    } else {
      input.width = frame.cloud.width;
      input.height = frame.cloud.height;
      input.xyz = std::move(frame.cloud.xyz);
    }
    input.truth = frame.T_world_sensor.value_or(Pose::Identity());
    inputs.push_back(std::move(input));
  }
  return inputs;
}

struct Placed {
  std::size_t frame;
  Localization found;
  Pose truth;
};

/// Counts a step between two frames of a submap.
void judge(const Placed& before, const Placed& now, double ms, bool verbose, Row& row) {
  const Pose true_step = before.truth.inverse() * now.truth;
  const Pose step = before.found.T_submap_camera.inverse() * now.found.T_submap_camera;
  const double metres = (true_step.inverse() * step).translation().norm();
  const double turn = rotationAngle((true_step.inverse() * step).linear());
  const bool right =
      turn <= 5.0 * kRadiansPerDegree && metres <= 0.1 + 0.05 * true_step.translation().norm();
  ++(right ? row.right : row.wrong);
  row.step_rms += metres * metres;
  row.turn_rms += turn * turn;
  if (!verbose) return;
  const PoseEvidence& e = now.found.evidence;
  std::printf(
      "  %zu->%zu %s %.3f m %.2f deg (of %.2f m %.1f deg) in %zu of %zu off %zu agree "
      "%.2f thr %.3f ov %.2f zncc %.2f rival %.2f odds %.2f %.0f ms%s%s\n",
      before.frame, now.frame, right ? "right" : "WRONG", metres, turn / kRadiansPerDegree,
      true_step.translation().norm(), rotationAngle(true_step.linear()) / kRadiansPerDegree,
      e.inliers, e.expected, e.off_plane, e.agreement, e.seen_through, e.overlap, e.correlation,
      e.rival, e.log_odds, ms, now.found.is_keyframe ? " key" : "",
      now.found.begins_submap ? " joined a step later" : "");
}

PointsView cloudOf(const Input& input) {
  return {input.xyz.data(), input.width, input.height, 3};
}

using Locate = std::function<Localization(const Input&)>;

Locate byImages(const io::Calibration& calibration) {
  LocalizerParams params;
  if (calibration.baseline)
    params.noise = SensorNoise::ofPair(calibration.camera.fx, *calibration.baseline);
  const auto localizer = std::make_shared<Localizer>(params);
  return [localizer, calibration](const Input& input) {
    LocalizerFrame frame;
    frame.gray = input.gray;
    frame.cloud = cloudOf(input);
    frame.camera = calibration.camera;
    return localizer->locate(frame);
  };
}

/// \param first  sets the cells, as a run does
Locate byClouds(const Input& first, bool is_camera) {
  const auto locator = std::make_shared<detail::CloudLocator>(surfaceParamsFor(
      cloudOf(first), is_camera ? SurfaceMapParams() : SurfaceMapParams::ofScanner()));
  return [locator, is_camera](const Input& input) {
    return locator->locate(cloudOf(input), is_camera, std::nullopt, Matrix6::Zero(),
                           []() { return Pose(Pose::Identity()); });
  };
}

Row measure(const std::vector<Input>& inputs, const Locate& locate, std::size_t first,
            std::size_t every, bool verbose) {
  std::map<std::size_t, std::vector<Placed>> submaps;
  Row row;
  std::size_t frames = 0;
  for (std::size_t i = first; i < inputs.size(); i += every) {
    const Input& input = inputs[i];
    const std::clock_t start = std::clock();
    const Localization found = locate(input);
    const double ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    row.ms += ms;
    row.most_ms = std::max(row.most_ms, ms);
    row.keyframes += found.is_keyframe ? 1 : 0;
    std::vector<Placed>& placed = submaps[found.submap];
    if (found.joined) {
      for (Placed& one : submaps[found.joined->submap]) {
        one.found.T_submap_camera = found.joined->T_other_submap * one.found.T_submap_camera;
        if (!placed.empty() && one.frame == submaps[found.joined->submap].front().frame)
          judge(placed.back(), one, 0.0, verbose, row);
        placed.push_back(one);
      }
      submaps.erase(found.joined->submap);
    }
    const Placed now{frames, found, input.truth};
    if (!placed.empty()) {
      judge(placed.back(), now, ms, verbose, row);
    } else if (verbose) {
      const PoseEvidence& e = found.evidence;
      std::printf(
          "  %zu begins submap %zu in %zu of %zu off %zu agree %.2f thr %.3f ov %.2f zncc "
          "%.2f rival %.2f odds %.2f\n",
          frames, found.submap, e.inliers, e.expected, e.off_plane, e.agreement, e.seen_through,
          e.overlap, e.correlation, e.rival, e.log_odds);
    }
    placed.push_back(now);
    ++frames;
  }
  row.steps = frames - 1;
  row.submaps = submaps.size();
  row.ms /= static_cast<double>(frames);
  const double counted = std::max<double>(1.0, double(row.right + row.wrong));
  row.step_rms = std::sqrt(row.step_rms / counted);
  row.turn_rms = std::sqrt(row.turn_rms / counted) / kRadiansPerDegree;
  const auto largest = std::max_element(
      submaps.begin(), submaps.end(),
      [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  std::vector<Pose> estimate, reference;
  for (const Placed& placed : largest->second) {
    estimate.push_back(placed.found.T_submap_camera);
    reference.push_back(placed.truth);
  }
  row.right_in_largest = estimate.size() - 1;
  const TrajectoryError error = trajectoryError(estimate, reference);
  row.ate = error.absolute_rms;
  row.drift = error.endDriftPercent();
  return row;
}

Options optionsOf(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--verbose") == 0) {
      options.verbose = true;
    } else if (std::strcmp(argv[i], "--clouds") == 0) {
      options.clouds = true;
    } else if (std::strcmp(argv[i], "--first") == 0 && i + 1 < argc) {
      options.first = static_cast<std::size_t>(std::max(0, std::atoi(argv[++i])));
    } else if (std::strcmp(argv[i], "--every") == 0 && i + 1 < argc) {
      options.every.clear();
      std::istringstream list(argv[++i]);
      for (std::string word; std::getline(list, word, ',');)
        options.every.push_back(static_cast<std::size_t>(std::max(1, std::atoi(word.c_str()))));
    } else {
      options.folders.emplace_back(argv[i]);
    }
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Options options = optionsOf(argc, argv);
    std::printf("%-24s %5s %5s %5s %5s %7s %7s %5s %8s %7s %7s %7s %6s %6s\n", "sequence", "every",
                "steps", "right", "wrong", "largest", "submaps", "keys", "rms mm", "rms deg",
                "ATE mm", "drift %", "ms", "most");
    std::size_t steps = 0, right = 0, wrong = 0;
    for (const std::string& folder : options.folders) {
      io::SequenceOptions reading;
      const io::Sequence sequence({folder}, reading);
      const std::vector<Input> inputs = readInputs(sequence);
      std::string name = folder;
      while (!name.empty() && name.back() == '/') name.pop_back();
      name = name.substr(name.find_last_of('/') + 1);
      std::size_t folder_right = 0, folder_steps = 0, folder_wrong = 0;
      for (const std::size_t every : options.every) {
        const bool is_camera = sequence.calibration().has_value();
        const Locate locate = options.clouds ? byClouds(inputs.at(options.first), is_camera)
                                             : byImages(*sequence.calibration());
        const Row row = measure(inputs, locate, options.first, every, options.verbose);
        std::printf(
            "%-24s %5zu %5zu %5zu %5zu %7zu %7zu %5zu %8.1f %7.2f %7.1f %7.2f %6.1f %6.1f\n",
            name.c_str(), every, row.steps, row.right, row.wrong, row.right_in_largest, row.submaps,
            row.keyframes, 1e3 * row.step_rms, row.turn_rms, 1e3 * row.ate, row.drift, row.ms,
            row.most_ms);
        std::fflush(stdout);
        folder_steps += row.steps;
        folder_right += row.right;
        folder_wrong += row.wrong;
      }
      std::printf("%-24s   all %5zu %5zu %5zu\n", name.c_str(), folder_steps, folder_right,
                  folder_wrong);
      steps += folder_steps;
      right += folder_right;
      wrong += folder_wrong;
    }
    std::printf("%-24s   all %5zu %5zu %5zu\n", "all", steps, right, wrong);
  } catch (const Error& error) {
    std::fprintf(stderr, "localization_steps: %s\n", error.what());
    return 1;
  }
  return 0;
}
