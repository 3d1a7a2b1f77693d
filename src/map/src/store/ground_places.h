// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping::detail {

/// Removed ground in a cube of a metre.
struct GroundPlace {
  std::array<std::int32_t, 3> cube{};  ///< spans [cube, cube + 1) metres
  std::array<float, 3> offset{};       ///< mean of the points, from the cube's lower corner, metres
  std::uint32_t points = 0;

  Vector3 mean() const {
    return {cube[0] + double{offset[0]}, cube[1] + double{offset[1]}, cube[2] + double{offset[2]}};
  }
};

/// Where frames had ground that was removed. No cells are made of it, but grids and plans have to
/// know how high it is.
class GroundPlaces {
 public:
  /// Some of the points of a frame: \p indices of ground.
  void add(const PointsView& points, const Indices& indices, const Pose& T_world_sensor);
  void add(const GroundPlaces& other, const Pose& T);

  /// By cube, ascending.
  const std::vector<GroundPlace>& places() const { return places_; }
  /// \param places  ascending
  void restore(std::vector<GroundPlace> places) { places_ = std::move(places); }

 private:
  void add(const Vector3& point, std::uint32_t points);

  std::vector<GroundPlace> places_;
};

}  // namespace planar_mapping::detail
