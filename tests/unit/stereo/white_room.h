// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "pipeline_frames.h"
#include "planar_mapping/stereo/matching/stereo_matcher.h"

namespace planar_mapping::test {

/// A walk through the simulated room "white": what the cameras saw, and the truth.
struct WhiteWalk {
  evaluation::Simulation simulation;
  std::vector<evaluation::SimulatedFrame> frames;
};

/// \param focal_length  pixels; 0 = 500
inline WhiteWalk walkWhiteRoom(std::uint64_t seed, int frames, double focal_length = 0.0) {
  evaluation::SimulationParams params;
  params.scene = "white";
  params.seed = seed;
  params.frames = frames;
  params.yaw = 0.1 + 0.37 * static_cast<double>(seed);
  params.clouds = false;
  params.images = true;
  params.focal_length = focal_length;
  params.right_exposure = 0.9 + 0.05 * static_cast<double>(seed % 5);
  params.threads = 0;
  WhiteWalk walk{evaluation::Simulation(params), {}};
  for (std::size_t i = 0; i < walk.simulation.size(); ++i)
    walk.frames.push_back(walk.simulation.frame(i));
  return walk;
}

inline io::Calibration calibrationOf(const WhiteWalk& walk) {
  io::Calibration calibration;
  calibration.camera = walk.simulation.params().camera();
  calibration.cx_right = calibration.camera.cx;
  calibration.baseline = walk.simulation.params().sensor.baseline;
  return calibration;
}

/// Overexposed, walls and ceiling are white alike, and no edge shows between them.
inline void overexpose(WhiteWalk& walk, double gain) {
  for (evaluation::SimulatedFrame& frame : walk.frames) {
    for (io::Image* image : {&frame.left, &frame.right}) {
      for (std::uint8_t& value : image->pixels)
        value = static_cast<std::uint8_t>(std::min(gain * static_cast<double>(value), 255.0));
    }
  }
}

/// The map that a configuration beside the sources makes of it, with the true poses.
inline PlanarMap mapOf(const WhiteWalk& walk, const std::string& configuration,
                       const std::vector<std::string>& assignments = {}) {
  Pipeline pipeline(readyConfiguration(configuration, assignments));
  for (const evaluation::SimulatedFrame& simulated : walk.frames) {
    Frame frame;
    frame.number = simulated.index;
    frame.timestamp = simulated.timestamp;
    frame.given_pose = simulated.T_world_camera;
    frame.T_world_sensor = simulated.T_world_camera;
    frame.cloud = pcl::make_shared<FrameCloud>();
    frame.images.left = simulated.left;
    frame.images.right = simulated.right;
    frame.images.calibration = calibrationOf(walk);
    pipeline.process(frame);
  }
  return pipeline.map();
}

struct WhiteRoomFigures {
  std::size_t wall_points = 0;   ///< on bare wall that was seen, 25 cm2 each
  double walls_occupied = 0.0;   ///< fraction of them within a cell of something occupied
  std::size_t free_points = 0;   ///< that rays passed truly, by a cell and more, and as
                                 ///< far over the floor; 1 dm3 each
  double free_occupied = 0.0;    ///< fraction of them in a cuboid
  double farthest_behind = 0.0;  ///< of any corner behind a wall, metres
  int cuboids_behind = 0;        ///< farther than two cells
};

/// The pixel in which a frame sees a point, by its true depth; -1 if it does not.
inline std::ptrdiff_t pixelOf(const evaluation::SimulatedFrame& frame, const PinholeCamera& camera,
                              const Vector3& point, double& depth) {
  const Vector3 c =
      frame.T_world_camera.linear().transpose() * (point - frame.T_world_camera.translation());
  depth = c.z();
  if (!(c.z() > 0.2)) return -1;
  const Vector2 pixel = camera.project(c) + Vector2::Constant(0.5);
  if (!(pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < camera.width &&
        pixel.y() < camera.height)) {
    return -1;
  }
  return static_cast<std::ptrdiff_t>(pixel.y()) * camera.width +
         static_cast<std::ptrdiff_t>(pixel.x());
}

inline WhiteRoomFigures figuresOf(const WhiteWalk& walk, const PlanarMap& map) {
  const double s = map.params().approximation.resolution;
  const PinholeCamera camera = walk.simulation.params().camera();
  const std::vector<evaluation::SceneObject>& objects = walk.simulation.scene().objects;
  std::vector<evaluation::Rendering> matchable;
  for (const evaluation::SimulatedFrame& frame : walk.frames)
    matchable.push_back(evaluation::matchablePart(frame.truth, walk.simulation.params().sensor));
  WhiteRoomFigures figures;
  std::vector<Plane> walls;  // towards the room
  double half_diagonal = 0.0;
  std::size_t occupied = 0;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    const evaluation::SceneObject& wall = objects[k];
    if (wall.name != "wall") continue;
    const Vector3 half = 0.5 * wall.size;
    Plane inner;
    inner.normal = -wall.T_world_object.linear().col(1);
    inner.offset = -inner.normal.dot(wall.T_world_object * Vector3(0.0, -half.y(), 0.0));
    walls.push_back(inner);
    half_diagonal = std::max(half_diagonal, half.x());
    constexpr double kStep = 0.05;
    for (double x = -half.x() + 0.5 * kStep; x < half.x(); x += kStep) {
      for (double z = -half.z() + 0.5 * kStep; z < half.z(); z += kStep) {
        const Vector3 point = wall.T_world_object * Vector3(x, -half.y(), z);
        bool seen = false;
        for (std::size_t f = 0; f < walk.frames.size() && !seen; ++f) {
          double depth = 0.0;
          const std::ptrdiff_t i = pixelOf(walk.frames[f], camera, point, depth);
          seen = i >= 0 && matchable[f].object[static_cast<std::size_t>(i)] == static_cast<int>(k);
        }
        if (!seen) continue;
        ++figures.wall_points;
        occupied += map.cuboidsAt(point, s).empty() ? 0 : 1;
      }
    }
  }
  figures.walls_occupied = static_cast<double>(occupied) / static_cast<double>(figures.wall_points);

