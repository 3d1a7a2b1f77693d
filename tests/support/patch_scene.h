// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::test {

/// Points in the frame of the sensor, and the planes that some of them are on.
struct PatchScene {
  std::vector<float> xyz;
  std::vector<PlaneSegment> planes;

  PointsView view() const { return PointsView(xyz.data(), xyz.size() / 3); }
  int add(const Vector3& p) {
    for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(p[k]));
    return static_cast<int>(xyz.size() / 3) - 1;
  }
  /// Random points of a rectangle spanned at \p corner, as a plane of the scene.
  void addPatch(Random& random, const Vector3& corner, const Vector3& a, const Vector3& b,
                int count, double noise) {
    const Vector3 normal = a.cross(b).normalized();
    PlaneSegment segment;
    segment.plane = {normal, -normal.dot(corner)};
    for (int i = 0; i < count; ++i) {
      segment.inliers.push_back(add(corner + random.uniform() * a + random.uniform() * b +
                                    noise * random.uniform(-1, 1) * normal));
    }
    planes.push_back(segment);
  }
};

/// A corner of a room with a box-shaped cloud of loose points.
inline PatchScene room(std::uint64_t seed = 1) {
  Random random(seed);
  PatchScene scene;
  scene.addPatch(random, {3, -1.5, 0}, {0, 3, 0}, {0, 0, 2}, 20000, 0.01);
  scene.addPatch(random, {0.5, 1.5, 0.03}, {2.4, 0, 0}, {0, 0, 1.5}, 15000, 0.01);
  scene.addPatch(random, {1.0, -1.0, 0.5}, {0.9, 0.2, 0}, {-0.1, 0.5, 0.2}, 5000, 0.005);
  for (int i = 0; i < 3000; ++i)
    scene.add({random.uniform(1.2, 1.6), random.uniform(0.2, 0.7), random.uniform(0.1, 0.9)});
  return scene;
}

inline PlanarMapParams paramsFor(Profile profile, double resolution = 0.1) {
  PlanarMapParams params = PlanarMapParams::of(profile);
  params.approximation.resolution = resolution;
  params.unknown_space = false;
  return params;
}

/// What is asked of a scene besides its points and planes.
struct PatchView {
  Pose T_world_sensor = Pose::Identity();
  const Indices* indices = nullptr;
  const std::vector<float>* probability = nullptr;
  FrameUpdate* update = nullptr;
};

/// The cuboids of a map of the scene alone.
inline std::vector<Cuboid> cuboidsOf(const PatchScene& scene, const PlanarMapParams& params,
                                     const PatchView& view = PatchView()) {
  PlanarMap map(params);
  FrameObservation frame;
  frame.T_world_sensor = view.T_world_sensor;
  frame.points = scene.view();
  frame.planes = &scene.planes;
  frame.indices = view.indices;
  frame.probability = view.probability;
  const FrameUpdate update = map.insert(frame);
  if (view.update != nullptr) *view.update = update;
  return map.cuboids();
}

}  // namespace planar_mapping::test
