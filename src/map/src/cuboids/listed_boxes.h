// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "cuboids/packed_boxes.h"

namespace planar_mapping::detail {

/// Boxes in few bytes, until a list of cuboids takes them over.
class ListedBoxes {
 public:
  ListedBoxes() = default;
  ListedBoxes(const std::vector<Cuboid>& boxes, double cell) : packed_(boxes, cell) {}

  std::size_t size() const { return packed_.size() + listed_; }
  /// \param list that took them over, if one did
  std::vector<Cuboid> unpacked(const std::vector<Cuboid>& list, double cell) const {
    const auto first = list.begin() + first_;
    std::vector<Cuboid> boxes(first, first + listed_);
    packed_.appendTo(boxes, cell);
    return boxes;
  }
  /// The end of the next list takes them over.
  void moveTo(std::vector<Cuboid>& next, const std::vector<Cuboid>& list, double cell) {
    const auto before = list.begin() + first_;
    first_ = static_cast<std::uint32_t>(next.size());
    next.insert(next.end(), before, before + listed_);
    packed_.appendTo(next, cell);
    listed_ = static_cast<std::uint32_t>(next.size()) - first_;
    packed_ = PackedBoxes();
  }
  std::size_t memoryBytes() const { return packed_.memoryBytes(); }

 private:
  PackedBoxes packed_;
  std::uint32_t first_ = 0;   ///< of those that the list has
  std::uint32_t listed_ = 0;  ///< how many
};

}  // namespace planar_mapping::detail
