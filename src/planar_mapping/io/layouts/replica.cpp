// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/text_lines.h"

// Replica as rendered for iMAP and NICE-SLAM: results/frameN.jpg and results/depthN.png, traj.txt
// with T_world_camera of each frame, row by row, and cam_params.json here or one folder up.
namespace planar_mapping::io::layouts {
namespace {

/// \param path  of cam_params.json, "" = the camera that all rooms are rendered with
Calibration readCamera(const std::string& path) {
  constexpr std::size_t kLargest = std::size_t{1} << 20;
  if (path.empty()) return depthCalibration({600.0, 600.0, 599.5, 339.5, 1200, 680}, 6553.5);
  const auto json = nlohmann::json::parse(readWholeFile(path, kLargest), nullptr, false);
  const auto number = [&](const char* key) {
    const bool has = json.is_object() && json.contains("camera") && json["camera"].is_object() &&
                     json["camera"].contains(key) && json["camera"][key].is_number();
    const double value = has ? json["camera"][key].get<double>() : -1.0;
    if (!(value > 0.0 && value < 1e6))
      throw IoError(path, "needs w, h, fx, fy, cx, cy and scale > 0 in \"camera\"");
    return value;
  };
  const auto width = static_cast<int>(number("w"));
  const auto height = static_cast<int>(number("h"));
  return depthCalibration({number("fx"), number("fy"), number("cx"), number("cy"), width, height},
                          number("scale"));
}

/// T_world_camera of each line.
std::vector<Pose> readPoses(const std::string& path) {
  std::vector<Pose> poses;
  forEachLine(path, "", [&](const Words& words, std::size_t line) {
    Eigen::Matrix<double, 4, 4, Eigen::RowMajor> values;
    finiteNumbers(words, 0, values.data(), 16, path, line);
    const std::optional<Pose> pose = poseOf(values.topRows<3>());
    if (!pose) failAtLine(path, line, "has no rotation matrix");
    poses.push_back(*pose);
  });
  return poses;
}

}  // namespace

bool hasReplica(const std::string& folder) {
  return isDirectory(joined(folder, "results")) && exists(joined(folder, "traj.txt"));
}

Description readReplica(const std::string& folder, const SequenceOptions& options) {
  constexpr double kFramesPerSecond = 30.0;
  Description description("Replica", SequenceKind::Rgbd);
  const std::string results = joined(folder, "results");
  FilesByName depths, colors;
  for (const auto& [name, file] : imagesByName(results))
    (name.compare(0, 5, "depth") == 0 ? depths : colors).emplace(name, file);
  if (!areMost(matchNames(depths, colors), depths, colors))
    throw IoError(results, "holds no frameN.jpg and depthN.png of the same numbers");
  listPairs(depths, colors, description);
  if (options.calibration_file.empty()) {
    description.calibration = ownCalibration(folder);
    if (!description.calibration)
      description.calibration =
          readCamera(firstOf(folder, {"cam_params.json", "../cam_params.json"}));
  }
  const std::string path = joined(folder, "traj.txt");
  const std::vector<Pose> poses = readPoses(path);
  const bool uses_poses = options.poses_file.empty();
  if (uses_poses) description.pose_source = PoseSource::File;
  auto depth = depths.begin();
  for (std::size_t i = 0; i < description.frames.size(); ++i, ++depth) {
    FrameEntry& frame = description.frames[i];
    std::uint64_t number = 0;  // the lines of traj.txt count from 0, too
    parseNumber(std::string_view(depth->first), number);
    frame.timestamp = static_cast<double>(number) / kFramesPerSecond;
    if (!uses_poses) continue;
    if (number < poses.size()) {
      frame.T_world_sensor = poses[number];
    } else if (options.growing) {
      description.frames.resize(i);
    } else if (!options.ignore_poses) {
      throw IoError(path, "holds " + std::to_string(poses.size()) + " poses, but none of frame " +
                              depth->first);
    }
  }
  description.drops_unpaired = true;
  return description;
}

}  // namespace planar_mapping::io::layouts
