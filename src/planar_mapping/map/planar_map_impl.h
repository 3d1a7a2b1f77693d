// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "planar_mapping/map/cuboids/compaction.h"
#include "planar_mapping/map/cuboids/cuboid_index.h"
#include "planar_mapping/map/file/map_record.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping {

struct PlanarMap::Impl {
  detail::MapData data;
  /// What a finished map has in place of planes, cells and cache: only parameters and space are in
  /// the data then.
  struct Finished {
    std::vector<Cuboid> cuboids;
    detail::CuboidIndex index;

    std::size_t memoryBytes() const;  ///< its own block included
  };
  std::unique_ptr<const Finished> finished;

  /// What const functions derive from the data at the first call after a change. Not copied.
  struct Cache {
    std::mutex mutex;
    std::atomic<bool> counted{false};  ///< is the compaction up to date?
    std::atomic<bool> ready{false};    ///< are the compaction's list and its index?
    std::atomic<bool> planes_ready{false};
    detail::CuboidIndex index;
    detail::Compaction compaction;
    struct Lists {
      std::vector<MapPlane> planes;
      std::vector<std::pair<double, Pose>> trajectory;  ///< as far as it was asked for
    };
    std::unique_ptr<Lists> lists;  ///< if one was asked for

    Lists& openLists() {
      if (!lists) lists = std::make_unique<Lists>();
      return *lists;
    }
    std::size_t memoryBytes() const;  ///< its own block included; the lock is held
  };
  std::unique_ptr<Cache> cache = std::make_unique<Cache>();  ///< null if finished

  static constexpr auto kNotCounted = static_cast<std::size_t>(-1);
  mutable std::atomic<std::size_t> unknown_cells{kNotCounted};  ///< that no cuboid occupies

  Impl() = default;
  Impl(const Impl& other) : data(other.data) {
    if (other.finished) finish(other.finished->cuboids);
  }
  /// From what a file holds.
  explicit Impl(const detail::MapRecord& record);
  void finish(const std::vector<Cuboid>& cuboids);

  /// The compaction; the lock of the cache is held.
  detail::Compaction& compacted(CoverEffort effort) const;
  /// What is occupied.
  struct Occupied {
    const std::vector<Cuboid>& cuboids;
    const detail::CuboidIndex& index;
  };
  Occupied occupied() const;
  /// Cells of a state that no cuboid occupies. They are many: they are not kept.
  detail::SpaceCells spaceCells(CellState state, const detail::SpaceBox& box) const {
    return detail::spaceCells(data.space, state, box, occupied().cuboids, data.unknownResolution());
  }
  /// Where unknown space is listed.
  detail::SpaceBox unknownBox() const;
  /// \throws InputError if the map is finished
  void requireGrowing(const char* what) const;
  void changed() {
    cache->counted.store(false, std::memory_order_release);
    cache->ready.store(false, std::memory_order_release);
    cache->planes_ready.store(false, std::memory_order_release);
    unknown_cells.store(kNotCounted, std::memory_order_release);
  }
};

/// For what asks a map questions from outside the class.
struct detail::MapAccess {
  static const PlanarMap::Impl& of(const PlanarMap& map) { return *map.impl_; }
  static PlanarMap::Impl& of(PlanarMap& map) { return *map.impl_; }
};

}  // namespace planar_mapping
