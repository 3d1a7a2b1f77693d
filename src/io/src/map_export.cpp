// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/map_export.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>

#include "number_text.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/map_json.h"

namespace planar_mapping {
namespace io {
namespace {

using Colour = std::array<int, 3>;

/// Corners of the faces, wound outwards; bit 0, 1, 2 of a corner choose the sign along u, v, n.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

/// Hues a golden angle apart, so that neighbours in number differ; gray without a plane.
Colour colourOf(const Cuboid& cuboid) {
  if (cuboid.state == CellState::Unknown) return {210, 210, 210};
  if (cuboid.plane_id < 0) return {150, 150, 152};
  const double turn = std::fmod(0.58 + 0.381966 * cuboid.plane_id, 1.0);
  const auto part = [turn](double shift) {
    const double wave = 0.5 + 0.5 * std::cos(2.0 * M_PI * (turn - shift));
    return static_cast<int>(std::lround(90.0 + 150.0 * wave));
  };
  return {part(0.0), part(1.0 / 3.0), part(2.0 / 3.0)};
}

/// Angles about the fixed x, y and z axes, in this order, radians.
Vector3 rollPitchYaw(const Quaternion& q) {
  const Matrix3 R = q.normalized().toRotationMatrix();
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) {  // roll and yaw turn about the same axis
    return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  }
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

std::vector<Cuboid> exported(const PlanarMap& map, ExportedSpace space) {
  std::vector<Cuboid> cuboids = map.cuboids();
  if (space == ExportedSpace::Occupied) return cuboids;
  const std::vector<Cuboid> unknown = map.unknownCuboids();
  cuboids.insert(cuboids.end(), unknown.begin(), unknown.end());
  return cuboids;
}

struct Format {
  const char* extension;
  std::string (*write)(const std::vector<Cuboid>&);
};
constexpr Format kFormats[] = {
    {".csv", cuboidsToCsv}, {".obj", cuboidsToObj}, {".ply", cuboidsToPly}, {".sdf", cuboidsToSdf}};

}  // namespace

std::string cuboidsToCsv(const std::vector<Cuboid>& cuboids) {
  std::string out = "cx,cy,cz,sx,sy,sz,qx,qy,qz,qw,plane_id,probability,state\n";
  for (const Cuboid& c : cuboids) {
    appendNumbers(out,
                  {c.center.x(), c.center.y(), c.center.z(), c.size.x(), c.size.y(), c.size.z(),
                   c.orientation.x(), c.orientation.y(), c.orientation.z(), c.orientation.w()},
                  ",");
    out += ',';
    appendNumber(out, c.plane_id);
    out += ',';
    appendNumber(out, c.probability);
    out += ',';
    out += toString(c.state);
    out += '\n';
  }
  return out;
}

std::string cuboidsToPly(const std::vector<Cuboid>& cuboids) {
  std::string out = "ply\nformat ascii 1.0\ncomment planar_mapping, metres\nelement vertex " +
                    std::to_string(8 * cuboids.size()) +
                    "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar "
                    "red\nproperty uchar green\nproperty uchar blue\nelement face " +
                    std::to_string(12 * cuboids.size()) +
                    "\nproperty list uchar uint vertex_indices\nend_header\n";
  for (const Cuboid& cuboid : cuboids) {
    const Colour colour = colourOf(cuboid);
    for (const Vector3& p : corners(cuboid)) {
      appendNumbers(out, {p.x(), p.y(), p.z()}, " ");
      for (const int part : colour) out += ' ' + std::to_string(part);
      out += '\n';
    }
  }
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const auto corner = [&](int k) {
      return ' ' + std::to_string(8 * i + static_cast<unsigned>(k));
    };
    for (const auto& f : kFaces) {
      out += '3' + corner(f[0]) + corner(f[1]) + corner(f[2]) + '\n';
      out += '3' + corner(f[0]) + corner(f[2]) + corner(f[3]) + '\n';
    }
  }
  return out;
}

std::string cuboidsToObj(const std::vector<Cuboid>& cuboids) {
  std::string out = "# planar_mapping, metres, z up\n";
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& cuboid = cuboids[i];
    out += "o cuboid" + std::to_string(i);
    if (cuboid.plane_id >= 0) out += "_plane" + std::to_string(cuboid.plane_id);
    out += '\n';
    for (const Vector3& p : corners(cuboid)) {
      out += "v ";
      appendNumbers(out, {p.x(), p.y(), p.z()}, " ");
      out += '\n';
    }
    for (const auto& f : kFaces) {
      out += 'f';
      for (const int k : f) out += ' ' + std::to_string(8 * i + static_cast<unsigned>(k) + 1);
      out += '\n';
    }
  }
  return out;
}

std::string cuboidsToSdf(const std::vector<Cuboid>& cuboids) {
  std::string out =
      "<?xml version=\"1.0\"?>\n<sdf version=\"1.7\">\n  <model name=\"planar_map\">\n"
      "    <static>true</static>\n    <link name=\"map\">\n";
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& c = cuboids[i];
    const Vector3 turn = rollPitchYaw(c.orientation);
    std::string box = "        <pose>";
    appendNumbers(box, {c.center.x(), c.center.y(), c.center.z(), turn.x(), turn.y(), turn.z()},
                  " ");
    box += "</pose>\n        <geometry><box><size>";
    appendNumbers(box, {c.size.x(), c.size.y(), c.size.z()}, " ");
    box += "</size></box></geometry>\n";
    const Colour colour = colourOf(c);
    std::string diffuse = "        <material><diffuse>";
    appendNumbers(diffuse, {colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0, 1.0}, " ");
    diffuse += "</diffuse></material>\n";
    const std::string name = "cuboid" + std::to_string(i);
    out += "      <collision name=\"" + name + "\">\n" + box + "      </collision>\n";
    out += "      <visual name=\"" + name + "\">\n" + box + diffuse + "      </visual>\n";
  }
  return out + "    </link>\n  </model>\n</sdf>\n";
}

std::string exportExtensions() {
  std::string names = "pmap, json";
  for (const Format& format : kFormats) names += std::string(", ") + (format.extension + 1);
  return names;
}

void exportMap(const PlanarMap& map, const std::string& path, ExportedSpace space,
               Overwrite overwrite) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".pmap") return saveMap(map, path, overwrite);
  if (extension == ".json") return saveMapJson(map, path, overwrite);
  for (const Format& format : kFormats) {
    if (extension != format.extension) continue;
    return writeFileAtomically(path, format.write(exported(map, space)), overwrite);
  }
  throw ParameterError("'" + path + "' has an extension that maps are not written in; there are " +
                       exportExtensions());
}

}  // namespace io
}  // namespace planar_mapping
