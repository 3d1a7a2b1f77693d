// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/ground_places.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

namespace planar_mapping::detail {
namespace {

/// Nothing if the cube is out of reach.
std::optional<GroundPlace> placeOf(const Vector3& point, int points, const Vector3& up) {
  const Vector3 cube = (point / GroundPlace::kSide).array().floor();
  if (!(cube.cwiseAbs().maxCoeff() <= std::numeric_limits<std::int16_t>::max()))
    return std::nullopt;
  GroundPlace place;
  for (std::size_t k = 0; k < 3; ++k)
    place.cube[k] = static_cast<std::int16_t>(cube[static_cast<Eigen::Index>(k)]);
  // At most 3.5 m from the corner: -111 to 111 steps.
  const double height = up.dot(point - place.corner());
  const long steps = GroundPlace::kZero + std::lround(height / GroundPlace::kStep);
  place.points = static_cast<std::uint16_t>(points);
  place.steps = static_cast<std::uint32_t>(points * steps);
  return place;
}

/// Of the same cube.
void join(const GroundPlace& from, GroundPlace& place) {
  constexpr int kMaxPoints = std::numeric_limits<std::uint16_t>::max();
  const int points = std::min<int>(from.points, kMaxPoints - place.points);
  place.steps += static_cast<std::uint32_t>(std::uint64_t{from.steps} *
                                            static_cast<std::uint64_t>(points) / from.points);
  place.points = static_cast<std::uint16_t>(place.points + points);
}

}  // namespace

Vector3 GroundPlace::position(const Vector3& up) const {
  const double height = up.dot(corner()) + kStep * (static_cast<double>(steps) / points - kZero);
  const Vector3 middle = corner() + Vector3::Constant(0.5 * kSide);
  return middle + (height - up.dot(middle)) * up;
}

void GroundPlaces::add(const PointsView& points, const Indices& indices, const Pose& T_world_sensor,
                       const Vector3& up) {
  constexpr std::size_t kSample = 2000;  // points of a frame
  std::vector<GroundPlace> places;
  for (std::size_t k = 0; k < indices.size(); k += indices.size() / kSample + 1) {
    const Vector3 point = points.point(static_cast<std::size_t>(indices[k]));
    if (const auto place = placeOf(T_world_sensor * point, 1, up)) places.push_back(*place);
  }
  add(std::move(places));
}

void GroundPlaces::add(const GroundPlaces& other, const Pose& T, const Vector3& up) {
  const Vector3 up_other = T.linear().transpose() * up;
  std::vector<GroundPlace> places;
  for (const GroundPlace& from : other.places_) {
    if (const auto place = placeOf(T * from.position(up_other), from.points, up))
      places.push_back(*place);
  }
  add(std::move(places));
}

void GroundPlaces::add(std::vector<GroundPlace> places) {
  const auto less = [](const GroundPlace& a, const GroundPlace& b) { return a.cube < b.cube; };
  std::stable_sort(places.begin(), places.end(), less);
  std::vector<GroundPlace> all;
  all.reserve(places_.size() + places.size());
  std::merge(places_.begin(), places_.end(), places.begin(), places.end(), std::back_inserter(all),
             less);
  places_.clear();
  for (const GroundPlace& place : all) {
    if (places_.empty() || places_.back().cube != place.cube) {
      places_.push_back(place);
    } else {
      join(place, places_.back());
    }
  }
  places_.shrink_to_fit();
}

}  // namespace planar_mapping::detail
