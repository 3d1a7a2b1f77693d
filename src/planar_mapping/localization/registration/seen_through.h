// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/localization/registration/surface_cells.h"

namespace planar_mapping::detail {

/// Planes where a sensor looked: those its rays met or went through.
struct PLANAR_MAPPING_EXPORT SeenThrough {
  std::size_t through = 0;
  std::size_t compared = 0;

  SeenThrough& operator+=(const SeenThrough& other) {
    through += other.through;
    compared += other.compared;
    return *this;
  }
  /// Of those that went through; zero where too few can be compared.
  double fraction() const;
};

/// How far a sensor saw, by direction: the least range of each bin of azimuth and elevation.
class PLANAR_MAPPING_EXPORT SeenRanges {
 public:
  SeenRanges() = default;
  /// \param cloud sensor's frame
  explicit SeenRanges(const PointsView& cloud, const SurfaceMapParams& params = {});

  /// Compares with the planes that face the sensor and lie where it looked: its rays went through
  /// one if nothing it saw there is as near. What it saw in front of a plane hides it, which says
  /// nothing. \param T_sensor_planes from the planes' frame to the sensor's
  SeenThrough compare(const std::vector<Surfel>& planes, const Pose& T_sensor_planes) const;
  /// The same of one plane.
  SeenThrough compare(const Surfel& plane, const Pose& T_sensor_plane) const;
  /// The same of points, which show what is smaller than a cell.
  SeenThrough compare(const PointsView& points, const Pose& T_sensor_points) const;
  /// Marks what the rays went through as gone.
  void markGone(SurfaceCells& cells, const Pose& T_sensor_cells) const;

 private:
  /// Of the bin of this direction and the eight around it: its own must have been looked at.
  double leastAround(const Vector3& direction) const;

  double cell_ = 0.0;
  std::vector<float> ranges_;  ///< by bin; infinite where there is no point
};

}  // namespace planar_mapping::detail
