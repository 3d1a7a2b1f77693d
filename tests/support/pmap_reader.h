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

#include "planar_mapping/core/base/types.h"
#include "pmap_bits.h"
#include "pmap_lattice.h"
#include "pmap_models.h"
#include "file/prior_maps.h"

// A second reader of .pmap, written from docs/file_format.md: it shares no code with the first, but
// the bytes of the prior maps.
namespace planar_mapping::test {

using Bytes = std::vector<std::uint8_t>;

/// The payload of a file whose frame is checked.
inline Bytes payloadOf(const Bytes& file) {
  const Bytes start{0x50, 0x4d, 0x41, 0x50, 4};
  EXPECT_TRUE(std::equal(start.begin(), start.end(), file.begin()));
  std::uint32_t checksum = 0;
  std::memcpy(&checksum, &file[5], 4);
  const Bytes payload(file.begin() + 9, file.end());
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

struct ReadPlane {
  int id = 0;
  unsigned frames = 0;
  Vector3 origin, u, v, n, mean;
  double weight = 0.0, residual = 0.0;
  std::vector<std::pair<Cell, int>> cells;
  std::vector<double> beliefs;
};

class PmapReader : public PmapModels {
 public:
  /// Has read the prior maps.
  PmapReader() { static_cast<PmapModels&>(*this) = experienced(); }
  explicit PmapReader(const Bytes& file) : PmapReader() {
    in = PmapBits(payloadOf(file));
    readMap();
  }

  PmapBits in;
  std::vector<double> values;  ///< of the parameters
  bool is_compact = false, has_unknown = false;
  std::int64_t min_points_per_cell = 0, next_plane_id = 0;
  std::vector<std::array<double, 8>> poses;
  std::vector<ReadPlane> planes;
  std::vector<std::pair<Cell, int>> cells, space_cells;
  std::vector<double> beliefs;
  std::vector<std::int64_t> region_frames;

 private:
  struct Nothing {};
  explicit PmapReader(Nothing) {}
  static const PmapModels& experienced() {
    static const PmapModels models = [] {
      using namespace detail;
      PmapReader learning{Nothing()};
      learning.in = PmapBits(Bytes(kPriorMaps, kPriorMaps + kPriorMapsSize));
      for (std::size_t i = 0; i < kPriorMapCount; ++i) learning.readMap();
      learning.forget();
      return static_cast<PmapModels&>(learning);
    }();
    return models;
  }

  void readMap() {
    values.clear();
    for (KnownValues& known : parameters) values.push_back(readParameter(known));
    is_compact = compact.code(in);
    has_unknown = unknown.code(in);
    min_points_per_cell = min_points.codeSigned(in);
    readTrajectory();
    readPlanes();
    readCells();
    space_cells = space.read(in);
  }

  double readParameter(KnownValues& known) {
    for (std::size_t i = 0; i < known.values.size(); ++i) {
      if (known.is_value[i].code(in)) return known.values[i];
    }
    double value = 0.0;
    if (is_decimal.code(in)) {
      const double scale = std::pow(10.0, places.code(in));
      value = static_cast<double>(digits.codeSigned(in)) / scale;
    } else {
      value = readDouble(in);
    }
    if (known.values.size() < 8) known.values.push_back(value);
    return value;
  }

  struct Track {
    std::vector<std::int64_t> before;
    std::int64_t errors[3] = {0, 0, 0};
    std::size_t bits = 0;
  };
  std::int64_t readNext(std::size_t k, Track& t) {
    const std::size_t n = t.before.size();
    const std::int64_t a = n == 0 ? 0 : t.before[n - 1];
    const std::int64_t d = n == 0 ? 0 : n == 1 ? a : a - t.before[n - 2];
    const std::int64_t damped = a + d - roundedDown(d, 4);
    const std::int64_t guesses[3] = {k == 0 ? a + d : damped, k == 0 ? damped : a + d, a};
    std::size_t best = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (t.errors[i] < t.errors[best]) best = i;
    }
    const std::size_t kind = k == 0 ? 0 : k < 4 ? 1 : 2;
    const std::int64_t apart = pose_numbers[kind][n < 2 ? n : 2 + t.bits].codeSigned(in);
    const std::int64_t value = (n < 2 ? a : guesses[best]) + apart;
    std::size_t bits = 0;
    while (bits < 21 && std::abs(apart) >> bits != 0) ++bits;
    t.bits = n == 0 ? 0 : n == 1 ? bits : (bits + t.bits + 1) / 2;
    for (std::size_t i = 0; i < 3 && n >= 2; ++i) {
      t.errors[i] = t.errors[i] / 2 + std::min<std::int64_t>(std::abs(value - guesses[i]), 1 << 30);
    }
    t.before.push_back(value);
    return value;
  }

  void readTrajectory() {
    poses.assign(frame_count.code(in), {});
    std::array<Track, 7> tracks;  // time, position, x y z of the quaternion
    for (auto& pose : poses) {
      pose[0] = in_microseconds.code(in) ? static_cast<double>(readNext(0, tracks[0])) / 1e6
                                         : readDouble(in);
      for (std::size_t k = 1; k < 4; ++k) {
        pose[k] = static_cast<double>(readNext(k, tracks[k])) / 4096.0;
      }
      std::int64_t left = 8191 * 8191;
      for (std::size_t k = 4; k < 7; ++k) {
        const std::int64_t part = readNext(k, tracks[k]);
        pose[k] = static_cast<double>(part);
        left -= part * part;
      }
      const double w = std::floor(std::sqrt(std::max(0.0, static_cast<double>(left))));
      pose[7] = negative.code(in) ? -w : w;
      pose[7] += static_cast<double>(last_part.codeSigned(in));
    }
  }

  void readPlanes() {
    next_plane_id = next_id.codeSigned(in);
    planes.assign(plane_count.code(in), {});
    std::array<std::int64_t, 6> turns{};
    for (Rounded* number : {&weight, &variance[0], &variance[1], &residual}) number->last = 0;
    int last_id = -1;
    const double s = values[0];
    for (ReadPlane& p : planes) {
      p.id = last_id += 1 + static_cast<int>(id.codeSigned(in));
      p.frames = static_cast<unsigned>(frames.codeSigned(in));
      anchor.codeSigned(in);
      anchor.codeSigned(in);
      p.cells = tiles.read(in);
      p.beliefs = tile_beliefs.read(in, p.cells);

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
        turns[k] += turn.codeSigned(in);
        angle = static_cast<double>(turns[k]) * M_PI / 65536.0;
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
      if (!flat[at.z() == 0.0 ? 0 : 1].code(in)) {
        slope.codeSigned(in);
        slope.codeSigned(in);
      }
      p.residual = residual.read(in);
    }
  }

  void readCells() {
    for (int i = 0; i < 3; ++i) cells_anchor.codeSigned(in);
    cells = blocks.read(in);
    beliefs = block_beliefs.read(in, cells);
    if (is_compact) {
      std::map<Cell, unsigned> known;
      for (const auto& [c, value] : cells) known[c] = 0;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        known[cells[i].first] = readEighths(cells[i].first, std::lround(17.0 * beliefs[i]), known);
      }
    } else {
      for (std::size_t i = 0; i < 3 * cells.size(); ++i) in.plain(0, 8);
    }
    region_frames.assign(region_count.code(in), 0);
    std::int64_t last = static_cast<std::int64_t>(poses.size()) - 1;
    for (std::int64_t& frame : region_frames) frame = last += region_frame.codeSigned(in);
  }

