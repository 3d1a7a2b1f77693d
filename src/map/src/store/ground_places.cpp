// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/ground_places.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_mapping::detail {
namespace {

constexpr int kMaxPoints = 255;

}  // namespace

Vector3 GroundPlace::position(const Vector3& up) const {
  const double height = up.dot(corner()) + kStep * (static_cast<double>(steps) / points - kZero);
  const Vector3 middle = corner() + Vector3::Constant(0.5 * kSide);
  return middle + (height - up.dot(middle)) * up;
}

void GroundPlaces::add(const PointsView& points, const Indices& indices, const Pose& T_world_sensor,
                       const Vector3& up) {
  constexpr std::size_t kSample = 2000;  // points of a frame
  for (std::size_t k = 0; k < indices.size(); k += indices.size() / kSample + 1)
    add(T_world_sensor * points.point(static_cast<std::size_t>(indices[k])), 1, up);
  places_.shrink_to_fit();
}

void GroundPlaces::add(const GroundPlaces& other, const Pose& T, const Vector3& up) {
  const Vector3 up_other = T.linear().transpose() * up;
  for (const GroundPlace& place : other.places_)
    add(T * place.position(up_other), place.points, up);
}

void GroundPlaces::add(const Vector3& point, int points, const Vector3& up) {
  const Vector3 cube = (point / GroundPlace::kSide).array().floor();
  if (!(cube.cwiseAbs().maxCoeff() <= std::numeric_limits<std::int16_t>::max())) return;
  GroundPlace place;
  for (std::size_t k = 0; k < 3; ++k)
    place.cube[k] = static_cast<std::int16_t>(cube[static_cast<Eigen::Index>(k)]);
  const auto found =
      std::lower_bound(places_.begin(), places_.end(), place,
                       [](const GroundPlace& a, const GroundPlace& b) { return a.cube < b.cube; });
  GroundPlace& known =
      found != places_.end() && found->cube == place.cube ? *found : *places_.insert(found, place);
  // At most 3.5 m from the corner: -111 to 111 steps.
  const double height = up.dot(point - place.corner());
  const int steps = GroundPlace::kZero + static_cast<int>(std::lround(height / GroundPlace::kStep));
  const int taken = std::min(points, kMaxPoints - int{known.points});
  known.steps = static_cast<std::uint16_t>(known.steps + taken * steps);
  known.points = static_cast<std::uint8_t>(known.points + taken);
}

}  // namespace planar_mapping::detail
