// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Free and unknown space of maps of simulated scenes against the exact truth: which cells rays
// passed. Seeds 1 to 3 chose the constants of the depth image; those here did not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "box_scene.h"
#include "evaluation/baselines/octree_grid.h"
#include "evaluation/baselines/rectangular_approximation.h"
#include "evaluation/baselines/standard_grid.h"
#include "evaluation/metrics/surface_truth.h"
#include "evaluation/simulation/simulation.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kCell = 0.1;
constexpr float kMappedDepth = 5.0f;

struct Walk {
  Simulation simulation;
  std::vector<SimulatedFrame> frames;
  PlanarMap map;
};

Walk walkThrough(const std::string& scene, bool is_perfect, std::uint64_t seed) {
  SimulationParams params;
  params.scene = scene;
  params.seed = seed;
  params.frames = 10;
  params.colors = false;
  params.yaw = 0.1 + 0.37 * static_cast<double>(seed);
  params.plain_fraction = 0.2;
  if (is_perfect) params.sensor = StereoSensorParams::perfect();
  Walk walk{Simulation(params), {}, PlanarMap()};
  for (std::size_t i = 0; i < walk.simulation.size(); ++i) {
    walk.frames.push_back(walk.simulation.frame(i));
    const SimulatedFrame& simulated = walk.frames.back();
    FrameObservation frame;
    frame.T_world_sensor = simulated.T_world_camera;
    frame.camera = params.camera();
    frame.points = PointsView(simulated.xyz.data(), static_cast<std::uint32_t>(params.width),
                              static_cast<std::uint32_t>(params.height), 3);
    Indices near;
    for (std::size_t k = 0; k < simulated.xyz.size() / 3; ++k) {
      if (simulated.xyz[3 * k + 2] < kMappedDepth) near.push_back(static_cast<int>(k));
    }
    frame.indices = &near;
    const PlaneSet found = findPlanes(frame.points, nullptr, MultiPlaneParams());
    frame.planes = &found.planes;
    if (!is_perfect) {
      StereoNoise noise;
      noise.baseline = params.sensor.baseline;
      noise.focal_length = frame.camera->fx;
      frame.noise = noise;
    }
    walk.map.insert(frame);
  }
  return walk;
}

/// Does the ray of a pixel that was measured truly reach beyond the point, by a margin?
bool isPassed(const Walk& walk, const Vector3& point, double margin) {
  const PinholeCamera camera = walk.simulation.params().camera();
  return std::any_of(walk.frames.begin(), walk.frames.end(), [&](const SimulatedFrame& frame) {
    const Vector3 c =
        frame.T_world_camera.linear().transpose() * (point - frame.T_world_camera.translation());
    if (!(c.z() > 1e-3)) return false;
    const Vector2 pixel = camera.project(c) + Vector2::Constant(0.5);
    if (!(pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < camera.width &&
          pixel.y() < camera.height)) {
      return false;
    }
    const auto i = static_cast<std::size_t>(static_cast<int>(pixel.y()) * camera.width +
                                            static_cast<int>(pixel.x()));
    return frame.xyz[3 * i + 2] > 0.0f &&
           static_cast<double>(frame.truth.depth[i]) > c.z() + margin;
  });
}

/// OctoMap of the same frames, all that was measured.
std::unique_ptr<OctreeGrid> octreeOf(const Walk& walk) {
  std::unique_ptr<OctreeGrid> octree = makeOctreeGrid(kCell);
  if (!octree) return octree;
  for (const SimulatedFrame& frame : walk.frames) {
    std::vector<Vector3> points;
    for (std::size_t i = 0; i < frame.xyz.size(); i += 3) {
      if (!(frame.xyz[i + 2] > 0.0f)) continue;
      points.push_back(frame.T_world_camera *
                       Vector3(frame.xyz[i], frame.xyz[i + 1], frame.xyz[i + 2]));
    }
    octree->insert(points, {}, frame.T_world_camera.translation());
  }
  octree->finish();
  return octree;
}

/// Fractions of the cells, by their middles, around the path.
struct Fractions {
  double passed_free = 0.0;      ///< of what rays passed, up to a cell before the surface
  double passed_occupied = 0.0;  ///< and what the map calls it otherwise
  double away_free = 0.0;        ///< of what rays passed at least a cell from any true surface
  double unpassed_not_free = 0.0;
  double octree_passed_free = 0.0;  ///< of OctoMap; 0 without it
  double octree_away_free = 0.0;

