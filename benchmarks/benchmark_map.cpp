// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Frames into a map and questions to it, beside OctoMap on the same frames in the same run. The
// real sequence is read from ../shared/data beside the sources; without it only the generated room
// is timed.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"

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
struct InsertOptions {
  bool unknown = true;
  bool segmentation = false;
  bool cuboids = false;  ///< the map is asked for them after each frame
  bool planes = true;    ///< or all points are clutter
};
void insertFrames(benchmark::State& state, const std::string& source,
                  const InsertOptions& options) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  std::unique_ptr<PlanarMap> map;
  for (auto _ : state) {
    map = std::make_unique<PlanarMap>(mapParams(0.1, options.unknown));
    for (const BenchmarkFrame& frame : sequence) {
      FrameObservation observation = frame.observation();
      PlaneSet found;
      if (options.segmentation) {
        found = findPlanes(frame.view(), nullptr, segmentationParams());
        observation.planes = &found.planes;
      }
      if (!options.planes) observation.planes = nullptr;
      map->insert(observation);
      if (options.cuboids) benchmark::DoNotOptimize(map->cuboids().data());
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

PlanarMap mapOf(const std::vector<BenchmarkFrame>& sequence) {
  PlanarMap map(mapParams(0.1, true));
  for (const BenchmarkFrame& frame : sequence) map.insert(frame.observation());
  return map;
}

constexpr double kRayRange = 8.0;

struct BenchmarkRay {
  Vector3 origin;
  Vector3 direction;
};

/// From where the sensor was, anywhere.
std::vector<BenchmarkRay> raysOf(const std::vector<BenchmarkFrame>& sequence) {
  Random random(2);
  std::vector<BenchmarkRay> rays;
  for (std::size_t i = 0; i < 4096; ++i) {
    const Vector3 direction(random.normal(), random.normal(), random.normal());
    rays.push_back({sequence[i % sequence.size()].pose.translation(), direction.normalized()});
  }
  return rays;
}

/// \param cast whether a ray meets something
template <typename Cast>
void timeRays(benchmark::State& state, const std::vector<BenchmarkFrame>& sequence,
              const Cast& cast) {
  const std::vector<BenchmarkRay> rays = raysOf(sequence);
  double hits = 0.0;
  for (const BenchmarkRay& ray : rays) hits += cast(ray) ? 1.0 : 0.0;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(cast(rays[i]));
    i = (i + 1) % rays.size();
  }
  state.counters["hit"] = hits / static_cast<double>(rays.size());
}

void castRays(benchmark::State& state, const std::string& source, UnknownSpaceIs unknown) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  const PlanarMap map = mapOf(sequence);
  timeRays(state, sequence, [&](const BenchmarkRay& ray) {
    return castRay(map, ray.origin, ray.direction, kRayRange, unknown).has_value();
  });
}

/// Anywhere within 4 m of where the sensor was.
std::vector<Vector3> pointsOf(const std::vector<BenchmarkFrame>& sequence) {
  Random random(3);
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < 4096; ++i) {
    const auto any = [&] { return random.uniform(-4.0, 4.0); };
    const double x = any(), y = any(), z = any();
    points.push_back(sequence[i % sequence.size()].pose.translation() + Vector3(x, y, z));
  }
  return points;
}

/// \param ask whether a point is occupied
template <typename Ask>
void timePoints(benchmark::State& state, const std::vector<BenchmarkFrame>& sequence,
                const Ask& ask) {
  const std::vector<Vector3> points = pointsOf(sequence);
  double occupied = 0.0;
  for (const Vector3& point : points) occupied += ask(point) ? 1.0 : 0.0;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(ask(points[i]));
    i = (i + 1) % points.size();
  }
  state.counters["occupied"] = occupied / static_cast<double>(points.size());
}

void askPoints(benchmark::State& state, const std::string& source) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  const PlanarMap map = mapOf(sequence);
  timePoints(state, sequence, [&](const Vector3& point) { return map.isOccupied(point); });
}

