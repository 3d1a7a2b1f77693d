// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/geometry/plane_moments.h"
#include "planar_mapping/ground/ground.h"

// The steps of findGround(): a plane from a sample, its bends (slopes), a label for every point.
namespace planar_mapping::detail {

/// Axes at the sensor: x forwards, y left, z up; and how wide the band around the ground is.
struct GroundFrame {
  GroundFrame(const GroundParams& params, const Vector3& up);

  Matrix3 axes;        ///< rows: forwards, left, up
  Vector3 depth_axis;  ///< unit, or zero: depth is the distance
  double distance_threshold;
  double noise_per_depth_and_height;  ///< noise_factor * dd / (B f), 0 without a noise model

  double band(double depth, double height) const {
    return std::max(distance_threshold, noise_per_depth_and_height * height * depth);
  }
  Vector3 local(const Vector3& p) const { return axes * p; }
  double depth(const Vector3& p) const;
};

/// Points of the sample in the ground frame, one array per coordinate.
struct GroundSample {
  std::vector<float> x, y, z;
  std::vector<float> depth;
  std::size_t size() const { return x.size(); }
};

/// At most \p params.sample_size finite points, spread evenly over those that count.
GroundSample drawGroundSample(const PointsView& points, const Indices* indices,
                              const GroundParams& params, const GroundFrame& frame);

/// Takes out what belongs to upright surfaces: a level cut through walls is no ground, and their
/// feet would lift the ground.
void dropUprights(GroundSample& sample, const GroundParams& params, const GroundFrame& frame);

/// z = slope_x * x + slope_y * y + offset in the ground frame.
struct GroundPlane {
  double slope_x = 0.0;
  double slope_y = 0.0;
  double offset = 0.0;
  /// 1 / sqrt(1 + slopes^2): turns a difference in z into a distance.
  double cosine() const;
  double height() const { return -offset * cosine(); }
};

struct GroundEstimate {
  GroundPlane plane;
  PlaneMoments moments;  ///< of the inliers, in the ground frame
};

/// The plane of the ground from the sample.
/// \param needed points of the sample that must support it
GroundStatus estimateGround(const GroundSample& sample, const GroundParams& params,
                            const GroundFrame& frame, double needed, GroundEstimate& estimate,
                            GroundDiagnostics& diagnostics);

/// Height of the ground over its plane at the sensor, in linear pieces on a square grid.
struct GroundBends {
  /// Follows the ground outwards from the sensor.
  GroundBends(const GroundSample& sample, const GroundEstimate& estimate,
              const GroundParams& params, const GroundFrame& frame);

  static constexpr int kCells = 64;
  static constexpr int kSide = kCells + 2;  ///< with the border

  /// For the pass over the points: column = 1 + floor((x - origin) * cells_per_metre), row
  /// likewise; w = c[0] + c[1] x + c[2] y with c = pieces + 3 * (row * kSide + column) is the
  /// distance of the local ground from the plane at the sensor, metres. Outside the grid the ground
  /// is flat, and so are the pieces along its border.
  float origin = 0.0f;
  float cells_per_metre = 0.0f;
  std::vector<float> pieces;  ///< three per cell; empty = flat
  std::size_t followed = 0;   ///< cells in which the ground was followed
};

/// Fills ground.is_ground and the counts that belong to it.
void labelGround(const PointsView& points, const Indices* indices, const GroundParams& params,
                 const GroundFrame& frame, const GroundPlane& plane, const GroundBends& bends,
                 Ground& ground);

}  // namespace planar_mapping::detail
