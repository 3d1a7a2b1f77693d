// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/cloud_places.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/registration/seen_through.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kNearest = 2;  // submaps of its own component that a cloud is registered to
// What all planes of a cloud share.
constexpr double kSharedShift = 0.01;  // metres
constexpr double kSharedTurn = 0.002;  // radians
// Of the points of two clouds, where the other one saw through: edges, and somebody who walks by.
// Half of what makes a doubt.
constexpr double kMostSeenThrough = 0.01;

/// The points of a keyframe, metres.
class KeyframePoints {
 public:
  explicit KeyframePoints(const Keyframe& key) {
    xyz_.reserve(key.points.size());
    for (const std::int16_t value : key.points)
      xyz_.push_back(static_cast<float>(key.point_step * value));
  }
  PointsView view() const { return {xyz_.data(), xyz_.size() / 3}; }

 private:
  std::vector<float> xyz_;
};

Vector3 middleOf(const PointsView& points) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < points.size; ++i) sum += points.point(i);
  return sum / static_cast<double>(std::max<std::size_t>(points.size, 1));
}

template <typename List>
bool contains(const List& list, std::int64_t id) {
  return std::find(list.begin(), list.end(), id) != list.end();
}

/// The best of each submap, the best of all first.
/// \param order  badness and cloud
template <typename Cloud>
std::vector<std::int64_t> bestOfSubmaps(std::vector<std::pair<double, const Cloud*>> order,
                                        std::size_t most) {
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::set<std::int64_t> submaps;
  std::vector<std::int64_t> ids;
  for (const auto& [badness, cloud] : order)
    if (ids.size() < most && submaps.insert(cloud->submap).second) ids.push_back(cloud->id);
  return ids;
}

Link linkOf(const Keyframe& key, const Keyframe& other, const CloudRegistration& place,
            double seen_through) {
  Link link = linkBetween(LinkKind::Surface, key, other);
  link.T_to_from = place.T_world_sensor * key.T_submap_keyframe.inverse();
  link.covariance = turnedCovariance(place.T_world_sensor,
                                     withShared(place.covariance, kSharedShift, kSharedTurn));
  link.evidence.inliers = place.matched;
  link.evidence.matches = place.planes;
  link.evidence.agreement = place.fraction;
  link.evidence.seen_through = seen_through;
  return link;
}

/// Of one cloud: leaves out components in which it was found at two places.
void leaveOutAmbiguous(const Keyframe& key, const AtlasData& data, std::vector<Link>& links) {
  std::map<std::int64_t, Pose> place_of;
  std::set<std::int64_t> ambiguous;
  const auto componentOf = [&](const Link& link) {
    return rowOf(data.submaps, link.to_submap).component;
  };
  for (const Link& link : links) {
    const Pose place =
        rowOf(data.submaps, link.to_submap).T_world_submap * link.T_to_from * key.T_submap_keyframe;
    const auto [first, is_new] = place_of.emplace(componentOf(link), place);
    if (!is_new && !isSamePlace(first->second, place)) ambiguous.insert(first->first);
  }
  const auto is_ambiguous = [&](const Link& link) {
    return ambiguous.count(componentOf(link)) > 0;
  };
  links.erase(std::remove_if(links.begin(), links.end(), is_ambiguous), links.end());
}

}  // namespace

CloudPlaces::Ranges CloudPlaces::rangesOf(const PointsView& points) {
  constexpr double kFirst = 0.5;    // metres
  constexpr double kPerOctave = 2;  // bins
  Ranges ranges{};
  for (std::size_t i = 0; i < points.size; ++i) {
    const double octaves = std::log2(std::max(points.point(i).norm(), kFirst) / kFirst);
    const auto bin = static_cast<std::size_t>(kPerOctave * octaves);
    ranges[std::min(bin, ranges.size() - 1)] += 1.0 / static_cast<double>(points.size);
  }
  return ranges;
}

void CloudPlaces::add(const Keyframe& key) {
  const KeyframePoints points(key);
  clouds_.push_back({key.id, key.submap, key.is_scan,
                     key.T_submap_keyframe * middleOf(points.view()), rangesOf(points.view())});
}

std::vector<std::int64_t> CloudPlaces::candidates(const Keyframe& key, std::size_t n,
                                                  const std::vector<std::int64_t>& excluded) const {
  std::vector<std::pair<double, const Kept*>> order;
  if (!key.is_scan) return {};
  const Ranges ranges = rangesOf(KeyframePoints(key).view());
  for (const Kept& other : clouds_) {
    if (!other.is_scan || other.submap == key.submap || contains(excluded, other.submap)) continue;
    double apart = 0.0;
    for (std::size_t i = 0; i < ranges.size(); ++i) apart += std::abs(ranges[i] - other.ranges[i]);
    order.emplace_back(apart, &other);
  }
  return bestOfSubmaps(std::move(order), n);
}

/// Clouds of the submaps of its own component that saw its surroundings from nearest: those of its
/// own session, or of others.
std::vector<std::int64_t> CloudPlaces::nearest(const Keyframe& key, const AtlasData& data,
                                               const Submap& own,
                                               const std::vector<std::int64_t>& excluded,
                                               double reach, bool of_own_session) const {
  const Vector3 middle =
      own.T_world_submap * (key.T_submap_keyframe * middleOf(KeyframePoints(key).view()));
  std::vector<std::pair<double, const Kept*>> order;
  for (const Kept& other : clouds_) {
    const Submap& submap = rowOf(data.submaps, other.submap);
    if (submap.id == own.id || submap.component != own.component ||
        (submap.session == own.session) != of_own_session || contains(excluded, submap.id))
      continue;
    const double apart = (submap.T_world_submap * other.middle - middle).norm();
    if (apart < reach) order.emplace_back(apart, &other);
  }
  return bestOfSubmaps(std::move(order), kNearest);
}

