// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/scene_content.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/geometry/plane.h"

namespace planar_mapping {

namespace {

using Bounds = Eigen::AlignedBox3d;

void add(const SceneContent& content, Bounds& box) {
  for (const Cuboid* cuboid : content.framed()) {
    for (const Vector3& corner : corners(*cuboid)) box.extend(corner);
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

double areaOf(const Cuboid& cuboid) {
  const Vector3& a = cuboid.size;
  return a.x() * a.y() + a.y() * a.z() + a.z() * a.x();
}

/// Along each axis as much surface lies before as behind it.
Vector3 middleOf(const std::vector<Cuboid>& cuboids) {
  Vector3 middle = Vector3::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<std::pair<double, double>> places;  // and areas
    double left = 0.0;
    for (const Cuboid& cuboid : cuboids) {
      places.emplace_back(cuboid.center[axis], areaOf(cuboid));
      left += 0.5 * areaOf(cuboid);
    }
    std::sort(places.begin(), places.end());
    for (const auto& [place, area] : places) {
      middle[axis] = place;
      if ((left -= area) <= 0.0) break;
    }
  }
  return middle;
}

/// Whether the one pose is far from all that was seen: then it is the origin of a cloud's
/// coordinates, and no sensor.
bool startsFarAway(const SceneContent& content) {
  Bounds box;
  add(content, box);
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

std::vector<const Cuboid*> SceneContent::framed() const {
  constexpr double kStrayFraction = 0.05;
  constexpr double kTimesFarther = 2.0;
  const Vector3 middle = middleOf(cuboids);
  double left = 0.0;
  std::vector<std::pair<double, const Cuboid*>> by_distance;
  for (const Cuboid& cuboid : cuboids) {
    left += (1.0 - kStrayFraction) * areaOf(cuboid);
    by_distance.emplace_back((cuboid.center - middle).norm(), &cuboid);
  }
  std::sort(by_distance.begin(), by_distance.end());
  double reach = 0.0;
  std::vector<const Cuboid*> kept;
  for (const auto& [distance, cuboid] : by_distance) {
    if (left > 0.0) {
      reach = std::max(reach, kTimesFarther * (distance + 0.5 * cuboid->size.norm()));
    } else if (distance > reach) {
      break;
    }
    left -= areaOf(*cuboid);
    kept.push_back(cuboid);
  }
  return kept;
}

bool SceneContent::bounds(Vector3& low, Vector3& high) const {
  Bounds box;
  add(*this, box);
  for (const SceneCloud& cloud : clouds) {
    for (std::size_t i = 0; i + 2 < cloud.xyz.size(); i += 3) {
      const Vector3 p(cloud.xyz[i], cloud.xyz[i + 1], cloud.xyz[i + 2]);
      if (p.allFinite()) box.extend(p);
    }
  }
  if (box.isEmpty()) {
    for (const Cuboid& cuboid : unknown) {
      for (const Vector3& corner : corners(cuboid)) box.extend(corner);
    }
  }
  if (sensors_known) {
    for (const Pose& pose : trajectory) box.extend(Vector3(pose.translation()));
  }
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
