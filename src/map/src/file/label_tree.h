// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "file/bit_stream.h"
#include "store/key_map.h"

namespace planar_mapping::detail {

/// Bundles of 64 cells and their trees in files of version 2.
/// A quadtree holds tiles of 8 x 8 cells, the octrees blocks of 4 x 4 x 4: Octree few cells, Space
/// solid parts of space, whose largest leaf is a whole block.
struct CellBundle {
  Int3 at;                  ///< tile or block coordinates; z = 0 for tiles
  std::uint64_t cells = 0;  ///< bit 8 b + a, or 16 z + 4 y + x; not 0
};

enum class TreeKind { Quadtree, Octree, Space };

/// Order of the cells of a bundle in the tree, and so of everything listed per cell.
const std::uint8_t* cellOrder(TreeKind kind);

/// Reads a tree and hands its bundles over in their order.
/// \throws Error if the labels make no tree of such bundles
void readTree(TreeKind kind, Label leaf, ByteReader& in,
              const std::function<void(const CellBundle&)>& take);
std::vector<CellBundle> readTree(TreeKind kind, Label leaf, ByteReader& in);

}  // namespace planar_mapping::detail
