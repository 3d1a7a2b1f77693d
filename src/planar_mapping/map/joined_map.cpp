// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/joined_map.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/map/integration/map_join.h"
#include "planar_mapping/map/planar_map_impl.h"

namespace planar_mapping {
namespace {

using detail::MapAccess;
using detail::MapData;

/// Farthest that a corner of the box moves, metres: no point in it moves farther.
double largestMotion(const Eigen::AlignedBox3d& box, const Pose& before, const Pose& after) {
  double largest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 at = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    largest = std::max(largest, (after * at - before * at).norm());
  }
  return largest;
}

}  // namespace

struct JoinedMap::Impl {
  struct Submap {
    std::shared_ptr<const PlanarMap> map;
    Pose pose;
    Eigen::AlignedBox3d bounds;  ///< of planes and cells, in its frame
    std::uint64_t version = 0;   ///< another one whenever it is set or moves

    const MapData& data() const { return MapAccess::of(*map).data; }
    bool isInPlace() const { return pose.matrix() == Pose::Identity().matrix(); }
  };
  std::map<std::int32_t, Submap> submaps;
  std::uint64_t versions = 0;
  PlanarMap joined;
  std::vector<std::uint64_t> in_joined;  ///< versions of the submaps of `joined`, in their order
  std::size_t last_joined = 0;

  Submap& at(std::int32_t id) {
    const auto found = submaps.find(id);
    if (found == submaps.end())
      throw InputError("there is no submap with the id " + std::to_string(id));
    return found->second;
  }
  /// \param id  with which it is to be joined
  Pose checked(std::int32_t id, const PlanarMap& map, const Pose& pose) const {
    if (map.isFinished()) throw InputError("a finished map cannot be joined with others");
    const MapData& data = MapAccess::of(map).data;
    const auto other = std::find_if(submaps.begin(), submaps.end(),
                                    [id](const auto& entry) { return entry.first != id; });
    return detail::requireJoinable(other == submaps.end() ? data : other->second.data(), data,
                                   pose);
  }
  void join(const std::vector<const Submap*>& all, std::size_t first);
};

/// Joins submaps from the first on with what there is.
void JoinedMap::Impl::join(const std::vector<const Submap*>& all, std::size_t first) {
  constexpr std::size_t kAtOnce = 16;  // placed ones, which take as much memory as the submaps
  MapData& data = MapAccess::of(joined).data;
  const int threads = data.params.approximation.threads;
  for (std::size_t begin = first; begin < all.size(); begin += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, all.size() - begin);
    std::vector<std::optional<MapData>> placed(count);
    parallelFor(count, threads, [&](std::size_t i) {
      const Submap& submap = *all[begin + i];
      if (!submap.isInPlace()) placed[i] = detail::placedMap(submap.data(), submap.pose);
    });
    for (std::size_t i = 0; i < count; ++i) {
      const Submap& submap = *all[begin + i];
      const MapData& map = placed[i] ? *placed[i] : submap.data();
      if (in_joined.empty() && !placed[i]) {
        data = map;
      } else {
        detail::joinMap(data, map, detail::Order::Later);
      }
      in_joined.push_back(submap.version);
      ++last_joined;
    }
  }
}

JoinedMap::JoinedMap() : impl_(std::make_unique<Impl>()) {}
JoinedMap::~JoinedMap() = default;
JoinedMap::JoinedMap(JoinedMap&& other) noexcept : impl_(std::make_unique<Impl>()) {
  std::swap(impl_, other.impl_);
}
JoinedMap& JoinedMap::operator=(JoinedMap&& other) noexcept {
  impl_ = std::exchange(other.impl_, std::make_unique<Impl>());
  return *this;
}

void JoinedMap::set(std::int32_t id, std::shared_ptr<const PlanarMap> map,
                    const Pose& T_world_submap) {
  if (map == nullptr) throw InputError("there is no map to be joined");
  Impl::Submap submap;
  submap.pose = impl_->checked(id, *map, T_world_submap);
  submap.bounds = detail::boundsOf(MapAccess::of(*map).data);
  submap.map = std::move(map);
  submap.version = ++impl_->versions;
  impl_->submaps[id] = std::move(submap);
}

bool JoinedMap::move(std::int32_t id, const Pose& T_world_submap) {
  Impl::Submap& submap = impl_->at(id);
  const Pose pose = impl_->checked(id, *submap.map, T_world_submap);
  const double least = 0.5 * submap.data().resolution();
  if (submap.bounds.isEmpty() || largestMotion(submap.bounds, submap.pose, pose) < least)
    return false;
  submap.pose = pose;
  submap.version = ++impl_->versions;
  return true;
}

void JoinedMap::remove(std::int32_t id) {
  impl_->at(id);
  impl_->submaps.erase(id);
}

std::size_t JoinedMap::size() const {
  return impl_->submaps.size();
}
bool JoinedMap::contains(std::int32_t id) const {
  return impl_->submaps.count(id) > 0;
}
const Pose& JoinedMap::pose(std::int32_t id) const {
  return impl_->at(id).pose;
}
std::size_t JoinedMap::lastJoined() const {
  return impl_->last_joined;
}

const PlanarMap& JoinedMap::map() {
  Impl& impl = *impl_;
  impl.last_joined = 0;
  std::vector<const Impl::Submap*> all;
  for (const auto& entry : impl.submaps) all.push_back(&entry.second);
  if (all.size() == 1 && all.front()->isInPlace()) return *all.front()->map;
  const auto same = std::mismatch(
      impl.in_joined.begin(), impl.in_joined.end(), all.begin(), all.end(),
      [](std::uint64_t version, const Impl::Submap* submap) { return version == submap->version; });
  if (same.first != impl.in_joined.end() || all.empty()) {
    impl.in_joined.clear();
    impl.joined = PlanarMap();
  }
  const std::size_t first = impl.in_joined.size();
  if (first == all.size()) return impl.joined;
  if (first == 0) impl.joined = PlanarMap(all.front()->map->params());
  MapAccess::of(impl.joined).changed();
  try {
    impl.join(all, first);
  } catch (...) {
    impl.in_joined.clear();
    impl.joined = PlanarMap();
    throw;
  }
  return impl.joined;
}

}  // namespace planar_mapping
