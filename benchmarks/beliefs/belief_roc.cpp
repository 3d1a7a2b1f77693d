// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// How well beliefs tell wrong matches of key features from right ones, by the rule of their update.
//
//   belief_roc CONFIG SEQUENCE [STEP [KEY=VALUE...]]
//
// SEQUENCE has true poses and true depth: rendered RGB-D, or what `planar_map simulate --write
// images` writes, with depth_gt/. Every STEP-th frame is taken. A match is wrong where the point
// that was seen before, carried over by true depth and pose, lies more than 3 px from the feature,
// or, of stereo pairs, the measured depth is off by more than three depth errors. Prints for each
// rule the area under the ROC curve of the belief after the match, and the fraction of right
// matches above the belief at which a tenth, or a fifth, of the wrong ones are kept. Equal beliefs
// count as if in random order.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/beliefs/kl_occupancy.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace {

using namespace planar_mapping;

constexpr double kWrong = 3.0;          ///< pixels, or depth errors
constexpr double kTruthScale = 1000.0;  ///< of depth_gt, units a metre

/// A belief after a match, and whether that was right.
using Verdict = std::pair<double, bool>;

/// Points of the curve: wrong and right matches kept, as fractions, from none to all.
std::vector<std::pair<double, double>> rocCurve(std::vector<Verdict> verdicts) {
  std::sort(verdicts.begin(), verdicts.end(),
            [](const Verdict& a, const Verdict& b) { return a.first > b.first; });
  const auto right = static_cast<double>(
      std::count_if(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.second; }));
  const double wrong = static_cast<double>(verdicts.size()) - right;
  std::vector<std::pair<double, double>> curve = {{0.0, 0.0}};
  double kept[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    kept[verdicts[i].second ? 1 : 0] += 1.0;
    if (i + 1 < verdicts.size() && verdicts[i + 1].first == verdicts[i].first) continue;
    curve.emplace_back(kept[0] / wrong, kept[1] / right);
  }
  return curve;
}

double areaOf(const std::vector<std::pair<double, double>>& curve) {
  double area = 0.0;
  for (std::size_t i = 1; i < curve.size(); ++i) {
    area += 0.5 * (curve[i].second + curve[i - 1].second) * (curve[i].first - curve[i - 1].first);
  }
  return area;
}

double rightKept(const std::vector<std::pair<double, double>>& curve, double wrong_kept) {
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const auto [x0, y0] = curve[i - 1];
    const auto [x1, y1] = curve[i];
    if (x1 > wrong_kept) return y0 + (y1 - y0) * (wrong_kept - x0) / (x1 - x0);
  }
  return 1.0;
}

/// A rule of the update with what it believes.
struct Rule {
  const char* name;
  KlOccupancy beliefs;
  std::vector<Verdict> verdicts;
};

Rule ruleOf(const char* name, UpdateRule update, const StereoNoise& noise,
            MotionReading reading = MotionReading::FeaturePosition) {
  KlOccupancyParams params;
  params.source = FeatureSource::Tracks;
  params.beliefs.update.rule = update;
  params.beliefs.motion_reading = reading;
  params.beliefs.occupancy.noise = noise;
  return {name, KlOccupancy(params), {}};
}

/// Where a feature was last seen.
struct Sighting {
  Pose T_world_sensor;  ///< true
  Pose T_map_sensor;    ///< as the motion found it
  Vector3 position;     ///< as measured
  Matrix6 covariance;   ///< of the motion up to then
  Vector3 truth;
};

/// The true depth at the feature: of the pixels about it the one next to what was measured, since
/// at an edge a fraction of a pixel decides. What was measured where there is no truth beside it.
double trueDepth(const io::DepthImage& truth, const KeyFeature& feature) {
  const double measured = feature.position.z();
  const auto column = static_cast<int>(std::lround(feature.column));
  const auto row = static_cast<int>(std::lround(feature.row));
  double best = truth.values.empty() ? measured : 1e9;
  for (int r = row - 1; r <= row + 1; ++r) {
    for (int c = column - 1; c <= column + 1; ++c) {
      if (r < 0 || c < 0 || r >= static_cast<int>(truth.height) ||
          c >= static_cast<int>(truth.width))
        continue;
      const double depth =
          truth.values[static_cast<std::size_t>(r) * truth.width + static_cast<std::size_t>(c)] /
          kTruthScale;
      if (depth > 0.0 && std::abs(depth - measured) < std::abs(best - measured)) best = depth;
    }
  }
  return best;
}

