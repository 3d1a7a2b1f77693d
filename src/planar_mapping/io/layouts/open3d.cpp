// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <nlohmann/json.hpp>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/text_lines.h"

// Open3D's reconstruction system: depth/ and color/ (or image/, rgb/), camera_intrinsic.json and
// trajectory.log, which may lie in scene/.
namespace planar_mapping::io::layouts {
namespace {

std::string colorFolderOf(const std::string& folder) {
  return firstOf(folder, {"color", "image", "rgb"});
}

std::string intrinsicsOf(const std::string& folder) {
  return firstOf(
      folder, {"camera_intrinsic.json", "intrinsic.json", "camera.json", "camera_primesense.json"});
}

std::string trajectoryOf(const std::string& folder) {
  return firstOf(folder, {"trajectory.log", "scene/trajectory.log", "test_scene/trajectory.log"});
}

Calibration readIntrinsics(const std::string& path) {
  constexpr std::size_t kLargest = std::size_t{1} << 20;
  constexpr double kDepthScale = 1000.0;  // of Open3D's readers, where nothing else is said
  const std::vector<std::uint8_t> bytes = readWholeFile(path, kLargest);
  const auto json = nlohmann::json::parse(bytes, nullptr, /*allow_exceptions=*/false);
  const auto number = [&](const nlohmann::json& value) {
    return value.is_number() ? value.get<double>() : std::nan("");
  };
  const bool sound = json.is_object() && json.contains("width") && json.contains("height") &&
                     json.contains("intrinsic_matrix") && json["intrinsic_matrix"].is_array() &&
                     json["intrinsic_matrix"].size() == 9;
  if (!sound)
    throw IoError(path,
                  "is no camera of Open3D: it needs width, height and intrinsic_matrix (9 "
                  "numbers, column by column)");
  const auto& k = json["intrinsic_matrix"];
  const double width = number(json["width"]);
  const double height = number(json["height"]);
  PinholeCamera camera;
  camera.fx = number(k[0]);
  camera.fy = number(k[4]);
  camera.cx = number(k[6]);
  camera.cy = number(k[7]);
  if (!(width >= 1 && width <= 65535 && height >= 1 && height <= 65535 && camera.fx > 0.0 &&
        camera.fy > 0.0 && std::isfinite(camera.cx) && std::isfinite(camera.cy)))
    throw IoError(path, "size and focal lengths must be numbers > 0, the centre finite");
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  const double scale = json.contains("depth_scale") ? number(json["depth_scale"]) : kDepthScale;
  if (!(scale > 0.0)) throw IoError(path, "depth_scale must be > 0");
  return depthCalibration(camera, scale);
}

void listImages(const std::string& folder, Description& description) {
  FilesByName depths = byName(depthFilesOf(joined(folder, "depth")));
  const std::string color_folder = colorFolderOf(folder);
  description.has_color = !color_folder.empty();
  FilesByName colors = description.has_color ? imagesByName(color_folder) : FilesByName();
  if (areMost(matchNames(depths, colors), depths, colors))
    return listPairs(depths, colors, description);
  // By their order: names of both hold different times.
  if (description.has_color && colors.size() != depths.size())
    throw IoError(color_folder, "holds " + std::to_string(colors.size()) + " images for " +
                                    std::to_string(depths.size()) +
                                    " depth images; they belong together by a number in their "
                                    "names, or in name order");
  auto color = colors.begin();
  for (const auto& entry : depths) {
    const bool has_color = color != colors.end();
    description.frames.push_back({entry.second, has_color ? (color++)->second : "", {}, {}});
  }
}

/// Blocks of five lines: three numbers, the first that of the frame, and T_world_camera.
void addTrajectory(const std::string& path, bool keep_all, Description& description) {
  std::vector<std::vector<double>> rows;
  forEachLine(path, "", [&](const Words& words, std::size_t line) {
    const std::size_t wanted = rows.size() % 5 == 0 ? 3 : 4;
    rows.emplace_back(wanted);
    finiteNumbers(words, 0, rows.back().data(), wanted, path, line);
  });
  if (rows.size() % 5 != 0) throw IoError(path, "is cut short: a pose has five lines");
  std::vector<FrameEntry>& frames = description.frames;
  for (std::size_t i = 0; i < rows.size(); i += 5) {
    const double number = rows[i][0];
    if (!(number >= 0 && number < static_cast<double>(frames.size())))
      throw IoError(path, "has a pose of frame " + std::to_string(static_cast<long>(number)) +
                              ", but there are " + std::to_string(frames.size()) + " frames");
    Eigen::Matrix<double, 3, 4> values;
    for (Eigen::Index row = 0; row < 3; ++row)
      values.row(row) = Vector4::Map(rows[i + 1 + static_cast<std::size_t>(row)].data());
    const std::optional<Pose> pose = poseOf(values);
    if (!pose)
      throw IoError(path, "the pose of frame " + std::to_string(static_cast<long>(number)) +
                              " has no rotation matrix");
    frames[static_cast<std::size_t>(number)].T_world_sensor = pose;
  }
  const std::size_t all = frames.size();
  if (!keep_all) dropWithoutPose(description);
  if (frames.empty()) throw IoError(path, "holds no pose");
  noteLeftOut(all - frames.size(), all, "frames", path + " has no pose of them", description);
  description.pose_source = PoseSource::File;
}

}  // namespace

bool hasOpen3d(const std::string& folder) {
  if (!isDirectory(joined(folder, "depth")) || isScannet(folder) || hasStray(folder)) return false;
  return isDirectory(joined(folder, "color")) || isDirectory(joined(folder, "image")) ||
         !intrinsicsOf(folder).empty() || !trajectoryOf(folder).empty();
}

Description readOpen3d(const std::string& folder, const SequenceOptions& options) {
  constexpr double kFramesPerSecond = 30.0;
  Description description("Open3D RGB-D", SequenceKind::Rgbd);
  listImages(folder, description);
  for (std::size_t i = 0; i < description.frames.size(); ++i)
    description.frames[i].timestamp = static_cast<double>(i) / kFramesPerSecond;
  if (options.calibration_file.empty()) {
    const std::string intrinsics = intrinsicsOf(folder);
    description.calibration = ownCalibration(folder);
    if (!description.calibration && !intrinsics.empty())
      description.calibration = readIntrinsics(intrinsics);
    if (!description.calibration)
      throw IoError(folder,
                    "the camera is not known: put Open3D's camera_intrinsic.json here, or "
                    "give a calib.yaml by --calib FILE");
  }
  const std::string trajectory = trajectoryOf(folder);
  if (options.poses_file.empty() && !trajectory.empty())
    addTrajectory(trajectory, options.ignore_poses, description);
  description.drops_unpaired = description.has_color;
  return description;
}

}  // namespace planar_mapping::io::layouts
