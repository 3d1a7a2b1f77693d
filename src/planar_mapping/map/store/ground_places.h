// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/base/types.h"

namespace planar_mapping::detail {

/// Removed ground in a cube, at most 65 km from the origin along each axis.
struct GroundPlace {
  static constexpr double kSide = 2.0;      ///< metres
  static constexpr double kStep = 0.03125;  ///< of heights, metres
  static constexpr int kZero = 128;         ///< steps at the height of the cube's lower corner

  std::array<std::int16_t, 3> cube{};  ///< spans [cube, cube + 1) times the side
  std::uint16_t points = 0;            ///< the first 65535
  std::uint32_t steps = 0;             ///< sum of their heights

  Vector3 corner() const { return kSide * Vector3(cube[0], cube[1], cube[2]); }
  /// At the middle of the cube, but for the height.
  Vector3 position(const Vector3& up) const;
};

/// Where frames had ground that was removed. No cells are made of it, but grids and plans have to
/// know how high it is.
class GroundPlaces {
 public:
  /// Some of the points of a frame.
  /// \param indices  of ground
  /// \param up  a unit vector, the same for all that is added
  void add(const PointsView& points, const Indices& indices, const Pose& T_world_sensor,
           const Vector3& up);
  void add(const GroundPlaces& other, const Pose& T, const Vector3& up);

  /// By cube, ascending.
  const std::vector<GroundPlace>& places() const { return places_; }
  /// \param places  ascending
  void restore(std::vector<GroundPlace> places) { places_ = std::move(places); }

 private:
  void add(std::vector<GroundPlace> places);

  std::vector<GroundPlace> places_;
};

}  // namespace planar_mapping::detail
