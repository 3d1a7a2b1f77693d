// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping {
namespace evaluation {

/// Parameters of OctreeGrid; the defaults are OctoMap's own.
struct PLANAR_MAPPING_EXPORT OctreeGridParams {
  double resolution = 0.1;         ///< s, side of the smallest cell, metres, > 0
  double max_range = -1.0;         ///< metres; obstacles beyond only clear up to it; < 0 = none
  int min_points = 1;              ///< that a cell needs from one insertion to be hit in it, >= 1
  double hit = 0.7;                ///< probability, in (0.5, 1)
  double miss = 0.4;               ///< probability, in (0, 0.5)
  double clamping_min = 0.1192;    ///< probability
  double clamping_max = 0.971;     ///< probability
  double occupied_at_least = 0.5;  ///< probability from which a leaf is occupied

  /// \throws ParameterError
  void validate() const;
};

/// OG, the octree baseline: OctoMap (Hornung et al., 2013) on its own library, with its recommended
/// settings. Insertion is discretized (one ray per cell that was hit, the fastest of its modes) and
/// prunes on the way; ground clears space and is never occupied, as in octomap_server.
///
/// Without OctoMap at build time isAvailable() is false and the constructor throws. Not copyable.
class PLANAR_MAPPING_EXPORT OctreeGrid {
 public:
  static bool isAvailable();

  /// \throws ParameterError; Error where the program was built without OctoMap
  explicit OctreeGrid(const OctreeGridParams& params);
  ~OctreeGrid();
  OctreeGrid(OctreeGrid&& other) noexcept;
  OctreeGrid& operator=(OctreeGrid&& other) noexcept;

  /// Adds one frame: cells with obstacle points are hit, cells that rays to obstacles or ground
  /// cross are missed; a hit goes before a miss. All in the world frame, metres. Points that are
  /// not finite or outside the tree (32768 cells from the origin) are counted as dropped.
  /// \throws InputError for an origin that is not finite or outside the tree
  void insert(const std::vector<Vector3>& obstacles, const std::vector<Vector3>& ground,
              const Vector3& origin);
  /// Maximum likelihood, then pruning: what a .bt file holds, and the form in which the octree has
  /// its fewest leaves. Nothing should be inserted after it: the beliefs are gone.
  void finish();

  struct Counts {
    std::size_t occupied_leaves = 0;  ///< N_f of the octree
    std::size_t free_leaves = 0;
    std::size_t occupied_cells = 0;  ///< in cells of the smallest size, like the next
    std::size_t free_cells = 0;
    std::size_t nodes = 0;  ///< inner nodes and leaves
    std::size_t dropped_points = 0;
  };
  Counts counts() const;
  /// Occupied leaves as cubes of s 2^k, by z, y, x of their centre.
  std::vector<Cuboid> cuboids() const;

  /// What OctoMap's memoryUsage() says.
  std::size_t reportedBytes() const;
  /// What the nodes take of the heap: for each node and each array of children the size of the
  /// block that malloc hands out, its administration included (glibc: 32 and 80 bytes). Counted
  /// over the nodes, so that nothing else the process does can disturb it; it equals the difference
  /// of mallinfo2() around an insertion, which a test checks. Fragmentation is not counted, nor
  /// are the 600 kB of work space each tree keeps for rays.
  std::size_t heapBytes() const;
  /// Bytes of the .bt file (header included); as it stands after finish(), which changes nothing
  /// in it.
  std::size_t fileBytes() const;
  /// The same after zstd at the level of our own map files.
  std::size_t compressedFileBytes() const;
  /// Is the leaf about the point there and not occupied?
  bool isFree(const Vector3& point) const;
  /// Bytes of the .ot file, which has the beliefs: of the tree as it is now.
  std::size_t otBytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evaluation
}  // namespace planar_mapping
