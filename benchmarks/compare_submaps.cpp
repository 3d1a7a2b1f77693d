// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// One map of a sequence beside the map that is joined from its submaps.
//
//   compare_submaps CONFIG SEQUENCE [FRAMES [KEY=VALUE...]]
//
// Frames with their planes and beliefs come from one run, so that only the joining differs. A
// submap has FRAMES frames (20). Submaps are joined where they are; and once more with the second
// half of them made in a frame of its own, 1 degree and 17 mm off, and moved back. "in another
// order" is one map to which the submaps' frames come last submap first: what the order alone
// changes.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/map/joined_map.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/map/planar_map_impl.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace {

using namespace planar_mapping;

/// Milliseconds of the processor: the machine may be busy.
double now() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

Pose smallMotion() {
  Pose motion = Pose::Identity();
  motion.linear() =
      Eigen::AngleAxisd(kRadiansPerDegree, Vector3(0.3, 0.2, 0.93).normalized()).toRotationMatrix();
  motion.translation() = Vector3(0.011, -0.012, 0.005);
  return motion;
}

struct Session {
  PlanarMap whole;
  PlanarMap other_order;
  std::vector<PlanarMap> submaps;
  std::vector<PlanarMap> moved;  ///< in the frame of smallMotion(), those of the second half
  std::vector<Vector3> points;   ///< some of those that were mapped, world frame
};

Session mapSession(Configuration configuration, std::size_t frames_per_submap) {
  constexpr std::size_t kEvery = 97;
  Session session;
  std::vector<Frame> frames;
  Stage* stage = nullptr;
  const auto insert = [&](Frame frame, PlanarMap& map, const Pose& T_map_world) {
    frame.T_world_sensor = T_map_world * frame.T_world_sensor;
    frame.map = &map;
    stage->process(frame);
  };
  SequenceSource source(configuration);
  Pipeline pipeline(std::move(configuration));
  for (const ConfiguredStage& s : pipeline.configuration().stages)
    if (s.enabled && s.kind == StageKind::Map) stage = s.stage.get();
  if (stage == nullptr) throw InputError("the configuration has no stage that makes a map");
  while (std::optional<Frame> frame = source.next()) {
    pipeline.process(*frame);
    if (!frame->inserted) continue;
    frame->images = FrameImages();
    frame->key_features.clear();
    frames.push_back(std::move(*frame));
  }
  session.whole = pipeline.map();
  const PlanarMapParams& params = session.whole.params();
  const std::size_t count = (frames.size() + frames_per_submap - 1) / frames_per_submap;
  session.submaps.assign(count, PlanarMap(params));
  session.moved.assign(count, PlanarMap(params));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t submap = i / frames_per_submap;
    insert(frames[i], session.submaps[submap], Pose::Identity());
    if (2 * submap >= count) insert(frames[i], session.moved[submap], smallMotion().inverse());
    const PointsView view = pointsOf(*frames[i].cloud);
    for (std::size_t k = 0; k < frames[i].indices.size(); k += kEvery)
      session.points.emplace_back(frames[i].T_world_sensor *
                                  view.point(static_cast<std::size_t>(frames[i].indices[k])));
  }
  session.other_order = PlanarMap(params);
  for (std::size_t submap = count; submap-- > 0;) {
    const std::size_t end = std::min(frames.size(), (submap + 1) * frames_per_submap);
    for (std::size_t i = submap * frames_per_submap; i < end; ++i)
      insert(frames[i], session.other_order, Pose::Identity());
  }
  return session;
}

struct Figures {
  std::size_t planes = 0, plane_cells = 0, cells = 0, cuboids = 0;
  double area = 0.0;  ///< of cuboids' largest faces, square metres
  double unknown = 0.0, free = 0.0, coverage = 0.0, cuboids_ms = 0.0;
};

