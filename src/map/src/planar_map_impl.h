// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "compaction.h"
#include "cuboid_index.h"
#include "finished_map.h"
#include "map_data.h"

namespace planar_mapping {

struct PlanarMap::Impl {
  detail::MapData data;
  /// What a finished map has in place of planes and cells: only parameters and space are in the
  /// data then.
  std::unique_ptr<const detail::FinishedMap> finished;

  /// What const functions derive from the data at the first call after a change. Not copied.
  struct Cache {
    std::mutex mutex;
    std::atomic<bool> counted{false};  ///< is the compaction up to date?
    detail::Compaction compaction;
    std::atomic<bool> ready{false};  ///< are the compaction's list and its index?
    std::atomic<bool> planes_ready{false};
    std::vector<MapPlane> planes;                     ///< if they were asked for
    std::vector<std::pair<double, Pose>> trajectory;  ///< as far as it was asked for
    detail::CuboidIndex index;

    std::atomic<bool> unknown_ready{false};
    std::size_t unknown_cells = 0;  ///< that no cuboid occupies
  };
  mutable Cache cache;

  Impl() = default;
  Impl(const Impl& other) : data(other.data) {
    if (other.finished) finished = std::make_unique<detail::FinishedMap>(*other.finished);
  }

  /// The compaction; the lock of the cache is held.
  detail::Compaction& compacted(CoverEffort effort) const;
  /// What is occupied.
  struct Occupied {
    const std::vector<Cuboid>& cuboids;
    const detail::CuboidIndex& index;
  };
  Occupied occupied() const;
  /// Unknown cells that no cuboid occupies. They are many: they are not kept.
  detail::KeyMap<detail::CubeBits> unknownCells() const {
    return detail::unknownCells(data.unknown, occupied().cuboids, data.unknownResolution());
  }
  /// \throws InputError if the map is finished
  void requireGrowing(const char* what) const;
  void changed() {
    cache.counted.store(false, std::memory_order_release);
    cache.ready.store(false, std::memory_order_release);
    cache.planes_ready.store(false, std::memory_order_release);
    cache.unknown_ready.store(false, std::memory_order_release);
  }
};

/// For what asks a map questions from outside the class.
struct detail::MapAccess {
  static const PlanarMap::Impl& of(const PlanarMap& map) { return *map.impl_; }
};

}  // namespace planar_mapping
