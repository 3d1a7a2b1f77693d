// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <map>

#include "planar_mapping/io/export/exported_map.h"

// Cuboids as triangles: PLY, OBJ, STL; glTF 2.0 in one file, a mesh for each plane, y up.
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
      for (const int part : {colour.red, colour.green, colour.blue}) out += static_cast<char>(part);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (const auto& triangle : kTriangles) {
      out += '\3';
      for (const int k : triangle) appendBytes(out, static_cast<std::int32_t>(8 * i) + k);
    }
  }
  return {std::move(out)};
}

Contents writeObj(const ExportedMap& map, const std::string& path) {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) groups[groupOf(map.cuboids[i])].push_back(i);
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

namespace {

constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr int kVertices = 34962, kIndices = 34963;

/// Colours of glTF are linear, those of a screen are not.
double linear(int part) {
  return std::pow(part / 255.0, 2.2);
}

/// A piece of the buffer, and what is in it.
struct Part {
  std::size_t offset, bytes;
  int target, type;
  std::size_t count;
  const char* shape;
  std::string limits;
};

class Model {
 public:
  /// Vertices are floats: they are relative to the origin, which the node carries as doubles.
  void add(const std::string& name, const std::vector<const Cuboid*>& cuboids,
           const Vector3& origin) {
    const Colour colour = colourOf(*cuboids.front());
    const std::size_t start = buffer_.size();
    Eigen::Vector3f low = Eigen::Vector3f::Constant(INFINITY), high = -low;
    for (const Cuboid* cuboid : cuboids) {
      for (const Vector3& corner : corners(*cuboid)) {
        const Eigen::Vector3f p = (corner - origin).cast<float>();
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
        appendFloats(buffer_, p.cast<double>());
      }
    }
    parts_.push_back({start, buffer_.size() - start, kVertices, kFloat, 8 * cuboids.size(), "VEC3",
                      concatenated(",\"min\":[", listOf(Vector3(low.cast<double>()), ","),
                                   "],\"max\":[", listOf(Vector3(high.cast<double>()), ","), ']')});
    const std::size_t indices = buffer_.size();
    for (std::size_t i = 0; i < cuboids.size(); ++i) {
      for (const auto& triangle : kTriangles) {
        for (const int k : triangle)
          appendBytes(buffer_, static_cast<std::uint32_t>(8 * i) + static_cast<std::uint32_t>(k));
      }
    }
    parts_.push_back({indices, buffer_.size() - indices, kIndices, kUnsignedInt,
                      36 * cuboids.size(), "SCALAR", ""});
    const int number = meshes_++;
    const char* comma = number > 0 ? "," : "";
    append(mesh_text_, comma, "{\"name\":\"", name,
           "\",\"primitives\":[{\"attributes\":{\"POSITION\":", parts_.size() - 2,
           "},\"indices\":", parts_.size() - 1, ",\"material\":", number, "}]}");
    append(node_text_, ",{\"name\":\"", name, "\",\"mesh\":", number, ",\"translation\":[",
           listOf(origin, ","), "]}");
    append(
        material_text_, comma, "{\"name\":\"", name,
        "\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[",
        NumberList{
            4, ",", {linear(colour.red), linear(colour.green), linear(colour.blue), colour.alpha}},
        "],\"metallicFactor\":0,\"roughnessFactor\":0.9}",
        colour.alpha < 1.0 ? ",\"alphaMode\":\"BLEND\"" : "", '}');
  }

  /// \param turn from the axes of the map to y up
  /// \param origin of the map
  std::string bytes(const Quaternion& turn, const Vector3& origin) const {
    std::string json =
        "{\"asset\":{\"version\":\"2.0\",\"generator\":\"planar_mapping\"},\"scene\":0,\"scenes\":"
        "[{\"nodes\":[0]}],\"nodes\":[{\"name\":\"planar_map\",\"rotation\":[";
    append(json, listOf(turn, ","), ']');
    if (!origin.isZero(0.0)) append(json, ",\"extras\":{\"origin_m\":[", listOf(origin, ","), "]}");
    if (meshes_ > 0) json += ",\"children\":[";
    for (int i = 1; i <= meshes_; ++i) append(json, i > 1 ? "," : "", i);
    if (meshes_ > 0) json += ']';
    append(json, '}', node_text_, ']');
    if (meshes_ > 0) {
      append(json, ",\"meshes\":[", mesh_text_, "],\"materials\":[", material_text_,
             "],\"buffers\":[{\"byteLength\":", buffer_.size(), "}]");
      std::string views, accessors;
      for (std::size_t i = 0; i < parts_.size(); ++i) {
        const Part& part = parts_[i];
        const char* comma = i > 0 ? "," : "";
        append(views, comma, "{\"buffer\":0,\"byteOffset\":", part.offset,
               ",\"byteLength\":", part.bytes, ",\"target\":", part.target, '}');
        append(accessors, comma, "{\"bufferView\":", i, ",\"componentType\":", part.type,
               ",\"count\":", part.count, ",\"type\":\"", part.shape, '"', part.limits, '}');
      }
      append(json, ",\"bufferViews\":[", views, "],\"accessors\":[", accessors, ']');
    }
    json += '}';
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    const std::size_t chunk = meshes_ > 0 ? 8 + buffer_.size() : 0;
    appendBytes(out, std::uint32_t{2});
    appendBytes(out, static_cast<std::uint32_t>(12 + 8 + json.size() + chunk));
    appendBytes(out, static_cast<std::uint32_t>(json.size()));
    out += "JSON" + json;
    if (meshes_ > 0) {
      appendBytes(out, static_cast<std::uint32_t>(buffer_.size()));
      out.append("BIN\0", 4);
      out += buffer_;
    }
    return out;
  }

 private:
  std::string buffer_;
  std::vector<Part> parts_;
  int meshes_ = 0;
  std::string mesh_text_, node_text_, material_text_;
};

}  // namespace

Contents writeGlb(const ExportedMap& map, const std::string&) {
  std::map<std::string, std::vector<const Cuboid*>> groups;
  Vector3 sum = Vector3::Zero();
  for (const Cuboid& cuboid : map.cuboids) {
    groups[groupOf(cuboid)].push_back(&cuboid);
    sum += cuboid.center;
  }
  // Whole metres: no rounding where the map is near its origin.
  const double count = std::max<double>(1.0, static_cast<double>(map.cuboids.size()));
  const Vector3 origin = (sum / count).array().round();
  Model model;
  for (const auto& [name, cuboids] : groups) model.add(name, cuboids, origin);
  return {model.bytes(turning(map.up, Vector3::UnitY()), map.origin)};
}

}  // namespace planar_mapping::io
