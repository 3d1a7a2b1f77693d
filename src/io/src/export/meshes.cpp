// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Cuboids as triangles: PLY, OBJ, STL.
#include <map>

#include "export/conventions.h"
#include "export/exported_map.h"

namespace planar_mapping::io {

Contents writePly(const ExportedMap& map, const std::string&) {
  const std::size_t count = map.cuboids.size();
  std::string out = concatenated(
      "ply\nformat binary_little_endian 1.0\ncomment planar_mapping, metres\n",
      originNote(map, "comment ", "\n"), "element vertex ", 8 * count,
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
      "green\nproperty uchar blue\nelement face ",
      12 * count, "\nproperty list uchar int vertex_indices\nend_header\n");
  out.reserve(out.size() + count * (8 * 15 + 12 * 13));
  for (const Cuboid& cuboid : map.cuboids) {
    const Colour colour = colourOf(cuboid);
    for (const Vector3& corner : corners(cuboid)) {
      appendFloats(out, corner);
      for (const int part : {colour.red, colour.green, colour.blue}) {
        out += static_cast<char>(part);
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (const auto& triangle : kTriangles) {
      out += '\3';
      for (const int k : triangle) {
        appendBytes(out, static_cast<std::int32_t>(8 * i) + k);
      }
    }
  }
  return {std::move(out)};
}

Contents writeObj(const ExportedMap& map, const std::string& path) {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    groups[groupOf(map.cuboids[i])].push_back(i);
  }
  std::string out = "# planar_mapping, metres\n" + originNote(map, "# ", "\n") + "mtllib " +
                    stemOf(path) + ".mtl\n";
  std::string materials = "# planar_mapping\n";
  std::size_t first = 1;  // vertices count from 1
  for (const auto& [name, members] : groups) {
    const Colour colour = colourOf(map.cuboids[members.front()]);
    append(materials, "newmtl ", name, "\nKd ",
           listOf(Vector3(colour.red, colour.green, colour.blue) / 255.0), "\nd ", colour.alpha,
           "\nillum 1\n");
    append(out, "o ", name, "\nusemtl ", name, '\n');
    for (const std::size_t i : members) {
      for (const Vector3& corner : corners(map.cuboids[i])) append(out, "v ", listOf(corner), '\n');
    }
    for (std::size_t i = 0; i < members.size(); ++i, first += 8) {
      for (const auto& triangle : kTriangles) {
        out += 'f';
        for (const int k : triangle) append(out, ' ', first + static_cast<std::size_t>(k));
        out += '\n';
      }
    }
  }
  return {std::move(out), std::move(materials)};
}

Contents writeStl(const ExportedMap& map, const std::string&) {
  // Must not begin with "solid".
  std::string out = "planar_mapping, binary, metres" + originNote(map, ", ", "");
  out.resize(80, ' ');
  appendBytes(out, static_cast<std::uint32_t>(12 * map.cuboids.size()));
  out.reserve(out.size() + map.cuboids.size() * 12 * 50);
  for (const Cuboid& cuboid : map.cuboids) {
    const std::array<Vector3, 8> corner = corners(cuboid);
    for (const auto& t : kTriangles) {
      const Vector3& a = corner[static_cast<std::size_t>(t[0])];
      const Vector3& b = corner[static_cast<std::size_t>(t[1])];
      const Vector3& c = corner[static_cast<std::size_t>(t[2])];
      appendFloats(out, Vector3((b - a).cross(c - a).normalized()));
      for (const Vector3* p : {&a, &b, &c}) appendFloats(out, *p);
      out.append(2, '\0');
    }
  }
  return {std::move(out)};
}

}  // namespace planar_mapping::io
