// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/rest_elements.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

/// \return false beyond all half cells, or if the point is not finite
bool halfCellOf(const Vector3& point, double half, HalfCell& cell) {
  bool is_inside = true;
  for (std::size_t k = 0; k < 3; ++k) {
    constexpr double kFarthest = 4e9;
    const double at = point[static_cast<Vector3::Index>(k)] / half;
    is_inside &= std::abs(at) < kFarthest;
    const auto whole = static_cast<std::int64_t>(std::abs(at) < kFarthest ? at : 0.0);
    cell[k] = whole - (static_cast<double>(whole) > at ? 1 : 0);
  }
  return is_inside;
}

}  // namespace

void addElements(const std::vector<SurfacePiece>& pieces, double half,
                 std::vector<Element>& elements) {
  // Pieces of a quarter follow each other, mostly in one half cell or two.
  constexpr std::size_t kLast = 4;
  const std::size_t first = elements.size();
  for (const SurfacePiece& piece : pieces) {
    Element element{{}, piece.probability, true, false};
    if (!halfCellOf(piece.center, half, element.at)) continue;
    const std::size_t last = std::min(kLast, elements.size() - first);
    const bool is_known = std::any_of(
        elements.end() - static_cast<std::ptrdiff_t>(last), elements.end(), [&](const Element& e) {
          return e.at == element.at && e.probability >= element.probability;
        });
    if (!is_known) elements.push_back(element);
  }
}

void addElements(const std::vector<NonPlanarCell>& cells, bool tolerant, int min_points,
                 std::vector<Element>& elements) {
  for (const NonPlanarCell& cell : cells) {
    if (min_points > 1 && cell.weight < static_cast<float>(min_points)) continue;
    const bool required = cell.octants != 0;
    for (int k = 0; k < 8; ++k) {
      const bool holds = (cell.octants >> k & 1) != 0;
      if (tolerant && !holds && required) continue;
      elements.push_back({{2 * static_cast<std::int64_t>(cell.x) + (k & 1),
                           2 * static_cast<std::int64_t>(cell.y) + (k >> 1 & 1),
                           2 * static_cast<std::int64_t>(cell.z) + (k >> 2 & 1)},
                          cell.probability,
                          required,
                          required});
    }
  }
}

std::size_t countHalfCells(const std::vector<Element>& elements) {
  std::vector<HalfCell> cells;
  cells.reserve(elements.size());
  for (const Element& e : elements) cells.push_back(e.at);
  std::sort(cells.begin(), cells.end());
  return static_cast<std::size_t>(std::unique(cells.begin(), cells.end()) - cells.begin());
}

}  // namespace planar_mapping::detail
