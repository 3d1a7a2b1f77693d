// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "label_tree.h"

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

std::uint64_t spread(std::uint32_t v, int dimensions) {
  std::uint64_t bits = 0;
  for (int i = 0; i < 21; ++i)
    bits |= static_cast<std::uint64_t>((v >> i) & 1u) << (i * dimensions);
  return bits;
}

class TreeWriter {
 public:
  TreeWriter(TreeKind kind, const std::vector<CellBundle>& bundles,
             const std::vector<std::uint64_t>& paths, Label leaf, ByteWriter& out)
      : shape_(shapeOf(kind)),
        order_(cellOrder(kind)),
        bundles_(bundles),
        paths_(paths),
        leaf_(leaf),
        out_(out) {}

  /// Bundles [begin, end) are below a node `level` levels above bundles; depth <= 20.
  void node(int level, std::size_t begin, std::size_t end) {
    if (begin == end) return out_.label(Label::Free);
    if (level == 0 && shape_.leaf_levels == shape_.bundle_levels && ~bundles_[begin].cells == 0) {
      return out_.label(leaf_);
    }
    out_.label(Label::Inner);
    if (level == 0) {
      const int children = 1 << shape_.dimensions;
      std::uint64_t path_bits = 0;
      for (unsigned path = 0; path < 64; ++path) {
        path_bits |= ((bundles_[begin].cells >> order_[path]) & 1u) << path;
      }
      for (int c = 0; c < children; ++c) cells(shape_.bundle_levels - 1, path_bits, c);
      return;
    }
    const int shift = (level - 1) * shape_.dimensions;
    const std::uint64_t mask = (std::uint64_t{1} << shape_.dimensions) - 1;
    std::size_t from = begin;
    for (std::uint64_t c = 0; c <= mask; ++c) {
      std::size_t to = from;
      while (to < end && ((paths_[to] >> shift) & mask) == c) ++to;
      node(level - 1, from, to);
      from = to;
    }
  }

 private:
  /// The part of a bundle at position \p index among the parts of its level.
  void cells(int level, std::uint64_t path_bits, int index) {
    const int count = 1 << (level * shape_.dimensions);
    const std::uint64_t full = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
    const std::uint64_t part = (path_bits >> (index * count)) & full;
    if (part == 0) return out_.label(Label::Free);
    if (part == full && level <= shape_.leaf_levels) return out_.label(leaf_);
    out_.label(Label::Inner);
    for (int c = 0; c < 1 << shape_.dimensions; ++c) {
      cells(level - 1, path_bits, (index << shape_.dimensions) + c);
    }
  }

  const Shape shape_;
  const std::uint8_t* order_;
  const std::vector<CellBundle>& bundles_;
  const std::vector<std::uint64_t>& paths_;
  const Label leaf_;
  ByteWriter& out_;
};

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

void writeTree(TreeKind kind, std::vector<CellBundle>& bundles, Label leaf, ByteWriter& out) {
  const Shape shape = shapeOf(kind);
  Int3 low{INT32_MAX, INT32_MAX, INT32_MAX};
  Int3 high{INT32_MIN, INT32_MIN, INT32_MIN};
  for (const CellBundle& b : bundles) {
    low = {std::min(low.x, b.at.x), std::min(low.y, b.at.y), std::min(low.z, b.at.z)};
    high = {std::max(high.x, b.at.x), std::max(high.y, b.at.y), std::max(high.z, b.at.z)};
  }
  if (bundles.empty()) low = high = Int3();
  const std::int32_t extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z}) + 1;
  int levels = 0;
  while ((std::int64_t{1} << levels) < extent) ++levels;

  std::vector<std::pair<std::uint64_t, CellBundle>> sorted;
  sorted.reserve(bundles.size());
  for (const CellBundle& b : bundles) {
    const std::uint64_t path =
        spread(static_cast<std::uint32_t>(b.at.x - low.x), shape.dimensions) |
        spread(static_cast<std::uint32_t>(b.at.y - low.y), shape.dimensions) << 1u |
        spread(static_cast<std::uint32_t>(b.at.z - low.z), shape.dimensions) << 2u;
    sorted.emplace_back(path, b);
  }
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::uint64_t> paths(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    paths[i] = sorted[i].first;
    bundles[i] = sorted[i].second;
  }

  out.zigzag(low.x);
  out.zigzag(low.y);
  if (shape.dimensions == 3) out.zigzag(low.z);
  out.u8(static_cast<std::uint8_t>(levels));
  TreeWriter(kind, bundles, paths, leaf, out).node(levels, 0, bundles.size());
  out.endLabels();
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
