// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Cuboids as a mesh: PLY, OBJ, STL, glTF 2.0 in one file; VTP with a quad for each face.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "planar_mapping/io/export/exported_map.h"

namespace planar_mapping::io {
namespace {

/// Triangles of some cuboids.
struct Mesh {
  std::vector<Vector3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  void add(const Cuboid& cuboid) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Vector3& corner : corners(cuboid)) vertices.push_back(corner);
    for (const auto& t : kTriangles)
      triangles.push_back({first + static_cast<std::uint32_t>(t[0]),
                           first + static_cast<std::uint32_t>(t[1]),
                           first + static_cast<std::uint32_t>(t[2])});
  }
};

Mesh meshOf(const ExportedMap& map) {
  Mesh mesh;
  for (const Cuboid& cuboid : map.cuboids) mesh.add(cuboid);
  return mesh;
}

/// A mesh for each plane, one for the rest and one for unknown space.
struct Group {
  Colour colour;
  Mesh mesh;
};
std::map<std::string, Group> groupsOf(const ExportedMap& map) {
  std::map<std::string, Group> groups;
  for (const Cuboid& cuboid : map.cuboids)
    groups.try_emplace(groupOf(cuboid), Group{colourOf(cuboid), {}}).first->second.mesh.add(cuboid);
  return groups;
}

}  // namespace

Contents writePly(const ExportedMap& map, const std::string&) {
  const Mesh mesh = meshOf(map);
  std::string out = concatenated(
      "ply\nformat binary_little_endian 1.0\ncomment planar_mapping, metres\n",
      originNote(map, "comment ", "\n"), "element vertex ", mesh.vertices.size(),
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
      "green\nproperty uchar blue\nelement face ",
      mesh.triangles.size(), "\nproperty list uchar int vertex_indices\nend_header\n");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Colour colour = colourOf(map.cuboids[i / 8]);
    appendFloats(out, mesh.vertices[i]);
    for (const int part : {colour.red, colour.green, colour.blue}) out += static_cast<char>(part);
  }
  for (const auto& triangle : mesh.triangles) {
    out += '\3';
    for (const std::uint32_t k : triangle) appendBytes(out, k);
  }
  return {std::move(out)};
}

Contents writeObj(const ExportedMap& map, const std::string& path) {
  std::string out = "# planar_mapping, metres\n" + originNote(map, "# ", "\n") + "mtllib " +
                    stemOf(path) + ".mtl\n";
  std::string materials = "# planar_mapping\n";
  std::size_t first = 1;  // vertices count from 1
  for (const auto& [name, group] : groupsOf(map)) {
    append(materials, "newmtl ", name, "\nKd ",
           listOf(Vector3(group.colour.red, group.colour.green, group.colour.blue) / 255.0), "\nd ",
           group.colour.alpha, "\nillum 1\n");
    append(out, "o ", name, "\nusemtl ", name, '\n');
    for (const Vector3& vertex : group.mesh.vertices) append(out, "v ", listOf(vertex), '\n');
    for (const auto& [a, b, c] : group.mesh.triangles)
      append(out, "f ", first + a, ' ', first + b, ' ', first + c, '\n');
    first += group.mesh.vertices.size();
  }
  return {std::move(out), std::move(materials)};
}

Contents writeStl(const ExportedMap& map, const std::string&) {
  const Mesh mesh = meshOf(map);
  // Must not begin with "solid".
  std::string out = "planar_mapping, binary, metres" + originNote(map, ", ", "");
  out.resize(80, ' ');
  appendBytes(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vector3 &a = mesh.vertices[i], &b = mesh.vertices[j], &c = mesh.vertices[k];
    appendFloats(out, Vector3((b - a).cross(c - a).normalized()));
    for (const Vector3* p : {&a, &b, &c}) appendFloats(out, *p);
    out.append(2, '\0');
  }
  return {std::move(out)};
}

