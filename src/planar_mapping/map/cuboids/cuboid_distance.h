// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/map/cuboids/cuboid_index.h"

namespace planar_mapping {

/// Answers for very many points how far the nearest of very many cuboids is: a tree of their
/// bounding boxes. Exact; const functions may be called from several threads at once.
class PLANAR_MAPPING_EXPORT CuboidDistance {
 public:
  /// \throws InputError for a cuboid that is not finite or of negative size
  explicit CuboidDistance(const std::vector<Cuboid>& cuboids);

  std::size_t size() const { return boxes_.size(); }
  /// Distance to the nearest cuboid, 0 inside, infinite without cuboids. Metres.
  double distance(const Vector3& point) const;
  /// distance(point) <= margin, faster.
  bool isWithin(const Vector3& point, double margin) const;
  /// The same for points of which neighbours are asked for one after the other: \p hint (0 at
  /// first) takes the cuboid that answered last from question to question.
  double distance(const Vector3& point, std::uint32_t& hint) const;
  bool isWithin(const Vector3& point, double margin, std::uint32_t& hint) const;

  /// What findBefore() finds.
  struct Overlap {
    bool is_whole = false;               ///< one of them holds all of the block
    std::vector<std::uint32_t> cuboids;  ///< that may hold a part of it; for holds()
  };
  /// The cuboids before number \p end of the list that reach into a block of space: all points
  /// center + half_axes * (a, b, c) with a, b, c in [-1, 1].
  void findBefore(std::size_t end, const Vector3& center, const Matrix3& half_axes,
                  Overlap& overlap) const;
  bool holds(std::uint32_t cuboid, const Vector3& point) const {
    return squaredDistance(boxes_[cuboid], point) <= 0.0;
  }

 private:
  struct Box {
    double center[3];
    double to_local[9];  ///< row major
    double half[3];
  };
  static double squaredDistance(const Box& box, const Vector3& point);

  std::vector<Box> boxes_;  ///< in the caller's order
  detail::CuboidIndex index_;
};

}  // namespace planar_mapping
