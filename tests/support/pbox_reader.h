// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <tuple>
#include <utility>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "pmap_bits.h"
#include "pmap_lattice.h"
#include "pmap_models.h"
#include "file/prior_maps.h"

// A second reader of .pbox, written from docs/finished_map.md: it shares no code with the first,
// but the bytes of the prior maps.
namespace planar_mapping::test {

/// Points in no order.
struct PointSet {
  std::array<Number, 3> low, size;
  Chance single, side;
  std::array<Chance, 16> together, bisected;

  void forget() {
    for (auto* chances : {&together, &bisected}) forgetEach(*chances);
    forgetEach(low);
    forgetEach(size);
    single.forget();
    side.forget();
  }
  std::vector<Cell> read(PmapBits& in, std::size_t count) {
    Cell from{}, lengths{1, 1, 1};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      from[axis] = static_cast<int>(low[axis].codeSigned(in));
      if (count > 1) lengths[axis] += static_cast<int>(size[axis].code(in));
    }
    std::vector<Cell> points;
    readHalves(in, count, from, lengths, points);
    std::sort(points.begin(), points.end(), [](const Cell& a, const Cell& b) {
      return std::tie(a[2], a[1], a[0]) < std::tie(b[2], b[1], b[0]);
    });
    return points;
  }

 private:
  void readHalves(PmapBits& in, std::size_t n, Cell from, Cell lengths, std::vector<Cell>& points) {
    if (n == 0) return;
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k) axis = lengths[k] > lengths[axis] ? k : axis;
    if (lengths[axis] == 1) {
      points.insert(points.end(), n, from);
      return;
    }
    const std::size_t lower = readLower(in, n);
    const int whole = lengths[axis];
    lengths[axis] = whole / 2;
    readHalves(in, lower, from, lengths, points);
    from[axis] += whole / 2;
    lengths[axis] = whole - whole / 2;
    readHalves(in, n - lower, from, lengths, points);
  }
  std::size_t readLower(PmapBits& in, std::size_t n) {
    if (n == 1) return single.code(in) ? 1 : 0;
    if (together[std::min<std::size_t>(n, 16) - 1].code(in)) return side.code(in) ? n : 0;
    std::size_t least = 1, most = n - 1;
    for (std::size_t step = 0; least < most; ++step) {
      const std::size_t middle = (least + most + 1) / 2;
      if (bisected[std::min<std::size_t>(step, 15)].code(in)) {
        least = middle;
      } else {
        most = middle - 1;
      }
    }
    return least;
  }
};

/// Lengths by that of the side before.
struct LengthModels : std::array<Number, 6> {
  void forget() { forgetEach(*this); }
  int read(PmapBits& in, int before) {
    std::size_t kind = 0;
    while (kind < 5 && before >> kind != 0) ++kind;
    return 1 + static_cast<int>((*this)[kind].code(in));
  }
};

struct PboxModels {
  std::array<KnownValues, 4> parameters;  ///< resolution, thickness, of space, surface_factor
  Chance is_decimal, compact, unknown;
  Symbol<3> places;
  Number digits;
  Number plane_count, rectangle_count, box_count, free_count, id, turn, plane_of_box;
  std::array<Number, 2> normal;
  std::array<Number, 3> origin;
  Symbol<3> axis, normal_axis;
  Chance level, reversed, on_plane, same_plane;
  Symbol<4> spread;
  PointSet rectangle_places, corners;
  std::array<LengthModels, 2> sides;
  std::array<LengthModels, 3> edges;
  Symbol<2> direction_axis;
  std::array<Number, 4> free_numbers;
  Lattice space_lattice{3, true};