/// \param whole  within whose bounds unknown space is counted
Figures figuresOf(const PlanarMap& map, const PlanarMap& whole,
                  const std::vector<Vector3>& points) {
  Figures f;
  const detail::MapData& data = detail::MapAccess::of(map).data;
  f.planes = data.planes.size();
  for (const detail::PlaneLayer& layer : data.planes)
    layer.raster.forEachTile([&](std::int32_t, std::int32_t, const detail::RasterTile& tile) {
      f.plane_cells += static_cast<std::size_t>(__builtin_popcountll(tile.occupied()));
    });
  data.cells.forEachBlock([&](const detail::Int3&, const detail::CellBlock& block) {
    f.cells += static_cast<std::size_t>(__builtin_popcountll(block.occupied()));
  });
  const double start = now();
  f.cuboids = map.cuboids().size();
  f.cuboids_ms = now() - start;
  const double side = data.unknownResolution();
  Vector3 low = Vector3::Zero(), high = low;
  whole.bounds(low, high);
  for (const Cuboid& cuboid : map.freeCuboids()) f.free += cuboid.size.prod();
  for (const Cuboid& cuboid : map.spaceCuboids(CellState::Unknown, low, high))
    f.unknown += cuboid.size.prod();
  f.free /= side * side * side;
  f.unknown /= side * side * side;
  for (const Cuboid& cuboid : map.cuboids()) f.area += cuboid.size.prod() / cuboid.size.minCoeff();
  std::size_t covered = 0;
  for (const Vector3& point : points)
    covered += map.cuboidsAt(point, 0.5 * data.resolution()).empty() ? 0 : 1;
  f.coverage =
      static_cast<double>(covered) / static_cast<double>(std::max<std::size_t>(1, points.size()));
  return f;
}

/// Of a lattice of points half a cell apart within the bounds of the first map.
void compareStates(const PlanarMap& one, const PlanarMap& other) {
  const double s = one.params().approximation.resolution;
  Vector3 low, high;
  if (!one.bounds(low, high)) return;
  constexpr double kMost = 4e6;  // points
  const double step = std::max(0.5 * s, std::cbrt((high - low).prod() / kMost));
  std::size_t both = 0, only_one = 0, only_other = 0, free = 0, free_both = 0, changed = 0;
  for (double x = low.x(); x < high.x(); x += step)
    for (double y = low.y(); y < high.y(); y += step)
      for (double z = low.z(); z < high.z(); z += step) {
        const CellState a = one.stateAt({x, y, z}), b = other.stateAt({x, y, z});
        both += a == CellState::Occupied && b == CellState::Occupied ? 1 : 0;
        only_one += a == CellState::Occupied && b != CellState::Occupied ? 1 : 0;
        only_other += a != CellState::Occupied && b == CellState::Occupied ? 1 : 0;
        free += a == CellState::Free ? 1 : 0;
        free_both += a == CellState::Free && b == CellState::Free ? 1 : 0;
        changed += a != b && a != CellState::Occupied && b != CellState::Occupied ? 1 : 0;
      }
  std::printf(
      "    occupied in both %zu, one only %zu, other only %zu (IoU %.3f); free %zu of %zu; "
      "free for unknown or reverse %zu; surfaces apart %.4f\n",
      both, only_one, only_other,
      static_cast<double>(both) / static_cast<double>(both + only_one + only_other), free_both,
      free, changed, compareMaps(one, other).fraction());
}

void print(const char* name, const Figures& f, const Figures& one, double merge_ms) {
  const auto percent = [](double value, double of) {
    return of > 0.0 ? 100.0 * (value / of - 1.0) : 0.0;
  };
  std::printf(
      "%-16s planes %zu, plane cells %zu (%+.1f %%), clutter %zu (%+.1f %%), all cells "
      "(%+.1f %%), cuboids %zu (%+.1f %%), area %.1f (%+.1f %%), coverage %.4f, unknown %.0f "
      "(%+.1f %%), free %.0f (%+.1f %%); join %.1f ms, cuboids %.0f ms\n",
      name, f.planes, f.plane_cells, percent(f.plane_cells, one.plane_cells), f.cells,
      percent(f.cells, one.cells), percent(f.cells + f.plane_cells, one.cells + one.plane_cells),
      f.cuboids, percent(f.cuboids, one.cuboids), f.area, percent(f.area, one.area), f.coverage,
      f.unknown, percent(f.unknown, one.unknown), f.free, percent(f.free, one.free), merge_ms,
      f.cuboids_ms);
}

