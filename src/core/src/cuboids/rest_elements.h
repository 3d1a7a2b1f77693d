// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/cuboids/detail/compact_cover.h"

namespace planar_mapping::detail {

using HalfCell = std::array<std::int64_t, 3>;  ///< x, y, z, each within 2^32 of 0

/// What a half cell holds. Of several in one half cell those that are required count, and of these
/// the exact ones, if there are any; of them the one that is believed most.
struct Element {
  HalfCell at{};
  float probability = 1.0f;
  bool required = false;
  bool exact = false;  ///< holds points anywhere in it, not those of a surface alone
};

/// Points beyond all half cells, or not finite, are left out.
void addElements(const std::vector<SurfacePiece>& pieces, double half,
                 std::vector<Element>& elements);

/// Those of cells with enough points, and where boxes may lie because a cell needs none.
void addElements(const std::vector<NonPlanarCell>& cells, bool tolerant, int min_points,
                 std::vector<Element>& elements);

/// How many half cells hold something.
std::size_t countHalfCells(const std::vector<Element>& elements);

}  // namespace planar_mapping::detail