  std::size_t wrong = 0;
  for (double x = -half_diagonal; x < half_diagonal; x += 0.1) {
    for (double y = -half_diagonal; y < half_diagonal; y += 0.1) {
      for (double z = 0.15; z < 2.5; z += 0.1) {  // a cell and more over the floor, too
        const Vector3 point(x, y, z);
        bool passed = false;
        for (std::size_t f = 0; f < walk.frames.size() && !passed; ++f) {
          double depth = 0.0;
          const std::ptrdiff_t i = pixelOf(walk.frames[f], camera, point, depth);
          passed = i >= 0 &&
                   static_cast<double>(walk.frames[f].truth.depth[static_cast<std::size_t>(i)]) >
                       depth + s;
        }
        if (!passed) continue;
        ++figures.free_points;
        wrong += map.isOccupied(point) ? 1 : 0;
      }
    }
  }
  figures.free_occupied = static_cast<double>(wrong) / static_cast<double>(figures.free_points);

  for (const Cuboid& cuboid : map.cuboids()) {
    double behind = 0.0;
    const Matrix3 axes = cuboid.orientation.toRotationMatrix();
    for (const Plane& wall : walls) {
      const Vector3 along = axes.transpose() * wall.normal;
      const double reach = 0.5 * along.cwiseAbs().dot(cuboid.size);
      behind = std::max(behind, reach - wall.signedDistance(cuboid.center));
    }
    figures.farthest_behind = std::max(figures.farthest_behind, behind);
    figures.cuboids_behind += behind > 2.0 * s ? 1 : 0;
  }
  return figures;
}

}  // namespace planar_mapping::test