/// Copies of the session one after the other until there are a hundred submaps, all of which move.
void timeCorrection(const Session& session) {
  constexpr std::int32_t kSubmaps = 100;
  Vector3 low, high;
  if (!session.whole.bounds(low, high)) return;
  std::vector<std::shared_ptr<const PlanarMap>> maps;
  for (const PlanarMap& map : session.submaps) maps.push_back(std::make_shared<PlanarMap>(map));
  const auto count = static_cast<std::int32_t>(maps.size());
  const Vector3 up = session.whole.params().approximation.up.normalized();
  const auto poseOf = [&](std::int32_t id, double turn) {
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::AngleAxisd(turn * id, up).toRotationMatrix();
    pose.translation().x() = 0.8 * (high.x() - low.x()) * (id / count);
    return pose;
  };
  JoinedMap joined;
  double start = now();
  for (std::int32_t id = 0; id < kSubmaps; ++id)
    joined.set(id, maps[static_cast<std::size_t>(id % count)], poseOf(id, 0.0));
  joined.map();
  std::printf("%d submaps: joined %.0f ms", kSubmaps, now() - start);
  const auto again = [&](const char* what) {
    start = now();
    joined.map();
    std::printf(", %s %.0f ms (%zu joined)", what, now() - start, joined.lastJoined());
  };
  constexpr double kTurn = 0.002;  // radians a submap
  for (std::int32_t id = 0; id < kSubmaps; ++id) joined.move(id, poseOf(id, kTurn));
  again("all moved");
  for (const std::int32_t count_moved : {1, 10}) {
    for (std::int32_t id = 1; id <= count_moved; ++id)
      joined.move(id, Pose(Eigen::Translation3d(0.3 * count_moved, 0.0, 0.0) * poseOf(id, kTurn)));
    again(count_moved == 1 ? "an early one moved" : "ten early ones moved");
  }
  for (std::int32_t id = kSubmaps / 2; id < kSubmaps; ++id) joined.move(id, poseOf(id, -kTurn));
  again("half of them moved");
  joined.set(kSubmaps, maps.front(), poseOf(kSubmaps, 0.0));
  again("one more");
  std::printf("\n");
}

int run(int argc, char** argv) {
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments.assign(argv + std::min(argc, 4), argv + argc);
  Configuration configuration = loadConfiguration(argv[1], table, overrides);
  configuration.inputs = {argv[2]};
  const int frames = argc > 3 ? std::max(1, std::atoi(argv[3])) : 20;
  const Session session = mapSession(std::move(configuration), static_cast<std::size_t>(frames));
  std::printf("%s: %zu frames in %zu submaps, cells of %.2f m\n", argv[2], session.whole.frames(),
              session.submaps.size(), session.whole.params().approximation.resolution);
  const Figures one = figuresOf(session.whole, session.whole, session.points);
  print("one map", one, one, 0.0);
  const auto show = [&](const char* name, const PlanarMap& map, double ms) {
    print(name, figuresOf(map, session.whole, session.points), one, ms);
    compareStates(session.whole, map);
  };
  show("in another order", session.other_order, 0.0);
  for (const bool is_moved : {false, true}) {
    JoinedMap joined;
    for (std::size_t i = 0; i < session.submaps.size(); ++i) {
      const bool moves = is_moved && session.moved[i].frames() > 0;
      joined.set(static_cast<std::int32_t>(i),
                 std::make_shared<PlanarMap>(moves ? session.moved[i] : session.submaps[i]),
                 moves ? smallMotion() : Pose::Identity());
    }
    const double start = now();
    const PlanarMap& map = joined.map();
    const double ms = now() - start;
    show(is_moved ? "joined, moved" : "joined", map, ms);
  }
  timeCorrection(session);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: compare_submaps CONFIG SEQUENCE [FRAMES [KEY=VALUE...]]\n");
    return 2;
  }
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "compare_submaps: %s\n", error.what());
    return 1;
  }
}
