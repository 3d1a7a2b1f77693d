// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/label_tree.h"

#include <algorithm>
#include <array>

namespace planar_mapping::detail {
namespace {

/// Leaves may stand for few cells only: larger ones would save little and let a small file ask for
/// much memory.
struct Shape {
  int dimensions;
  int bundle_levels;   ///< of a bundle: its side is 2^levels cells
  int leaf_levels;     ///< of the largest leaf
  std::int32_t limit;  ///< of bundle coordinates, exclusive
};
Shape shapeOf(TreeKind kind) {
  if (kind == TreeKind::Quadtree) return {2, 3, 2, kLatticeLimit / 8};
  return {3, 2, kind == TreeKind::Octree ? 1 : 2, kLatticeLimit / 4};
}

/// cells[path] for a path of child numbers down a bundle.
std::array<std::uint8_t, 64> makeOrder(TreeKind kind) {
  const Shape shape = shapeOf(kind);
  std::array<std::uint8_t, 64> order{};
  for (unsigned path = 0; path < 64; ++path) {
    unsigned c[3] = {0, 0, 0};
    for (int level = 0; level < shape.bundle_levels; ++level) {
      for (int d = 0; d < shape.dimensions; ++d) {
        c[d] |= ((path >> (level * shape.dimensions + d)) & 1u) << level;
      }
    }
    order[path] = static_cast<std::uint8_t>(shape.dimensions == 2 ? 8 * c[1] + c[0]
                                                                  : 16 * c[2] + 4 * c[1] + c[0]);
  }
  return order;
}

class TreeReader {
 public:
  using Take = std::function<void(const CellBundle&)>;
  TreeReader(TreeKind kind, Int3 corner, Label leaf, ByteReader& in, const Take& take)
      : shape_(shapeOf(kind)),
        order_(cellOrder(kind)),
        corner_(corner),
        leaf_(leaf),
        in_(in),
        take_(take) {}

  /// Depth is bounded by the number of levels, which the caller has checked.
  void node(int level, const Int3& at) {
    const Label label = in_.label();
    if (label == Label::Free) return;
    const bool is_full = label == leaf_ && level == 0 && shape_.leaf_levels == shape_.bundle_levels;
    if (label != Label::Inner && !is_full) {
      in_.fail("has a leaf that is too large or of another kind");
    }
    if (level == 0) {
      std::uint64_t path_bits = is_full ? ~std::uint64_t{0} : 0;
      for (int c = 0; c < 1 << shape_.dimensions && !is_full; ++c) {
        cells(shape_.bundle_levels - 1, path_bits, c);
      }
      if (path_bits == 0) in_.fail("has an inner node without a set cell");
      CellBundle bundle;
      bundle.at = {corner_.x + at.x, corner_.y + at.y, corner_.z + at.z};
      if (bundle.at.x >= shape_.limit || bundle.at.y >= shape_.limit ||
          bundle.at.z >= shape_.limit) {
        in_.fail("has cells outside the world");
      }
      for (unsigned path = 0; path < 64; ++path) {
        bundle.cells |= ((path_bits >> path) & 1u) << order_[path];
      }
      take_(bundle);
      return;
    }
    for (int c = 0; c < 1 << shape_.dimensions; ++c) {
      const std::int32_t half = std::int32_t{1} << (level - 1);
      node(level - 1, {at.x + ((c & 1) != 0 ? half : 0), at.y + ((c & 2) != 0 ? half : 0),
                       at.z + ((c & 4) != 0 ? half : 0)});
    }
  }

 private:
  void cells(int level, std::uint64_t& path_bits, int index) {
    const Label label = in_.label();
    if (label == Label::Free) return;
    if (label == leaf_ && level <= shape_.leaf_levels) {
      const int count = 1 << (level * shape_.dimensions);
      path_bits |= ((std::uint64_t{1} << count) - 1) << (index * count);
      return;
    }
    if (label != Label::Inner || level == 0) {
      in_.fail("has a leaf that is too large or of another kind");
    }
    for (int c = 0; c < 1 << shape_.dimensions; ++c) {
      cells(level - 1, path_bits, (index << shape_.dimensions) + c);
    }
  }

  const Shape shape_;
  const std::uint8_t* order_;
  const Int3 corner_;
  const Label leaf_;
  ByteReader& in_;
  const Take& take_;
};

}  // namespace

const std::uint8_t* cellOrder(TreeKind kind) {
  static const std::array<std::uint8_t, 64> quadtree = makeOrder(TreeKind::Quadtree);
  static const std::array<std::uint8_t, 64> octree = makeOrder(TreeKind::Octree);
  return kind == TreeKind::Quadtree ? quadtree.data() : octree.data();
}

std::vector<CellBundle> readTree(TreeKind kind, Label leaf, ByteReader& in) {
  std::vector<CellBundle> bundles;
  readTree(kind, leaf, in, [&](const CellBundle& bundle) { bundles.push_back(bundle); });
  return bundles;
}

void readTree(TreeKind kind, Label leaf, ByteReader& in,
              const std::function<void(const CellBundle&)>& take) {
  const Shape shape = shapeOf(kind);
  Int3 corner;
  corner.x = in.within(-shape.limit, shape.limit - 1);
  corner.y = in.within(-shape.limit, shape.limit - 1);
  if (shape.dimensions == 3) corner.z = in.within(-shape.limit, shape.limit - 1);
  const int levels = in.u8();
  if ((std::int64_t{1} << std::min(levels, 62)) >= 4 * static_cast<std::int64_t>(shape.limit)) {
    in.fail("has a tree deeper than the world");
  }
  TreeReader(kind, corner, leaf, in, take).node(levels, Int3());
  in.endLabels();
}

}  // namespace planar_mapping::detail
