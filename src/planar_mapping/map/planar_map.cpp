// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/planar_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/planar_map_impl.h"

namespace planar_mapping {

namespace {

bool boundsOf(const std::vector<Cuboid>& cuboids, Vector3& low, Vector3& high) {
  if (cuboids.empty()) return false;
  low = Vector3::Constant(INFINITY);
  high = -low;
  for (const Cuboid& cuboid : cuboids) {
    for (const Vector3& corner : corners(cuboid)) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  return true;
}

/// What seems free up to a far point of a stereo camera may lie behind what is there.
detail::Clearing clearingOf(const detail::MapData& map, const FrameObservation& frame) {
  constexpr double kSureCells = 4.0;  // of depth error
  detail::Clearing clearing{static_cast<float>(map.maxRange()), 0.0f, 0.0f};
  if (!frame.noise) return clearing;
  const double error = frame.noise->depthError(1.0);
  clearing.error = static_cast<float>(error);
  clearing.sure = static_cast<float>(std::sqrt(kSureCells * map.resolution() / error));
  return clearing;
}

}  // namespace

PlanarMap::PlanarMap(const PlanarMapParams& params) : impl_(std::make_unique<Impl>()) {
  params.validate();
  impl_->data = detail::MapData(params);
}
PlanarMap::~PlanarMap() = default;
PlanarMap::PlanarMap(const PlanarMap& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
// A moved-from map is an empty one, not a trap.
PlanarMap::PlanarMap(PlanarMap&& other) noexcept : impl_(std::make_unique<Impl>()) {
  std::swap(impl_, other.impl_);
}
PlanarMap& PlanarMap::operator=(const PlanarMap& other) {
  if (this != &other) impl_ = std::make_unique<Impl>(*other.impl_);
  return *this;
}
PlanarMap& PlanarMap::operator=(PlanarMap&& other) noexcept {
  impl_ = std::exchange(other.impl_, std::make_unique<Impl>());
  return *this;
}

const PlanarMapParams& PlanarMap::params() const {
  return impl_->data.params;
}

FrameUpdate PlanarMap::insert(const FrameObservation& observation) {
  impl_->requireGrowing("insert()");
  detail::Frame frame = detail::makeFrame(observation);
  detail::MapData& map = impl_->data;
  impl_->changed();
  map.trajectory.push_back({observation.timestamp, frame.sensor, frame.orientation});
  if (observation.ground != nullptr)
    map.ground.add(observation.points, *observation.ground, observation.T_world_sensor,
                   map.params.approximation.up.normalized());
  if (map.params.unknown_space || map.params.miss_factor < 1.0) {
    frame.images = detail::makeDepthImages(
        observation, frame.rotation, frame.sensor, frame.use, map.params.range_image_step,
        clearingOf(map, observation), map.params.miss_factor < 1.0);
  }
  detail::leaveOutStray(map, frame);
  // Independent of each other; run in parallel.
  const auto integrateSurfaces = [&] {
    detail::associatePlanes(map, frame);
    detail::integratePlanes(map, frame);
    detail::integrateCells(map, frame);
    detail::integrateMisses(map, frame);
  };
  double space_range = std::numeric_limits<double>::infinity();
  const auto integrateSpace = [&] {
    if (!map.params.unknown_space) return;
    for (const detail::DepthImage& image : frame.images) {
      double range = map.maxRange();
      if (!(map.params.max_range > 0.0)) range = std::min<double>(range, image.farthest());
      detail::SpaceBudget budget;  // each image has a part: what is near comes first in all
      budget.ray_cells /= static_cast<double>(frame.images.size());
      budget.regions /= frame.images.size();
      budget.cubes /= frame.images.size();
      map.space.integrate(image, map.unknownResolution(), range, budget);
      space_range = std::min(space_range, budget.range);
    }
  };
  parallelFor(2, map.params.approximation.threads,
              [&](std::size_t part) { part == 0 ? integrateSurfaces() : integrateSpace(); });
  frame.update.space_range = space_range;
  detail::mergePlanes(map, frame);
  frame.update.patches_rebuilt = map.commit();
  return frame.update;
}

FrameUpdate PlanarMap::merge(const PlanarMap& other, const Pose& T_map_other) {
  impl_->requireGrowing("merge()");
  other.impl_->requireGrowing("merge()");
  if (&other == this) return merge(PlanarMap(other), T_map_other);
  const FrameUpdate update = detail::mergeMaps(impl_->data, other.impl_->data, T_map_other);
  impl_->changed();
  impl_->cache = std::make_unique<Impl::Cache>();  // revisions may have begun anew
  return update;
}

void PlanarMap::clear() {
  impl_->requireGrowing("clear()");
  const PlanarMapParams params = impl_->data.params;
  impl_ = std::make_unique<Impl>();
  impl_->data = detail::MapData(params);
}

detail::Compaction& PlanarMap::Impl::compacted(CoverEffort effort) const {
  const bool is_too_quick = effort == CoverEffort::Full && !cache->compaction.isSettled();
  if (is_too_quick || !cache->counted.load(std::memory_order_relaxed)) {
    cache->compaction.update(data, effort);
    cache->counted.store(true, std::memory_order_release);
  }
  return cache->compaction;
}

detail::SpaceBox PlanarMap::Impl::unknownBox() const {
  if (!data.space.isUnseenUnknown()) return {};
  detail::SpaceBox box;
  if (!boundsOf(occupied().cuboids, box.low, box.high)) box.high = box.low;
  return box;
}

PlanarMap::Impl::Occupied PlanarMap::Impl::occupied() const {
  if (finished) return {finished->cuboids, finished->index};
  const Occupied derived{cache->compaction.list(), cache->index};
  if (cache->ready.load(std::memory_order_acquire)) return derived;
  const std::lock_guard<std::mutex> lock(cache->mutex);
  if (cache->ready.load(std::memory_order_relaxed)) return derived;
  cache->index.build(compacted(CoverEffort::Full).makeList(data));
  cache->ready.store(true, std::memory_order_release);
  return derived;
}

std::size_t PlanarMap::Impl::Cache::memoryBytes() const {
  const std::size_t bytes = sizeof(Cache) + index.memoryBytes() + compaction.memoryBytes();
  if (!lists) return bytes;
  return bytes + sizeof(Lists) + detail::capacityBytes(lists->planes) +
         detail::capacityBytes(lists->trajectory);
}

void PlanarMap::Impl::requireGrowing(const char* what) const {
  if (!finished) return;
  throw InputError(std::string(what) +
                   " needs a map with planes and beliefs; this one is finished and only answers "
                   "questions");
}

PlanarMap::Impl::Impl(const detail::MapRecord& record) : data(detail::mapOf(record)) {
  if (record.is_finished) finish(record.cuboids);
}

void PlanarMap::Impl::finish(const std::vector<Cuboid>& cuboids) {
  auto map = std::make_unique<Finished>();
  map->cuboids = cuboids;
  map->index.build(map->cuboids);
  finished = std::move(map);
  cache.reset();
}

std::size_t PlanarMap::Impl::Finished::memoryBytes() const {
  return sizeof(Finished) + detail::capacityBytes(cuboids) + index.memoryBytes();
}

PlanarMap PlanarMap::finished() const {
  if (impl_->finished) return *this;
  PlanarMap map;
  map.impl_ = std::make_unique<Impl>(detail::finishedRecordOf(impl_->data, cuboids()));
  return map;
}
bool PlanarMap::isFinished() const {
  return impl_->finished != nullptr;
}

const std::vector<Cuboid>& PlanarMap::cuboids() const {
  return impl_->occupied().cuboids;
}
std::size_t PlanarMap::cuboidCount() const {
  if (impl_->finished) return impl_->finished->cuboids.size();
  const std::lock_guard<std::mutex> lock(impl_->cache->mutex);
  return impl_->compacted(CoverEffort::Full).count();
}
std::size_t PlanarMap::cuboidCountAtMost() const {
  if (impl_->finished) return impl_->finished->cuboids.size();
  const std::lock_guard<std::mutex> lock(impl_->cache->mutex);
  return impl_->compacted(CoverEffort::Quick).count();
}
std::size_t PlanarMap::clutteredRegions() const {
  if (impl_->finished) return 0;
  const std::lock_guard<std::mutex> lock(impl_->cache->mutex);
  return impl_->compacted(CoverEffort::Full).clutteredRegions();
}
const std::vector<MapPlane>& PlanarMap::planes() const {
  static const std::vector<MapPlane> kNone;
  if (impl_->finished) return kNone;
  Impl::Cache& cache = *impl_->cache;
  if (cache.planes_ready.load(std::memory_order_acquire)) return cache.lists->planes;
  const std::lock_guard<std::mutex> lock(cache.mutex);
  std::vector<MapPlane>& planes = cache.openLists().planes;
  if (cache.planes_ready.load(std::memory_order_relaxed)) return planes;
  planes.clear();
  planes.reserve(impl_->data.planes.size());
  for (const detail::PlaneLayer& layer : impl_->data.planes) {
    planes.push_back({layer.id, layer.plane(), layer.moments(), layer.frames});
  }
  cache.planes_ready.store(true, std::memory_order_release);
  return planes;
}
const std::vector<std::pair<double, Pose>>& PlanarMap::trajectory() const {
  static const std::vector<std::pair<double, Pose>> kNone;
  if (impl_->finished) return kNone;
  Impl::Cache& cache = *impl_->cache;
  const std::lock_guard<std::mutex> lock(cache.mutex);
  std::vector<std::pair<double, Pose>>& trajectory = cache.openLists().trajectory;
  // Poses are only ever added, until the map is made anew.
  for (std::size_t i = trajectory.size(); i < impl_->data.trajectory.size(); ++i) {
    const detail::FramePose& frame = impl_->data.trajectory[i];
    trajectory.emplace_back(frame.timestamp, frame.pose());
  }
  return trajectory;
}

std::vector<GroundPoint> PlanarMap::ground() const {
  std::vector<GroundPoint> ground;
  const Vector3 up = params().approximation.up.normalized();
  for (const detail::GroundPlace& place : impl_->data.ground.places())
    ground.push_back({place.position(up), place.points});
  return ground;
}

static_assert(PlanarMap::kReach == detail::kLatticeLimit);

std::size_t PlanarMap::unknownCells() const {
  const std::size_t counted = impl_->unknown_cells.load(std::memory_order_acquire);
  if (counted != Impl::kNotCounted) return counted;
  const std::size_t count = impl_->spaceCells(CellState::Unknown, impl_->unknownBox()).count();
  impl_->unknown_cells.store(count, std::memory_order_release);
  return count;
}

std::vector<Cuboid> PlanarMap::unknownCuboids() const {
  const detail::SpaceBox box = impl_->unknownBox();
  return spaceCuboids(CellState::Unknown, box.low, box.high);
}

std::vector<Cuboid> PlanarMap::freeCuboids() const {
  const detail::SpaceBox all;
  return spaceCuboids(CellState::Free, all.low, all.high);
}

std::vector<Cuboid> PlanarMap::spaceCuboids(CellState state, const Vector3& box_low,
                                            const Vector3& box_high) const {
  if (state == CellState::Occupied) throw ParameterError("space is free or unknown");
  const double s = impl_->data.unknownResolution();
  std::vector<Cuboid> cuboids;
  for (const detail::CellBlockBox& box :
       detail::mergeToBoxes(impl_->spaceCells(state, {box_low, box_high}))) {
    const Vector3 low(box.low.x, box.low.y, box.low.z);
    const Vector3 size(box.size.x, box.size.y, box.size.z);
    Cuboid cuboid;
    cuboid.center = s * (low + 0.5 * size);
    cuboid.size = s * size;
    cuboid.probability = state == CellState::Unknown ? 0.5f : 0.0f;
    cuboid.state = state;
    cuboids.push_back(cuboid);
  }
  return cuboids;
}

std::size_t PlanarMap::frames() const {
  return impl_->data.trajectory.size();
}
bool PlanarMap::empty() const {
  return cuboids().empty() && impl_->data.space.empty();
}

bool PlanarMap::bounds(Vector3& low, Vector3& high) const {
  return boundsOf(cuboids(), low, high);
}

std::size_t PlanarMap::memoryBytes() const {
  const std::size_t bytes = sizeof(PlanarMap) + sizeof(Impl) + impl_->data.memoryBytes();
  if (impl_->finished) return bytes + impl_->finished->memoryBytes();
  const std::lock_guard<std::mutex> lock(impl_->cache->mutex);
  return bytes + impl_->cache->memoryBytes();
}

std::vector<std::uint8_t> PlanarMap::serialize() const {
  return detail::serializeMap(isFinished() ? detail::finishedRecordOf(impl_->data, cuboids())
                                           : detail::recordOf(impl_->data, cuboids()));
}

PlanarMap PlanarMap::deserialize(const std::uint8_t* data, std::size_t size, int threads) {
  requireInRange("threads", threads, 0, 4096);
  PlanarMap map;
  map.impl_ = std::make_unique<Impl>(detail::deserializeMap(data, size));
  map.impl_->data.params.approximation.threads = threads;
  return map;
}

}  // namespace planar_mapping
