// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/geometry/camera.h"

#include <cmath>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

void StereoNoise::validate() const {
  requirePositive("baseline", baseline, "m");
  requirePositive("focal_length", focal_length, "px");
  requireInRange("disparity_error", disparity_error, 0.0, std::numeric_limits<double>::max(), "px");
}

void FeatureCamera::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  requirePositive("fx", fx, "px");
  requirePositive("fy", fy, "px");
  requireInRange("cx", cx, -kLargest, kLargest, "px");
  requireInRange("cy", cy, -kLargest, kLargest, "px");
  requirePositive("pixel_error", pixel_error, "px");
  requireInRange("depth_error", depth_error, 0.0, kLargest, "m");
  requireInRange("depth_error_growth", depth_error_growth, 0.0, kLargest, "1/m");
  requirePositive("depth_error + depth_error_growth", depth_error + depth_error_growth);
}

FeatureSighting project(const FeatureCamera& camera, const Vector3& point) {
  const double w = 1.0 / point.z();
  return {camera.fx * point.x() * w + camera.cx, camera.fy * point.y() * w + camera.cy, w};
}

Vector3 backProject(const FeatureCamera& camera, const FeatureSighting& sighting) {
  const double z = 1.0 / sighting.inverse_depth;
  return {(sighting.column - camera.cx) / camera.fx * z, (sighting.row - camera.cy) / camera.fy * z,
          z};
}

Vector3 sightingVariance(const FeatureCamera& camera, double inverse_depth) {
  const double w_error =
      camera.depth_error * inverse_depth * inverse_depth + camera.depth_error_growth;
  const double pixel = camera.pixel_error * camera.pixel_error;
  return {pixel, pixel, w_error * w_error};
}

Matrix3 positionCovariance(const FeatureCamera& camera, const FeatureSighting& sighting) {
  return positionCovariance(camera, sighting, sightingVariance(camera, sighting.inverse_depth));
}

Matrix3 positionCovariance(const FeatureCamera& camera, const FeatureSighting& sighting,
                           const Vector3& variance) {
  const double z = 1.0 / sighting.inverse_depth;
  Matrix3 jacobian;
  const Vector3 ray((sighting.column - camera.cx) / camera.fx,
                    (sighting.row - camera.cy) / camera.fy, 1.0);
  jacobian << z / camera.fx, 0.0, -ray.x() * z * z,  //
      0.0, z / camera.fy, -ray.y() * z * z,          //
      0.0, 0.0, -z * z;
  return jacobian * variance.asDiagonal() * jacobian.transpose();
}

bool sightingOf(const FeatureCamera& camera, const KeyFeature& feature, FeatureSighting& sighting) {
  constexpr double kFarthest = 1e9;
  constexpr double kNearest = 1e-3;
  const Vector3& p = feature.position;
  if (!p.allFinite() || !(p.z() > kNearest) || p.cwiseAbs().maxCoeff() > kFarthest) return false;
  sighting = project(camera, p);
  if (std::isfinite(feature.column) && std::isfinite(feature.row)) {
    sighting.column = feature.column;
    sighting.row = feature.row;
  }
  return true;
}

}  // namespace planar_mapping
