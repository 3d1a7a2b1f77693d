// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "planar_mapping/map/integration/frame.h"

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

/// Whether a place is between what is measured before and behind it, within a ray or two.
bool isAtEdge(const DepthImage& image, const Vector3& world, double margin) {
  const Vector3 place = image.toCamera(world);
  if (!image.isOfScan() || !(place.z() > 0.0) || !image.isResponsible(place)) return false;
  const double side = image.tileSide(place.z());
  const DepthImage::Look look = image.look(place, {side, side, margin}, false);
  return look.nearest < look.near && look.farthest > look.far;
}

}  // namespace

void leaveOutStray(const MapData& map, Frame& frame) {
  constexpr float kAlone = 0.5f;  // Eq. 4 of one point
  const std::vector<float>* belief = frame.observation->probability;
  if (belief == nullptr || !map.isCompact()) return;
  const auto is_stray = [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    if ((*belief)[at] > kAlone) return false;
    const Vector3 world = frame.rotation * frame.observation->points.point(at) + frame.sensor;
    const Vector3 cell = (world / map.unknownResolution()).array().floor();
    return cell.cwiseAbs().maxCoeff() < kLatticeLimit && !map.space.isUnknown(toInt3(cell)) &&
           std::any_of(frame.images.begin(), frame.images.end(),
                       [&](const auto& image) { return isAtEdge(image, world, map.resolution()); });
  };
  frame.update.dropped_points += eraseIf(frame.non_planar, is_stray);
}

}  // namespace planar_mapping::detail
