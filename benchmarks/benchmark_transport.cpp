// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// What it costs to take frames of 640 x 480 from a front-end to the mapping side: bytes and time,
// on the five depth frames of shared/data where they are, else on a simulated wall. Figures of
// docs/dev/front_end_protocol.md.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "../tests/unit/transport/transport_session.h"
#include "planar_mapping/pipeline/sequence_source.h"

namespace planar_mapping::transport {
namespace {

constexpr std::uint64_t kFramesSent = 50;

/// Four frames, with 300 key features each.
const std::vector<Frame>& frames() {
  static const std::vector<Frame> result = []() {
    const std::string folder = PLANAR_MAPPING_SOURCE_DIR "/../shared/data/rgbd_tum_cabinet";
    std::vector<Frame> read;
    if (std::filesystem::exists(folder)) {
      Configuration configuration;
      configuration.inputs = {folder};
      configuration.frames.last = 4;
      SequenceSource source(configuration);
      while (std::optional<Frame> frame = source.next()) read.push_back(std::move(*frame));
    }
    for (std::uint64_t i = 1; read.size() < 4; ++i) read.push_back(transportFrame(640, 480, i));
    for (Frame& frame : read) {
      KeyFeature feature;
      feature.track = 1;
      frame.key_features.assign(300, feature);
    }
    return read;
  }();
  return result;
}

/// A front-end that has its frames ready, and a mapping side that does nothing with them.
void overLoopback(benchmark::State& state, CloudEncoding encoding, bool with_keys) {
  class Source : public FrameSource {
   public:
    std::vector<std::string> names() const override { return {"benchmark"}; }
    io::SequenceKind kind() const override { return io::SequenceKind::Rgbd; }
    io::PoseSource poseSource() const override { return io::PoseSource::File; }
    std::optional<std::size_t> size() const override { return kFramesSent; }
    std::optional<Frame> next() override {
      if (position_ == kFramesSent) return std::nullopt;
      return frames()[position_++ % 4];
    }

   private:
    std::uint64_t position_ = 0;
  };
  frames();
  double bytes = 0.0;
  for (auto _ : state) {
    ListenerOptions listening = listenerOptions();
    FrontEndOptions options = frontEndOptions();
    options.encoding = encoding;
    if (with_keys) {
      listening.keys = makeKeys();
      options.keys = makeKeys();
      listening.keys.peers = {options.keys.public_key};
      options.keys.peers = {listening.keys.public_key};
    }
    FrameListener listener({"127.0.0.1", 0}, listening);
    auto sender = std::async(std::launch::async, [&]() {
      return runFrontEnd(
          listener.endpoint(), [](const std::string&) { return std::make_unique<Source>(); },
          options);
    });
    (void)listener.kind();
    const auto start = std::chrono::steady_clock::now();
    while (listener.next()) continue;
    listener.confirm();
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(passed.count() / kFramesSent);
    bytes += static_cast<double>(sender.get().bytes_sent) / kFramesSent;
  }
  state.counters["bytes"] = benchmark::Counter(bytes, benchmark::Counter::kAvgIterations);
}

void fiveSessions(benchmark::internal::Benchmark* benchmark) {
  benchmark->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(5);
}

BENCHMARK_CAPTURE(overLoopback, raw, CloudEncoding::Raw, false)->Apply(fiveSessions);
BENCHMARK_CAPTURE(overLoopback, raw_with_keys, CloudEncoding::Raw, true)->Apply(fiveSessions);
BENCHMARK_CAPTURE(overLoopback, compact, CloudEncoding::Compact, false)->Apply(fiveSessions);
BENCHMARK_CAPTURE(overLoopback, compact_with_keys, CloudEncoding::Compact, true)
    ->Apply(fiveSessions);

}  // namespace
}  // namespace planar_mapping::transport

BENCHMARK_MAIN();