  /// What cuboids occupy of passed space is the fault of cuboids: docs/results.md has both.
  double freeOfNotOccupied() const { return passed_free / (1.0 - passed_occupied); }
};

Fractions fractionsOf(const Walk& walk) {
  constexpr double kReach = 5.0;  // metres around the path, in which no place is far from a wall
  Vector3 low = walk.frames.front().T_world_camera.translation(), high = low;
  for (const SimulatedFrame& frame : walk.frames) {
    low = low.cwiseMin(frame.T_world_camera.translation());
    high = high.cwiseMax(frame.T_world_camera.translation());
  }
  low -= Vector3(kReach, kReach, 1.5);
  high += Vector3(kReach, kReach, 2.5);
  const SurfaceTruth truth(walk.simulation.scene());
  const std::unique_ptr<OctreeGrid> octree = octreeOf(walk);
  std::size_t passed = 0, free = 0, occupied = 0, unpassed = 0, not_free = 0;
  std::size_t away = 0, away_free = 0, octree_free = 0, octree_away_free = 0;
  constexpr double kStep = kCell;
  for (double x = std::floor(low.x() / kCell) * kCell + 0.5 * kCell; x < high.x(); x += kStep) {
    for (double y = std::floor(low.y() / kCell) * kCell + 0.5 * kCell; y < high.y(); y += kStep) {
      for (double z = std::floor(low.z() / kCell) * kCell + 0.5 * kCell; z < high.z(); z += kStep) {
        const Vector3 point(x, y, z);
        const CellState state = walk.map.stateAt(point);
        if (isPassed(walk, point, kCell)) {
          ++passed;
          free += state == CellState::Free ? 1 : 0;
          occupied += state == CellState::Occupied ? 1 : 0;
          const bool is_away = !truth.isNear(point, kCell);
          const bool is_octree_free = octree && octree->isFree(point);
          away += is_away ? 1 : 0;
          away_free += is_away && state == CellState::Free ? 1 : 0;
          octree_free += is_octree_free ? 1 : 0;
          octree_away_free += is_away && is_octree_free ? 1 : 0;
        } else if (!isPassed(walk, point, 0.0)) {
          ++unpassed;
          not_free += state == CellState::Free ? 0 : 1;
        }
      }
    }
  }
  EXPECT_GT(passed, 1000u);
  EXPECT_GT(unpassed, 2000u);
  const auto fraction = [](std::size_t part, std::size_t of) {
    return static_cast<double>(part) / static_cast<double>(of);
  };
  Fractions f;
  f.passed_free = fraction(free, passed);
  f.passed_occupied = fraction(occupied, passed);
  f.away_free = fraction(away_free, away);
  f.unpassed_not_free = fraction(not_free, unpassed);
  f.octree_passed_free = fraction(octree_free, passed);
  f.octree_away_free = fraction(octree_away_free, away);
  std::printf(
      "passed: %.2f %% free (OctoMap %.2f), %.2f %% occupied; a cell from any surface: %.2f %% "
      "free (OctoMap %.2f); not passed: %.2f %% not free\n",
      100.0 * f.passed_free, 100.0 * f.octree_passed_free, 100.0 * f.passed_occupied,
      100.0 * f.away_free, 100.0 * f.octree_away_free, 100.0 * f.unpassed_not_free);
  return f;
}

void expectKnown(const Fractions& f, std::uint64_t seed) {
  EXPECT_GE(f.freeOfNotOccupied(), 0.97) << seed;
  EXPECT_GE(f.away_free, 0.97) << seed;
  EXPECT_GE(f.passed_free, f.octree_passed_free) << seed;
  EXPECT_GE(f.unpassed_not_free, 0.995) << seed;
}

class ObservedSpace : public testing::TestWithParam<const char*> {};

TEST_P(ObservedSpace, IsKnownFreeWhereExactRaysPassedAndNowhereElse) {
  for (const std::uint64_t seed : {21, 22}) {
    const Fractions f = fractionsOf(walkThrough(GetParam(), true, seed));
    expectKnown(f, seed);
    EXPECT_GE(f.passed_free, 0.97) << seed;
  }
}

