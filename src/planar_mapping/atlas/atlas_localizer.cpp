// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_localizer.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kCheckedKeyframes = 8;  // keyframes that are checked
/// Another place counts unless it is 20 times less likely (natural logarithm).
constexpr double kMinOddsOverOthers = 3.0;

/// \param link  from the frame to the submap
Place placeOf(const Link& link, const Submap& submap) {
  Place place;
  place.component = submap.component;
  place.session = submap.session;
  place.submap = submap.id;
  place.keyframe = link.to_keyframe;
  place.T_world_sensor = submap.T_world_submap * link.T_to_from;
  place.evidence = link.evidence;
  // Errors turn about the origin of the submap there, about the sensor here.
  const Eigen::Translation3d to_sensor(-place.T_world_sensor.translation());
  place.covariance = turnedCovariance(to_sensor * submap.T_world_submap, link.covariance);
  return place;
}

}  // namespace

AtlasLocalizer::AtlasLocalizer(const AtlasData& atlas) : atlas_(atlas) {
  for (const Keyframe& key : atlas_.keyframes) places_.add(key);
}

std::optional<Place> AtlasLocalizer::find(Keyframe frame) const {
  frame.id = frame.submap = -1;  // no keyframe is its own
  frame.T_submap_keyframe = Pose::Identity();
  std::vector<Place> places;
  for (const Link& link : places_.links(frame, atlas_, {}, kCheckedKeyframes))
    places.push_back(placeOf(link, detail::rowOf(atlas_.submaps, link.to_submap)));
  const auto likelier = [](const Place& a, const Place& b) {
    return a.evidence.log_odds < b.evidence.log_odds;
  };
  const auto best = std::max_element(places.begin(), places.end(), likelier);
  if (best == places.end()) return std::nullopt;
  const bool is_ambiguous = std::any_of(places.begin(), places.end(), [&](const Place& other) {
    return other.component == best->component &&
           !detail::isSamePlace(other.T_world_sensor, best->T_world_sensor) &&
           best->evidence.log_odds - other.evidence.log_odds < kMinOddsOverOthers;
  });
  if (is_ambiguous) return std::nullopt;
  return *best;
}

}  // namespace planar_mapping