  unsigned readEighths(const Cell& c, long belief, const std::map<Cell, unsigned>& known) {
    std::size_t around = 0;
    for (int k = 0; k < 27; ++k) {
      around += known.count({c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1});
    }
    unsigned own = 0;
    for (unsigned i = 0; i < 8; ++i) {
      const auto exists = [&](int x, int y, int z) {
        return std::size_t{known.count({c[0] + x, c[1] + y, c[2] + z})};
      };
      // The eighth x, y, z further, in eighths' sides.
      const auto f = [&](int x, int y, int z) -> std::size_t {
        const int at[3] = {static_cast<int>(i & 1) + x, static_cast<int>(i >> 1 & 1) + y,
                           static_cast<int>(i >> 2) + z};
        const auto half = [&](int k) { return static_cast<int>(roundedDown(at[k], 2)); };
        const auto bit = [&](int k) { return at[k] - 2 * half(k); };
        const Cell cell{c[0] + half(0), c[1] + half(1), c[2] + half(2)};
        const auto found = known.find(cell);
        const unsigned set = cell == c ? own : found == known.end() ? 0 : found->second;
        return set >> (bit(0) + 2 * bit(1) + 4 * bit(2)) & 1;
      };
      const auto bits = [](const std::vector<std::size_t>& all) {
        std::size_t value = 0;
        for (std::size_t k = 0; k < all.size(); ++k) value |= all[k] << k;
        return value;
      };
      const auto sum = [](const std::vector<std::size_t>& all) {
        std::size_t value = 0;
        for (const std::size_t one : all) value += one;
        return value;
      };
      const std::vector<std::size_t> faces{f(-1, 0, 0), f(0, -1, 0), f(0, 0, -1)};
      const std::vector<std::size_t> inner{faces[0],     faces[1],     faces[2],     f(-1, -1, 0),
                                           f(-1, 0, -1), f(0, -1, -1), f(-1, -1, -1)};
      const std::vector<std::size_t> outer{f(1, -1, 0), f(1, 0, -1),  f(0, 1, -1),
                                           f(1, 1, -1), f(-1, 1, -1), f(1, -1, -1)};
      const std::size_t far = bits({f(-2, 0, 0), f(0, -2, 0), f(0, 0, -2)});
      const std::size_t there = bits({exists(-1, 0, 0), exists(0, -1, 0), exists(0, 0, -1)});
      const int x = (i & 1) != 0 ? 1 : -1, y = (i & 2) != 0 ? 1 : -1, z = (i & 4) != 0 ? 1 : -1;
      const std::size_t beyond = bits({exists(x, 0, 0), exists(0, y, 0), exists(0, 0, z)});
      const std::size_t edges =
          bits({exists(x, y, 0), exists(x, 0, z), exists(0, y, z), exists(x, y, z)});
      const std::size_t ones =
          std::min<std::size_t>(3, static_cast<std::size_t>(__builtin_popcount(own)));
      const std::vector<std::size_t> contexts{
          own | 1u << i,
          i + 8 * bits(faces) + 64 * there,
          beyond + 8 * edges + 128 * bits(faces),
          i + 8 * beyond + 64 * bits(faces) + 512 * std::min<std::size_t>(2, ones),
          static_cast<std::size_t>(belief) + 32 * ones + 128 * i,
          bits(inner) + 128 * i,
          bits(outer) + 64 * bits(faces) + 512 * ones,
          far + 8 * bits(faces) + 64 * i + 512 * beyond,
          std::min<std::size_t>(7, sum(inner) + sum(outer)) + 8 * ones +
              32 * std::min<std::size_t>(7, around / 2) + 256 * sum(faces) +
              (belief > 8 ? 1024 : 0)};
      const std::size_t crowd = std::min<std::size_t>(3, (around - 1) / 3);
      if (eighths.code(in, false, contexts, {ones + 4 * crowd, i + 8 * bits(faces)})) {
        own |= 1u << i;
      }
    }
    EXPECT_NE(own, 0u);
    return own;
  }
};

}  // namespace planar_mapping::test
