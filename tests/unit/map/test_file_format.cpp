// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// A second reader of .pmap, written from docs/file_format.md: it shares no code with the first.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/map/planar_map.h"
#include "pmap_bits.h"

namespace planar_mapping {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Cell = std::array<int, 3>;
using test::Chance;
using test::Mixed;
using test::Number;
using test::PmapBits;
using test::Symbol;

/// The payload of a file whose frame is checked.
Bytes payloadOf(const Bytes& file) {
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

double readDouble(PmapBits& in) {
  const std::uint64_t bits = in.plain(0, 64);
  double value = 0.0;
  std::memcpy(&value, &bits, 8);
  return value;
}

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

struct Beliefs {
  std::array<Chance, 2> same;
  std::size_t before = 1;
  Symbol<8> values;
  unsigned last = 255;
  std::vector<double> read(PmapBits& in, std::size_t count) {
    std::vector<double> beliefs;
    while (beliefs.size() < count) {
      before = same[before].code(in) ? 1 : 0;
      if (before == 0) last = values.code(in);
      beliefs.push_back(last / 255.0);
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
};

struct Reader {
  explicit Reader(const Bytes& file) : in(payloadOf(file)) {
    const double usual[26] = {0.1, 0.0, 0.9,   0.0,  0.0, 0.0, 0.5, 4.0,   0.0,
                              0.0, 1.0, 0.087, 0.1,  0.5, 0.0, 10., 0.5,   0.5,
                              0.7, 0.7, 1.0,   0.15, 1.0, 3.0, 0.1, 0.0087};
    Chance is_usual;
    for (const double value : usual) {
      parameters.push_back(is_usual.code(in) ? value : readDouble(in));
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
    Beliefs beliefs;
    int last_id = -1;
    const double s = parameters[0];
    for (ReadPlane& p : planes) {
      p.id = last_id += 1 + static_cast<int>(id.codeSigned(in));
      p.frames = static_cast<unsigned>(frames.codeSigned(in));
      anchor.codeSigned(in);
      anchor.codeSigned(in);
      p.cells = tiles.read(in);
      beliefs.read(in, p.cells.size());

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
          spread[i] = 0.25 * s * s * square / static_cast<double>(n);
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
    Beliefs().read(in, cells.size());
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
            faces |= std::size_t{before[axis] != 0 ? 1u : 0u} << (6 + axis);
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
  std::vector<std::int64_t> region_frames;
};

class FileFormat : public testing::TestWithParam<Profile> {};

TEST_P(FileFormat, IsReadByAReaderWrittenFromItsDescription) {
  PlanarMapParams params;
  params.approximation.profile = GetParam();
  params.max_range = 8.0;
  PlanarMap map(params);
  for (int i = 0; i < 3; ++i) {
    map.insert(test::look(test::Scene(), test::lookFrom({0.1 * i, 0.0, 1.0}), 0.5 * i).frame());
  }
  const Bytes file = map.serialize();
  const Reader read(file);
  EXPECT_EQ(read.in.end(), read.in.bytes.size());
  EXPECT_EQ(read.compact, GetParam() == Profile::Compact);
  EXPECT_TRUE(read.unknown);
  EXPECT_EQ(read.min_points, 1);
  const double s = read.parameters[0];
  EXPECT_EQ(s, 0.1);
  EXPECT_EQ(read.parameters[15], 8.0);

  ASSERT_EQ(read.poses.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const double x = 0.1 * static_cast<double>(i);
    const auto& p = read.poses[i];
    EXPECT_EQ(p[0], 0.5 * static_cast<double>(i));
    EXPECT_LT((Vector3(p[1], p[2], p[3]) - Vector3(x, 0.0, 1.0)).norm(), 2.2e-4);
    EXPECT_EQ(Vector3(map.trajectory()[i].second.translation()), Vector3(p[1], p[2], p[3]));
    const Quaternion turn(Matrix3(test::lookFrom({x, 0.0, 1.0}).linear()));
    EXPECT_NEAR(std::abs(turn.dot(Quaternion(p[7], p[4], p[5], p[6]).normalized())), 1.0, 1e-7);
  }

  ASSERT_EQ(read.planes.size(), map.planes().size());
  EXPECT_GE(read.next_id, static_cast<std::int64_t>(map.planes().size()));
  for (std::size_t k = 0; k < read.planes.size(); ++k) {
    const ReadPlane& plane = read.planes[k];
    const MapPlane& own = map.planes()[k];
    EXPECT_EQ(plane.id, own.id);
    EXPECT_EQ(plane.frames, own.frames);
    EXPECT_LT((plane.n - own.plane.normal).norm(), 1e-12);
    EXPECT_NEAR(plane.n.dot(plane.origin) + own.plane.offset, 0.0, 1e-12);
    EXPECT_EQ(plane.weight, own.moments.weight());
    EXPECT_LT((plane.mean - own.moments.mean()).norm(), 1e-9);
    EXPECT_NEAR(std::sqrt(plane.residual), own.rms(), 1e-6 + 0.05 * own.rms());
    EXPECT_GT(plane.cells.size(), 0u);
    for (const auto& [c, value] : plane.cells) {
      const Vector3 centre = plane.origin + (c[0] + 0.5) * s * plane.u +
                             (c[1] + 0.5) * s * plane.v - 0.5 * s * plane.n;
      EXPECT_FALSE(map.cuboidsAt(centre, s).empty());
    }
  }

  EXPECT_GT(read.cells.size(), 0u);
  for (const auto& [c, value] : read.cells) {
    EXPECT_FALSE(map.cuboidsAt(s * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5), s).empty());
  }
  ASSERT_EQ(read.region_frames.size(), 1u);
  EXPECT_LE(read.region_frames[0], 2);

  std::size_t not_occupied = 0;
  for (const auto& [c, value] : read.space) {
    const Vector3 centre = s * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
    if (value == 1) {
      EXPECT_FALSE(map.isUnknown(centre));
    } else {
      EXPECT_FALSE(map.isFree(centre));
      not_occupied += map.isUnknown(centre);
    }
  }
  EXPECT_EQ(not_occupied, map.unknownCells());
}

INSTANTIATE_TEST_SUITE_P(Profiles, FileFormat, testing::Values(Profile::Compact, Profile::Paper));

TEST(FileFormat, DescribesTheEmptyMap) {
  const Bytes file = PlanarMap().serialize();
  EXPECT_LT(file.size(), 40u);
  const Reader read(file);
  EXPECT_TRUE(read.poses.empty());
  EXPECT_TRUE(read.planes.empty());
  EXPECT_TRUE(read.cells.empty());
  EXPECT_TRUE(read.space.empty());
  EXPECT_EQ(read.in.end(), read.in.bytes.size());
}

/// Files written by the release before version 3, of three frames each.
class Version2 : public testing::TestWithParam<const char*> {};

TEST_P(Version2, IsReadAndSavedAsVersion3) {
  const std::string path =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/tests/data/version2_" + GetParam() + ".pmap";
  std::ifstream stream(path, std::ios::binary);
  const Bytes file((std::istreambuf_iterator<char>(stream)), {});
  ASSERT_GT(file.size(), 4000u) << path;
  ASSERT_EQ(file[8], 2);
  const PlanarMap map = PlanarMap::deserialize(file.data(), file.size());
  EXPECT_EQ(map.frames(), 3u);
  EXPECT_EQ(map.planes().size(), 10u);
  EXPECT_EQ(map.params().approximation.resolution, 0.25);
  EXPECT_NEAR(static_cast<double>(map.unknownCells()), 34430.0, 40.0);
  EXPECT_EQ(map.trajectory()[2].first, 1.0);
  EXPECT_LT((Vector3(map.trajectory()[2].second.translation()) - Vector3(0.3, 0.0, 1.0)).norm(),
            3e-4);
  EXPECT_TRUE(map.isOccupied({0.0, 5.02, 1.4}));
  EXPECT_TRUE(map.isFree({0.0, 3.0, 1.6}));
  EXPECT_TRUE(map.isUnknown({0.0, 6.0, 1.2}));
  const Bytes saved = map.serialize();
  EXPECT_EQ(saved[8], 3);
  EXPECT_LT(saved.size() * 4, file.size());
  const PlanarMap again = PlanarMap::deserialize(saved.data(), saved.size());
  EXPECT_EQ(again.serialize(), saved);
  EXPECT_EQ(again.cuboids().size(), map.cuboids().size());
  for (std::size_t cut = 0; cut < file.size(); cut += 37) {
    EXPECT_ANY_THROW(PlanarMap::deserialize(file.data(), cut));
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, Version2, testing::Values("compact", "paper"));

}  // namespace
}  // namespace planar_mapping