Contents writeGlb(const ExportedMap& map, const std::string&) {
  using Json = nlohmann::ordered_json;
  constexpr int kFloat = 5126, kUnsignedInt = 5125;   // componentType
  constexpr int kVertices = 34962, kIndices = 34963;  // target
  const auto list = [](const auto& v) { return Json(std::vector<double>(v.begin(), v.end())); };
  // Colours of glTF are linear, those of a screen are not.
  const auto linear = [](int part) { return std::pow(part / 255.0, 2.2); };

  // Vertices are floats: they are relative to the middle of the map, which nodes carry as doubles.
  // Whole metres: no rounding where the map is near its origin.
  Vector3 middle = Vector3::Zero();
  for (const Cuboid& cuboid : map.cuboids)
    middle += cuboid.center / static_cast<double>(map.cuboids.size());
  middle = middle.array().round();

  const Quaternion turn = turning(map.up, Vector3::UnitY());
  Json json = Json::parse(
      R"({"asset":{"version":"2.0","generator":"planar_mapping"},"scene":0,"scenes":[{"nodes":[0]}],
          "nodes":[{"name":"planar_map"}]})");
  json["nodes"][0]["rotation"] = {turn.x(), turn.y(), turn.z(), turn.w()};
  if (!map.origin.isZero(0.0)) json["nodes"][0]["extras"]["origin_m"] = list(map.origin);
  std::string buffer;
  const auto addView = [&](int target, int type, const char* shape, std::size_t count,
                           std::size_t start) {
    json["bufferViews"].push_back({{"buffer", 0},
                                   {"byteOffset", start},
                                   {"byteLength", buffer.size() - start},
                                   {"target", target}});
    json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                 {"componentType", type},
                                 {"count", count},
                                 {"type", shape}});
  };
  std::size_t number = 0;
  for (const auto& [name, group] : groupsOf(map)) {
    std::size_t start = buffer.size();
    Eigen::Vector3f low = Eigen::Vector3f::Constant(INFINITY), high = -low;
    for (const Vector3& vertex : group.mesh.vertices) {
      const Eigen::Vector3f p = (vertex - middle).cast<float>();
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
      appendFloats(buffer, p.cast<double>());
    }
    addView(kVertices, kFloat, "VEC3", group.mesh.vertices.size(), start);
    json["accessors"].back()["min"] = list(low);
    json["accessors"].back()["max"] = list(high);
    start = buffer.size();
    for (const auto& triangle : group.mesh.triangles)
      for (const std::uint32_t k : triangle) appendBytes(buffer, k);
    addView(kIndices, kUnsignedInt, "SCALAR", 3 * group.mesh.triangles.size(), start);
    const Json primitive = {{"attributes", {{"POSITION", 2 * number}}},
                            {"indices", 2 * number + 1},
                            {"material", number}};
    json["meshes"].push_back({{"name", name}, {"primitives", Json::array({primitive})}});
    json["nodes"].push_back({{"name", name}, {"mesh", number}, {"translation", list(middle)}});
    json["nodes"][0]["children"].push_back(++number);
    const Colour& c = group.colour;
    const Json look = {
        {"baseColorFactor", {linear(c.red), linear(c.green), linear(c.blue), c.alpha}},
        {"metallicFactor", 0},
        {"roughnessFactor", 0.9}};
    json["materials"].push_back({{"name", name}, {"pbrMetallicRoughness", look}});
    if (c.alpha < 1.0) json["materials"].back()["alphaMode"] = "BLEND";
  }
  if (!buffer.empty()) json["buffers"].push_back({{"byteLength", buffer.size()}});

  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out = "glTF";
  appendBytes(out, std::uint32_t{2});
  appendBytes(out, static_cast<std::uint32_t>(12 + 8 + text.size() +
                                              (buffer.empty() ? 0 : 8 + buffer.size())));
  appendBytes(out, static_cast<std::uint32_t>(text.size()));
  out += "JSON" + text;
  if (!buffer.empty()) {
    appendBytes(out, static_cast<std::uint32_t>(buffer.size()));
    out.append("BIN\0", 4);
    out += buffer;
  }
  return {std::move(out)};
}

namespace {

/// One <DataArray>; append(cuboid, its number) writes its values.
template <typename Append>
void appendArray(std::string& out, const ExportedMap& map, const std::string& attributes,
                 Append&& append) {
  out += "<DataArray " + attributes + " format=\"ascii\">\n";
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) append(map.cuboids[i], i);
  out += "</DataArray>\n";
}

/// The same value for the six faces of a cuboid.
template <typename ValueOf>
void appendCellArray(std::string& out, const ExportedMap& map, const std::string& type,
                     const std::string& name, const ValueOf& valueOf) {
  appendArray(out, map, "type=\"" + type + "\" Name=\"" + name + "\"",
              [&](const Cuboid& cuboid, std::size_t i) {
                const std::string value = concatenated(valueOf(cuboid, i));
                for (int face = 0; face < 6; ++face) (out += value) += face < 5 ? ' ' : '\n';
              });
}

}  // namespace

Contents writeVtp(const ExportedMap& map, const std::string&) {
  const std::size_t count = map.cuboids.size();
  std::string out = concatenated(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n<DataArray "
      "type=\"Float64\" Name=\"origin_m\" NumberOfComponents=\"3\" NumberOfTuples=\"1\" "
      "format=\"ascii\">",
      listOf(map.origin), "</DataArray>\n</FieldData>\n<Piece NumberOfPoints=\"", 8 * count,
      "\" NumberOfPolys=\"", 6 * count,
      "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\">\n<Points>\n");
  appendArray(out, map, "type=\"Float64\" NumberOfComponents=\"3\"",
              [&](const Cuboid& cuboid, std::size_t) {
                for (const Vector3& corner : corners(cuboid)) append(out, listOf(corner), '\n');
              });
  out += "</Points>\n<Polys>\n";
  appendArray(out, map, "type=\"Int64\" Name=\"connectivity\"", [&](const Cuboid&, std::size_t i) {
    for (const auto& face : kCuboidFaces) {
      for (const int k : face) append(out, 8 * i + static_cast<std::size_t>(k), ' ');
    }
    out += '\n';
  });
  appendArray(out, map, "type=\"Int64\" Name=\"offsets\"", [&](const Cuboid&, std::size_t i) {
    for (std::size_t face = 1; face <= 6; ++face)
      append(out, 24 * i + 4 * face, face < 6 ? ' ' : '\n');
  });
  out += "</Polys>\n<CellData Scalars=\"plane_id\">\n";
  appendCellArray(out, map, "Int32", "cuboid_id", [](const Cuboid&, std::size_t i) { return i; });
  appendCellArray(out, map, "Int32", "plane_id",
                  [](const Cuboid& c, std::size_t) { return c.plane_id; });
  appendCellArray(out, map, "Float32", "probability",
                  [](const Cuboid& c, std::size_t) { return c.probability; });
  appendCellArray(out, map, "UInt8", "state",
                  [](const Cuboid& c, std::size_t) { return static_cast<int>(c.state); });
  appendCellArray(out, map, "Float64\" NumberOfComponents=\"3", "size",
                  [](const Cuboid& c, std::size_t) { return listOf(c.size); });
  out += "</CellData>\n</Piece>\n</PolyData>\n</VTKFile>\n";
  return {std::move(out)};
}

}  // namespace planar_mapping::io
