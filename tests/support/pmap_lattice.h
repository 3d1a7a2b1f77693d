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
      : flat_(dimensions == 2),
        twos_(with_twos),
        labels_(11, 3 * 4096, {3, 3 * 64}),
        cells_(11, 2 * 4096, {2, 2 * 64}) {}

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
          if (label == 3) readCell(in, c, bit);
          const int value = label == 3 ? cell_.at(c) : label;
          if (value != 0) all.emplace_back(c, value);
        }
      }
    }
    return all;
  }

  /// Writes regions in a row that are all of one label.
  void writeRegions(PmapBits& out, std::uint64_t count, std::int64_t corner, unsigned label) {
    count_.code(out, count);
    for (int i = 0; i < 3; ++i) corner_.codeSigned(out, corner);
    for (std::uint64_t i = 1; i < count; ++i) next_.code(out, true);
    for (std::uint64_t i = 0; i < count; ++i) {
      uniform_.code(out, true);
      uniform_label_.code(out, label);
    }
  }
  void writeNothing(PmapBits& out) { count_.code(out, 0); }

  void forget() {
    labels_.forget();
    cells_.forget();
    for (Chance* c : {&uniform_, &next_, &same_row_, &same_slab_}) c->forget();
    uniform_label_.forget();
    for (Number* n : {&count_, &corner_, &step_}) n->forget();
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

  /// Contexts by the place and the neighbours that get(dx, dy, dz) tells.
  template <typename Get>
  std::vector<std::size_t> contexts(std::size_t place, Get&& get) const {
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
    std::size_t lower = 0, upper = 0;
    for (int i = 0; i < 12; ++i) {
      const Cell n =
          i < 9 ? Cell{i % 3 - 1, i / 3 - 1, -1} : Cell{i == 9 ? -1 : i - 10, i == 9 ? 0 : -1, 0};
      const auto value = static_cast<std::size_t>(get(n[0], n[1], n[2]));
      lower |= (value & 1) << i;
      upper |= (value >> 1) << i;
    }
    const Cell r{1, 0, 0}, f{0, 1, 0}, a{0, 0, 1};
    const std::size_t nearest = group({l, b, d});
    return {
        nearest,
        group({l, b, d, {-1, -1, 0}, {-1, 0, -1}, {0, -1, -1}}),
        group({l, b, d, {1, -1, 0}, {1, 0, -1}, {0, 1, -1}}),
        group({l, b, d, {-2, 0, 0}, {0, -2, 0}, {0, 0, -2}}),
        group({l, b, d, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}),
        group({{-1, -1, 0}, {1, -1, 0}, {-2, -1, 0}, {2, -1, 0}, {-1, -2, 0}, {1, -2, 0}}),
        flat_ ? group({l, b, {1, -1, 0}, {2, -1, 0}, {-2, 0, 0}, {-1, -1, 0}})
              : group({{-1, 0, -1}, {1, 0, -1}, {0, -1, -1}, {0, 1, -1}, d, {0, 0, -2}}),
        nearest + 64 * place,
        flat_ ? group({l, b, r, f, {-1, -1, 0}, {1, -1, 0}}) : group({l, b, r, f, a, {0, 0, -2}}),
        flat_ ? group({l, b, {-2, 0, 0}, {0, -2, 0}, {-1, -1, 0}, {1, -1, 0}}) : lower,
        flat_ ? 0 : upper};
  }
  static bool decide(PmapBits& in, Mixed& model, std::vector<std::size_t> contexts,
                     std::size_t decision) {
    const std::size_t nearest = contexts[0];
    for (std::size_t& c : contexts) c += 4096 * decision;
    return model.code(in, false, contexts, {decision, 64 * decision + nearest});
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
      const auto edge = [](int k) { return k == 0 ? 0 : k == 7 ? 2 : 1; };
      const int place = edge(i % 8) + 3 * edge(i / 8 % 8) + 9 * edge(i / 64);
      const auto c = contexts(static_cast<std::size_t>(place), [&](int dx, int dy, int dz) {
        const auto at = label_.find({b[0] + dx, b[1] + dy, b[2] + dz});
        return at == label_.end() ? 0 : at->second;
      });
      int label = 0;
      if (decide(in, labels_, c, 0)) {
        label = 3;
      } else if (twos_ && decide(in, labels_, c, 1)) {
        label = 2;
      } else {
        label = decide(in, labels_, c, 2) ? 1 : 0;
      }
      label_[b] = label;
    }
  }

  void readCell(PmapBits& in, const Cell& c, int place) {
    const int shift = flat_ ? 3 : 2;
    const auto contexts_of = contexts(static_cast<std::size_t>(place), [&](int dx, int dy, int dz) {
      const Cell n{c[0] + dx, c[1] + dy, c[2] + dz};
      const auto bundle = label_.find({n[0] >> shift, n[1] >> shift, flat_ ? 0 : n[2] >> shift});
      if (bundle == label_.end()) return 0;
      if (bundle->second != 3) return bundle->second;
      const auto known = cell_.find(n);
      return known == cell_.end() ? 3 : known->second;
    });
    int value = twos_ && decide(in, cells_, contexts_of, 0) ? 2 : 0;
    if (value == 0) value = decide(in, cells_, contexts_of, 1) ? 1 : 0;
    cell_[c] = value;
  }

  bool flat_;
  bool twos_;
  Mixed labels_, cells_;
  Chance uniform_, next_, same_row_, same_slab_;
  Symbol<2> uniform_label_;
  Number count_, corner_, step_;
  std::map<Cell, int> label_, cell_;
};

}  // namespace planar_mapping::test