  PboxModels() {
    const double usual[4] = {0.1, 0.0, 0.0, 3.0};
    for (std::size_t i = 0; i < 4; ++i) parameters[i].values = {usual[i]};
  }
  void forget() {
    for (KnownValues& known : parameters) forgetEach(known.is_value);
    for (Chance* c : {&is_decimal, &compact, &unknown, &level, &reversed, &on_plane, &same_plane}) {
      c->forget();
    }
    for (Number* n : {&digits, &plane_count, &rectangle_count, &box_count, &free_count, &id, &turn,
                      &plane_of_box}) {
      n->forget();
    }
    forgetEach(normal);
    forgetEach(origin);
    forgetEach(sides);
    forgetEach(edges);
    forgetEach(free_numbers);
    places.forget();
    axis.forget();
    normal_axis.forget();
    spread.forget();
    direction_axis.forget();
    rectangle_places.forget();
    corners.forget();
    space_lattice.forget();
  }
};

class PboxReader : public PboxModels {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// Has read the prior maps.
  PboxReader() { static_cast<PboxModels&>(*this) = experienced(); }
  explicit PboxReader(const Bytes& file) : PboxReader() {
    in = PmapBits(payloadOf(file));
    readMap();
  }

  PmapBits in;
  double resolution = 0.0, thickness = 0.0, surface_factor = 0.0, space_resolution = 0.0;
  bool is_compact = false, has_unknown = false;
  std::vector<Cuboid> cuboids;
  std::vector<std::pair<Cell, int>> space;

  /// Writes the usual parameters, compact, unknown space.
  void writeStart(PmapBits& out) {
    for (KnownValues& known : parameters) known.is_value[0].code(out, true);
    compact.code(out, true);
    unknown.code(out, true);
  }

 private:
  struct Nothing {};
  explicit PboxReader(Nothing) {}
  static const PboxModels& experienced() {
    static const PboxModels models = [] {
      using namespace detail;
      PboxReader learning{Nothing()};
      learning.in =
          PmapBits(Bytes(kPriorFinishedMaps, kPriorFinishedMaps + kPriorFinishedMapsSize));
      for (std::size_t i = 0; i < kPriorFinishedMapCount; ++i) learning.readMap();
      learning.forget();
      return static_cast<PboxModels&>(learning);
    }();
    return models;
  }

  static Bytes payloadOf(const Bytes& file) {
    const Bytes start{0x50, 0x42, 0x4f, 0x58, 2};
    EXPECT_TRUE(std::equal(start.begin(), start.end(), file.begin()));
    return Bytes(file.begin() + 9, file.end());
  }

