// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "planar_mapping/core/geometry/detail/plane_moments.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping::detail {

inline Plane planeOf(const PlaneFrame& frame) {
  return {frame.n, -frame.n.dot(frame.origin)};
}

/// mantissa 2^exponent, or 0.
struct RoundedNumber {
  std::uint16_t mantissa = 0;  ///< 0 or with its highest bit set
  std::int16_t exponent = 0;

  static constexpr int kLargestExponent = 256;
  /// \p value rounded to a mantissa of \p bits; 0 if it is not positive.
  static RoundedNumber from(double value, int bits);
  double value() const;
};

/// What a plane is like; StoredPlane is the same in few bytes.
struct PlaneFit {
  PlaneFrame frame;
  Plane plane;
  PlaneMoments moments;
};

/// Frame and moments of a plane as the file keeps them (docs/file_format.md, "Planes"): in whole
/// numbers. The live map rounds what it keeps the same way, so that a loaded map is the same map.
struct StoredPlane {
  // Units: what they leave out is far below what a stereo camera can tell (a millimetre at 5 m).
  static constexpr double kDirection = 1.0 / 32768.0;  ///< of components of the normal and slopes
  static constexpr std::int32_t kHalfTurn = 1 << 16;   ///< pi
  static constexpr double kLength = 1.0 / 4096.0;      ///< of origin and height, metres
  static constexpr double kPlace = 1.0 / 16.0;         ///< of the mean within the plane, metres
  static constexpr std::int32_t kCorrelation = 64;     ///< stands for 1
  static constexpr int kWeightBits = 10;
  static constexpr int kVarianceBits = 6;
  static constexpr std::int64_t kLargest = std::int64_t{1} << 60;
  static constexpr std::int32_t kLargestSlope = 1 << 30;

  std::uint8_t axis = 0;  ///< of the largest component of the normal; 3 more: it is negative
  std::array<std::int32_t, 2> normal{};  ///< the next two components, cyclically
  std::int32_t turn = 0;                 ///< of u from the reference direction, about the normal
  std::array<std::int64_t, 3> origin{};  ///< its coordinates along u, v, n
  RoundedNumber weight;
  std::array<std::int64_t, 3> mean{};     ///< from the origin, along u, v, n
  std::array<RoundedNumber, 2> variance;  ///< of the points along u and v
  std::int32_t correlation = 0;           ///< of the two
  std::array<std::int32_t, 2> slope{};    ///< of the fitted height over u and v
  RoundedNumber residual;                 ///< variance of the height about that

  static StoredPlane from(const PlaneFrame& frame, const PlaneMoments& moments);
  PlaneFrame frame() const;
  bool hasFrameOf(const StoredPlane& o) const {
    return axis == o.axis && normal == o.normal && turn == o.turn && origin == o.origin;
  }
  /// \param frame what frame() gives
  PlaneMoments moments(const PlaneFrame& frame) const;
  PlaneFit fit() const;
};

}  // namespace planar_mapping::detail
