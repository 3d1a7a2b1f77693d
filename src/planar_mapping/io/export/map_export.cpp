// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/export/map_export.h"

#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/export/exported_map.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/map_json.h"

namespace planar_mapping::io {
namespace {

struct Format {
  const char* extension;
  const char* readers;
  Writer* write;  ///< null: the whole map
  Space space = Space::AsAsked;
  const char* beside = nullptr;  ///< extension of its second file
};

constexpr Format kFormats[] = {
    {".pmap", "the map itself: this program and library", nullptr},
    {".json", "all cuboids and planes: any program", nullptr},
    {".csv", "a cuboid a line: spreadsheets, pandas", writeCsv},
    {".sdf", "a static model: Gazebo", writeSdf},
    {"/", "NAME/ with model.config and model.sdf: a model folder of Gazebo", writeModelFolder},
    {".urdf", "one link of boxes: ROS, PyBullet, Drake", writeUrdf},
    {".scene", "collision objects: MoveIt", writeScene},
    {".pgm", "plan with its .yaml, a pair for each storey: nav2, map_server", writePgm, Space::Plan,
     ".yaml"},
    {".svg", "floor plan, a file for each storey: browsers, Inkscape", writeSvg, Space::Plan},
    {".dxf", "floor plan, a file for each storey: CAD", writeDxf, Space::Plan},
    {".bt", "octree, free or occupied: OctoMap, octovis, MoveIt", writeOctree, Space::Free},
    {".ot", "octree of log-odds: OctoMap", writeOctree, Space::Free},
    {".html", "one page with the map in 3-D, its plan and figures: web browsers", writePage,
     Space::Page},
    {".vtp", "boxes with their properties: ParaView, VTK", writeVtp},
    {".glb", "glTF 2.0, y up: Blender, web browsers, Unity, assimp", writeGlb},
    {".ply", "coloured mesh: MeshLab, CloudCompare, PCL, Open3D", writePly},
    {".obj", "with its .mtl: Blender, Open3D, assimp", writeObj, Space::AsAsked, ".mtl"},
    {".stl", "mesh without colours: CAD, MeshLab", writeStl},
    {".pcd", "centres or points on the surface: PCL, CloudCompare", writePoints},
};

bool isFolder(const std::string& path) {
  return !path.empty() && path.back() == '/';
}

const Format& formatOf(const std::string& path) {
  const std::string extension =
      isFolder(path) ? "/" : std::filesystem::path(path).extension().string();
  std::string names;
  for (const Format& format : kFormats) {
    if (extension == format.extension) return format;
    names += std::string(" ") + format.extension;
  }
  throw ParameterError("'" + path + "' has an extension that maps are not written in; there are" +
                       names);
}

/// All of them or, unless the last step fails, none.
void writeFiles(const std::vector<std::string>& paths, const Contents& contents,
                Overwrite overwrite) {
  std::vector<std::unique_ptr<AtomicFile>> files;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    files.push_back(std::make_unique<AtomicFile>(paths[i], overwrite));
    files.back()->write(contents.at(i));
  }
  for (const std::unique_ptr<AtomicFile>& file : files) file->commit();
}

/// A name that needs no quotes in any format.
void requireName(const std::string& frame_id) {
  for (const char c : frame_id) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("_-./", c) != nullptr)
      continue;
    throw ParameterError("frame_id is '" + frame_id + "', but must be of letters, digits and _-./");
  }
  if (frame_id.empty()) throw ParameterError("frame_id must not be empty");
}

}  // namespace

ExportedMap exportedOf(const PlanarMap& map, Space space, const ExportOptions& options) {
  ExportedMap exported;
  if (space == Space::Plan || space == Space::Page) exported.plan = planSourceOf(map);
  if (space != Space::Plan) exported.cuboids = map.cuboids();
  if (space == Space::Page) exported.unknown = map.unknownCuboids();
  exported.up = map.params().approximation.up.normalized();
  exported.origin = map.params().origin;
  exported.resolution = map.params().approximation.resolution;
  exported.frames = map.frames();
  exported.options = options;
  if (space == Space::Free) {
    exported.free = map.freeCuboids();
  } else if (options.unknown && space == Space::AsAsked) {
    const std::vector<Cuboid> unknown = map.unknownCuboids();
    exported.cuboids.insert(exported.cuboids.end(), unknown.begin(), unknown.end());
  }
  return exported;
}

