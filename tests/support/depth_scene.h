// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/plane.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::test {

/// A depth camera at the origin (x right, y down, z forward) that looks at rectangles and balls.
/// Every pixel knows the surface it shows.
class DepthScene {
 public:
  DepthScene(int width, int height, double focal_length)
      : width_(width), height_(height), focal_length_(focal_length) {}

  /// Rectangle centre + a u + b v with a, b in [-1, 1]. \return its surface number
  int addRectangle(const Vector3& centre, const Vector3& u, const Vector3& v) {
    surfaces_.push_back({centre, u, v, 0.0});
    return static_cast<int>(surfaces_.size()) - 1;
  }
  int addBall(const Vector3& centre, double radius) {
    surfaces_.push_back({centre, Vector3::Zero(), Vector3::Zero(), radius});
    return static_cast<int>(surfaces_.size()) - 1;
  }
  /// A plane without end seen through the whole image.
  int addPlane(const Vector3& point, const Vector3& normal) {
    const Vector3 u = normal.normalized().unitOrthogonal();
    return addRectangle(point, 1e3 * u, 1e3 * normal.normalized().cross(u));
  }

  /// \param noise standard deviation of the depth is noise * z^2
  /// \param missing fraction of pixels without a return
  void render(double noise, double missing, std::uint64_t seed) {
    Random random(seed);
    const auto size = static_cast<std::size_t>(width_) * height_;
    xyz.assign(3 * size, std::numeric_limits<float>::quiet_NaN());
    truth.assign(size, -1);
    for (int row = 0; row < height_; ++row) {
      for (int column = 0; column < width_; ++column) {
        const Vector3 ray((column - 0.5 * (width_ - 1)) / focal_length_,
                          (row - 0.5 * (height_ - 1)) / focal_length_, 1.0);
        double depth = std::numeric_limits<double>::max();
        int seen = -1;
        for (std::size_t i = 0; i < surfaces_.size(); ++i) {
          const double z = hit(surfaces_[i], ray);
          if (z > 0.1 && z < depth) {
            depth = z;
            seen = static_cast<int>(i);
          }
        }
        const double shift = noise > 0.0 ? noise * depth * depth * random.normal() : 0.0;
        if (seen < 0 || random.uniform() < missing) continue;
        set(row, column, ray * (depth + shift), seen);
      }
    }
  }

  /// Pixels at depth edges fly between their two surfaces.
  void addFlyingPixels(std::uint64_t seed) {
    Random random(seed);
    const std::vector<float> before = xyz;
    for (int row = 0; row < height_; ++row) {
      for (int column = 1; column < width_; ++column) {
        const std::size_t i = index(row, column);
        const float here = before[3 * i + 2];
        const float beside = before[3 * i - 1];
        if (!(std::fabs(here - beside) > 0.1F)) continue;
        const double fraction = random.uniform(0.2, 0.8);
        const Vector3 p(before[3 * i], before[3 * i + 1], here);
        set(row, column, p * (1.0 + fraction * (beside / here - 1.0)), -1);
      }
    }
  }

  PointsView view() const {
    return PointsView(xyz.data(), static_cast<std::uint32_t>(width_),
                      static_cast<std::uint32_t>(height_), 3);
  }
  Plane plane(int surface) const {
    const Surface& s = surfaces_[static_cast<std::size_t>(surface)];
    const Vector3 n = s.u.cross(s.v).normalized();
    return orientedTowards({n, -n.dot(s.centre)}, Vector3::Zero());
  }
  std::size_t pixelsOf(int surface) const {
    return static_cast<std::size_t>(std::count(truth.begin(), truth.end(), surface));
  }

  std::vector<float> xyz;  ///< NaN where nothing was measured
  std::vector<int> truth;  ///< surface per pixel, -1 = none or flying

 private:
  struct Surface {
    Vector3 centre, u, v;
    double radius;  ///< 0 for a rectangle
  };

  static double hit(const Surface& s, const Vector3& ray) {
    if (s.radius > 0.0) {
      const double a = ray.squaredNorm();
      const double b = ray.dot(s.centre);
      const double c = s.centre.squaredNorm() - s.radius * s.radius;
      const double root = b * b - a * c;
      return root < 0.0 ? -1.0 : (b - std::sqrt(root)) / a;
    }
    const Vector3 n = s.u.cross(s.v);
    const double along = n.dot(ray);
    if (along == 0.0) return -1.0;
    const double z = n.dot(s.centre) / along;
    const Vector3 at = z * ray - s.centre;
    const bool inside =
        std::fabs(at.dot(s.u)) <= s.u.squaredNorm() && std::fabs(at.dot(s.v)) <= s.v.squaredNorm();
    return inside ? z : -1.0;
  }
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * width_ + column;
  }
  void set(int row, int column, const Vector3& p, int surface) {
    const std::size_t i = index(row, column);
    for (int axis = 0; axis < 3; ++axis) xyz[3 * i + axis] = static_cast<float>(p[axis]);
    truth[i] = surface;
  }

  int width_, height_;
  double focal_length_;
  std::vector<Surface> surfaces_;
};

inline double angleBetween(const Plane& a, const Plane& b) {
  return std::atan2(a.normal.cross(b.normal).norm(), std::fabs(a.normal.dot(b.normal)));
}

/// Fraction of a surface's pixels that are inliers of the segment that has most of them.
inline double recall(const DepthScene& scene, const PlaneSet& set, int surface,
                     std::size_t* which) {
  std::size_t best = 0;
  for (std::size_t k = 0; k < set.planes.size(); ++k) {
    std::size_t hits = 0;
    for (const int i : set.planes[k].inliers)
      hits += scene.truth[static_cast<std::size_t>(i)] == surface;
    if (hits > best) {
      best = hits;
      *which = k;
    }
  }
  return static_cast<double>(best) / static_cast<double>(scene.pixelsOf(surface));
}

/// The corner of a room: floor, left wall, far wall.
inline DepthScene cornerOfARoom(int width = 320, int height = 240) {
  DepthScene scene(width, height, 0.8 * width);
  scene.addRectangle({0.0, 1.0, 2.5}, {3.0, 0.0, 0.0}, {0.0, 0.0, 2.0});
  scene.addRectangle({-1.2, 0.0, 2.5}, {0.0, 1.0, 0.0}, {0.0, 0.0, 2.0});
  scene.addRectangle({0.9, 0.0, 3.5}, {2.1, 0.0, 0.6}, {0.0, 1.0, 0.0});
  return scene;
}

inline void expectSameBytes(const PlaneSet& a, const PlaneSet& b) {
  ASSERT_EQ(a.planes.size(), b.planes.size());
  for (std::size_t k = 0; k < a.planes.size(); ++k) {
    EXPECT_EQ(a.planes[k].inliers, b.planes[k].inliers);
    EXPECT_EQ(a.planes[k].patches, b.planes[k].patches);
    EXPECT_EQ(a.planes[k].plane.coefficients(), b.planes[k].plane.coefficients());
    EXPECT_EQ(a.planes[k].rms, b.planes[k].rms);
  }
}

}  // namespace planar_mapping::test
