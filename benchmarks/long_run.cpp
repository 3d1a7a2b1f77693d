// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// A long simulated run through all mapping stages, without files: does the time of a frame stay
// flat while the map grows, and the map small?
//
//   long_run CONFIG corridor|standing [FRAMES [WIDTH [NOISE_PX [KEY=VALUE...]]]]
//
// corridor: 100 m along, turned by 20 degrees against the grid; standing: every frame from one
// place. The clouds have WIDTH x 3/4 WIDTH pixels, 320 x 240 by default, lest 1000 frames take
// minutes, and the depth error that NOISE_PX, 0.5 by default, are at a width of 640; the poses are
// given. Prints a line for each tenth.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "pipeline_frames.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace {

using namespace planar_mapping;

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double medianOf(const std::vector<double>& ms, std::size_t begin, std::size_t end) {
  end = std::min(end, ms.size());
  if (begin >= end) return 0.0;
  return median({ms.begin() + static_cast<std::ptrdiff_t>(begin),
                 ms.begin() + static_cast<std::ptrdiff_t>(end)});
}

int run(const std::string& configuration, bool standing, int frames, int width, double noise_px,
        const std::vector<std::string>& assignments) {
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments = assignments;
  Pipeline pipeline(loadConfiguration(configuration, table, overrides));
  test::SimulatedCorridor corridor;
  corridor.standing = standing;
  corridor.frames = frames;
  corridor.width = width;
  corridor.noise_px = noise_px;
  const evaluation::Simulation simulation(corridor.params());
  std::vector<double> ms;
  std::size_t first_bytes = 0;
  std::size_t skipped = 0;
  std::printf("%7s %8s %8s %12s %12s %12s\n", "frame", "planes", "cuboids", "memory, B", "file, B",
              "median, ms");
  const std::size_t tenth = std::max<std::size_t>(1, simulation.size() / 10);
  for (std::size_t i = 0; i < simulation.size(); ++i) {
    Frame frame = test::simulatedFrame(simulation, i);
    const FrameReport report = pipeline.process(frame);
    skipped += report.skip_reason.empty() ? 0 : 1;
    ms.push_back(report.frame_ms);
    if (first_bytes == 0) first_bytes = pipeline.map().memoryBytes();
    if ((i + 1) % tenth != 0) continue;
    std::printf("%7zu %8zu %8zu %12zu %12zu %12.2f\n", i + 1, pipeline.map().planes().size(),
                report.cuboids, pipeline.map().memoryBytes(), pipeline.map().serialize().size(),
                medianOf(ms, i + 1 - tenth, i + 1));
    std::fflush(stdout);
  }
  const double early = medianOf(ms, 100, 200);
  const double late = medianOf(ms, ms.size() > 100 ? ms.size() - 100 : 0, ms.size());
  std::printf("median of frames 100-200 %.2f ms, of the last 100 %.2f ms", early, late);
  if (early > 0.0) std::printf(": %.2f times", late / early);
  std::printf("; memory after the first frame %zu B, after the last %zu B; %zu frames skipped\n",
              first_bytes, pipeline.map().memoryBytes(), skipped);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const bool known =
      argc >= 3 && (std::strcmp(argv[2], "corridor") == 0 || std::strcmp(argv[2], "standing") == 0);
  if (!known) {
    std::fprintf(
        stderr,
        "usage: long_run CONFIG corridor|standing [FRAMES [WIDTH [NOISE_PX [KEY=VALUE...]]]]\n");
    return 2;
  }
  try {
    return run(argv[1], std::strcmp(argv[2], "standing") == 0, argc > 3 ? std::atoi(argv[3]) : 1000,
               argc > 4 ? std::atoi(argv[4]) : 320, argc > 5 ? std::atof(argv[5]) : 0.5,
               {argv + std::min(argc, 6), argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "long_run: %s\n", error.what());
    return 1;
  }
}
