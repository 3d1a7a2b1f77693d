// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// Time of the stages after the front-end, with one thread and with all cores.
//
//   benchmark_frames CONFIG SEQUENCE [ROUNDS [KEY=VALUE...]]
//
// The front-end runs once; its frames are then mapped ROUNDS times (5) with each number of threads
// in turn, each time from an empty map. Prints for each stage the median over the frames of the
// least time of a frame, and a fingerprint of the map, which is the same for any number of threads.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/core/error.h"
#include "planar_mapping/core/parallel.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace {

using namespace planar_mapping;

/// What is asked for on the command line.
struct Request {
  std::string config;
  std::string sequence;
  int rounds = 5;
  std::vector<std::string> assignments;

  Configuration configuration(int threads) const {
    StageTable table;
    registerBuiltinStages(table);
    ConfigurationOverrides overrides;
    overrides.assignments = assignments;
    overrides.assignments.push_back("threads=" + std::to_string(threads));
    Configuration loaded = loadConfiguration(config, table, overrides);
    loaded.inputs = {sequence};
    return loaded;
  }
};

/// Frames as the front-end leaves them.
std::vector<Frame> seenFrames(const Request& request) {
  Configuration configuration = request.configuration(resolveThreads(0));
  SequenceSource source(configuration);
  Pipeline pipeline(std::move(configuration));
  std::vector<Frame> frames;
  while (std::optional<Frame> frame = source.next()) {
    pipeline.processFrontEnd(*frame);
    frame->images = FrameImages();
    frames.push_back(std::move(*frame));
  }
  return frames;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Least times of each frame over the rounds, by row of the table: the stages, what is between
/// them, and the sum of what comes after the motion.
struct Times {
  std::vector<std::string> rows;
  std::vector<std::vector<double>> ms;
  std::size_t bytes = 0;
  std::uint64_t fingerprint = 0;

  void add(std::size_t row, std::size_t frame, double value) {
    ms.resize(rows.size());
    ms[row].resize(std::max(ms[row].size(), frame + 1), 1e9);
    ms[row][frame] = std::min(ms[row][frame], value);
  }
};

/// One round from an empty map.
void mapFrames(const Request& request, const std::vector<Frame>& frames, int threads,
               Times& times) {
  Pipeline pipeline(request.configuration(threads));
  const std::vector<ConfiguredStage>& stages = pipeline.configuration().stages;
  times.rows.clear();
  for (const ConfiguredStage& stage : stages) times.rows.push_back(stage.name);
  times.rows.insert(times.rows.end(), {"between the stages", "after the motion"});
  for (std::size_t f = 0; f < frames.size(); ++f) {
    Frame frame = frames[f];
    frame.cloud = FrameCloud::Ptr(new FrameCloud(*frames[f].cloud));
    frame.stage_ms.clear();
    const FrameReport report = pipeline.process(frame);
    double motion = 0.0;
    double between = report.frame_ms;
    for (std::size_t i = 0; i < stages.size(); ++i) {
      times.add(i, f, report.stage_ms[i]);
      between -= report.stage_ms[i];
      if (stages[i].kind == StageKind::Motion) motion += report.stage_ms[i];
    }
    times.add(stages.size(), f, between);
    times.add(stages.size() + 1, f, report.frame_ms - motion);
  }
  const std::vector<std::uint8_t> bytes = pipeline.map().serialize();
  times.bytes = bytes.size();
  times.fingerprint = 0xCBF29CE484222325ULL;  // FNV-1a
  for (const std::uint8_t byte : bytes) {
    times.fingerprint = (times.fingerprint ^ byte) * 0x100000001B3ULL;
  }
}

int run(const Request& request) {
  const std::vector<Frame> frames = seenFrames(request);
  const int all = resolveThreads(0);
  Times one, several;
  for (int round = 0; round < request.rounds; ++round) {
    mapFrames(request, frames, 1, one);
    mapFrames(request, frames, all, several);
  }
  std::printf("%zu frames, %d rounds, median of the least times, ms\n", frames.size(),
              request.rounds);
  std::printf("%-28s %10s %7d threads\n", "", "1 thread", all);
  for (std::size_t row = 0; row < one.rows.size(); ++row) {
    const double ms = median(one.ms[row]);
    if (ms > 0.0) {
      std::printf("%-28s %10.2f %10.2f\n", one.rows[row].c_str(), ms, median(several.ms[row]));
    }
  }
  std::printf("map: %zu bytes, %016llx and %016llx\n", one.bytes,
              static_cast<unsigned long long>(one.fingerprint),
              static_cast<unsigned long long>(several.fingerprint));
  return one.fingerprint == several.fingerprint ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: benchmark_frames CONFIG SEQUENCE [ROUNDS [KEY=VALUE...]]\n");
    return 2;
  }
  Request request;
  request.config = argv[1];
  request.sequence = argv[2];
  if (argc > 3) request.rounds = std::max(1, std::atoi(argv[3]));
  request.assignments.assign(argv + std::min(argc, 4), argv + argc);
  try {
    return run(request);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "benchmark_frames: %s\n", error.what());
    return 1;
  }
}
