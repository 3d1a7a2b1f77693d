// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"

namespace planar_mapping {

// Public structs hold unaligned Eigen types only, so that their layout does not depend on the
// instruction set a caller compiles for and std::vector of them needs no special allocator.
using Vector2 = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
using Vector3 = Eigen::Vector3d;
using Vector4 = Eigen::Matrix<double, 4, 1, Eigen::DontAlign>;
using Matrix3 = Eigen::Matrix3d;
using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;
using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;
/// Rigid motion; T_world_camera maps camera coordinates to world coordinates.
using Pose = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;
using Indices = std::vector<int>;

/// \param what  what the pose is, begins the message
/// \throws InputError if it is not finite or its rotation is not orthonormal within 10^-3
PLANAR_MAPPING_EXPORT void requireRigid(const char* what, const Pose& pose);

/// A cloud somebody else owns: xyz triples of float, metres, `stride` floats apart.
///
/// Row major when organized (height > 1); functions that take a view skip points that are no
/// measurement, see isMeasured(). It is a strided float view rather than a 3 x N matrix of doubles
/// so that a pcl::PointCloud of any point type is read in place: copying 640 x 480 points to double
/// costs more than segmenting them.
struct PointsView {
  const float* data = nullptr;
  std::size_t size = 0;
  std::size_t stride = 3;  ///< distance between points, in floats, >= 3
  std::uint32_t width = 0;
  std::uint32_t height = 0;

  PointsView() = default;
  /// Points one after the other; set `stride` where they are farther apart. There is no constructor
  /// of three numbers: `PointsView(data, 640, 480)` would be ambiguous.
  PointsView(const float* first, std::size_t count)
      : data(first),
        size(count),
        width(static_cast<std::uint32_t>(count)),
        height(count > 0 ? 1 : 0) {}
  /// An organized cloud.
  PointsView(const float* first, std::uint32_t columns, std::uint32_t rows,
             std::size_t floats_apart)
      : data(first),
        size(static_cast<std::size_t>(columns) * rows),
        stride(floats_apart),
        width(columns),
        height(rows) {}

  const float* operator[](std::size_t i) const { return data + i * stride; }
  Vector3 point(std::size_t i) const {
    const float* p = (*this)[i];
    return {p[0], p[1], p[2]};
  }
  bool isFinite(std::size_t i) const {
    const float* p = (*this)[i];
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
  }
  /// False for what drivers write where nothing was measured: a coordinate that is not finite, or
  /// all three zero, which is the sensor itself.
  bool isMeasured(std::size_t i) const {
    const float* p = (*this)[i];
    return isFinite(i) && !(p[0] == 0.0F && p[1] == 0.0F && p[2] == 0.0F);
  }
  bool isOrganized() const { return height > 1; }
};

}  // namespace planar_mapping
