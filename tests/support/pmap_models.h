// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "pmap_bits.h"
#include "pmap_lattice.h"

// What learns while a .pmap is read or written, from docs/file_format.md.
namespace planar_mapping::test {

struct Beliefs {
  explicit Beliefs(int dimensions) : flat(dimensions == 2) {}
  bool flat;
  Mixed bits{8, 32 * 18 * 18, {5, 5 * 16}};
  void forget() { bits.forget(); }

  static std::size_t coarse(unsigned k) { return k == 0 ? 0 : k == 17 ? 3 : 4 * k >= 51 ? 2 : 1; }
  std::vector<double> read(PmapBits& in, const std::vector<std::pair<Cell, int>>& cells) {
    std::map<Cell, unsigned> known;
    for (const auto& [c, value] : cells) known[c] = 0;
    std::vector<double> beliefs;
    const std::vector<Cell> beside{{1, 0, 0},
                                   {0, 1, 0},
                                   {-1, 0, 0},
                                   {0, -1, 0},
                                   flat ? Cell{-1, 1, 0} : Cell{0, 0, 1},
                                   flat ? Cell{1, 1, 0} : Cell{0, 0, -1},
                                   {2, 0, 0},
                                   {0, 2, 0}};
    for (const auto& [c, value] : cells) {
      const auto before = [&](int dx, int dy, int dz) {
        const auto at = known.find({c[0] + dx, c[1] + dy, c[2] + dz});
        return at == known.end() ? 0u : at->second;
      };
      const unsigned l = before(-1, 0, 0), b = before(0, -1, 0), e = before(1, -1, 0);
      const unsigned d = flat ? before(-1, -1, 0) : before(0, 0, -1);
      const unsigned mean = l == 0 || b == 0 ? l + b : (l + b) / 2;
      const std::size_t all = coarse(l) + 4 * coarse(b) + 16 * coarse(d) + 64 * coarse(e);
      std::size_t around = 0;
      for (std::size_t i = 0; i < 8; ++i) {
        const Cell& n = beside[i];
        around |= known.count({c[0] + n[0], c[1] + n[1], c[2] + n[2]}) << i;
      }
      unsigned node = 1;
      for (std::size_t i = 0; i < 5; ++i) {
        std::vector<std::size_t> contexts{l,          b,          mean,   all,
                                          18 * l + b, 18 * d + e, around, 4 * mean + around % 4};
        for (std::size_t& context : contexts) context = node + 32 * context;
        const bool one = bits.code(in, false, contexts, {i, i + 5 * (coarse(l) + 4 * coarse(b))});
        node = 2 * node + (one ? 1 : 0);
      }
      known[c] = 17 - (node - 32);
      beliefs.push_back(known[c] / 17.0);
    }
    return beliefs;
  }
};

/// mantissa 2^exponent
struct Rounded {
  int bits;
  Chance zero;
  Number step;
  std::int64_t last = 0;
  void forget() {
    zero.forget();
    step.forget();
  }
  std::int64_t placeOf(double value) const {
    int exponent = 0;
    auto mantissa = std::lround(std::ldexp(std::frexp(value, &exponent), bits));
    return std::int64_t{exponent - bits} * (1 << (bits - 1)) + mantissa - (1 << (bits - 1));
  }
  double read(PmapBits& in, double guess = 0.0) {
    if (zero.code(in)) return 0.0;
    if (guess > 0.0) last = placeOf(guess);
    last += step.codeSigned(in);
    const std::int64_t highest = 1 << (bits - 1);
    const auto exponent = static_cast<int>(std::floor(static_cast<double>(last) / highest));
    return std::ldexp(static_cast<double>(highest + last - exponent * highest), exponent);
  }
};

/// A parameter and the values it had so far.
struct KnownValues {
  std::vector<double> values;
  std::array<Chance, 8> is_value;
};

/// All that learns while files are read or written.
struct PmapModels {
  std::array<KnownValues, 26> parameters;
  Chance is_decimal, compact, unknown;
  Symbol<3> places;
  Number digits, min_points;

  Number frame_count, next_id, plane_count;
  Chance in_microseconds, negative;
  std::array<std::array<Number, 24>, 3> pose_numbers;
  Number last_part;

  Number id, frames, turn, anchor, correlation, slope;
  std::array<Number, 2> normal;
  std::array<Number, 3> origin, mean;
  Symbol<3> axis;
  Chance level, reversed;
  std::array<Chance, 2> flat;
  Rounded weight{10, {}, {}}, residual{6, {}, {}};
  std::array<Rounded, 2> variance{Rounded{6, {}, {}}, Rounded{6, {}, {}}};
  Lattice tiles{2, false};
  Beliefs tile_beliefs{2};

  Number cells_anchor, region_count, region_frame;
  Lattice blocks{3, false};
  Beliefs block_beliefs{3};
  Mixed eighths{9, 4096, {16, 64}};
  Lattice space{3, true};

  PmapModels() {
    const double usual[26] = {0.1, 0.0, 0.9,   0.0,  0.0, 0.0, 0.5, 4.0,   0.0,
                              0.0, 1.0, 0.087, 0.1,  0.5, 0.0, 10., 0.5,   0.5,
                              0.7, 0.7, 1.0,   0.15, 1.0, 3.0, 0.1, 0.0087};
    for (std::size_t i = 0; i < 26; ++i) parameters[i].values = {usual[i]};
  }
  void forget() {
    for (KnownValues& known : parameters) forgetEach(known.is_value);
    for (Chance* c : {&is_decimal, &compact, &unknown, &in_microseconds, &negative, &level,
                      &reversed, &flat[0], &flat[1]}) {
      c->forget();
    }
    for (Number* n :
         {&digits, &min_points, &frame_count, &next_id, &plane_count, &last_part, &id, &frames,
          &turn, &anchor, &correlation, &slope, &cells_anchor, &region_count, &region_frame}) {
      n->forget();
    }
    for (auto& kind : pose_numbers) forgetEach(kind);
    forgetEach(normal);
    forgetEach(origin);
    forgetEach(mean);
    forgetEach(variance);
    places.forget();
    axis.forget();
    weight.forget();
    residual.forget();
    tile_beliefs.forget();
    block_beliefs.forget();
    eighths.forget();
    for (Lattice* lattice : {&tiles, &blocks, &space}) lattice->forget();
  }
};

}  // namespace planar_mapping::test
