// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/cloud_places.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kPoints = 2400;   // kept of a cloud
constexpr std::size_t kCandidates = 2;  // submaps that a cloud is registered to
// What all planes of a cloud share, so that many of them do not average it out.
constexpr double kSharedShift = 0.01;  // metres
constexpr double kSharedTurn = 0.002;  // radians

Vector3 middleOf(const std::vector<float>& xyz) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3)
    sum += Vector3(xyz[i], xyz[i + 1], xyz[i + 2]);
  return 3.0 / static_cast<double>(std::max<std::size_t>(xyz.size(), 3)) * sum;
}

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

/// Points spread over a cloud.
std::vector<float> thinned(const PointsView& cloud) {
  std::vector<std::size_t> measured;
  for (std::size_t i = 0; i < cloud.size; ++i)
    if (cloud.isMeasured(i)) measured.push_back(i);
  const std::size_t count = std::min(kPoints, measured.size());
  std::vector<float> xyz;
  xyz.reserve(3 * count);
  const double apart = static_cast<double>(measured.size()) / static_cast<double>(count);
  for (std::size_t k = 0; k < count; ++k) {
    // Not always of the same columns of an image.
    const double within = std::fmod(0.618034 * static_cast<double>(k), 1.0);
    const float* point =
        cloud[measured[static_cast<std::size_t>((static_cast<double>(k) + within) * apart)]];
    xyz.insert(xyz.end(), point, point + 3);
  }
  return xyz;
}

}  // namespace

void CloudPlaces::add(const SeenCloud& cloud) {
  Kept kept{cloud.submap, cloud.T_submap_sensor, thinned(cloud.points), {}};
  if (kept.xyz.empty()) return;
  kept.middle = cloud.T_submap_sensor * middleOf(kept.xyz);
  clouds_.push_back(std::move(kept));
}

SurfaceMap CloudPlaces::mapOf(std::int64_t submap, const SurfaceMapParams& params) const {
  const auto is_in = [&](const Kept& cloud) { return cloud.submap == submap; };
  const auto first = std::find_if(clouds_.begin(), clouds_.end(), is_in);
  SurfaceMap map(surfaceParamsFor(viewOf(first->xyz), params));
  for (const Kept& cloud : clouds_)
    if (is_in(cloud)) map.insert(viewOf(cloud.xyz), cloud.T_submap_sensor);
  return map;
}

std::vector<Link> CloudPlaces::links(const SeenCloud& cloud, const AtlasData& data,
                                     const std::vector<std::int64_t>& excluded) const {
  const SurfaceMapParams params =
      cloud.is_scan ? SurfaceMapParams::ofScanner() : SurfaceMapParams();
  const Submap& own = rowOf(data.submaps, cloud.submap);
  const Vector3 middle =
      own.T_world_submap * (cloud.T_submap_sensor * middleOf(thinned(cloud.points)));
  std::map<std::int64_t, double> nearest;
  for (const Kept& other : clouds_) {
    const Submap& submap = rowOf(data.submaps, other.submap);
    if (submap.id == own.id || submap.component != own.component ||
        std::find(excluded.begin(), excluded.end(), submap.id) != excluded.end())
      continue;
    const double apart = (submap.T_world_submap * other.middle - middle).norm();
    const auto [known, is_new] = nearest.emplace(submap.id, apart);
    if (!is_new) known->second = std::min(known->second, apart);
  }
  std::vector<std::pair<double, std::int64_t>> order;
  for (const auto& [id, apart] : nearest)
    if (apart < params.search_reach) order.emplace_back(apart, id);
  std::sort(order.begin(), order.end());
  order.resize(std::min(order.size(), kCandidates));

  std::vector<Link> found;
  for (const auto& [apart, id] : order) {
    const SurfaceMap map = mapOf(id, params);
    const Pose T_other_own = rowOf(data.submaps, id).T_world_submap.inverse() * own.T_world_submap;
    const Pose guess = T_other_own * cloud.T_submap_sensor;
    const CloudRegistration near = map.locateNear(cloud.points, guess);
    const CloudRegistration place = map.locateFar(cloud.points, guess, near);
    if (!place.found || place.fraction < params.min_fraction) continue;
    Link link;
    link.kind = LinkKind::Loop;
    link.from_submap = own.id;
    link.to_submap = id;
    link.T_to_from = place.T_world_sensor * cloud.T_submap_sensor.inverse();
    Vector6 shared;
    shared << Vector3::Constant(kSharedShift * kSharedShift),
        Vector3::Constant(kSharedTurn * kSharedTurn);
    link.covariance =
        turnedCovariance(place.T_world_sensor, place.covariance + Matrix6(shared.asDiagonal()));
    link.evidence.inliers = place.matched;
    link.evidence.matches = place.planes;
    link.evidence.agreement = place.fraction;
    link.evidence.seen_through = place.seen_through;
    found.push_back(std::move(link));
  }
  return found;
}

}  // namespace planar_mapping::detail
