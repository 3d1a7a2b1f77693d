// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "registration/plane_neighbours.h"

#include <cmath>
#include <utility>

namespace planar_mapping::detail {

PlaneNeighbours::PlaneNeighbours(std::vector<Surfel> planes, double reach, CellShape shape)
    : reach_(reach), shape_(shape), planes_(std::move(planes)) {
  for (const Surfel& plane : planes_) {
    CellKey cell;
    const Vector3 scaled = plane.center / reach_;
    if (!cellOf(scaled.x(), scaled.y(), scaled.z(), cell)) continue;
    const auto number = static_cast<std::size_t>(cells_.insert(cell));
    if (number == members_.size()) members_.emplace_back();
    members_[number].push_back(static_cast<std::uint32_t>(&plane - planes_.data()));
  }
}

const Surfel* PlaneNeighbours::nearest(const Vector3& point, const Vector3& normal, double reach,
                                       double min_cosine) const {
  CellKey middle;
  const Vector3 scaled = point / reach_;
  if (!cellOf(scaled.x(), scaled.y(), scaled.z(), middle)) return nullptr;
  double best = reach * reach;
  const Surfel* found = nullptr;
  for (int i = 0; i < 27; ++i) {
    const std::int32_t cell =
        cells_.find({middle.x + i / 9 - 1, middle.y + i / 3 % 3 - 1, middle.z + i % 3 - 1});
    if (cell < 0) continue;
    for (const std::uint32_t member : members_[static_cast<std::size_t>(cell)]) {
      const Surfel& plane = planes_[member];
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
