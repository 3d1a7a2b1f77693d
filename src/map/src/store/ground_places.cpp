// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/ground_places.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "store/lattice.h"

namespace planar_mapping::detail {

void GroundPlaces::add(const PointsView& points, const Indices& indices,
                       const Pose& T_world_sensor) {
  constexpr std::size_t kSample = 2000;  // points of a frame
  for (std::size_t k = 0; k < indices.size(); k += indices.size() / kSample + 1)
    add(T_world_sensor * points.point(static_cast<std::size_t>(indices[k])), 1);
}

void GroundPlaces::add(const GroundPlaces& other, const Pose& T) {
  for (const GroundPlace& place : other.places_) add(T * place.mean(), place.points);
}

void GroundPlaces::add(const Vector3& point, std::uint32_t points) {
  const Vector3 corner = point.array().floor();
  if (!(corner.cwiseAbs().maxCoeff() < kLatticeLimit)) return;
  GroundPlace place;
  for (int axis = 0; axis < 3; ++axis) place.cube[axis] = static_cast<std::int32_t>(corner[axis]);
  const auto found =
      std::lower_bound(places_.begin(), places_.end(), place,
                       [](const GroundPlace& a, const GroundPlace& b) { return a.cube < b.cube; });
  GroundPlace& known =
      found != places_.end() && found->cube == place.cube ? *found : *places_.insert(found, place);
  points = std::min(points, std::numeric_limits<std::uint32_t>::max() - known.points);
  known.points += points;
  const float weight = static_cast<float>(points) / static_cast<float>(known.points);
  for (int axis = 0; axis < 3; ++axis) {
    const auto offset = static_cast<float>(point[axis] - corner[axis]);
    known.offset[axis] += weight * (offset - known.offset[axis]);
  }
}

}  // namespace planar_mapping::detail
