// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>

#include "planar_mapping/atlas/atlas_data.h"

namespace planar_mapping::detail {

constexpr double kInverseDepthUnits = 4096.0;  // of Keyframe::inverse_depths

/// The grid of inverse depths of a keyframe. Does not outlive it.
class KeyframeCells {
 public:
  explicit KeyframeCells(const Keyframe& key)
      : key_(key),
        across_(key.cells_across),
        down_(across_ > 0 ? static_cast<int>(key.inverse_depths.size()) / across_ : 0) {}

  std::size_t size() const { return key_.inverse_depths.size(); }
  int across() const { return across_; }
  int down() const { return down_; }

  bool contains(double column, double row) const {
    return column >= -0.5 && row >= -0.5 && column < key_.width - 0.5 && row < key_.height - 0.5;
  }
  int columnOf(double column) const {
    const auto cell = static_cast<int>((column + 0.5) * across_ / key_.width);
    return std::clamp(cell, 0, across_ - 1);
  }
  int rowOf(double row) const {
    return std::clamp(static_cast<int>((row + 0.5) * down_ / key_.height), 0, down_ - 1);
  }
  /// The cell of a pixel that the image contains.
  std::size_t at(double column, double row) const {
    return static_cast<std::size_t>(rowOf(row) * across_ + columnOf(column));
  }
  /// What is measured in a cell, in the middle of it; inverse depth 0 = nothing.
  FeatureSighting middle(int column, int row) const {
    return {(column + 0.5) * key_.width / across_ - 0.5, (row + 0.5) * key_.height / down_ - 0.5,
            depth(column, row)};
  }
  double depth(int column, int row) const {
    return key_.inverse_depths[static_cast<std::size_t>(row * across_ + column)] /
           kInverseDepthUnits;
  }

 private:
  const Keyframe& key_;
  int across_;
  int down_;
};

}  // namespace planar_mapping::detail
