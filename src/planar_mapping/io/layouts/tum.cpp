// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/text_lines.h"

// TUM RGB-D: rgb.txt and depth.txt list `timestamp file`, or associations.txt pairs of both;
// groundtruth.txt has poses of its own times.
// ICL-NUIM, "TUM RGB-D compatible PNGs": depth/N.png and rgb/N.png, with or without
// associations.txt, and poses in NAME.gt.freiburg with numbers of frames as times.
namespace planar_mapping::io::layouts {
namespace {

std::string fileOfLine(const std::string& folder, std::string_view word, const std::string& list,
                       std::size_t line) {
  const std::string file = joined(folder, std::string(word));
  if (word.empty() || word.front() == '/' || word.find("..") != std::string_view::npos)
    failAtLine(list, line, quoted(word) + " is no file of this folder");
  return file;
}

std::vector<StampedFile> readList(const std::string& folder, const char* name,
                                  Description& description) {
  const std::string path = joined(folder, name);
  if (!exists(path)) throw IoError(path, "no such file; TUM RGB-D has rgb.txt and depth.txt");
  std::vector<StampedFile> files;
  forEachLine(path, ",", [&](const Words& words, std::size_t line) {
    if (words.size() != 2) failAtLine(path, line, "is not `timestamp file`");
    files.push_back({finiteNumber(words[0], path, line), fileOfLine(folder, words[1], path, line)});
  });
  if (files.empty()) throw IoError(path, "lists no image");
  const auto isEarlier = [](const StampedFile& a, const StampedFile& b) {
    return a.timestamp < b.timestamp;
  };
  if (!std::is_sorted(files.begin(), files.end(), isEarlier)) {
    description.notes.push_back(std::string("the times in ") + name +
                                " do not increase from line to line: frames are taken in the order "
                                "of their times, which is wrong if those are no times");
    std::stable_sort(files.begin(), files.end(), isEarlier);
  }
  return files;
}

void readLists(const std::string& folder, Description& description) {
  const std::vector<StampedFile> depths = readList(folder, "depth.txt", description);
  const std::vector<StampedFile> colors = readList(folder, "rgb.txt", description);
  for (const StampedFile& depth : depths) {
    const StampedFile* color = nearestFile(colors, depth.timestamp);
    if (color == nullptr) continue;
    description.frames.push_back({depth.file, color->file, depth.timestamp, {}});
  }
  if (description.frames.empty())
    throw IoError(folder, "rgb.txt has no image within 20 ms of any of depth.txt");
  noteLeftOut(depths.size() - description.frames.size(), depths.size(), "depth images",
              "no colour image within 20 ms of them", description);
}

/// The cameras of the data set, by the authors' calibration of the colour camera that depth is
/// registered to; images of freiburg3 are undistorted already.
std::optional<Calibration> freiburgCamera(const std::string& folder) {
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

void readAssociations(const std::string& folder, Description& description) {
  const std::string path = joined(folder, "associations.txt");
  forEachLine(path, ",", [&](const Words& words, std::size_t line) {
    if (words.size() != 4) failAtLine(path, line, "is not `time file time file`");
    const bool depth_first = words[1].compare(0, 5, "depth") == 0;
    const std::size_t depth = depth_first ? 0 : 2;
    description.frames.push_back({fileOfLine(folder, words[depth + 1], path, line),
                                  fileOfLine(folder, words[3 - depth], path, line),
                                  finiteNumber(words[depth], path, line),
                                  {}});
  });
  if (description.frames.empty()) throw IoError(path, "lists no image");
}

}  // namespace

bool hasTum(const std::string& folder) {
  return exists(joined(folder, "depth.txt")) || exists(joined(folder, "rgb.txt")) ||
         (exists(joined(folder, "associations.txt")) && !hasIcl(folder));
}

Description readTum(const std::string& folder, const SequenceOptions& options) {
  Description description("TUM RGB-D", SequenceKind::Rgbd);
  description.has_color = true;
  const bool has_lists = exists(joined(folder, "depth.txt")) || exists(joined(folder, "rgb.txt"));
  if (has_lists) {
    readLists(folder, description);
  } else {
    readAssociations(folder, description);
  }
  if (options.calibration_file.empty()) {
    description.calibration = ownCalibration(folder);
    if (!description.calibration) description.calibration = freiburgCamera(folder);
    if (!description.calibration)
      throw IoError(folder,
                    "the camera is not known: give its calib.yaml (image_width, image_height, fx, "
                    "fy, cx, cy, depth_scale) by --calib FILE or put it here, or let the folder's "
                    "name say freiburg1, freiburg2 or freiburg3");
  }
  const std::string poses = joined(folder, "groundtruth.txt");
  if (options.poses_file.empty() && exists(poses))
    addPosesByTime(poses, readTumPoses(poses), Pose::Identity(), options, description);
  return description;
}

namespace {

/// NAME.gt.freiburg, or "".
std::string posesOf(const std::string& folder) {
  for (const std::string& file : filesOf(folder))
    if (endsWith(file, ".gt.freiburg")) return file;
  return "";
}

void listImages(const std::string& folder, Description& description) {
  const std::vector<std::string> depths = depthFilesOf(joined(folder, "depth"));
  const FilesByName colors = imagesByName(joined(folder, "rgb"));
  for (const std::string& file : depths) {
    const std::string color = fileOf(colors, stemOf(file));
    if (color.empty()) continue;
    description.frames.push_back({file, color, finiteNumber(stemOf(file), file, 0), {}});
  }
  if (description.frames.empty())
    throw IoError(folder, "depth/ and rgb/ have no file name in common");
  noteLeftOut(depths.size() - description.frames.size(), depths.size(), "depth images",
              "no colour image of their name", description);
}

}  // namespace

bool hasIcl(const std::string& folder) {
  return isDirectory(joined(folder, "depth")) && isDirectory(joined(folder, "rgb")) &&
         !posesOf(folder).empty();
}

Description readIcl(const std::string& folder, const SequenceOptions& options) {
  constexpr double kFramesPerSecond = 30.0;
  Description description("ICL-NUIM", SequenceKind::Rgbd);
  description.has_color = true;
  listImages(folder, description);
  description.calibration = depthCalibration({481.2, 480.0, 319.5, 239.5, 640, 480}, 5000.0);
  if (options.poses_file.empty()) {
    // The data set has fy = -480: its camera and world are left-handed. Mirrored in y, both are
    // right-handed, and the camera's y axis is down.
    std::vector<StampedPose> poses = readTumPoses(posesOf(folder));
    const Vector3 mirror(1.0, -1.0, 1.0);
    for (StampedPose& stamped : poses) {
      stamped.pose.linear() =
          mirror.asDiagonal() * Matrix3(stamped.pose.linear()) * mirror.asDiagonal();
      stamped.pose.translation() = mirror.cwiseProduct(stamped.pose.translation());
    }
    addPosesByTime(posesOf(folder), poses, Pose::Identity(), options, description);
  }
  for (FrameEntry& frame : description.frames) *frame.timestamp /= kFramesPerSecond;
  return description;
}

}  // namespace planar_mapping::io::layouts
