// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

#include "planar_mapping/core/types.h"
#include "pmap_bits.h"
#include "pmap_lattice.h"

// A second reader of .pmap, written from docs/file_format.md: it shares no code with the first.
namespace planar_mapping::test {

using Bytes = std::vector<std::uint8_t>;

/// The payload of a file whose frame is checked.
inline Bytes payloadOf(const Bytes& file) {
  const Bytes start{0x50, 0x4d, 0x41, 0x50, 0x0d, 0x0a, 0x1a, 0x0a, 3, 0, 0, 0};
  EXPECT_TRUE(std::equal(start.begin(), start.end(), file.begin()));
  std::uint32_t checksum = 0, size = 0;
  std::memcpy(&checksum, &file[12], 4);
  std::memcpy(&size, &file[16], 4);
  const Bytes payload(file.begin() + 20, file.end());
  EXPECT_EQ(payload.size(), size);
  std::uint32_t crc = 0xffffffffu;
  for (const std::uint8_t byte : payload) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0u);
  }
  EXPECT_EQ(~crc, checksum);
  return payload;
}

inline double readDouble(PmapBits& in) {
  const std::uint64_t bits = in.plain(0, 64);
  double value = 0.0;
  std::memcpy(&value, &bits, 8);
  return value;
}

struct Beliefs {
  explicit Beliefs(int dimensions) : flat(dimensions == 2) {}
  bool flat;
  Mixed bits{4, 32 * 256, 5};

