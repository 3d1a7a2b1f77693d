// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Data sets of depth images: TUM RGB-D, ICL-NUIM, and those with a file for the pose of each frame.
#include <algorithm>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io::layouts {
namespace {

// TUM RGB-D: rgb.txt and depth.txt list `timestamp file`, or associations.txt pairs of both;
// groundtruth.txt has poses of its own times.

std::string fileOfLine(const std::string& folder, std::string_view word, const std::string& list,
                       std::size_t line) {
  if (word.empty() || word.front() == '/' || word.find("..") != std::string_view::npos)
    failAtLine(list, line, quoted(word) + " is no file of this folder");
  return joined(folder, std::string(word));
}

std::vector<StampedFile> readList(const std::string& folder, const char* name,
                                  Description& description) {
  const std::string path = joined(folder, name);
  if (!exists(path)) throw IoError(path, "no such file; TUM RGB-D has rgb.txt and depth.txt");
  std::vector<StampedFile> files;
  bool ascend = true;
  forEachLine(path, ",", [&](const Words& words, std::size_t line) {
    if (words.size() != 2) failAtLine(path, line, "is not `timestamp file`");
    const double time = finiteNumber(words[0], path, line);
    ascend = ascend && (files.empty() || files.back().timestamp <= time);
    files.push_back({time, fileOfLine(folder, words[1], path, line)});
  });
  if (!ascend)
    description.notes.push_back(std::string("the times in ") + name +
                                " do not increase from line to line: frames are taken in the order "
                                "of their times, which is wrong if those are no times");
  return files;
}

}  // namespace

void listTum(const std::string& folder, const SequenceOptions&, Description& description) {
  description.has_color = true;
  if (!firstOf(folder, {"depth.txt", "rgb.txt"}).empty()) {
    std::vector<StampedFile> depths = readList(folder, "depth.txt", description);
    return listByTime(std::move(depths), readList(folder, "rgb.txt", description), folder,
                      {"depth.txt", "rgb.txt"}, description);
  }
  const std::string path = joined(folder, "associations.txt");
  forEachLine(path, ",", [&](const Words& words, std::size_t line) {
    if (words.size() != 4) failAtLine(path, line, "is not `time file time file`");
    const std::size_t depth = words[1].compare(0, 5, "depth") == 0 ? 0 : 2;
    description.frames.push_back({fileOfLine(folder, words[depth + 1], path, line),
                                  fileOfLine(folder, words[3 - depth], path, line),
                                  finiteNumber(words[depth], path, line),
                                  {}});
  });
  if (description.frames.empty()) throw IoError(path, "lists no image");
}

