// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping::test {

/// What 16 rings of a scanner, -15 to 15 degrees, see from inside a bare box: 28,800 points of the
/// scanner's frame, ring by ring.
/// \param low,high  corners of the box in its own frame, metres
/// \param heading  of the box in the scanner's frame, radians about z
/// \param noise  of the range, metres
inline std::vector<float> ringScan(const Eigen::Array3d& low, const Eigen::Array3d& high,
                                   double heading, double noise, Random& random) {
  const Matrix3 turn = Eigen::AngleAxisd(heading, Vector3::UnitZ()).toRotationMatrix();
  std::vector<float> xyz;
  for (int ring = 0; ring < 16; ++ring) {
    const double elevation = (-15.0 + 2.0 * ring) * M_PI / 180.0;
    for (int column = 0; column < 1800; ++column) {
      const double azimuth = column * M_PI / 900.0;
      const Vector3 ray(std::cos(elevation) * std::cos(azimuth),
                        std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const Eigen::Array3d along = (turn.transpose() * ray).array();
      const double range = (along > 0.0).select(high / along, low / along).minCoeff();
      const Eigen::Vector3f p = (ray * (range + noise * random.normal())).cast<float>();
      xyz.insert(xyz.end(), p.data(), p.data() + 3);
    }
  }
  return xyz;
}

/// What a scanner sees from inside a bare box, every so many degrees of elevation up to
/// \p steepest and every half of that of azimuth.
/// \param low,high  corners of the box in the scanner's frame, metres
inline std::vector<float> boxScan(const Eigen::Array3d& low, const Eigen::Array3d& high,
                                  double steepest, double degrees = 1.0) {
  std::vector<float> xyz;
  for (double elevation = -steepest; elevation <= steepest; elevation += degrees) {
    for (double azimuth = 0.0; azimuth < 360.0; azimuth += 0.5 * degrees) {
      const double e = elevation * M_PI / 180.0, a = azimuth * M_PI / 180.0;
      const Vector3 ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      const Eigen::Array3d along = ray.array();
      const Eigen::Array3d walls = (along > 0.0).select(high, low);
      const double range = (along == 0.0).select(INFINITY, walls / along).minCoeff();
      const Eigen::Vector3f p = (ray * range).cast<float>();
      xyz.insert(xyz.end(), p.data(), p.data() + 3);
    }
  }
  return xyz;
}

}  // namespace planar_mapping::test
