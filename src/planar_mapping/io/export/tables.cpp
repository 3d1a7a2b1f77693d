// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A row for each cuboid: CSV; a point for each, or many: PCD.
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/export/exported_map.h"

namespace planar_mapping::io {
namespace {

/// Of a file: 1.5 GB.
constexpr std::size_t kMaxPoints = 50'000'000;

}  // namespace

Contents writeCsv(const ExportedMap& map, const std::string&) {
  std::string out =
      "cuboid_id,frame_id,state,probability,plane_id,center_x_m,center_y_m,center_z_m,size_x_m,"
      "size_y_m,size_z_m,qx,qy,qz,qw,up_x,up_y,up_z,origin_x_m,origin_y_m,origin_z_m\n";
  const std::string axes = concatenated(listOf(map.up, ","), ',', listOf(map.origin, ","));
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    append(out, i, ',', map.options.frame_id, ',', toString(c.state), ',', c.probability, ',',
           c.plane_id, ',', listOf(c.center, ","), ',', listOf(c.size, ","), ',',
           listOf(c.orientation, ","), ',', axes, '\n');
  }
  return {std::move(out)};
}

Contents writePoints(const ExportedMap& map, const std::string&) {
  const double spacing = map.options.spacing > 0.0 ? map.options.spacing : 0.5 * map.resolution;
  // Points of a face along an axis lie in the middle of equal parts.
  const auto parts = [spacing](double length) {
    return std::max(1.0, std::ceil(length / spacing - 1e-9));
  };
  double count = static_cast<double>(map.cuboids.size());
  const bool surface = map.options.points == ExportedPoints::Surface;
  if (surface) {
    count = 0.0;
    for (const Cuboid& c : map.cuboids) {
      const double x = parts(c.size.x()), y = parts(c.size.y()), z = parts(c.size.z());
      count += 2.0 * (x * y + y * z + z * x);
    }
  }
  if (!(count <= static_cast<double>(kMaxPoints)))
    throw ParameterError("a spacing of " + std::to_string(spacing) +
                         " m gives more than 50 million points; take a larger one");
  const std::string points = std::to_string(static_cast<std::size_t>(count));
  std::string out =
      "# .PCD v0.7 - Point Cloud Data file format\n" + originNote(map, "# ", "\n") +
      "VERSION 0.7\nFIELDS x y z rgb probability "
      "plane_id cuboid_id state\nSIZE 4 4 4 4 4 4 4 1\nTYPE F F F U F I I U\nCOUNT 1 1 1 1 1 1 1 "
      "1\nWIDTH " +
      points + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA binary\n";
  out.reserve(out.size() + static_cast<std::size_t>(count) * 29);
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    const Colour colour = colourOf(c);
    const auto add = [&](const Vector3& point) {
      appendFloats(out, point);
      appendBytes(out,
                  static_cast<std::uint32_t>(colour.red << 16 | colour.green << 8 | colour.blue));
      appendBytes(out, c.probability);
      appendBytes(out, c.plane_id);
      appendBytes(out, static_cast<std::int32_t>(i));
      appendBytes(out, static_cast<std::uint8_t>(c.state));
    };
    if (!surface) {
      add(c.center);
      continue;
    }
    const Matrix3 axes = c.orientation.toRotationMatrix() * c.size.asDiagonal();
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3, b = (k + 2) % 3;
      const double along_a = parts(c.size[a]), along_b = parts(c.size[b]);
      for (const double side : {-0.5, 0.5}) {
        for (double u = 0.5; u < along_a; ++u) {
          for (double v = 0.5; v < along_b; ++v)
            add(c.center + side * axes.col(k) + (u / along_a - 0.5) * axes.col(a) +
                (v / along_b - 0.5) * axes.col(b));
        }
      }
    }
  }
  return {std::move(out)};
}

}  // namespace planar_mapping::io
