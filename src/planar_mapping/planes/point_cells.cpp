// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/point_cells.h"

#include <cstring>

#include "planar_mapping/base/point_indices.h"

namespace planar_mapping::detail {

namespace {

constexpr std::uint32_t kSampleDivisor = 8;

/// Drawn by the bits of its coordinates, so that the order of the points does not matter.
bool isSampled(const float* p) {
  std::array<std::uint32_t, 3> bits;
  std::memcpy(bits.data(), p, sizeof(bits));
  std::uint32_t h = bits[0] * 0x9E3779B1u + bits[1] * 0x85EBCA77u + bits[2] * 0xC2B2AE3Du;
  h ^= h >> 15u;
  h *= 0x2C1B3C6Du;
  return (h >> 16u) % kSampleDivisor == 0;
}

/// The cell of \p p; false if it is not finite or too far away.
bool cellAt(const float* p, double inverse_side, CellKey& key) {
  return cellOf({p[0] * inverse_side, p[1] * inverse_side, p[2] * inverse_side}, key);
}

/// Adds \p p to the sums of the cell \p key, about its centre.
void addTo(PointSums& s, const float* p, const CellKey& key, double side) {
  s.add(p[0] - (key.x + 0.5) * side, p[1] - (key.y + 0.5) * side, p[2] - (key.z + 0.5) * side);
}

}  // namespace

double chooseCellSide(const PointsView& points, const Indices* indices, double smallest,
                      double fraction_in_company) {
  std::vector<const float*> sample;
  const std::size_t considered = countOf(points, indices);
  sample.reserve(considered / kSampleDivisor + considered / 64 + 16);
  for (std::size_t k = 0; k < considered; ++k) {
    const float* p = points[at(indices, k)];
    if (isSampled(p) && points.isMeasured(at(indices, k))) sample.push_back(p);
  }
  /// A point and its copies, such as the second return of a laser, are no company.
  struct Sampled {
    const float* first;
    std::size_t points;
    bool company;
  };
  double side = smallest;
  // 2^64 times the smallest side: all floats are in one of eight cells long before.
  for (int doubling = 0; doubling < 64; ++doubling, side *= 2.0) {
    CellTable table(sample.size() / 8);
    std::vector<Sampled> cells;
    std::size_t inside = 0;
    for (const float* p : sample) {
      CellKey key;
      if (!cellAt(p, 1.0 / side, key)) continue;
      ++inside;
      const auto number = static_cast<std::size_t>(table.insert(key));
      if (number == cells.size()) cells.push_back({p, 0, false});
      Sampled& cell = cells[number];
      ++cell.points;
      cell.company |= p[0] != cell.first[0] || p[1] != cell.first[1] || p[2] != cell.first[2];
    }
    std::size_t alone = sample.size() - inside;
    for (const Sampled& cell : cells) alone += cell.company ? 0 : cell.points;
    if (static_cast<double>(alone) <=
        (1.0 - fraction_in_company) * static_cast<double>(sample.size())) {
      break;
    }
  }
  return side;
}

PointCells buildPointCells(const PointsView& points, const Indices* indices, double side) {
  PointCells grid;
  grid.side = side;
  const double inverse_side = 1.0 / side;
  const std::size_t considered = countOf(points, indices);
  grid.cell_of.resize(considered);
  for (std::size_t k = 0; k < considered; ++k) {
    const float* p = points[at(indices, k)];
    CellKey key;
    const bool is_measured = points.isMeasured(at(indices, k));
    if (!is_measured || !cellAt(p, inverse_side, key)) {
      grid.cell_of[k] = -1;
      grid.points_not_measured += is_measured ? 0 : 1;
      continue;
    }
    const std::int32_t cell = grid.table.insert(key);
    grid.cell_of[k] = cell;
    if (static_cast<std::size_t>(cell) == grid.sums.size()) grid.sums.emplace_back();
    addTo(grid.sums[static_cast<std::size_t>(cell)], p, key, side);
  }
  return grid;
}

}  // namespace planar_mapping::detail