std::string originNote(const ExportedMap& map, const char* before, const char* after) {
  if (map.origin.isZero(0.0)) return "";
  return concatenated(before, "origin_m ", listOf(map.origin), after);
}

std::string stemOf(const std::string& path) {
  const std::filesystem::path name(path);
  return (isFolder(path) ? name.parent_path().filename() : name.stem()).string();
}

std::vector<ExportFormat> exportFormats() {
  std::vector<ExportFormat> formats;
  for (const Format& format : kFormats) formats.push_back({format.extension, format.readers});
  return formats;
}

std::vector<std::string> exportedFiles(const std::string& path, bool distance,
                                       std::size_t storeys) {
  const Format& format = formatOf(path);
  if (isFolder(path)) return {path + "model.sdf", path + "model.config"};
  std::vector<std::string> files;
  const auto add = [&](const std::string& name) {
    std::filesystem::path file(path);
    if (!name.empty()) file.replace_filename(name);
    files.push_back(file.string());
    if (format.beside != nullptr) files.push_back(file.replace_extension(format.beside).string());
    if (distance && format.write == writePgm)
      files.push_back(file.replace_extension(".npy").string());
  };
  add("");
  for (std::size_t storey = 0; storeys > 1 && storey < storeys; ++storey)
    add(stemOf(path) + "_" + std::to_string(storey) + format.extension);
  return files;
}

std::vector<std::string> exportMap(const PlanarMap& map, const std::string& path,
                                   const ExportOptions& options) {
  const Format& format = formatOf(path);
  requireInRange("cell", options.cell, 0.0, 1e6, "m");
  requireInRange("spacing", options.spacing, 0.0, 1e6, "m");
  requireName(options.frame_id);
  if (format.extension == std::string(".pmap")) {
    saveMap(map, path, options.overwrite);
    return {};
  }
  if (format.write == nullptr) {
    saveMapJson(map, path, options.overwrite, options.frame_id);
    return {};
  }
  ExportedMap exported = exportedOf(map, format.space, options);
  const Contents contents = format.write(exported, path);
  if (isFolder(path)) {
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error) throw IoError(path, "cannot be created: " + error.message());
  }
  const std::size_t plans = contents.size() / exportedFiles(path, options.distance).size();
  writeFiles(exportedFiles(path, options.distance, plans > 1 ? plans - 1 : 1), contents,
             options.overwrite);
  return exported.notes;
}

Colour colourOf(const Cuboid& cuboid) {
  if (cuboid.state == CellState::Unknown) return {210, 210, 210, 0.3};
  if (cuboid.plane_id < 0) return {150, 150, 152};
  const double turn = std::fmod(0.58 + 0.381966 * cuboid.plane_id, 1.0);
  const auto part = [turn](double shift) {
    const double wave = 0.5 + 0.5 * std::cos(2.0 * M_PI * (turn - shift));
    return static_cast<int>(std::lround(90.0 + 150.0 * wave));
  };
  return {part(0.0), part(1.0 / 3.0), part(2.0 / 3.0)};
}

std::string groupOf(const Cuboid& cuboid) {
  if (cuboid.state == CellState::Unknown) return "unknown";
  return cuboid.plane_id < 0 ? "no_plane" : "plane_" + std::to_string(cuboid.plane_id);
}

Vector3 rollPitchYaw(const Quaternion& q) {
  const Matrix3 R = q.normalized().toRotationMatrix();
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) {  // roll and yaw turn about the same axis
    return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  }
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

}  // namespace planar_mapping::io
