// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "pmap_bits.h"

namespace planar_mapping::test {

using Cell = std::array<int, 3>;

/// A lattice: the values of its cells that are not 0, in the order of the file.
class Lattice {
 public:
  Lattice(int dimensions, bool with_twos)
      : flat_(dimensions == 2), twos_(with_twos), labels_(8, 3 * 4096, 3), cells_(8, 2 * 4096, 2) {}

  std::vector<std::pair<Cell, int>> read(PmapBits& in) {
    label_.clear();
    cell_.clear();
    const int depth = flat_ ? 1 : 8;
    const std::vector<Cell> regions = readRegions(in);
    for (const Cell& r : regions) readLabels(in, r);
    std::vector<std::pair<Cell, int>> all;
    const int side = flat_ ? 8 : 4;
    for (const Cell& r : regions) {
      for (int i = 0; i < 64 * depth; ++i) {
        const Cell b{8 * r[0] + i % 8, 8 * r[1] + i / 8 % 8, depth * r[2] + i / 64};
        const int label = label_.at(b);
        if (label == 0) continue;
        for (int bit = 0; bit < 64; ++bit) {
          const Cell c{side * b[0] + bit % side, side * b[1] + bit / side % side,
                       flat_ ? 0 : side * b[2] + bit / 16};
          if (label == 3) readCell(in, c);
          const int value = label == 3 ? cell_.at(c) : label;
          if (value != 0) all.emplace_back(c, value);
        }
      }
    }
    return all;
  }

 private:
  std::vector<Cell> readRegions(PmapBits& in) {
    std::vector<Cell> regions(count_.code(in));
    Cell row{}, slab{};
    for (std::size_t i = 0; i < regions.size(); ++i) {
      Cell& r = regions[i];
      const auto corner = [&](int from) { return from + static_cast<int>(corner_.codeSigned(in)); };
      const auto step = [&] { return static_cast<int>(step_.codeSigned(in)); };
      if (i == 0) {
        r[0] = corner(0);
        r[1] = corner(0);
        if (!flat_) r[2] = corner(0);
        row = slab = r;
        continue;
      }
      r = regions[i - 1];
      if (next_.code(in)) {
        ++r[0];
      } else if (same_row_.code(in)) {
        r[0] += 2 + step();
      } else if (flat_ || same_slab_.code(in)) {
        r[1] += 1 + step();
        r[0] = corner(row[0]);
        row = r;
      } else {
        r[2] += 1 + step();
        r[1] = corner(slab[1]);
        r[0] = corner(slab[0]);
        row = slab = r;
      }
    }
    return regions;
  }

  /// Contexts by the neighbours that get(dx, dy, dz) tells.
  template <typename Get>
  std::vector<std::size_t> contexts(Get&& get) const {
    const auto group = [&](std::vector<Cell> neighbours) {
      std::size_t context = 0;
      for (std::size_t i = 0; i < neighbours.size(); ++i) {
        const Cell& d = neighbours[i];
        const int value = flat_ && d[2] != 0 ? 0 : get(d[0], d[1], d[2]);
        context |= static_cast<std::size_t>(value) << (2 * i);
      }
      return context;
    };
    const Cell l{-1, 0, 0}, b{0, -1, 0}, d{0, 0, -1};
    std::size_t bits = 0;
    const auto two = [&](int dx, int dy, int dz) {
      return flat_ && dz != 0 ? 0u : static_cast<unsigned>(get(dx, dy, dz)) >> 1;
    };
    for (int i = 0; i < 9; ++i) bits |= std::size_t{two(i % 3 - 1, i / 3 - 1, -1)} << i;
    bits |= std::size_t{two(-1, 0, 0)} << 9 | std::size_t{two(0, -1, 0)} << 10 |
            std::size_t{two(1, -1, 0)} << 11;
    return {group({l, b, d}),
            group({l, b, d, {-1, -1, 0}, {-1, 0, -1}, {0, -1, -1}}),
            group({l, b, d, {1, -1, 0}, {1, 0, -1}, {0, 1, -1}}),
            group({l, b, d, {-2, 0, 0}, {0, -2, 0}, {0, 0, -2}}),
            group({l, b, d, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}),
            group({{-1, -1, 0}, {1, -1, 0}, {-2, -1, 0}, {2, -1, 0}, {-1, -2, 0}, {1, -2, 0}}),
            flat_ ? group({l, b, {1, -1, 0}, {2, -1, 0}, {-2, 0, 0}, {-1, -1, 0}})
                  : group({{-1, 0, -1}, {1, 0, -1}, {0, -1, -1}, {0, 1, -1}, d, {0, 0, -2}}),
            bits};
  }
  static std::vector<std::size_t> shifted(std::vector<std::size_t> contexts, std::size_t decision) {
    for (std::size_t& c : contexts) c += 4096 * decision;
    return contexts;
  }

  void readLabels(PmapBits& in, const Cell& r) {
    const int depth = flat_ ? 1 : 8;
    const bool uniform = uniform_.code(in);
    const int all = uniform ? static_cast<int>(uniform_label_.code(in)) : 0;
    for (int i = 0; i < 64 * depth; ++i) {
      const Cell b{8 * r[0] + i % 8, 8 * r[1] + i / 8 % 8, depth * r[2] + i / 64};
      if (uniform) {
        label_[b] = all;
        continue;
      }
      const auto c = contexts([&](int dx, int dy, int dz) {
        const auto at = label_.find({b[0] + dx, b[1] + dy, b[2] + dz});
        return at == label_.end() ? 0 : at->second;
      });
      int label = 0;
      if (labels_.code(in, false, shifted(c, 0), 0)) {
        label = 3;
      } else if (twos_ && labels_.code(in, false, shifted(c, 1), 1)) {
        label = 2;
      } else {
        label = labels_.code(in, false, shifted(c, 2), 2) ? 1 : 0;
      }
      label_[b] = label;
    }
  }

  void readCell(PmapBits& in, const Cell& c) {
    const int shift = flat_ ? 3 : 2;
    const auto contexts_of = contexts([&](int dx, int dy, int dz) {
      const Cell n{c[0] + dx, c[1] + dy, c[2] + dz};
      const auto bundle = label_.find({n[0] >> shift, n[1] >> shift, flat_ ? 0 : n[2] >> shift});
      if (bundle == label_.end()) return 0;
      if (bundle->second != 3) return bundle->second;
      const auto known = cell_.find(n);
      return known == cell_.end() ? 3 : known->second;
    });
    int value = twos_ && cells_.code(in, false, contexts_of, 0) ? 2 : 0;
    if (value == 0) value = cells_.code(in, false, shifted(contexts_of, 1), 1) ? 1 : 0;
    cell_[c] = value;
  }

  const bool flat_;
  const bool twos_;
  Mixed labels_, cells_;
  Chance uniform_, next_, same_row_, same_slab_;
  Symbol<2> uniform_label_;
  Number count_, corner_, step_;
  std::map<Cell, int> label_, cell_;
};

}  // namespace planar_mapping::test
