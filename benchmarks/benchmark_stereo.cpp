// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The steps of the stereo front-end, each by itself and together as a frame of a sequence.
//
//   benchmark_stereo [folder of a stereo sequence]     default: a made pair of 640 x 480 pixels
#include <benchmark/benchmark.h>

#include <filesystem>
#include <string>
#include <vector>

#include "planar_mapping/stereo/features/feature_tracker.h"
#include "planar_mapping/stereo/matching/stereo_matcher.h"
#include "planar_mapping/stereo/rectification.h"
#include "stereo_images.h"

namespace {

using namespace planar_mapping;

struct Input {
  std::vector<ImagePair> pairs;
  io::Calibration calibration;
};

Input& input() {
  static Input data;
  return data;
}

void readInput(const std::string& folder) {
  Input& data = input();
  if (folder.empty()) {
    data.calibration = pairCalibration(640, 480);
    for (const double shift : {0.0, 3.7})
      data.pairs.push_back(pairOf(Pattern(1), {12.0, 0.0, 0.1}, 640, 480, shift));
    return;
  }
  data.calibration = io::readCalibration(folder + "/calib.yaml");
  for (const char* number : {"000000", "000001"}) {
    for (const char* extension : {".png", ".jpg"}) {
      const std::string name = std::string("/") + number + extension;
      if (!std::filesystem::exists(folder + "/left" + name)) continue;
      data.pairs.push_back(
          {io::readImage(folder + "/left" + name), io::readImage(folder + "/right" + name)});
    }
  }
}

void Matching(benchmark::State& state) {
  StereoMatcherParams params;
  params.threads = static_cast<int>(state.range(0));
  const StereoMatcher matcher(params);
  const ImagePair& pair = input().pairs.front();
  StereoReport report;
  for (auto _ : state) {
    benchmark::DoNotOptimize(matcher.match(pair.left, pair.right, input().calibration, &report));
  }
  state.counters["disparities"] = report.disparities;
  state.counters["density"] = report.density;
  state.counters["range_ms"] = report.range_ms;
  state.counters["match_ms"] = report.match_ms;
  state.counters["refine_ms"] = report.refine_ms;
}

void runFeatures(benchmark::State& state, FeatureDetector detector) {
  FeatureTrackerParams params;
  params.detector = detector;
  params.threads = static_cast<int>(state.range(0));
  FeatureTracker tracker(params);
  std::size_t frame = 0;
  for (auto _ : state) {
    const ImagePair& pair = input().pairs[frame++ % input().pairs.size()];
    benchmark::DoNotOptimize(tracker.track(pair.left, pair.right, input().calibration));
  }
  const FeatureReport& report = tracker.report();
  state.counters["features"] = static_cast<double>(report.features_left);
  state.counters["stereo"] = static_cast<double>(report.stereo_matches);
  state.counters["tracked"] = static_cast<double>(report.tracked);
  state.counters["detect_ms"] = report.detect_ms;
  state.counters["stereo_ms"] = report.stereo_ms;
  state.counters["track_ms"] = report.track_ms;
}

void Sift(benchmark::State& state) {
  runFeatures(state, FeatureDetector::Sift);
}
void Orb(benchmark::State& state) {
  runFeatures(state, FeatureDetector::Orb);
}
void FrontEnd(benchmark::State& state) {
  StereoMatcherParams matching;
  FeatureTrackerParams tracking;
  matching.threads = tracking.threads = static_cast<int>(state.range(0));
  const StereoMatcher matcher(matching);
  FeatureTracker tracker(tracking);
  std::vector<float> xyz;
  std::size_t frame = 0;
  for (auto _ : state) {
    const ImagePair& pair = input().pairs[frame++ % input().pairs.size()];
    tracker.begin(pair.left);
    const DisparityImage disparity = matcher.match(pair.left, pair.right, input().calibration);
    triangulate(disparity, input().calibration, xyz);
    const PointsView cloud(xyz.data(), static_cast<std::uint32_t>(disparity.width),
                           static_cast<std::uint32_t>(disparity.height), 3);
    benchmark::DoNotOptimize(tracker.track(pair.left, pair.right, input().calibration, cloud));
  }
}

BENCHMARK(Matching)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(Sift)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(Orb)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(FrontEnd)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  readInput(argc > 1 ? argv[1] : "");
  if (input().pairs.empty()) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
