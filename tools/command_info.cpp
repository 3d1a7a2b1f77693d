// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json mapInfo(const std::string& path) {
  const PlanarMap map = io::loadMap(path);
  std::size_t planar = 0;
  for (const Cuboid& cuboid : map.cuboids()) planar += cuboid.plane_id >= 0 ? 1 : 0;
  const CuboidApproximationParams& approximation = map.params().approximation;
  Json info = {{"type", map.isFinished() ? "finished map" : "map"},
               {"resolution_m", approximation.resolution},
               {"profile", approximation.profile == Profile::Paper ? "paper" : "compact"}};
  if (!map.isFinished()) {
    info["frames"] = map.frames();
    info["planes"] = map.planes().size();
  }
  info["cuboids"] = {{"planar", planar},
                     {"non_planar", map.cuboids().size() - planar},
                     {"total", map.cuboids().size()}};
  if (const Vector3& origin = map.params().origin; !origin.isZero(0.0))
    info["origin_m"] = toJson(origin);
  info["unknown_cells"] = map.unknownCells();
  info["memory_bytes"] = map.memoryBytes();
  const std::vector<io::MapTile> tiles = io::mapTilesOf(path);
  std::uintmax_t bytes = tiles.empty() ? fs::file_size(path) : 0;
  for (const io::MapTile& tile : tiles) bytes += fs::file_size(tile.path);
  info["file_bytes"] = bytes;
  // A first frame that is not moved gives the map its coordinates.
  const auto& poses = map.trajectory();
  const bool is_first =
      !poses.empty() && poses.front().second.matrix() == Pose::Identity().matrix();
  const bool is_own = map.params().frame == MapFrame::Start;
  info["frame"] = is_own ? "its own (poses were found)" : is_first ? "of the first frame" : "world";
  info["up"] = toJson(approximation.up);
  if (map.params().unknown_space) info["max_range_m"] = map.params().max_range;
  Vector3 low;
  Vector3 high;
  if (map.bounds(low, high)) info["bounds_m"] = {{"low", toJson(low)}, {"high", toJson(high)}};
  return info;
}

Json cloudInfo(const std::string& path, double scale) {
  io::CloudData cloud = io::readCloudFile(path, io::CloudChannels::none());
  io::scaleCloud(cloud, scale);
  const io::CloudFileInfo header = io::readCloudFileInfo(path);
  Eigen::AlignedBox3d bounds;
  std::size_t finite = 0;
  const PointsView points = cloud.view();
  for (std::size_t i = 0; i < points.size; ++i) {
    if (!points.isMeasured(i)) continue;
    bounds.extend(points.point(i));
    ++finite;
  }
  const char* const formats[] = {"none", "pcd", "ply", "kitti scan"};
  Json info = {{"type", formats[static_cast<int>(header.format)]},
               {"encoding", header.encoding},
               {"width", cloud.width},
               {"height", cloud.height},
               {"fields", header.fields},
               {"points", cloud.size()},
               {"finite", finite},
               {"viewpoint_m", toJson(cloud.T_world_sensor.translation())},
               {"file_bytes", fs::file_size(path)}};
  const Vector3& origin = cloud.origin;
  if (finite > 0)
    info["bounds_m"] = {{"low", toJson(origin + bounds.min())},
                        {"high", toJson(origin + bounds.max())}};
  return info;
}

Json sequenceInfo(const std::string& path, const io::SequenceOptions& options) {
  const io::Sequence sequence({path}, options);
  const char* poses = sequence.poseSource() == io::PoseSource::None        ? "none"
                      : sequence.poseSource() == io::PoseSource::Viewpoint ? "viewpoint"
                                                                           : "file";
  const char* kind = sequence.kind() == io::SequenceKind::Rgbd     ? "rgbd"
                     : sequence.kind() == io::SequenceKind::Stereo ? "stereo"
                                                                   : "clouds";
  Json info = {{"type", "sequence"},
               {"layout", sequence.layout()},
               {"kind", kind},
               {"frames", sequence.size()},
               {"poses", poses}};
  if (!sequence.notes().empty()) info["notes"] = sequence.notes();
  if (sequence.calibration()) {
    const PinholeCamera& camera = sequence.calibration()->camera;
    info["image"] = {{"width", camera.width}, {"height", camera.height}};
  }
  return info;
}

Json infoOf(const std::string& given, const io::SequenceOptions& options) {
  const std::string path = io::mapFileOf(given);
  std::error_code ignored;
  if (!io::mapTilesOf(path).empty()) return mapInfo(path);
  if (fs::is_directory(path, ignored)) return sequenceInfo(path, options);
  if (io::recognizeCloudFile(path) != io::CloudFormat::None) return cloudInfo(path, options.scale);
  try {
    return mapInfo(path);
  } catch (const Error&) {
    const fs::path ending = fs::path(path).extension();
    if (ending == ".pcd" || ending == ".ply" || ending == ".bin")
      return cloudInfo(path, options.scale);
    if (ending == ".pmap" || !fs::exists(path, ignored)) throw;
    if (ending == ".atlas")
      throw IoError(path, "is an atlas: planar_map atlas info tells what it holds");
    throw IoError(path,
                  "is neither a map (.pmap) nor a cloud (PCD, PLY, KITTI) nor a sequence folder");
  }
}

void printFlat(const Json& json, const std::string& prefix) {
  for (const auto& item : json.items()) {
    const std::string key = prefix.empty() ? item.key() : prefix + "." + item.key();
    if (item.value().is_object()) {
      printFlat(item.value(), key);
    } else {
      std::cout << key << ": "
                << (item.value().is_string() ? item.value().get<std::string>()
                                             : item.value().dump())
                << '\n';
    }
  }
}

}  // namespace

void addInfoCommand(CLI::App& app, int&) {
  struct Arguments {
    std::string file;
    io::SequenceOptions options;
    bool json = false;
  };
  auto* command = app.add_subcommand("info", "What a map, a cloud or a sequence folder holds");
  const auto arguments = std::make_shared<Arguments>();
  command
      ->add_option("file", arguments->file,
                   "Map, result folder of a run, PCD or PLY file, or sequence folder")
      ->required();
  command->add_option("--calib", arguments->options.calibration_file,
                      "Calibration (calib.yaml) in place of the folder's");
  addScaleOption(*command, arguments->options.scale);
  command->add_flag("--json", arguments->json, "For machines");
  command->callback([arguments]() {
    const Json info = infoOf(arguments->file, arguments->options);
    if (arguments->json) {
      std::cout << info.dump(2) << '\n';
    } else {
      printFlat(info, "");
    }
  });
}

}  // namespace planar_mapping::tools
