// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "registration/plane_neighbours.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace planar_mapping::detail {

PlaneNeighbours::PlaneNeighbours(std::vector<Surfel> planes, double reach, CellShape shape)
    : reach_(reach), shape_(shape), planes_(std::move(planes)) {
  entries_.reserve(planes_.size());
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    Entry entry;
    entry.plane = static_cast<std::uint32_t>(i);
    if (cellOf(planes_[i].center, entry.cell)) entries_.push_back(entry);
  }
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.cell.x, a.cell.y, a.cell.z, a.plane) <
           std::tie(b.cell.x, b.cell.y, b.cell.z, b.plane);
  });
}

bool PlaneNeighbours::cellOf(const Vector3& point, CellIndex& cell) const {
  constexpr double kFarthestCell = 1e9;
  const Vector3 scaled = point / reach_;
  if (!(scaled.cwiseAbs().maxCoeff() < kFarthestCell)) return false;
  cell = {static_cast<std::int32_t>(std::floor(scaled.x())),
          static_cast<std::int32_t>(std::floor(scaled.y())),
          static_cast<std::int32_t>(std::floor(scaled.z()))};
  return true;
}

const Surfel* PlaneNeighbours::nearest(const Vector3& point, const Vector3& normal, double reach,
                                       double min_cosine) const {
  CellIndex middle;
  if (!cellOf(point, middle)) return nullptr;
  double best = reach * reach;
  const Surfel* found = nullptr;
  for (int row = 0; row < 9; ++row) {
    const std::int32_t x = middle.x + row / 3 - 1;
    const std::int32_t y = middle.y + row % 3 - 1;
    auto entry =
        std::lower_bound(entries_.begin(), entries_.end(), std::make_tuple(x, y, middle.z - 1),
                         [](const Entry& a, const auto& first) {
                           return std::tie(a.cell.x, a.cell.y, a.cell.z) < first;
                         });
    for (; entry != entries_.end(); ++entry) {
      if (entry->cell.x != x || entry->cell.y != y || entry->cell.z > middle.z + 1) break;
      const Surfel& plane = planes_[entry->plane];
      const double squared = (plane.center - point).squaredNorm();
      if (squared >= best) continue;
      const double cosine = plane.normal.dot(normal);
      if ((shape_ == CellShape::Line ? std::abs(cosine) : cosine) < min_cosine) continue;
      best = squared;
      found = &plane;
    }
  }
  return found;
}

}  // namespace planar_mapping::detail
