// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/plane.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::test {

/// A cloud of which one knows the planes: points in the frame of a sensor at the origin.
struct PlaneScene {
  std::vector<float> xyz;
  std::vector<int> truth;  ///< plane of each point, -1 = none
  std::vector<Plane> planes;

  std::size_t size() const { return truth.size(); }
  PointsView view() const { return PointsView(xyz.data(), truth.size()); }
  void add(const Vector3& p, int plane) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
    truth.push_back(plane);
  }
  void shuffle(Random& random) {
    for (std::size_t i = size(); i > 1; --i) {
      const std::size_t j = random.below(static_cast<std::uint32_t>(i));
      for (std::size_t axis = 0; axis < 3; ++axis)
        std::swap(xyz[3 * (i - 1) + axis], xyz[3 * j + axis]);
      std::swap(truth[i - 1], truth[j]);
    }
  }
};

enum class RoomKind {
  Dense,          ///< directions drawn evenly from the sensor
  Features,       ///< patches of about ten features, as many on each wall
  UnevenFeatures  ///< the same, 1/12 to 1/3 of them on a wall
};

/// A closed room of 6 x 5 x 3 m, turned so that no wall is along an axis, seen from inside with an
/// error of \p noise * range^2 along the ray, and evenly spread outliers that make up
/// \p outlier_fraction of all points; in random order.
inline PlaneScene makeRoom(std::size_t on_planes, double outlier_fraction, double noise,
                           std::uint64_t seed, RoomKind kind) {
  Random random(seed, 77);
  PlaneScene scene;
  const Vector3 extent(6.0, 5.0, 3.0);
  const Vector3 eye(random.uniform(2.0, 3.0), random.uniform(1.6, 2.6), 1.2);
  const Matrix3 turn = (Eigen::AngleAxisd(random.uniform(0.4, 1.4), Vector3::UnitZ()) *
                        Eigen::AngleAxisd(0.3, Vector3::UnitX()))
                           .toRotationMatrix();
  for (int wall = 0; wall < 6; ++wall) {
    Vector3 inward = Vector3::Zero();
    inward[wall / 2] = wall % 2 == 0 ? 1.0 : -1.0;
    const Vector3 foot = wall % 2 == 0 ? Vector3::Zero().eval() : extent;
    scene.planes.push_back({turn * inward, inward.dot(eye - foot)});
  }
  const auto direction = [&] {
    return Vector3(random.normal(), random.normal(), random.normal()).normalized();
  };
  const auto see = [&](const Vector3& ray, double range, int wall) {
    scene.add(turn * (ray * (range + noise * range * range * random.normal())), wall);
  };
  if (kind == RoomKind::Dense) {
    for (std::size_t i = 0; i < on_planes; ++i) {
      const Vector3 ray = direction();
      double range = 1e9;
      int wall = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double far = ray[axis] > 0.0 ? extent[axis] : 0.0;
        const double hit = (far - eye[axis]) / ray[axis];
        if (hit > 0.0 && hit < range) {
          range = hit;
          wall = 2 * axis + (ray[axis] > 0.0 ? 1 : 0);
        }
      }
      see(ray, range, wall);
    }
  } else {
    constexpr int kEven[6] = {100, 100, 100, 100, 100, 100};
    constexpr int kUneven[6] = {50, 200, 30, 150, 70, 100};
    for (int wall = 0; wall < 6; ++wall) {
      const int axis = wall / 2;
      const int fraction = (kind == RoomKind::Features ? kEven : kUneven)[wall];
      const std::size_t wanted = on_planes * static_cast<std::size_t>(fraction) / 600;
      for (std::size_t made = 0; made < wanted;) {
        Vector3 middle(random.uniform(), random.uniform(), random.uniform());
        middle = middle.cwiseProduct(extent);
        middle[axis] = wall % 2 == 0 ? 0.0 : extent[axis];
        for (int feature = 0; feature < 10 && made < wanted; ++feature) {
          Vector3 p = middle + 0.35 * Vector3(random.normal(), random.normal(), random.normal());
          p[axis] = middle[axis];
          if ((p.array() < 0.0).any() || (p.array() > extent.array()).any()) continue;
          ++made;
          see((p - eye).normalized(), (p - eye).norm(), wall);
        }
      }
    }
  }
  const double outliers =
      static_cast<double>(on_planes) * outlier_fraction / (1.0 - outlier_fraction) + 0.5;
  for (std::size_t i = 0; i < static_cast<std::size_t>(outliers); ++i) {
    Vector3 p(random.uniform(-0.05, 1.05), random.uniform(-0.05, 1.05),
              random.uniform(-0.05, 1.05));
    scene.add(turn * (p.cwiseProduct(extent) - eye), -1);
  }
  scene.shuffle(random);
  return scene;
}

/// How well planes were found: a true plane counts if one segment has more than 80 % of its points
/// and is less than one degree off.
struct PlaneScore {
  double recall = 0.0;
  double precision = 0.0;
  double angle_deg = 0.0;     ///< mean over the planes found
  double point_recall = 0.0;  ///< of the points of true planes, in the segment of their plane
};

inline PlaneScore scorePlanes(const PlaneScene& scene, const PlaneSet& found) {
  const std::size_t number = scene.planes.size();
  std::vector<std::vector<std::size_t>> overlap(found.planes.size(),
                                                std::vector<std::size_t>(number, 0));
  for (std::size_t s = 0; s < found.planes.size(); ++s) {
    for (const int i : found.planes[s].inliers) {
      const int truth = scene.truth[static_cast<std::size_t>(i)];
      if (truth >= 0) ++overlap[s][static_cast<std::size_t>(truth)];
    }
  }
  PlaneScore score;
  std::set<std::size_t> used;
  double right = 0.0, all = 0.0;
  for (std::size_t t = 0; t < number; ++t) {
    const auto size = static_cast<double>(
        std::count(scene.truth.begin(), scene.truth.end(), static_cast<int>(t)));
    all += size;
    std::size_t best = 0;
    for (std::size_t s = 1; s < found.planes.size(); ++s) {
      if (overlap[s][t] > overlap[best][t]) best = s;
    }
    if (found.planes.empty()) continue;
    right += static_cast<double>(overlap[best][t]);
    const double cosine = std::abs(found.planes[best].plane.normal.dot(scene.planes[t].normal));
    const double angle = std::acos(std::min(1.0, cosine)) * 180.0 / M_PI;
    if (static_cast<double>(overlap[best][t]) > 0.8 * size && angle < 1.0 &&
        used.insert(best).second) {
      score.angle_deg += angle;
    }
  }
  const auto hits = static_cast<double>(used.size());
  if (hits > 0.0) score.angle_deg /= hits;
  score.recall = hits / static_cast<double>(std::max<std::size_t>(1, number));
  score.precision = found.planes.empty() ? 0.0 : hits / static_cast<double>(found.planes.size());
  score.point_recall = all > 0.0 ? right / all : 0.0;
  return score;
}

}  // namespace planar_mapping::test