/// The cameras of the data set, by the authors' calibration of the colour camera that depth is
/// registered to; images of freiburg3 are undistorted already.
std::optional<Calibration> calibrateTum(const std::string& folder, const Description&) {
  struct Known {
    const char* names[2];
    PinholeCamera camera;
    std::optional<LensDistortion> lens;
  };
  static const Known kKnown[] = {
      {{"freiburg1", "fr1"},
       {517.3, 516.5, 318.6, 255.3, 640, 480},
       LensDistortion{0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
      {{"freiburg2", "fr2"},
       {520.9, 521.0, 325.1, 249.7, 640, 480},
       LensDistortion{0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
      {{"freiburg3", "fr3"}, {535.4, 539.2, 320.1, 247.6, 640, 480}, {}}};
  const std::string name = nameOf(folder);
  for (const Known& known : kKnown) {
    for (const char* part : known.names) {
      if (name.find(part) == std::string::npos) continue;
      Calibration calibration = depthCalibration(known.camera, 5000.0);
      calibration.distortion = known.lens;
      return calibration;
    }
  }
  return std::nullopt;
}

void addTumPoses(const std::string& folder, const SequenceOptions& options,
                 Description& description) {
  const std::string poses = joined(folder, "groundtruth.txt");
  if (exists(poses))
    addPoses(poses, {readTumPoses(poses)}, PosesBy::Time, Pose::Identity(), options, description);
}

// ICL-NUIM, "TUM RGB-D compatible PNGs": depth/N.png and rgb/N.png, and poses in NAME.gt.freiburg
// with numbers of frames as times.

void listIcl(const std::string& folder, const SequenceOptions&, Description& description) {
  listDepth(folder, "rgb", description);
  for (FrameEntry& frame : description.frames) {
    frame.number = finiteNumber(stemOf(frame.file), frame.file, 0);
    frame.timestamp = *frame.number / kFramesPerSecond;
  }
}

std::optional<Calibration> calibrateIcl(const std::string&, const Description&) {
  return depthCalibration({481.2, 480.0, 319.5, 239.5, 640, 480}, 5000.0);
}

void addIclPoses(const std::string& folder, const SequenceOptions& options,
                 Description& description) {
  const std::vector<std::string> files = filesOf(folder);
  const std::string path = *std::find_if(files.begin(), files.end(), [](const std::string& file) {
    return endsWith(file, ".gt.freiburg");
  });
  // The data set has fy = -480: its camera and world are left-handed. Mirrored in y, both are
  // right-handed, and the camera's y axis is down.
  Trajectory trajectory{readTumPoses(path)};
  const Vector3 mirror(1.0, -1.0, 1.0);
  for (StampedPose& stamped : trajectory.poses) {
    stamped.pose.linear() =
        mirror.asDiagonal() * Matrix3(stamped.pose.linear()) * mirror.asDiagonal();
    stamped.pose.translation() = mirror.cwiseProduct(stamped.pose.translation());
  }
  addPoses(path, trajectory, PosesBy::Number, Pose::Identity(), options, description);
}

// RGB-D frames with a file each for the pose: NAME.depth.png, NAME.color.png and NAME.pose.txt in
// one folder (3DMatch, 7-Scenes), or depth/N.png, color/N.jpg, pose/N.txt and intrinsic/ (ScanNet).
// A pose is T_world_camera, four rows of four numbers.
namespace {

/// The first numbers of each of the first rows; not finite where the camera was lost.
Eigen::MatrixXd readMatrix(const std::string& path, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd matrix(rows, columns);
  Eigen::Index row = 0;
  forEachLine(path, "", [&](const Words& words, std::size_t line) {
    if (row == rows) return;
    bool sound = words.size() >= static_cast<std::size_t>(columns);
    for (Eigen::Index i = 0; sound && i < columns; ++i)
      sound = parseNumber(words[static_cast<std::size_t>(i)], matrix(row, i));
    if (!sound) failAtLine(path, line, "needs " + std::to_string(columns) + " numbers");
    ++row;
  });
  if (row < rows) throw IoError(path, "needs " + std::to_string(rows) + " rows of numbers");
  return matrix;
}

/// \param lenient  a faulty one is none
std::optional<Pose> readPose(const std::string& path, bool lenient) {
  try {
    const Eigen::MatrixXd matrix = readMatrix(path, 3, 4);
    if (!matrix.allFinite()) return std::nullopt;
    const std::optional<Pose> pose = poseOf(matrix);
    if (!pose) throw IoError(path, "has no rotation matrix");
    return pose;
  } catch (const IoError&) {
    if (!lenient) throw;
    return std::nullopt;
  }
}

bool isScannet(const std::string& folder) {
  return isDirectory(joined(folder, "pose"));
}

}  // namespace

void listPosedFrames(const std::string& folder, const SequenceOptions& options,
                     Description& description) {
  constexpr std::string_view kDepthEnd = ".depth.png";
  const bool is_scannet = isScannet(folder);
  description.layout = is_scannet ? "ScanNet" : "RGB-D frames with poses";
  std::vector<FrameEntry>& frames = description.frames;
  for (const std::string& depth : depthFilesOf(is_scannet ? joined(folder, "depth") : folder)) {
    if (!is_scannet && !endsWith(depth, kDepthEnd)) continue;
    const std::string name = is_scannet ? stemOf(depth) : stemOf(stemOf(depth));
    const std::string color = is_scannet ? "color/" + name : name + ".color";
    const std::string pose =
        firstOf(folder, {is_scannet ? "pose/" + name + ".txt" : name + ".pose.txt"});
    const double number = numberOf(name).value_or(static_cast<double>(frames.size()));
    frames.push_back(
        {depth, firstOf(folder, {color + ".jpg", color + ".png"}), number / kFramesPerSecond, {}});
    if (!pose.empty() && options.poses_file.empty())
      frames.back().T_world_sensor = readPose(pose, options.ignore_poses);
    description.has_color = description.has_color || !frames.back().partner.empty();
    if (frames.back().T_world_sensor) description.pose_source = PoseSource::File;
  }
  const std::size_t all = frames.size();
  if (description.pose_source == PoseSource::None || options.ignore_poses) return;
  frames.erase(std::remove_if(frames.begin(), frames.end(),
                              [](const FrameEntry& f) { return !f.T_world_sensor; }),
               frames.end());
  noteLeftOut(all - frames.size(), all, "frames", "they have no pose, or one that is not finite",
              description);
}

std::optional<Calibration> calibratePosedFrames(const std::string& folder,
                                                const Description& description) {
  const std::string path = firstOf(folder, {"intrinsic/intrinsic_depth.txt",
                                            "camera-intrinsics.txt", "../camera-intrinsics.txt"});
  if (path.empty()) return std::nullopt;
  constexpr double kMillimetres = 1000.0;
  const Eigen::MatrixXd k = readMatrix(path, 2, 3);
  const DepthImage image = readDepthPng(description.frames.front().file);
  if (!(k(0, 0) > 0.0 && k(1, 1) > 0.0 && k.allFinite()))
    throw IoError(path, "focal lengths must be numbers > 0, the centre finite");
  return depthCalibration({k(0, 0), k(1, 1), k(0, 2), k(1, 2), static_cast<int>(image.width),
                           static_cast<int>(image.height)},
                          kMillimetres);
}

}  // namespace planar_mapping::io::layouts
