// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "planar_mapping/base/random.h"
#include "planar_mapping/viewer/scene/scene_content.h"

/// Content made by hand for the tests, benchmarks and pictures of the viewer.
namespace planar_mapping::testing {

/// A cuboid of a plane: n is the side it was seen from, u lies across n and up where possible.
inline Cuboid plate(const Vector3& center, const Vector3& normal, double across, double along,
                    std::int32_t plane_id, double thickness = 0.1) {
  Cuboid cuboid;
  const Vector3 n = normal.normalized();
  const Vector3 seed = std::abs(n.z()) > 0.9 ? Vector3(1.0, 0.0, 0.0) : Vector3::UnitZ().cross(n);
  const Vector3 u = (seed - seed.dot(n) * n).normalized();
  Matrix3 axes;
  axes << u, n.cross(u), n;
  cuboid.orientation = Quaternion(axes);
  cuboid.center = center - 0.5 * thickness * n;
  cuboid.size = {across, along, thickness};
  cuboid.plane_id = plane_id;
  return cuboid;
}

inline Pose cameraPose(const Vector3& position, const Vector3& forward) {
  const Vector3 z = forward.normalized();
  const Vector3 x = z.cross(Vector3::UnitZ()).normalized();
  Pose pose = Pose::Identity();
  pose.linear() << x, z.cross(x), z;
  pose.translation() = position;
  return pose;
}

/// A room of 6 x 4 x 2.5 m with ceiling, table, a tilted board, two boxes and rubble, seen from
/// inside by a camera that walks through it; what is behind the boxes is unknown.
inline SceneContent room() {
  SceneContent content;
  content.resolution = 0.1;
  std::vector<Cuboid>& c = content.cuboids;
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  for (int i = 0; i < 3; ++i) {
    c.push_back(plate({1.0 + 2.0 * i, 2.0, 0.0}, z, 2.0, 4.0, 0));
    c.push_back(plate({1.0 + 2.0 * i, 2.0, 2.5}, -z, 2.0, 4.0, 1));
    c.push_back(plate({1.0 + 2.0 * i, 0.0, 1.25}, y, 2.0, 2.5, 2));
    c.push_back(plate({1.0 + 2.0 * i, 4.0, 1.25}, -y, 2.0, 2.5, 3));
  }
  c.push_back(plate({0.0, 2.0, 1.25}, x, 4.0, 2.5, 4));
  c.push_back(plate({6.0, 1.0, 1.25}, -x, 2.0, 2.5, 5));
  c.push_back(plate({6.0, 3.0, 1.9}, -x, 2.0, 1.2, 5));
  c.push_back(plate({3.0, 2.9, 0.75}, z, 1.6, 0.8, 6, 0.05));
  for (const auto& [dx, dy] : {std::pair{-0.7, -0.3}, {0.7, -0.3}, {-0.7, 0.3}, {0.7, 0.3}})
    c.push_back(plate({3.0 + dx, 2.9 + dy, 0.35}, -x, 0.06, 0.7, -1, 0.06));
  c.push_back(plate({2.8, 2.8, 0.9}, -y, 0.3, 0.3, 7, 0.2));
  c.push_back(plate({4.7, 3.4, 0.4}, -x, 0.8, 0.8, 8));
  c.push_back(plate({5.1, 3.0, 0.4}, -y, 0.8, 0.8, 9));
  c.push_back(plate({5.1, 3.4, 0.8}, z, 0.8, 0.8, 10));
  c.push_back(plate({0.6, 0.7, 0.6}, {0.8, 0.3, 0.45}, 1.0, 1.2, 11, 0.05));
  Random random(7);
  for (int i = 0; i < 60; ++i) {
    Cuboid rubble;
    rubble.center = {4.4 + 1.2 * random.uniform(), 0.4 + 0.8 * random.uniform(),
                     0.05 + 0.4 * random.uniform() * random.uniform()};
    rubble.size = Vector3::Constant(0.1);
    rubble.probability = static_cast<float>(0.5 + 0.4 * random.uniform());
    c.push_back(rubble);
  }
  for (std::size_t i = 0; i < c.size(); ++i)
    c[i].probability = c[i].plane_id < 0 ? c[i].probability : 1.0f - 0.04f * (i % 9);
  Cuboid behind;
  behind.state = CellState::Unknown;
  behind.center = {5.45, 3.5, 0.4};
  behind.size = {0.9, 0.9, 0.8};
  content.unknown.push_back(behind);
  behind.center = {6.6, 2.0, 1.25};
  behind.size = {1.0, 4.0, 2.5};
  content.unknown.push_back(behind);
  for (int i = 0; i <= 24; ++i) {
    const double t = i / 24.0;
    content.trajectory.push_back(cameraPose({0.6 + 3.4 * t, 1.3 + 0.5 * std::sin(3.0 * t), 1.1},
                                            {1.0, 0.5 * std::cos(3.0 * t), -0.15}));
  }
  return content;
}

/// Many small cuboids of all orientations over rolling ground, on about 200 planes.
inline SceneContent field(int count, unsigned seed = 1) {
  SceneContent content;
  content.resolution = 0.2;
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    Cuboid cuboid;
    const double px = 40.0 * random.uniform(), py = 25.0 * random.uniform();
    cuboid.center = {px, py, 1.0 + 0.8 * std::sin(0.4 * px) * std::cos(0.5 * py)};
    const Vector3 normal(-0.32 * std::cos(0.4 * px) * std::cos(0.5 * py),
                         0.4 * std::sin(0.4 * px) * std::sin(0.5 * py), 1.0);
    cuboid.orientation = Quaternion::FromTwoVectors(Vector3::UnitZ(), normal);
    cuboid.size = {0.1 + 0.5 * random.uniform(), 0.1 + 0.5 * random.uniform(), 0.1};
    cuboid.plane_id =
        static_cast<std::int32_t>(px / 3.0) * 13 + static_cast<std::int32_t>(py / 2.0);
    cuboid.probability = static_cast<float>(random.uniform());
    content.cuboids.push_back(cuboid);
  }
  return content;
}

}  // namespace planar_mapping::testing