SurfaceMap CloudPlaces::mapOf(std::int64_t submap, const AtlasData& data,
                              const SurfaceMapParams& params) const {
  SurfaceMap map(params);
  for (const Kept& cloud : clouds_) {
    if (cloud.submap != submap) continue;
    const Keyframe& key = rowOf(data.keyframes, cloud.id);
    map.insert(KeyframePoints(key).view(), key.T_submap_keyframe);
  }
  return map;
}

/// Of the points of a cloud, what clouds saw through that were taken nearby, or of theirs what it
/// saw through: rooms of one shape differ in what stands in them. Nothing where less than half can
/// be compared.
/// \param T_world_key    in the world of the component
/// \param beside         of the component and session of the others
/// \param within_submap  the others are of that submap: the rest of its session may have drifted
std::optional<double> CloudPlaces::seenThrough(const Keyframe& key, const Pose& T_world_key,
                                               const Submap& beside, bool within_submap,
                                               const AtlasData& data) const {
  constexpr std::size_t kViews = 3;
  constexpr double kReach = 4.0;  // metres
  std::vector<std::pair<double, const Kept*>> near;
  const auto poseOf = [&](const Kept& cloud) -> Pose {
    return rowOf(data.submaps, cloud.submap).T_world_submap *
           rowOf(data.keyframes, cloud.id).T_submap_keyframe;
  };
  for (const Kept& cloud : clouds_) {
    const Submap& submap = rowOf(data.submaps, cloud.submap);
    if (within_submap ? submap.id != beside.id
                      : submap.component != beside.component || submap.session != beside.session)
      continue;
    const double apart = (poseOf(cloud).translation() - T_world_key.translation()).norm();
    if (within_submap || apart < kReach) near.emplace_back(apart, &cloud);
  }
  std::stable_sort(near.begin(), near.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  near.resize(std::min(near.size(), kViews));
  const KeyframePoints own(key);
  const SeenRanges seen(own.view());
  SeenThrough forward, back;
  for (const auto& [apart, cloud] : near) {
    const KeyframePoints theirs(rowOf(data.keyframes, cloud->id));
    const Pose T_other_key = poseOf(*cloud).inverse() * T_world_key;
    forward += SeenRanges(theirs.view()).compare(own.view(), T_other_key);
    back += seen.compare(theirs.view(), T_other_key.inverse());
  }
  if (2 * std::min(forward.compared, back.compared) < own.view().size) return std::nullopt;
  return std::max(forward.fraction(), back.fraction());
}

std::vector<Link> CloudPlaces::links(const Keyframe& key, const AtlasData& data,
                                     const std::vector<std::int64_t>& excluded,
                                     std::size_t most) const {
  const KeyframePoints points(key);
  const PointsView cloud = points.view();
  const SurfaceMapParams params =
      surfaceParamsFor(cloud, key.is_scan ? SurfaceMapParams::ofScanner() : SurfaceMapParams());
  const Submap* const own = key.submap < 0 ? nullptr : &rowOf(data.submaps, key.submap);
  std::vector<Link> found, doubts;
  std::vector<std::int64_t> known = excluded;
  const auto add = [&](const Keyframe& other, const CloudRegistration& place) {
    if (!place.found || place.fraction < params.min_fraction) return;
    const Submap& submap = rowOf(data.submaps, other.submap);
    // Within a session the way between two submaps says enough.
    const bool is_told =
        own != nullptr && submap.component == own->component && submap.session == own->session;
    const std::optional<double> seen_through =
        seenThrough(key, submap.T_world_submap * place.T_world_sensor, submap, is_told, data);
    if (!seen_through) return;
    const Link link = linkOf(key, other, place, *seen_through);
    if (is_told ? !link.isDoubt() : *seen_through <= kMostSeenThrough)
      found.push_back(link);
    else if (link.isDoubt() && !is_told && own != nullptr)
      doubts.push_back(link);
  };
  if (own != nullptr)
    for (const Submap& submap : data.submaps)
      if (submap.component == own->component) known.push_back(submap.id);
  for (const std::int64_t id : candidates(key, most, known)) {
    const Keyframe& other = rowOf(data.keyframes, id);
    const SurfaceMap map = mapOf(other.submap, data, params);
    add(other, map.locateFar(cloud, other.T_submap_keyframe, {}));
  }
  leaveOutAmbiguous(key, data, found);
  if (own != nullptr) {
    std::vector<std::int64_t> near;
    for (const bool of_own_session : {true, false})
      for (const std::int64_t id :
           nearest(key, data, *own, excluded, params.search_reach, of_own_session))
        near.push_back(id);
    for (const std::int64_t id : near) {
      const Keyframe& other = rowOf(data.keyframes, id);
      const SurfaceMap map = mapOf(other.submap, data, params);
      const Pose guess = rowOf(data.submaps, other.submap).T_world_submap.inverse() *
                         own->T_world_submap * key.T_submap_keyframe;
      add(other, map.locateFar(cloud, guess, map.locateNear(cloud, guess)));
    }
  }
  found.insert(found.end(), doubts.begin(), doubts.end());
  return found;
}

}  // namespace planar_mapping::detail
