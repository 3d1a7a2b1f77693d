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
  bool keeps_without_last = false;       ///< the last one was replaced: it grows
  std::optional<MapData> without_last;
  std::vector<std::uint64_t> in_without_last;  ///< of without_last
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
  static bool startsWith(const std::vector<const Submap*>& all,
                         const std::vector<std::uint64_t>& versions);
  void dropFrom(const std::vector<const Submap*>& all);
  void join(const std::vector<const Submap*>& all, std::size_t first, std::size_t end);
};

/// Are these the first ones of all?
bool JoinedMap::Impl::startsWith(const std::vector<const Submap*>& all,
                                 const std::vector<std::uint64_t>& versions) {
  return versions.size() <= all.size() && std::equal(versions.begin(), versions.end(), all.begin(),
                                                     [](std::uint64_t version, const Submap* one) {
                                                       return version == one->version;
                                                     });
}

/// What is joined is not the beginning of all of them: it becomes that.
void JoinedMap::Impl::dropFrom(const std::vector<const Submap*>& all) {
  if (!in_joined.empty()) in_joined.pop_back();
  keeps_without_last = keeps_without_last || (!in_joined.empty() && startsWith(all, in_joined));
  in_joined.clear();
  joined = PlanarMap();
  if (without_last && startsWith(all, in_without_last)) {
    joined = PlanarMap(all.front()->map->params());
    MapAccess::of(joined).data = *without_last;
    in_joined = in_without_last;
  } else {
    without_last.reset();
  }
}

/// Joins submaps from the first to before the end with what there is.
void JoinedMap::Impl::join(const std::vector<const Submap*>& all, std::size_t first,
                           std::size_t end) {
  constexpr std::size_t kAtOnce = 16;  // placed ones, which take as much memory as the submaps
  MapData& data = MapAccess::of(joined).data;
  const int threads = data.params.approximation.threads;
  for (std::size_t begin = first; begin < end; begin += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, end - begin);
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
  if (all.empty() || !impl.startsWith(all, impl.in_joined)) impl.dropFrom(all);
  const std::size_t first = impl.in_joined.size();
  if (first == all.size()) return impl.joined;
  if (first == 0) impl.joined = PlanarMap(all.front()->map->params());
  MapAccess::of(impl.joined).changed();
  try {
    const std::size_t last = all.size() - 1;
    impl.join(all, first, last);
    if (impl.keeps_without_last && first < last) {
      impl.without_last = MapAccess::of(impl.joined).data;
      impl.in_without_last = impl.in_joined;
    }
    impl.join(all, last, all.size());
  } catch (...) {
    impl.in_joined.clear();
    impl.joined = PlanarMap();
    throw;
  }
  return impl.joined;
}

}  // namespace planar_mapping
