// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {

/// The map of a world, joined from submaps that may move: each is a map in a frame of its own with
/// a pose in the world.
///
/// The joined map is always made of the submaps, in the order of their ids as
/// PlanarMap::merge() has it, each resampled once: planes ride along with the pose, non-planar
/// cells and space are resampled where the pose is not the identity. It depends on the submaps and
/// their poses alone: neither on the order of calls nor on the number of threads. Of submaps in
/// the order in which they were made the later one decides what is free.
///
/// \code
/// planar_mapping::JoinedMap joined;
/// joined.set(0, first, planar_mapping::Pose::Identity());  // std::shared_ptr<const PlanarMap>
/// joined.set(1, second, planar_mapping::Pose::Identity());
/// plan(joined.map());
/// joined.move(1, corrected);  // a loop was closed
/// plan(joined.map());
/// \endcode
///
/// Not for several threads at once; map() itself works on `threads` of the first submap's
/// parameters.
class PLANAR_MAPPING_EXPORT JoinedMap {
 public:
  JoinedMap();
  ~JoinedMap();
  JoinedMap(JoinedMap&& other) noexcept;
  JoinedMap& operator=(JoinedMap&& other) noexcept;

  /// Adds a submap, or replaces the one with this id. The map is not to be changed as long as it is
  /// here.
  /// \param T_world_submap  a rigid motion
  /// \throws InputError as PlanarMap::merge() for maps that do not fit together; nothing has
  ///         changed then
  void set(std::int32_t id, std::shared_ptr<const PlanarMap> map, const Pose& T_world_submap);
  /// Gives a submap another pose. Where that moves nothing within the bounds of its planes and
  /// cells by half a cell or more, it stays where it is.
  /// \return whether it moved
  /// \throws InputError if there is none with this id, or as set()
  bool move(std::int32_t id, const Pose& T_world_submap);
  /// \throws InputError if there is none with this id
  void remove(std::int32_t id);

  std::size_t size() const;  ///< submaps
  bool contains(std::int32_t id) const;
  /// Where it is joined: the last pose that moved it. \throws InputError as move()
  const Pose& pose(std::int32_t id) const;

  /// The joined map, valid until the next call of a function that is not const; the submap itself
  /// if there is only one, in place; an empty map if there is none. After submaps with higher ids
  /// were added only these are joined with it; where the last one is replaced again and again, it
  /// alone is joined, which takes the memory of a second map; after other changes all are.
  /// Cuboids are derived when they are asked for.
  /// \throws InputError if a submap has too much space to be resampled, as PlanarMap::merge()
  const PlanarMap& map();
  /// Submaps that the last call of map() joined with others.
  std::size_t lastJoined() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
