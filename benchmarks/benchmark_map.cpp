// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Frames into a map, beside OctoMap on the same frames in the same run. The real sequence is read
// from ../shared/data beside the sources; without it only the generated room is timed.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/core/multi_plane.h"
#include "planar_mapping/core/random.h"
#include "planar_mapping/io/sequence.h"
#include "planar_mapping/map/planar_map.h"

#ifdef PLANAR_MAPPING_HAS_OCTOMAP
#include <octomap/octomap.h>
#endif

namespace {

using namespace planar_mapping;

struct BenchmarkFrame {
  std::vector<float> xyz;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  Pose pose = Pose::Identity();
  PinholeCamera camera;
  std::vector<PlaneSegment> planes;

  PointsView view() const { return {xyz.data(), width, height, 3}; }
  FrameObservation observation() const {
    FrameObservation frame;
    frame.T_world_sensor = pose;
    frame.points = view();
    frame.planes = &planes;
    frame.camera = camera;
    return frame;
  }
};

MultiPlaneParams segmentationParams() {
  MultiPlaneParams params;
  params.min_inliers = 1000;
  return params;
}

const std::vector<BenchmarkFrame>& frames(const std::string& source) {
  static std::vector<std::pair<std::string, std::vector<BenchmarkFrame>>> all;
  for (const auto& [name, loaded] : all) {
    if (name == source) return loaded;
  }
  std::vector<BenchmarkFrame> loaded;
  if (source == "room") {
    test::Scene scene;
    scene.camera = {500.0, 500.0, 319.5, 239.5, 640, 480};
    for (int i = 0; i < 5; ++i) {
      const test::View view = test::look(scene, test::lookFrom({-0.4 + 0.2 * i, 0.0, 1.0}));
      loaded.push_back({view.xyz, 640, 480, view.pose, view.camera, view.planes});
    }
  } else {
    const std::string folder = std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/" + source;
    if (std::filesystem::exists(folder)) {
      const io::Sequence sequence({folder});
      for (std::size_t i = 0; i < sequence.size(); ++i) {
        const io::Frame frame = sequence.read(i, io::CloudChannels::none());
        BenchmarkFrame f;
        f.xyz = frame.cloud.xyz;
        f.width = frame.cloud.width;
        f.height = frame.cloud.height;
        f.pose = frame.T_world_sensor.value_or(Pose::Identity());
        f.camera = frame.camera.value_or(PinholeCamera{});
        f.planes = findPlanes(f.view(), nullptr, segmentationParams()).planes;
        loaded.push_back(std::move(f));
      }
    }
  }
  all.emplace_back(source, std::move(loaded));
  return all.back().second;
}

PlanarMapParams mapParams(double resolution, bool unknown) {
  PlanarMapParams params;
  params.approximation.resolution = resolution;
  params.max_range = 8.0;
  params.unknown_space = unknown;
  return params;
}

/// Planes given; one iteration is the whole sequence into an empty map, the time that of a frame.
void insertFrames(benchmark::State& state, const std::string& source, double resolution,
                  bool unknown, bool with_segmentation) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  std::unique_ptr<PlanarMap> map;
  for (auto _ : state) {
    map = std::make_unique<PlanarMap>(mapParams(resolution, unknown));
    for (const BenchmarkFrame& frame : sequence) {
      FrameObservation observation = frame.observation();
      PlaneSet found;
      if (with_segmentation) {
        found = findPlanes(frame.view(), nullptr, segmentationParams());
        observation.planes = &found.planes;
      }
      map->insert(observation);
    }
    benchmark::DoNotOptimize(map->frames());
  }
  state.counters["s/frame"] = benchmark::Counter(
      static_cast<double>(sequence.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["planes"] = static_cast<double>(map->planes().size());
  state.counters["cuboids"] = static_cast<double>(map->cuboids().size());
  state.counters["file_bytes"] = static_cast<double>(map->serialize().size());
  state.counters["memory_bytes"] = static_cast<double>(map->memoryBytes());
  state.counters["unknown"] = static_cast<double>(map->unknownCells());
}

void queryPoints(benchmark::State& state, const std::string& source) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  PlanarMap map(mapParams(0.1, true));
  for (const BenchmarkFrame& frame : sequence) map.insert(frame.observation());
  Vector3 low, high;
  map.bounds(low, high);
  Random random;
  std::vector<Vector3> points;
  for (int i = 0; i < 4096; ++i) {
    points.emplace_back(random.uniform(low.x(), high.x()), random.uniform(low.y(), high.y()),
                        random.uniform(low.z(), high.z()));
  }
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(map.stateAt(points[i]));
    i = (i + 1) % points.size();
  }
}

#ifdef PLANAR_MAPPING_HAS_OCTOMAP
void insertIntoOctoMap(benchmark::State& state, const std::string& source, double resolution,
                       bool discretize) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  std::vector<octomap::Pointcloud> clouds;
  for (const BenchmarkFrame& frame : sequence) {
    octomap::Pointcloud cloud;
    const PointsView points = frame.view();
    for (std::size_t i = 0; i < points.size; ++i) {
      if (!points.isFinite(i)) continue;
      const Vector3 p = frame.pose * points.point(i);
      cloud.push_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                      static_cast<float>(p.z()));
    }
    clouds.push_back(cloud);
  }
  std::unique_ptr<octomap::OcTree> tree;
  for (auto _ : state) {
    tree = std::make_unique<octomap::OcTree>(resolution);
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const Vector3 sensor = sequence[i].pose.translation();
      tree->insertPointCloud(
          clouds[i],
          octomap::point3d(static_cast<float>(sensor.x()), static_cast<float>(sensor.y()),
                           static_cast<float>(sensor.z())),
          8.0, false, discretize);
    }
  }
  state.counters["s/frame"] = benchmark::Counter(
      static_cast<double>(sequence.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["memory_bytes"] = static_cast<double>(tree->memoryUsage());
  std::ostringstream file;
  tree->writeBinary(file);
  state.counters["file_bytes"] = static_cast<double>(file.str().size());
}
#endif

void registerAll() {
  for (const std::string source : {"room", "rgbd_icl_five", "rgbd_tum_cabinet"}) {
    const auto add = [&](const std::string& name, auto&&... arguments) {
      benchmark::RegisterBenchmark((source + "/" + name).c_str(), arguments...)
          ->Unit(benchmark::kMillisecond);
    };
    add("planar_map/0.1", insertFrames, source, 0.1, true, false);
    add("planar_map/0.1/no_unknown", insertFrames, source, 0.1, false, false);
    add("planar_map/0.05", insertFrames, source, 0.05, true, false);
    add("planar_map/0.1/with_segmentation", insertFrames, source, 0.1, true, true);
    benchmark::RegisterBenchmark((source + "/query").c_str(), queryPoints, source);
#ifdef PLANAR_MAPPING_HAS_OCTOMAP
    add("octomap/0.1", insertIntoOctoMap, source, 0.1, false);
    add("octomap/0.1/discretized", insertIntoOctoMap, source, 0.1, true);
#endif
  }
}

}  // namespace

int main(int argc, char** argv) {
  registerAll();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
