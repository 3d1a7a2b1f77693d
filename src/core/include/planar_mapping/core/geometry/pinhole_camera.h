// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/base/types.h"

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

}  // namespace planar_mapping