TEST_P(ObservedSpace, IsKnownFreeWhereNoisyRaysPassed) {
  for (const std::uint64_t seed : {23, 24}) {
    expectKnown(fractionsOf(walkThrough(GetParam(), false, seed)), seed);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, ObservedSpace, testing::Values("room", "corridor", "rooms"));

/// Planes of the scene of which a frame shows at least 0.05 m2 among the points that are mapped.
std::size_t truePlanes(const Walk& walk) {
  const PinholeCamera camera = walk.simulation.params().camera();
  const auto width = static_cast<std::size_t>(camera.width);
  std::vector<double> most(walk.simulation.planes().size(), 0.0);
  for (const SimulatedFrame& frame : walk.frames) {
    std::vector<double> area(most.size(), 0.0);
    for (std::size_t i = 0; i < frame.labels.size(); ++i) {
      const double depth = static_cast<double>(frame.truth.depth[i]);
      if (frame.labels[i] == 0 || !(depth < static_cast<double>(kMappedDepth))) continue;
      const std::size_t plane = frame.labels[i] - 1;
      const Vector3 ray =
          camera.rayOf(static_cast<double>(i % width), static_cast<double>(i / width));
      const Vector3 normal =
          frame.T_world_camera.linear().transpose() * walk.simulation.planes()[plane].normal;
      area[plane] += depth * depth / (camera.fx * camera.fy * std::abs(normal.dot(ray)));
    }
    for (std::size_t k = 0; k < most.size(); ++k) most[k] = std::max(most[k], area[k]);
  }
  return static_cast<std::size_t>(
      std::count_if(most.begin(), most.end(), [](double area) { return area >= 0.05; }));
}

/// Planes of the map with at least as much surface in cuboids of their own.
std::size_t mappedPlanes(const PlanarMap& map) {
  std::map<std::int32_t, double> area;
  for (const Cuboid& cuboid : map.cuboids())
    area[cuboid.plane_id] += cuboid.size.x() * cuboid.size.y();
  area.erase(-1);
  return static_cast<std::size_t>(
      std::count_if(area.begin(), area.end(), [](const auto& of) { return of.second >= 0.05; }));
}

TEST(PlanesOfAMap, AreNoMoreThanHalfAgainThoseThatAreThere) {
  for (const char* scene : {"room", "corridor", "rooms"}) {
    for (const bool is_perfect : {true, false}) {
      for (const std::uint64_t seed : {25, 26}) {
        const Walk walk = walkThrough(scene, is_perfect, seed);
        const auto there = static_cast<double>(truePlanes(walk));
        const auto mapped = static_cast<double>(mappedPlanes(walk.map));
        std::printf("%s, %s: %.0f planes for %.0f that are there; smaller ones counted, too, %zu\n",
                    scene, is_perfect ? "exact" : "noise", mapped, there, walk.map.planes().size());
        EXPECT_LE(mapped, 1.5 * there) << scene << seed;
        EXPECT_GE(mapped, 0.6 * there) << scene << seed;
      }
    }
  }
}

// Never more cuboids than RA's better variant has boxes, also where there is no plane to win by.

std::size_t boxesOfRA(const std::vector<float>& xyz, double cell) {
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    points.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
  StandardGrid grid(cell);
  grid.insert(points);
  return RectangularApproximation(cell, grid.cells()).size();
}

struct SceneSize {
  int boxes;
  double width;  ///< cells; a region of the map has 64
};

TEST(NeverMoreCells, ThanRAInScenesOfBoxesWithoutPlanes) {
  std::size_t ours = 0, theirs = 0;
  std::uint64_t seed = 0;
  for (const test::BoxKind kind :
       {test::BoxKind::Shells, test::BoxKind::CellShells, test::BoxKind::CellBlocks}) {
    for (const double cell : {0.05, 0.1, 0.3}) {
      for (const SceneSize size : {SceneSize{12, 120.0}, {24, 60.0}, {30, 200.0}}) {
        Random random(++seed);
        const std::vector<float> xyz = test::boxScene(random, kind, size.boxes, cell, size.width);
        PlanarMap map(test::keepAll(cell));
        test::insertPoints(map, xyz);
        const std::size_t cuboids = map.cuboids().size();
        const std::size_t boxes = boxesOfRA(xyz, cell);
        EXPECT_LE(cuboids, boxes) << "seed " << seed;
        EXPECT_EQ(cuboids, map.cuboidCount());
        ours += cuboids;
        theirs += boxes;
      }
    }
  }
  RecordProperty("ours", std::to_string(ours));
  RecordProperty("RA", std::to_string(theirs));
  EXPECT_GE(seed, 20u);
  EXPECT_LT(10 * ours, 9 * theirs);
}

}  // namespace
}  // namespace planar_mapping::evaluation