  void readMap() {
    cuboids.clear();
    resolution = readParameter(parameters[0]);
    thickness = readParameter(parameters[1]);
    space_resolution = readParameter(parameters[2]);
    surface_factor = readParameter(parameters[3]);
    is_compact = compact.code(in);
    has_unknown = unknown.code(in);
    readPlanes();
    readBoxes();
    for (std::uint64_t n = free_count.code(in); n > 0; --n) cuboids.push_back(readFree());
    space = space_lattice.read(in);
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
      const std::uint64_t bits = in.plain(0, 64);
      std::memcpy(&value, &bits, 8);
    }
    if (known.values.size() < 8) known.values.push_back(value);
    return value;
  }

  void readPlanes() {
    std::array<std::int64_t, 6> turns{};
    int last_id = -1;
    for (std::uint64_t n = plane_count.code(in); n > 0; --n) {
      last_id += 1 + static_cast<int>(id.code(in));
      const unsigned k = axis.code(in);
      const double a = static_cast<double>(normal[0].codeSigned(in)) / 32768.0;
      const double b = static_cast<double>(normal[1].codeSigned(in)) / 32768.0;
      const auto largest = static_cast<Eigen::Index>(k % 3);
      Vector3 w;
      w[largest] = (k < 3 ? 1.0 : -1.0) * std::sqrt(1.0 - a * a - b * b);
      w[(largest + 1) % 3] = a;
      w[(largest + 2) % 3] = b;
      const Vector3 up = std::abs(w.z()) < 0.75 ? Vector3::UnitZ() : Vector3::UnitX();
      const Vector3 along = up.cross(w).normalized();
      double angle = 0.0;
      if (level.code(in)) {
        angle = reversed.code(in) ? M_PI : 0.0;
      } else {
        turns[k] += turn.codeSigned(in);
        angle = static_cast<double>(turns[k]) * M_PI / 65536.0;
      }
      const Vector3 u = std::cos(angle) * along + std::sin(angle) * w.cross(along);
      Matrix3 axes;
      axes << u, w.cross(u), w;
      Vector3 o;
      for (Number& part : origin) {
        o[&part - origin.data()] = static_cast<double>(part.codeSigned(in)) / 4096.0;
      }
      readRectangles(axes, o, spread.code(in), last_id);
    }
  }

  void readRectangles(const Matrix3& axes, const Vector3& o, unsigned steps, int plane_id) {
    const double s = resolution;
    const double full = thickness > 0.0 ? thickness : s;
    double front = 0.0, back = full;
    if (is_compact && surface_factor > 0.0) {
      const unsigned wide = steps > 12 ? steps - 12 : 0;
      const double reach = s * std::min(steps, 12u) / 16.0;
      const double most = wide > 0 ? 0.375 + 0.125 * wide : 0.45;
      front = std::min({reach, most * s, std::max(0.5, most) * full});
      back = std::max(full - front, std::min(reach, 0.75 * s));
    }
    for (const Cell& at : rectangle_places.read(in, rectangle_count.code(in))) {
      const int height = sides[0].read(in, 0);
      const int width = sides[1].read(in, height);
      Cuboid c;
      c.size = {0.5 * s * width, 0.5 * s * height, front + back};
      c.center = axes * (o + Vector3(0.5 * s * (at[0] + 0.5 * width),
                                     0.5 * s * (at[1] + 0.5 * height), 0.5 * (front - back)));
      c.orientation = Quaternion(axes);
      c.plane_id = plane_id;
      cuboids.push_back(c);
    }
  }

  void readBoxes() {
    const std::uint64_t count = box_count.code(in);
    if (count == 0) return;
    int last_plane = 0;
    for (const Cell& low : corners.read(in, count)) {
      Cell size{};
      size[2] = edges[2].read(in, 0);
      size[1] = edges[1].read(in, size[2]);
      size[0] = edges[0].read(in, size[1]);
      const Vector3 lengths = 0.5 * resolution * Vector3(size[0], size[1], size[2]);
      Cuboid c;
      c.center = 0.5 * resolution * Vector3(low[0], low[1], low[2]) + 0.5 * lengths;
      c.size = lengths;
      if (on_plane.code(in)) {
        if (!same_plane.code(in)) last_plane += static_cast<int>(plane_of_box.codeSigned(in));
        c.plane_id = last_plane;
        const unsigned n = normal_axis.code(in);
        const unsigned way = direction_axis.code(in);
        Matrix3 axes = Matrix3::Zero();
        axes(n % 3, 2) = n < 3 ? 1.0 : -1.0;
        axes((n + 1 + (way & 1)) % 3, 0) = way < 2 ? 1.0 : -1.0;
        axes.col(1) = Vector3(axes.col(2)).cross(Vector3(axes.col(0)));
        c.orientation = Quaternion(axes);
        c.size = axes.transpose().cwiseAbs() * lengths;
      }
      cuboids.push_back(c);
    }
  }

  Cuboid readFree() {
    Cuboid c;
    const double unit = resolution / 1024.0;
    for (int i = 0; i < 3; ++i) c.center[i] = unit * double(free_numbers[0].codeSigned(in));
    for (int i = 0; i < 3; ++i) c.size[i] = unit * double(free_numbers[1].codeSigned(in));
    for (int i = 0; i < 4; ++i) {
      c.orientation.coeffs()[i] = static_cast<double>(free_numbers[2].codeSigned(in));
    }
    c.orientation.normalize();
    c.plane_id = static_cast<int>(free_numbers[3].codeSigned(in));
    return c;
  }
};

}  // namespace planar_mapping::test
