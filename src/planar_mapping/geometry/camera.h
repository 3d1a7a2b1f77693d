// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// Pinhole model of a rectified image: column = fx x / z + cx, row = fy y / z + cy (pixels, their
/// centres at whole numbers) of a point in the camera's frame (x right, y down, z forward, metres).
struct PinholeCamera {
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  int width = 0;
  int height = 0;

  /// The point at depth 1 that a pixel shows.
  Vector3 rayOf(double column, double row) const {
    return {(column - cx) / fx, (row - cy) / fy, 1.0};
  }
  /// Column and row of a point; its depth must not be 0.
  Vector2 project(const Vector3& point) const {
    return {fx * point.x() / point.z() + cx, fy * point.y() / point.z() + cy};
  }
};

/// Depth error of a stereo camera, dz = z^2 / (B f) * dd (the paper, III-D).
struct PLANAR_MAPPING_EXPORT StereoNoise {
  double baseline = 0.12;        ///< B, metres, > 0
  double focal_length = 500.0;   ///< f, pixels, > 0
  double disparity_error = 0.5;  ///< dd, pixels, >= 0

  /// dz at depth \p z (metres).
  double depthError(double z) const { return z * z / (baseline * focal_length) * disparity_error; }
  /// \throws ParameterError
  void validate() const;
};

/// A key feature of one frame: a place that is recognised in other frames, with its 3-D position
/// (the paper, III-B; METHOD section 1).
struct KeyFeature {
  std::int64_t track = -1;     ///< identity over frames, >= 0; a feature seen again keeps it
  std::int32_t sightings = 1;  ///< frames it was seen in so far, this one counted
  float column = std::numeric_limits<float>::quiet_NaN();     ///< pixels, left or only image
  float row = std::numeric_limits<float>::quiet_NaN();        ///< pixels
  float disparity = std::numeric_limits<float>::quiet_NaN();  ///< pixels; NaN without a stereo pair
  Vector3 position = Vector3::Zero();                         ///< sensor's frame, metres
};

/// What a camera measures of a point: column and row in pixels, and 1 / z in 1/m. The error of a
/// stereo camera's disparity d = B f / z is one number at any depth, so that in these three the
/// noise is nearly normal even where depth itself is anybody's guess.
struct FeatureSighting {
  double column = 0.0;
  double row = 0.0;
  double inverse_depth = 0.0;
};

/// A pinhole camera that measures depth, by stereo or otherwise, and how well it does.
struct PLANAR_MAPPING_EXPORT FeatureCamera {
  double fx = 500.0;  ///< pixels, > 0
  double fy = 500.0;  ///< pixels, > 0
  double cx = 320.0;  ///< pixels
  double cy = 240.0;  ///< pixels
  /// [ours] Standard deviation of a feature's column and row, pixels, > 0.
  double pixel_error = 0.5;
  /// [ours] Standard deviation of depth: dz = depth_error + depth_error_growth * z^2. At least one
  /// of them is > 0.
  double depth_error = 0.0;               ///< metres, >= 0
  double depth_error_growth = 1.0 / 120;  ///< 1/m, >= 0; of a stereo camera dd / (B f)

  /// dz at depth \p z, metres.
  double depthError(double z) const { return depth_error + depth_error_growth * z * z; }
  /// Takes focal lengths and principal point; the errors stay.
  void setPinhole(const PinholeCamera& camera) {
    fx = camera.fx;
    fy = camera.fy;
    cx = camera.cx;
    cy = camera.cy;
  }
  /// \throws ParameterError
  void validate() const;
};

/// Where the camera sees \p point (its own frame, z > 0).
PLANAR_MAPPING_EXPORT FeatureSighting project(const FeatureCamera& camera, const Vector3& point);
/// The point a sighting stands for, in the camera's frame.
PLANAR_MAPPING_EXPORT Vector3 backProject(const FeatureCamera& camera,
                                          const FeatureSighting& sighting);
/// Variances of column, row (px^2) and inverse depth (1/m^2) of a sighting.
PLANAR_MAPPING_EXPORT Vector3 sightingVariance(const FeatureCamera& camera, double inverse_depth);
/// Covariance of backProject(), square metres.
PLANAR_MAPPING_EXPORT Matrix3 positionCovariance(const FeatureCamera& camera,
                                                 const FeatureSighting& sighting);
/// The same for other variances of the sighting, as sightingVariance() has them.
PLANAR_MAPPING_EXPORT Matrix3 positionCovariance(const FeatureCamera& camera,
                                                 const FeatureSighting& sighting,
                                                 const Vector3& variance);

/// The sighting in a feature; column and row follow from the position where they are not known (a
/// feature of a cloud without image).
/// \return false if the position is not finite, not in front of the camera or beyond 1e9 m
PLANAR_MAPPING_EXPORT bool sightingOf(const FeatureCamera& camera, const KeyFeature& feature,
                                      FeatureSighting& sighting);

}  // namespace planar_mapping
