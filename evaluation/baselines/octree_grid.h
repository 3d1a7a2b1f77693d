// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping::evaluation {

/// OG, the octree baseline: OctoMap (Hornung et al., 2013) on its own library, with its recommended
/// settings. Insertion is discretized (one ray per cell that was hit, the fastest of its modes) and
/// prunes on the way; ground clears space and is never occupied, as in octomap_server.
class OctreeGrid {
 public:
  virtual ~OctreeGrid() = default;
  /// Adds one frame: cells with obstacle points are hit, cells that rays to obstacles or ground
  /// cross are missed; a hit goes before a miss. All in the world frame, metres. Points that are
  /// not finite or outside the tree (32768 cells from the origin) are counted as dropped.
  /// \throws InputError for an origin that is not finite or outside the tree
  virtual void insert(const std::vector<Vector3>& obstacles, const std::vector<Vector3>& ground,
                      const Vector3& origin) = 0;
  /// Maximum likelihood, then pruning: what a .bt file holds, and the form in which the octree has
  /// its fewest leaves. Nothing should be inserted after it: the beliefs are gone.
  virtual void finish() = 0;

  struct Counts {
    std::size_t occupied_leaves = 0;  ///< N_f of the octree
    std::size_t free_leaves = 0;
    std::size_t occupied_cells = 0;  ///< in cells of the smallest size, like the next
    std::size_t free_cells = 0;
    std::size_t nodes = 0;  ///< inner nodes and leaves
    std::size_t dropped_points = 0;
  };
  virtual Counts counts() const = 0;
  /// Occupied leaves as cubes of s 2^k, by z, y, x of their centre.
  virtual std::vector<Cuboid> cuboids() const = 0;

  /// What the nodes take of the heap: for each node and each array of children the size of the
  /// block that malloc hands out, its administration included (glibc: 32 and 80 bytes). Counted
  /// over the nodes, so that nothing else the process does can disturb it; it equals the difference
  /// of mallinfo2() around an insertion, which a test checks. Fragmentation is not counted, nor
  /// are the 600 kB of work space each tree keeps for rays.
  virtual std::size_t heapBytes() const = 0;
  /// Bytes of the .bt file (header included); as it stands after finish(), which changes nothing
  /// in it.
  virtual std::size_t fileBytes() const = 0;
  /// The same after zstd at the level of our own map files.
  virtual std::size_t compressedFileBytes() const = 0;
  /// Is the leaf about the point there and not occupied?
  virtual bool isFree(const Vector3& point) const = 0;
  /// Bytes of the .ot file, which has the beliefs: of the tree as it is now.
  virtual std::size_t otBytes() const = 0;
};

/// \param s           side of the smallest cell, metres, > 0
/// \param min_points  that a cell needs from one insertion to be hit in it, >= 1
/// \return null where the program was built without OctoMap
/// \throws ParameterError
PLANAR_MAPPING_EXPORT std::unique_ptr<OctreeGrid> makeOctreeGrid(double s, int min_points = 1);

}  // namespace planar_mapping::evaluation
