// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/number_text.h"
#include "planar_mapping/map/file/map_record.h"
#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/integration/map_join.h"

namespace planar_mapping::detail {
namespace {

void requireSame(const char* what, double ours, double other) {
  if (ours == other) return;
  throw InputError("maps with different " + std::string(what) +
                   " cannot be merged: " + numberText(ours) + " m here, " + numberText(other) +
                   " m in the other; map one of them again");
}

void requireAlike(const MapData& map, const MapData& other) {
  if (map.isCompact() != other.isCompact()) {
    throw InputError("maps of different profiles cannot be merged; map one of them again");
  }
  requireSame("resolutions", map.resolution(), other.resolution());
  requireSame("resolutions of unknown space", map.unknownResolution(), other.unknownResolution());
  requireSame("thicknesses", map.thickness(), other.thickness());
}

/// A map that lies on its side was given a wrong pose.
void requireLevel(const MapData& map, const MapData& other, const Pose& T) {
  constexpr double kMaxTilt = 0.175;  // 10 degrees: poses of maps are not exact
  const Vector3 ours = map.params.approximation.up.normalized();
  const Vector3 theirs = T.linear() * other.params.approximation.up.normalized();
  if (std::acos(std::clamp(ours.dot(theirs), -1.0, 1.0)) <= kMaxTilt) return;
  const auto text = [](const Vector3& up) {
    const Vector3 rounded = (100.0 * up).array().round() / 100.0 + 0.0;  // no -0
    return "(" + numberText(rounded.x()) + ", " + numberText(rounded.y()) + ", " +
           numberText(rounded.z()) + ")";
  };
  throw InputError("up is " + text(ours) + " here, but " + text(theirs) +
                   " in the other map, where its pose puts it; it needs a pose that turns one to "
                   "the other");
}

/// Far enough from the end of the lattice for a block around it.
bool isWithin(const Vector3& point, double side) {
  return (point / side).cwiseAbs().maxCoeff() < kLatticeLimit - 8;
}

/// Refuses what the lattice of the map does not hold: nothing is dropped unsaid.
void requireWithin(const MapData& data, const Pose& T, bool with_space) {
  const auto require = [&](const Vector3& low, const Vector3& high, double side) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 at(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                       corner & 4 ? high.z() : low.z());
      if (isWithin(T * at, side)) continue;
      throw InputError("part of it would lie beyond the " + std::to_string(kLatticeLimit) +
                       " cells of " + numberText(side) +
                       " m that a map reaches from its origin along each axis");
    }
  };
  const double s = data.resolution();
  for (const PlaneLayer& layer : data.planes) {
    const Eigen::AlignedBox3d box = layer.bounds(s, data.thickness());
    if (!box.isEmpty()) require(box.min(), box.max(), s);
  }
  const auto requireCube = [&](const Int3& at, double side, double cell) {
    const Vector3 low = side * Vector3(at.x, at.y, at.z);
    require(low, low + Vector3::Constant(side), cell);
  };
  data.cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
    if (block.occupied() != 0) requireCube(at, 4.0 * s, s);
  });
  if (!with_space) return;
  const double cell = data.unknownResolution();
  data.space.forEachRegion(
      [&](const Int3& at, const SpaceRegion&) { requireCube(at, 32.0 * cell, cell); });
}

FrameUpdate take(MapData& map, const MapData& other, const Pose& T) {
  if (other.trajectory.empty()) return {};
  const bool is_later = !map.trajectory.empty() &&
                        other.trajectory.front().timestamp > map.trajectory.front().timestamp;
  const Order order = is_later ? Order::Later : Order::Unknown;
  const bool in_place = T.matrix() == Pose::Identity().matrix();
  return in_place ? joinMap(map, other, order) : joinMap(map, placedMap(other, T), order);
}

/// All that is known of space, whatever the numbers of planes.
std::vector<std::uint8_t> contentOf(const MapData& map) {
  MapRecord record = recordOf(map, {});
  record.params = PlanarMapParams();
  record.params.approximation = map.params.approximation;
  record.next_plane_id = 0;
  for (PlaneRecord& plane : record.planes) plane.id = record.next_plane_id++;
  return sectionsOf(std::move(record));
}

/// Of two maps with frames: negative if \p a began first, 0 if they are the same.
int compare(const MapData& a, const MapData& b) {
  const double begins = a.trajectory.front().timestamp - b.trajectory.front().timestamp;
  if (begins != 0.0) return begins < 0.0 ? -1 : 1;
  const std::vector<std::uint8_t> content_a = contentOf(a), content_b = contentOf(b);
  return content_a < content_b ? -1 : content_b < content_a ? 1 : 0;
}

}  // namespace

Pose requireJoinable(const MapData& map, const MapData& other, const Pose& T_map_other) {
  Pose T = T_map_other;
  requirePose(T);
  T.linear() = Quaternion(T.linear()).normalized().toRotationMatrix();
  requireAlike(map, other);
  requireWithin(other, T, map.params.unknown_space);
  return T;
}

FrameUpdate mergeMaps(MapData& map, const MapData& other, const Pose& T_map_other) {
  const Pose T = requireJoinable(map, other, T_map_other);
  requireLevel(map, other, T);
  const bool in_place = T.matrix() == Pose::Identity().matrix();
  if (other.trajectory.empty()) return {};
  const int order = map.trajectory.empty() ? 1 : compare(map, other);
  if (order == 0 && in_place) return {};
  if (order <= 0) return take(map, other, T);
  // The one that began first takes the other, whichever was asked to.
  MapData first(map.params);
  if (in_place && other.params.unseen == map.params.unseen &&
      other.params.unknown_space == map.params.unknown_space) {
    first = other;
    first.params = map.params;
  } else {
    take(first, other, T);
  }
  FrameUpdate update = take(first, map, Pose::Identity());
  update.planes_new = first.planes.size() + update.planes_merged - map.planes.size();
  map = std::move(first);
  return update;
}

}  // namespace planar_mapping::detail