  static std::size_t coarse(unsigned k) { return k == 0 ? 0 : k == 17 ? 3 : 4 * k >= 51 ? 2 : 1; }
  std::vector<double> read(PmapBits& in, const std::vector<std::pair<Cell, int>>& cells) {
    std::map<Cell, unsigned> known;
    std::vector<double> beliefs;
    for (const auto& [c, value] : cells) {
      const auto before = [&](int dx, int dy, int dz) {
        const auto at = known.find({c[0] + dx, c[1] + dy, c[2] + dz});
        return at == known.end() ? 0u : at->second;
      };
      const unsigned l = before(-1, 0, 0), b = before(0, -1, 0), e = before(1, -1, 0);
      const unsigned d = flat ? before(-1, -1, 0) : before(0, 0, -1);
      const unsigned mean = l == 0 || b == 0 ? l + b : (l + b) / 2;
      const std::size_t all = coarse(l) + 4 * coarse(b) + 16 * coarse(d) + 64 * coarse(e);
      unsigned node = 1;
      for (std::size_t i = 0; i < 5; ++i) {
        const bool one = bits.code(
            in, false, {node + 32 * l, node + 32 * b, node + 32 * mean, node + 32 * all}, i);
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

struct ReadPlane {
  int id = 0;
  unsigned frames = 0;
  Vector3 origin, u, v, n, mean;
  double weight = 0.0, residual = 0.0;
  std::vector<std::pair<Cell, int>> cells;
  std::vector<double> beliefs;
};

struct PmapReader {
  explicit PmapReader(const Bytes& file) : in(payloadOf(file)) {
    const double usual[26] = {0.1, 0.0, 0.9,   0.0,  0.0, 0.0, 0.5, 4.0,   0.0,
                              0.0, 1.0, 0.087, 0.1,  0.5, 0.0, 10., 0.5,   0.5,
                              0.7, 0.7, 1.0,   0.15, 1.0, 3.0, 0.1, 0.0087};
    Chance is_usual, is_decimal;
    Symbol<3> places;
    Number digits;
    for (double value : usual) {
      if (!is_usual.code(in)) {
        if (is_decimal.code(in)) {
          const double scale = std::pow(10.0, places.code(in));
          value = static_cast<double>(digits.codeSigned(in)) / scale;
        } else {
          value = readDouble(in);
        }
      }
      parameters.push_back(value);
    }
    compact = in.plain(0, 1) == 1;
    unknown = in.plain(0, 1) == 1;
    min_points = Number().codeSigned(in);
    readTrajectory();
    readPlanes();
    readCells();
    space = Lattice(3, true).read(in);
  }

  void readTrajectory() {
    poses.resize(counts.code(in));
    Chance in_microseconds, negative;
    std::array<Number, 4> numbers;
    std::array<std::vector<std::int64_t>, 7> before;  // time, position, x y z of the quaternion
    const auto step = [](std::int64_t d, std::size_t k) {
      return k == 0 ? d : d - static_cast<std::int64_t>(std::floor(static_cast<double>(d) / 4.0));
    };
    const auto next = [&](std::size_t k) {
      std::vector<std::int64_t>& b = before[k];
      const std::int64_t guess = b.empty()      ? 0
                                 : b.size() < 2 ? b[0]
                                                : b.back() + step(b.back() - b[b.size() - 2], k);
      b.push_back(guess + numbers[k == 0 ? 0 : k < 4 ? 1 : 2].codeSigned(in));
      return b.back();
    };
    for (auto& pose : poses) {
      pose[0] = in_microseconds.code(in) ? static_cast<double>(next(0)) / 1e6 : readDouble(in);
      for (std::size_t k = 1; k < 4; ++k) pose[k] = static_cast<double>(next(k)) / 4096.0;
      std::int64_t left = 8191 * 8191;
      for (std::size_t k = 4; k < 7; ++k) {
        const std::int64_t part = next(k);
        pose[k] = static_cast<double>(part);
        left -= part * part;
      }
      const double w = std::floor(std::sqrt(std::max(0.0, static_cast<double>(left))));
      pose[7] = negative.code(in) ? -w : w;
      pose[7] += static_cast<double>(numbers[3].codeSigned(in));
    }
  }

  void readPlanes() {
    next_id = counts.codeSigned(in);
    planes.resize(counts.code(in));
    Number id, frames, turn, anchor, correlation, slope;
    std::array<Number, 2> normal;
    std::array<Number, 3> origin, mean;
    Symbol<3> axis;
    Chance level, reversed;
    Rounded weight{10, {}, {}}, residual{6, {}, {}};
    std::array<Rounded, 2> variance{Rounded{6, {}, {}}, Rounded{6, {}, {}}};
    Lattice tiles(2, false);
    Beliefs believed(2);
    int last_id = -1;
    const double s = parameters[0];
    for (ReadPlane& p : planes) {
      p.id = last_id += 1 + static_cast<int>(id.codeSigned(in));
      p.frames = static_cast<unsigned>(frames.codeSigned(in));
      anchor.codeSigned(in);
      anchor.codeSigned(in);
      p.cells = tiles.read(in);
      p.beliefs = believed.read(in, p.cells);

      const unsigned k = axis.code(in);
      const double a = static_cast<double>(normal[0].codeSigned(in)) / 32768.0;
      const double b = static_cast<double>(normal[1].codeSigned(in)) / 32768.0;
      const auto largest = static_cast<Eigen::Index>(k % 3);
      p.n[largest] = (k < 3 ? 1.0 : -1.0) * std::sqrt(1.0 - a * a - b * b);
      p.n[(largest + 1) % 3] = a;
      p.n[(largest + 2) % 3] = b;
      const Vector3 up = std::abs(p.n.z()) < 0.75 ? Vector3::UnitZ() : Vector3::UnitX();
      const Vector3 along = up.cross(p.n).normalized();
      double angle = 0.0;
      if (level.code(in)) {
        angle = reversed.code(in) ? M_PI : 0.0;
      } else {
        angle = static_cast<double>(turn.codeSigned(in)) * M_PI / 65536.0;
      }
      p.u = std::cos(angle) * along + std::sin(angle) * p.n.cross(along);
      p.v = p.n.cross(p.u);
      Vector3 o;
      for (std::size_t i = 0; i < 3; ++i) {
        o[static_cast<int>(i)] = static_cast<double>(origin[i].codeSigned(in)) / 4096.0;
      }
      p.origin = o.x() * p.u + o.y() * p.v + o.z() * p.n;
      p.weight = weight.read(in);
      Vector3 at;
      std::array<double, 2> spread{};
      for (std::size_t i = 0; i < 3; ++i) {
        std::int64_t guess = 0;
        if (i < 2) {
          std::int64_t sum = 0;
          double square = 0.0;
          const auto n = static_cast<std::int64_t>(p.cells.size());
          for (const auto& [c, value] : p.cells) sum += 2 * c[i] + 1;
          sum /= n;
          for (const auto& [c, value] : p.cells) {
            square += static_cast<double>((2 * c[i] + 1 - sum) * (2 * c[i] + 1 - sum));
          }
          guess = std::llround(0.5 * s * static_cast<double>(sum) / (1.0 / 16.0));
          // In this order: the rounding of a number between two others depends on it.
          spread[i] = 0.5 * s * (0.5 * s) * (square / static_cast<double>(n));
        }
        at[static_cast<int>(i)] =
            static_cast<double>(guess + mean[i].codeSigned(in)) / (i < 2 ? 16.0 : 4096.0);
      }
      p.mean = p.origin + at.x() * p.u + at.y() * p.v + at.z() * p.n;
      for (std::size_t i = 0; i < 2; ++i) variance[i].read(in, spread[i]);
      correlation.codeSigned(in);
      slope.codeSigned(in);
      slope.codeSigned(in);
      p.residual = residual.read(in);
    }
  }

  void readCells() {
    Number anchor;
    for (int i = 0; i < 3; ++i) anchor.codeSigned(in);
    cells = Lattice(3, false).read(in);
    beliefs = Beliefs(3).read(in, cells);
    if (compact) {
      Mixed eighths(7, 2048, 1);
      std::map<Cell, unsigned> known;
      for (const auto& [c, value] : cells) known[c] = 0;
      for (const auto& [c, value] : cells) {
        const auto octants = [&](int dx, int dy, int dz) {
          const auto at = known.find({c[0] - dx, c[1] - dy, c[2] - dz});
          return at == known.end() ? 0u : at->second;
        };
        const unsigned before[3] = {octants(1, 0, 0), octants(0, 1, 0), octants(0, 0, 1)};
        unsigned own = 0;
        for (unsigned i = 0; i < 8; ++i) {
          std::size_t faces = i, face_count = 0, beyond = 0;
          const auto hasCell = [&](bool x, bool y, bool z) {
            const Cell at{c[0] + (x ? (i & 1 ? 1 : -1) : 0), c[1] + (y ? (i & 2 ? 1 : -1) : 0),
                          c[2] + (z ? (i & 4 ? 1 : -1) : 0)};
            return static_cast<std::size_t>(known.count(at));
          };
          const std::size_t n[7] = {hasCell(true, false, false), hasCell(false, true, false),
                                    hasCell(false, false, true), hasCell(true, true, false),
                                    hasCell(true, false, true),  hasCell(false, true, true),
                                    hasCell(true, true, true)};
          for (std::size_t k = 0; k < 7; ++k) beyond |= n[k] << k;
          std::size_t ones = 0;
          for (unsigned k = 0; k < i; ++k) ones += own >> k & 1;
          for (unsigned axis = 0; axis < 3; ++axis) {
            const unsigned from = (i >> axis & 1) != 0 ? own : before[axis];
            const std::size_t face = from >> (i ^ 1u << axis) & 1;
            faces |= face << (3 + axis);
            face_count += face;
            // Not in one expression: gcc 12 gets that wrong under the sanitizers.
            const std::size_t there = before[axis] != 0 ? 1 : 0;
            faces |= there << (6 + axis);
          }
          if (eighths.code(
                  in, false,
                  {own | 1u << i, faces, i | before[0] << 3, i | before[2] << 3,
                   beyond + 16 * (faces & 56),
                   i + 8 * (beyond & 7) + 8 * (faces & 56) + 512 * std::min<std::size_t>(ones, 2),
                   std::min<std::size_t>(ones, 3) + 4 * face_count + 16 * (n[0] + n[1] + n[2])},
                  0)) {
            own |= 1u << i;
          }
        }
        EXPECT_NE(own, 0u);
        known[c] = own;
      }
    } else {
      for (std::size_t i = 0; i < 3 * cells.size(); ++i) in.plain(0, 8);
    }
    region_frames.resize(Number().code(in));
    Number step;
    std::int64_t last = static_cast<std::int64_t>(poses.size()) - 1;
    for (std::int64_t& frame : region_frames) frame = last += step.codeSigned(in);
  }

  PmapBits in;
  std::vector<double> parameters;
  bool compact = false, unknown = false;
  std::int64_t min_points = 0, next_id = 0;
  Number counts;
  std::vector<std::array<double, 8>> poses;
  std::vector<ReadPlane> planes;
  std::vector<std::pair<Cell, int>> cells, space;
  std::vector<double> beliefs;
  std::vector<std::int64_t> region_frames;
};

}  // namespace planar_mapping::test