int run(const std::string& config, const std::string& sequence, int step,
        const std::vector<std::string>& assignments) {
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments = assignments;
  Configuration configuration = loadConfiguration(config, table, overrides);
  configuration.inputs = {sequence};
  configuration.frames.step = step;
  SequenceSource source(configuration);
  Pipeline pipeline(std::move(configuration));
  std::vector<Rule> rules;
  std::vector<Verdict> by_motion;    // Eq. 9 of this match alone
  std::vector<Verdict> by_sighting;  // and Eq. 4 of this sighting
  std::map<std::int64_t, Sighting> seen;
  Matrix6 covariance = Matrix6::Zero();
  StereoNoise noise;
  std::size_t wrong = 0;
  std::size_t frames = 0;
  while (std::optional<Frame> frame = source.next()) {
    pipeline.process(*frame);
    if (!frame->skip_reason.empty() || !frame->camera || !frame->given_pose) continue;
    ++frames;
    const PinholeCamera& camera = *frame->camera;
    if (rules.empty()) {
      noise.focal_length = camera.fx;
      noise.baseline = frame->baseline.value_or(noise.baseline);
      rules.push_back(ruleOf("kl", UpdateRule::KullbackLeibler, noise));
      rules.push_back(
          ruleOf("kl, pose", UpdateRule::KullbackLeibler, noise, MotionReading::RobotPose));
      rules.push_back(ruleOf("log-odds", UpdateRule::LogOdds, noise));
      rules.push_back(ruleOf("none", UpdateRule::None, noise));
    }
    char name[32];
    std::snprintf(name, sizeof name, "/depth_gt/%06zu.png", frame->number);
    io::DepthImage truth;
    if (std::filesystem::exists(sequence + name)) truth = io::readDepthPng(sequence + name);
    std::vector<std::int32_t> labels(frame->cloud->size(), -1);
    for (std::size_t k = 0; k < frame->planes.size(); ++k)
      for (const int i : frame->planes[k].inliers)
        labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(k);
    OccupancyFrame view;
    view.points = pointsOf(*frame->cloud);
    view.indices = &frame->indices;
    view.plane_labels = &labels;
    view.T_world_sensor = frame->T_world_sensor;
    view.key_features = &frame->key_features;
    view.motion = frame->motion;
    if (frame->motion) covariance += frame->motion->covariance;
    for (Rule& rule : rules) {
      std::vector<float> probability;
      rule.beliefs.update(view, probability);
    }
    const OccupancyParams& occupancy = rules.front().beliefs.params().beliefs.occupancy;
    for (const KeyFeature& feature : frame->key_features) {
      if (feature.track < 0 || !feature.position.allFinite() || !(feature.position.z() > 0.0))
        continue;
      const double depth = trueDepth(truth, feature);
      const Sighting now{*frame->given_pose, frame->T_world_sensor, feature.position, covariance,
                         feature.position * (depth / feature.position.z())};
      const auto [place, is_new] = seen.try_emplace(feature.track, now);
      if (is_new) continue;
      const Sighting before = std::exchange(place->second, now);
      const Vector3 carried = now.T_world_sensor.inverse() * before.T_world_sensor * before.truth;
      if (!(carried.z() > 0.0)) continue;
      const double column = camera.fx * carried.x() / carried.z() + camera.cx;
      const double row = camera.fy * carried.y() / carried.z() + camera.cy;
      const double off = std::hypot(column - static_cast<double>(feature.column),
                                    row - static_cast<double>(feature.row));
      const bool right = off <= kWrong &&
                         std::abs(feature.position.z() - depth) <= kWrong * noise.depthError(depth);
      wrong += right ? 0 : 1;
      for (Rule& rule : rules)
        rule.verdicts.emplace_back(rule.beliefs.tracks().belief(feature.track).value_or(0.0),
                                   right);
      const double factor = featureMotionFactor(now.position, before.position,
                                                now.T_map_sensor.inverse() * before.T_map_sensor,
                                                now.covariance - before.covariance, occupancy);
      by_motion.emplace_back(factor, right);
      by_sighting.emplace_back(factor * rules.back().verdicts.back().first, right);
    }
  }
  std::printf("%zu frames, %zu matches, %zu wrong\n", frames, by_motion.size(), wrong);
  if (wrong == 0 || wrong == by_motion.size()) return 0;
  std::printf("%-28s %8s %12s %12s\n", "belief", "area", "right at .1", "right at .2");
  const auto print = [](const char* name, const std::vector<Verdict>& verdicts) {
    const auto curve = rocCurve(verdicts);
    std::printf("%-28s %8.3f %12.3f %12.3f\n", name, areaOf(curve), rightKept(curve, 0.1),
                rightKept(curve, 0.2));
  };
  for (const Rule& rule : rules) print(rule.name, rule.verdicts);
  print("Eq. 9 of the match alone", by_motion);
  print("Eq. 4 and 9, no memory", by_sighting);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: belief_roc CONFIG SEQUENCE [STEP [KEY=VALUE...]]\n");
    return 2;
  }
  try {
    return run(argv[1], argv[2], argc > 3 ? std::max(1, std::atoi(argv[3])) : 1,
               {argv + std::min(argc, 4), argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "belief_roc: %s\n", error.what());
    return 1;
  }
}
