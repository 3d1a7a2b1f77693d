// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "rest_elements.h"

#include <algorithm>

namespace planar_mapping::detail {

bool halfCellOf(const Vector3& point, double half, HalfCell& cell) {
  const Eigen::Array3d at = (point / half).array().floor();
  if (!(at.abs() < 4e9).all()) return false;
  cell = {static_cast<std::int64_t>(at.x()), static_cast<std::int64_t>(at.y()),
          static_cast<std::int64_t>(at.z())};
  return true;
}

void addElements(const std::vector<SurfacePiece>& pieces, double half,
                 std::vector<Element>& elements) {
  // Pieces of a quarter follow each other, mostly in one half cell or two.
  constexpr std::size_t kLast = 4;
  const std::size_t first = elements.size();
  for (const SurfacePiece& piece : pieces) {
    HalfCell at{};
    if (!halfCellOf(piece.center, half, at)) continue;
    const Element element(at, piece.probability, true, false);
    const std::size_t last = std::min(kLast, elements.size() - first);
    const bool is_known = std::any_of(elements.end() - last, elements.end(), [&](const Element& e) {
      return e.isAt(element) && e.probability >= element.probability;
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
      elements.emplace_back(HalfCell{2 * static_cast<std::int64_t>(cell.x) + (k & 1),
                                     2 * static_cast<std::int64_t>(cell.y) + (k >> 1 & 1),
                                     2 * static_cast<std::int64_t>(cell.z) + (k >> 2 & 1)},
                            cell.probability, required, required);
    }
  }
}

void sortElements(std::vector<Element>& elements) {
  std::sort(elements.begin(), elements.end());
  elements.erase(std::unique(elements.begin(), elements.end(),
                             [](const Element& l, const Element& r) { return l.isAt(r); }),
                 elements.end());
}

}  // namespace planar_mapping::detail
