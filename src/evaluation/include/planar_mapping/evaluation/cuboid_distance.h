// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/cuboid.h"
#include "planar_mapping/core/export.h"

namespace planar_mapping {
namespace evaluation {

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
  /// Is the point inside a cuboid whose number is less than \p end?
  bool isInsideOneBefore(const Vector3& point, std::size_t end) const;

 private:
  struct Box {
    double center[3];
    double to_local[9];  ///< row major
    double half[3];
    std::uint32_t number;  ///< in the caller's list
  };
  struct Node {
    double low[3];
    double high[3];
    std::uint32_t first;  ///< box of a leaf, else the right child; the left one is next
    std::uint32_t count;  ///< boxes of a leaf, 0 = inner node
    std::uint32_t least;  ///< smallest number below it
  };
  std::uint32_t build(std::uint32_t begin, std::uint32_t end, const std::vector<double>& bounds,
                      std::vector<std::uint32_t>& order);
  static double squaredDistance(const Box& box, const double* point);
  static double squaredDistance(const Node& node, const double* point);

  std::vector<Box> boxes_;  ///< in the order of the tree
  std::vector<Node> nodes_;
};

}  // namespace evaluation
}  // namespace planar_mapping
