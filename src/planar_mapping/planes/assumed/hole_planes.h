// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/random.h"
#include "planar_mapping/planes/assumed/tile_image.h"

namespace planar_mapping::detail {

/// A plane that may continue in a hole.
struct HolePlane {
  std::size_t number = 0;  ///< of the frame's planes
  Plane plane;
  Matrix3 covariance = Matrix3::Zero();  ///< of its distance from points p: p . covariance . p
  Indices ends;                          ///< tiles on it, ascending
};

/// Which planes the tiles at the ends of a hole lie on.
class HolePlanes {
 public:
  /// \param up  zero: not known
  HolePlanes(const TileImage& tiles, const Vector3& up, const MultiPlaneParams& params)
      : tiles_(tiles), up_(up), params_(params) {}

  /// How far off a plane a point of it may seem, metres.
  double band(const Vector3& point) const {
    return params_.noise
               ? std::max(params_.distance_threshold, params_.noise->depthError(point.z()))
               : params_.distance_threshold;
  }
  bool isUpright(const Plane& plane) const {
    return !up_.isZero() && std::abs(plane.normal.dot(up_)) <= kUpright;
  }
  /// A direction in a plane: the level one of an upright plane.
  Vector3 levelAlong(const Plane& plane) const {
    return isUpright(plane) ? Vector3(up_.cross(plane.normal)) : plane.normal.unitOrthogonal();
  }
  bool areTurnedAlike(const Plane& a, const Plane& b) const {
    return a.normal.dot(b.normal) >= std::cos(kUpright);
  }
  /// The ends that lie on a plane. \return false if they are too few or the plane is seen through
  bool isSeen(const Hole& hole, const Plane& plane, Indices& ends) const;
  /// \return false if the tiles leave open how the plane is turned
  bool fit(HolePlane& plane) const;
  /// Fits a plane to tiles as well. \return false if not all of them lie on one
  bool join(const Indices& tiles, HolePlane& plane) const;
  /// An upright plane of some of the ends of a hole, which are not of planes turned otherwise.
  bool search(const Hole& hole, const Indices& ends, const std::vector<PlaneSegment>& known,
              Random& random, HolePlane& best) const;

 private:
  static constexpr double kUpright = 0.17;  ///< radians: ten degrees

  /// Nearly all of the tiles.
  bool lieOn(const Indices& tiles, const Plane& plane) const;
  bool isAcross(const HolePlane& plane, const std::vector<PlaneSegment>& known) const;

  const TileImage& tiles_;
  const Vector3 up_;
  const MultiPlaneParams& params_;
};

}  // namespace planar_mapping::detail