#ifdef PLANAR_MAPPING_HAS_OCTOMAP
octomap::point3d toOctoMap(const Vector3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

std::vector<octomap::Pointcloud> octoMapClouds(const std::vector<BenchmarkFrame>& sequence) {
  std::vector<octomap::Pointcloud> clouds;
  for (const BenchmarkFrame& frame : sequence) {
    octomap::Pointcloud cloud;
    const PointsView points = frame.view();
    for (std::size_t i = 0; i < points.size; ++i) {
      if (points.isMeasured(i)) cloud.push_back(toOctoMap(frame.pose * points.point(i)));
    }
    clouds.push_back(cloud);
  }
  return clouds;
}

std::unique_ptr<octomap::OcTree> octoMapOf(const std::vector<BenchmarkFrame>& sequence,
                                           const std::vector<octomap::Pointcloud>& clouds,
                                           double resolution, bool discretize) {
  auto tree = std::make_unique<octomap::OcTree>(resolution);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    tree->insertPointCloud(clouds[i], toOctoMap(sequence[i].pose.translation()), 8.0, false,
                           discretize);
  }
  return tree;
}

void insertIntoOctoMap(benchmark::State& state, const std::string& source, double resolution,
                       bool discretize) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  const std::vector<octomap::Pointcloud> clouds = octoMapClouds(sequence);
  std::unique_ptr<octomap::OcTree> tree;
  for (auto _ : state) tree = octoMapOf(sequence, clouds, resolution, discretize);
  state.counters["s/frame"] = benchmark::Counter(
      static_cast<double>(sequence.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["memory_bytes"] = static_cast<double>(tree->memoryUsage());
  std::ostringstream file;
  tree->writeBinary(file);
  state.counters["file_bytes"] = static_cast<double>(file.str().size());
}

/// Through what is unknown as well: without that OctoMap's rays end at the first unseen cell.
void castRaysInOctoMap(benchmark::State& state, const std::string& source) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  const std::unique_ptr<octomap::OcTree> tree =
      octoMapOf(sequence, octoMapClouds(sequence), 0.1, true);
  tree->prune();
  timeRays(state, sequence, [&](const BenchmarkRay& ray) {
    octomap::point3d end;
    return tree->castRay(toOctoMap(ray.origin), toOctoMap(ray.direction), end, true, kRayRange);
  });
}

void askPointsOfOctoMap(benchmark::State& state, const std::string& source) {
  const std::vector<BenchmarkFrame>& sequence = frames(source);
  if (sequence.empty()) {
    state.SkipWithError("no data");
    return;
  }
  const std::unique_ptr<octomap::OcTree> tree =
      octoMapOf(sequence, octoMapClouds(sequence), 0.1, true);
  tree->prune();
  timePoints(state, sequence, [&](const Vector3& point) {
    const octomap::OcTreeNode* node = tree->search(toOctoMap(point));
    return node != nullptr && tree->isNodeOccupied(node);
  });
}
#endif

void registerAll() {
  for (const std::string source : {"room", "rgbd_icl_five", "rgbd_tum_cabinet"}) {
    const auto add = [&](const std::string& name, auto&&... arguments) {
      benchmark::RegisterBenchmark((source + "/" + name).c_str(), arguments...)
          ->Unit(benchmark::kMillisecond);
    };
    add("planar_map/0.1", insertFrames, source, InsertOptions());
    add("planar_map/0.1/no_unknown", insertFrames, source, InsertOptions{false});
    add("planar_map/0.1/with_segmentation", insertFrames, source, InsertOptions{true, true});
    add("planar_map/0.1/with_cuboids", insertFrames, source, InsertOptions{true, false, true});
    add("planar_map/0.1/clutter", insertFrames, source, InsertOptions{true, false, false, false});
    add("planar_map/0.1/clutter/with_cuboids", insertFrames, source,
        InsertOptions{true, false, true, false});
    const auto addQuestion = [&](const std::string& name, auto&&... arguments) {
      benchmark::RegisterBenchmark((source + "/" + name).c_str(), arguments...)
          ->Unit(benchmark::kMicrosecond);
    };
    addQuestion("point", askPoints, source);
    addQuestion("ray", castRays, source, UnknownSpaceIs::AnObstacle);
    addQuestion("ray/through_unknown", castRays, source, UnknownSpaceIs::Transparent);
#ifdef PLANAR_MAPPING_HAS_OCTOMAP
    add("octomap/0.1", insertIntoOctoMap, source, 0.1, false);
    add("octomap/0.1/discretized", insertIntoOctoMap, source, 0.1, true);
    addQuestion("octomap/point", askPointsOfOctoMap, source);
    addQuestion("octomap/ray", castRaysInOctoMap, source);
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
