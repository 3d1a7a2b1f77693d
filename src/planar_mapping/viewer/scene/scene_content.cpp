// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/scene_content.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/geometry/plane.h"

namespace planar_mapping {

namespace {

using Bounds = Eigen::AlignedBox3d;

void add(const std::vector<Cuboid>& cuboids, Bounds& box) {
  for (const Cuboid& cuboid : cuboids) {
    for (const Vector3& corner : corners(cuboid)) box.extend(corner);
  }
}

void requireDrawable(const std::vector<Cuboid>& cuboids, const char* what) {
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& c = cuboids[i];
    const bool finite = c.center.allFinite() && c.size.allFinite() &&
                        c.orientation.coeffs().allFinite() && std::isfinite(c.probability);
    if (!finite || (c.size.array() < 0.0).any() || !(c.orientation.norm() > 1e-6))
      throw InputError(std::string(what) + " " + std::to_string(i) +
                       " cannot be drawn: its centre, size, orientation or probability is not "
                       "finite, a length is negative or its quaternion is zero");
  }
}

/// Whether the one pose is far from all that was seen: then it is the origin of a cloud's
/// coordinates, and no sensor.
bool startsFarAway(const SceneContent& content) {
  Bounds box;
  add(content.cuboids, box);
  return content.trajectory.size() == 1 && !box.isEmpty() &&
         (content.trajectory.front().translation() - box.center()).norm() >
             2.0 * box.diagonal().norm();
}

}  // namespace

std::size_t SceneContent::cloudPoints() const {
  std::size_t count = 0;
  for (const SceneCloud& cloud : clouds) count += cloud.size();
  return count;
}

bool SceneContent::bounds(Vector3& low, Vector3& high) const {
  Bounds box;
  add(cuboids, box);
  for (const SceneCloud& cloud : clouds) {
    for (std::size_t i = 0; i + 2 < cloud.xyz.size(); i += 3) {
      const Vector3 p(cloud.xyz[i], cloud.xyz[i + 1], cloud.xyz[i + 2]);
      if (p.allFinite()) box.extend(p);
    }
  }
  if (box.isEmpty()) add(unknown, box);
  for (const Pose& pose : trajectory) box.extend(Vector3(pose.translation()));
  if (box.isEmpty()) return false;
  low = box.min();
  high = box.max();
  return true;
}

void SceneContent::validate() const {
  requireDrawable(cuboids, "cuboid");
  requireDrawable(unknown, "unknown cuboid");
  requireDrawable(free, "free cuboid");
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (!trajectory[i].matrix().allFinite())
      throw InputError("pose " + std::to_string(i) + " of the trajectory is not finite");
  }
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    const SceneCloud& cloud = clouds[i];
    if (cloud.xyz.size() % 3 != 0 || (!cloud.rgb.empty() && cloud.rgb.size() != cloud.xyz.size()))
      throw InputError("cloud " + std::to_string(i) + " has " + std::to_string(cloud.xyz.size()) +
                       " coordinates and " + std::to_string(cloud.rgb.size()) +
                       " colour values; three of each make a point");
  }
  if (!up.allFinite() || !(up.norm() > 1e-6)) throw InputError("the up axis is zero or not finite");
}

SceneContent sceneContent(const PlanarMap& map) {
  SceneContent content;
  content.cuboids = map.cuboids();
  content.unknown = map.unknownCuboids();
  auto trajectory = map.trajectory();  // by time: frames that were placed later come last
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [time, pose] : trajectory) content.trajectory.push_back(pose);
  content.sensors_known = map.params().unknown_space;  // else a cloud may be merged of many scans
  if (!content.sensors_known && startsFarAway(content)) content.trajectory.clear();
  content.ground = map.ground();
  content.floors = measuredFloors(map);
  content.planes = map.planes().size();
  content.resolution = map.params().approximation.resolution;
  content.up = map.params().approximation.up.normalized();
  content.unseen = map.params().unseen;
  Vector3 low, high;
  if (content.unseen == Unseen::Unknown && content.bounds(low, high)) {
    const Vector3 deeper = 4.0 * content.resolution * content.up.cwiseAbs();  // drops
    content.free = map.spaceCuboids(CellState::Free, low - deeper, high + deeper);
  }
  return content;
}

double tiltOf(const Cuboid& cuboid, const Vector3& up) {
  // Tilt is defined against z: the normal is expressed in a frame whose z axis is up.
  const Vector3 normal = cuboid.orientation * Vector3::UnitZ();
  const double c = std::clamp(normal.dot(up.normalized()), -1.0, 1.0);
  return std::abs(normalizedTilt({Vector3(std::sqrt(1.0 - c * c), 0.0, c), 0.0}));
}

double heightOf(const Cuboid& cuboid, const Vector3& up) {
  return cuboid.center.dot(up.normalized());
}

bool looksAlongZ(const SceneContent& content, double fraction) {
  if (content.trajectory.empty() || content.cuboids.empty()) return false;
  const double widest = std::tan(60.0 * kRadiansPerDegree);
  std::size_t seen = 0;
  for (const Cuboid& cuboid : content.cuboids) {
    for (const Pose& pose : content.trajectory) {
      const Vector3 p = pose.inverse() * cuboid.center;
      if (p.z() > 0.0 && p.head<2>().norm() <= widest * p.z()) {
        ++seen;
        break;
      }
    }
  }
  return seen >= fraction * static_cast<double>(content.cuboids.size());
}

}  // namespace planar_mapping
