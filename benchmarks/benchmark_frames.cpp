// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// Time of the stages after the front-end, with one thread and with all cores.
//
//   benchmark_frames CONFIG SEQUENCE [ROUNDS [KEY=VALUE...]]
//
// The front-end runs once; its frames are then mapped ROUNDS times (5) with each number of threads
// in turn, each time from an empty map. Prints for each stage the median over the frames of the
// least time of a frame, by the clock and of the processors (on a busy machine with one thread the
// one to trust), and a fingerprint of the map, which is the same for any number of threads.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/parallel.h"
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

double processorMilliseconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// A stage and what the processors spend on it.
class TimedStage : public Stage {
 public:
  TimedStage(std::unique_ptr<Stage> stage, double& ms) : stage_(std::move(stage)), ms_(ms) {}
  void declare(ParameterTable&) override {}
  void adapt(const CloudScale& scale) override { stage_->adapt(scale); }
  void limit(CloudScale& scale) const override { stage_->limit(scale); }
  void configureMap(PlanarMapParams& params) const override { stage_->configureMap(params); }
  void process(Frame& frame) override {
    const double start = processorMilliseconds();
    stage_->process(frame);
    ms_ = processorMilliseconds() - start;
  }

 private:
  std::unique_ptr<Stage> stage_;
  double& ms_;
};

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
  std::vector<std::vector<double>> clock;
  std::vector<std::vector<double>> processors;
  std::size_t bytes = 0;
  std::uint64_t fingerprint = 0;

  Times(std::vector<std::string> names, std::size_t frames)
      : rows(std::move(names)),
        clock(rows.size(), std::vector<double>(frames, 1e9)),
        processors(clock) {}
};

void takeLeast(double& least, double value) {
  least = std::min(least, value);
}

/// One round from an empty map.
void mapFrames(const Request& request, const std::vector<Frame>& frames, int threads,
               Times& times) {
  Configuration configuration = request.configuration(threads);
  std::vector<double> spent(configuration.stages.size(), 0.0);
  for (std::size_t i = 0; i < spent.size(); ++i) {
    std::unique_ptr<Stage>& stage = configuration.stages[i].stage;
    stage = std::make_unique<TimedStage>(std::move(stage), spent[i]);
  }
  Pipeline pipeline(std::move(configuration));
  const std::vector<ConfiguredStage>& stages = pipeline.configuration().stages;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    Frame frame = frames[f];
    frame.cloud = FrameCloud::Ptr(new FrameCloud(*frames[f].cloud));
    frame.stage_ms.clear();
    std::fill(spent.begin(), spent.end(), 0.0);
    const double start = processorMilliseconds();
    const FrameReport report = pipeline.process(frame);
    double between[2] = {report.frame_ms, processorMilliseconds() - start};
    double after[2] = {between[0], between[1]};
    for (std::size_t i = 0; i < stages.size(); ++i) {
      takeLeast(times.clock[i][f], report.stage_ms[i]);
      takeLeast(times.processors[i][f], spent[i]);
      const double ms[2] = {report.stage_ms[i], spent[i]};
      for (int k = 0; k < 2; ++k) {
        between[k] -= ms[k];
        if (stages[i].kind == StageKind::Motion) after[k] -= ms[k];
      }
    }
    takeLeast(times.clock[stages.size()][f], between[0]);
    takeLeast(times.processors[stages.size()][f], between[1]);
    takeLeast(times.clock[stages.size() + 1][f], after[0]);
    takeLeast(times.processors[stages.size() + 1][f], after[1]);
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
  std::vector<std::string> rows;
  for (const ConfiguredStage& stage : request.configuration(1).stages) rows.push_back(stage.name);
  rows.insert(rows.end(), {"between the stages", "after the motion"});
  Times one(rows, frames.size());
  Times several(rows, frames.size());
  for (int round = 0; round < request.rounds; ++round) {
    mapFrames(request, frames, 1, one);
    mapFrames(request, frames, all, several);
  }
  std::printf("%zu frames, %d rounds, median of the least times, ms\n", frames.size(),
              request.rounds);
  std::printf("%-28s %10s %10s %10s %10s\n", "threads", "1", "processor",
              std::to_string(all).c_str(), "processors");
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (!(median(one.processors[row]) > 0.0)) continue;  // of the front-end
    std::printf("%-28s %10.2f %10.2f %10.2f %10.2f\n", rows[row].c_str(), median(one.clock[row]),
                median(one.processors[row]), median(several.clock[row]),
                median(several.processors[row]));
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
