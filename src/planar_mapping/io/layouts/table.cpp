// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The layouts of folders that are read.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io::layouts {
namespace {

/// Our own folder: clouds/, or depth/ (and rgb/), or left/ and right/.
void listNative(const std::string& folder, const SequenceOptions& options,
                Description& description);
/// A directory of cloud files.
void listCloudFiles(const std::string& folder, const SequenceOptions& options,
                    Description& description);
void addOwnPoses(const std::string& folder, const SequenceOptions& options,
                 Description& description);

/// Frames that a description stands for.
void listMade(const std::string& folder, const SequenceOptions& options, Description& description);

struct Layout {
  const char* name;
  /// It is this layout if all words of one of these are there: "x/" is a directory, "*x" a file
  /// whose name ends so, "!x" must not be there.
  const char* marks[5];
  SequenceKind kind;
  List* list;
  Calibrate* calibrate;  ///< null = calib.yaml only, which all may have
  AddPoses* add_poses;   ///< null = none
};

constexpr Layout kLayouts[] = {
    {"KITTI odometry",
     {"image_0/", "image_2/", "velodyne/"},
     SequenceKind::Stereo,
     listKitti,
     calibrateKitti,
     addKittiPoses},
    {"KITTI raw",
     {"image_00/data/", "image_02/data/", "velodyne_points/data/"},
     SequenceKind::Stereo,
     listKittiRaw,
     calibrateKittiRaw,
     nullptr},
    {"TUM RGB-D",
     {"depth.txt", "rgb.txt", "associations.txt !*.gt.freiburg"},
     SequenceKind::Rgbd,
     listTum,
     calibrateTum,
     addTumPoses},
    {"ICL-NUIM",
     {"depth/ rgb/ *.gt.freiburg"},
     SequenceKind::Rgbd,
     listIcl,
     calibrateIcl,
     addIclPoses},
    {"EuRoC (ASL)",
     {"mav0/", "cam0/sensor.yaml", "cam0/data.csv"},
     SequenceKind::Stereo,
     listEuroc,
     calibrateEuroc,
     addEurocPoses},
    {"Middlebury",
     {"im0.png", "im1.png"},
     SequenceKind::Stereo,
     listMiddlebury,
     calibrateMiddlebury,
     nullptr},
    {"RGB-D with a pose a frame",
     {"depth/ pose/ intrinsic/", "*.depth.png *.pose.txt"},
     SequenceKind::Rgbd,
     listPosedFrames,
     calibratePosedFrames,
     nullptr},
    {"simulation", {"simulation.json"}, SequenceKind::Rgbd, listMade, nullptr, addOwnPoses}};
/// What the others are not.
constexpr Layout kNative = {"sequence folder",
                            {"clouds/", "left/", "right/", "depth/", "calib.yaml"},
                            SequenceKind::Clouds,
                            listNative,
                            nullptr,
                            addOwnPoses};
constexpr Layout kCloudFiles = {"cloud files",  {},      SequenceKind::Clouds,
                                listCloudFiles, nullptr, addOwnPoses};

bool hasWord(const std::string& folder, std::string word) {
  if (word.front() == '!') return !hasWord(folder, word.substr(1));
  if (word.back() == '/') return isDirectory(joined(folder, word));
  if (word.front() != '*') return exists(joined(folder, word));
  if (!isDirectory(folder)) return false;
  const std::vector<std::string> files = filesOf(folder);
  return std::any_of(files.begin(), files.end(), [&](const std::string& file) {
    return endsWith(file, std::string_view(word).substr(1));
  });
}

bool isOf(const Layout& layout, const std::string& folder) {
  return std::any_of(std::begin(layout.marks), std::end(layout.marks), [&](const char* mark) {
    if (mark == nullptr) return false;
    const Words words = splitWords(mark);
    return std::all_of(words.begin(), words.end(),
                       [&](std::string_view word) { return hasWord(folder, std::string(word)); });
  });
}

/// What to do with files that are there but not read as they are; "" = there are none.
std::string adviceOnFiles(const std::string& folder) {
  struct Advice {
    const char* mark;
    const char* sentence;
  };
  constexpr Advice kAdvice[] = {
      {"rgbd/",
       "the .depth files of Record3D are not read: write them as PNG images of 16 bits "
       "(millimetres) into depth/, its images into rgb/, and calib.yaml from K of metadata, scaled "
       "to the size of the depth images, with depth_scale: 1000"},
      {"depth_left/",
       "TartanAir is not read as it is: write depth_left/*.npy (metres) as PNG images of 16 bits "
       "into depth/, copy image_left/ to rgb/ with the same numbers, and write calib.yaml; its "
       "poses are of a body with x forward, y right and z down"},
      {"results/ traj.txt",
       "Replica as rendered for NICE-SLAM is not read as it is: move results/depth*.png to depth/ "
       "and results/frame*.jpg to rgb/, write calib.yaml from cam_params.json, and the first three "
       "rows of each matrix of traj.txt, 12 numbers a line, to poses.txt"}};
  for (const Advice& one : kAdvice) {
    const Layout marked = {"", {one.mark}, SequenceKind::Clouds, nullptr, nullptr, nullptr};
    if (isOf(marked, folder)) return std::string("; ") + one.sentence;
  }
  if (imageFilesOf(folder).empty()) return "";
  return "; images of a stereo camera belong into left/ and right/ (left_0.png and right_0.png "
         "are a pair; cut images that show both views side by side into halves), those of a depth "
         "camera into depth/ and rgb/";
}

void listCloudFiles(const std::string& folder, const SequenceOptions& options,
                    Description& description) {
  listClouds(folder, description);
  if (description.frames.empty() && !options.growing)
    throw IoError(folder,
                  "holds neither PCD or PLY files nor a sequence (calib.yaml with clouds/, depth/ "
                  "or left/ and right/; or KITTI, TUM RGB-D, ICL-NUIM, EuRoC, Middlebury, 3DMatch, "
                  "7-Scenes, ScanNet)" +
                      adviceOnFiles(folder));
}

void listNative(const std::string& folder, const SequenceOptions& options,
                Description& description) {
  const auto has = [&](const char* part) { return isDirectory(joined(folder, part)); };
  std::vector<SequenceKind> kinds;
  if (has("clouds")) kinds.push_back(SequenceKind::Clouds);
  if (has("depth")) kinds.push_back(SequenceKind::Rgbd);
  if (has("left")) kinds.push_back(SequenceKind::Stereo);
  if (kinds.empty() && has("right"))
    throw IoError(folder, "has right/ but no left/, which a stereo sequence needs");
  if (kinds.empty())
    throw IoError(folder, "has a calib.yaml, but neither clouds/ nor depth/ nor left/ and right/" +
                              adviceOnFiles(folder));
  const auto wanted =
      options.preferred ? std::find(kinds.begin(), kinds.end(), *options.preferred) : kinds.end();
  description.kind = wanted != kinds.end() ? *wanted : kinds.front();
  const bool knows_camera =
      !options.calibration_file.empty() || exists(joined(folder, "calib.yaml"));
  const bool is_depth = description.kind == SequenceKind::Rgbd;
  if (!knows_camera && description.kind != SequenceKind::Clouds)
    throw IoError(joined(folder, "calib.yaml"),
                  std::string("no such file; ") +
                      (is_depth ? "an RGB-D sequence" : "a stereo sequence") +
                      " needs it, or a calibration by --calib FILE: image_width, image_height, fx, "
                      "fy, cx, cy, " +
                      (is_depth ? "depth_scale (units a metre)" : "baseline_m"));
  switch (description.kind) {
    case SequenceKind::Clouds:
      listClouds(joined(folder, "clouds"), description);
      if (description.frames.empty())
        throw IoError(joined(folder, "clouds"), "holds no PCD or PLY files");
      break;
    case SequenceKind::Rgbd: {
      const std::string color = firstOf(folder, {"rgb", "color", "image"});
      listDepth(folder, color.empty() ? "" : nameOf(color), description);
      break;
    }
    case SequenceKind::Stereo:
      listStereo(folder, "left", "right", description);
      break;
  }
}

void listMade(const std::string& folder, const SequenceOptions&, Description& description) {
  const std::string file = joined(folder, "simulation.json");
  try {
    const std::size_t frames = nlohmann::json::parse(readWholeText(file)).at("frames");
    description.frames.assign(frames, {file, {}, {}, {}});
  } catch (const nlohmann::json::exception&) {
    throw IoError(file, "is no description of a simulation, or damaged");
  }
  description.is_made = description.has_color = true;
}

void addOwnPoses(const std::string& folder, const SequenceOptions& options,
                 Description& description) {
  const std::string poses = joined(folder, "poses.txt");
  if (exists(poses))
    addPoses(poses, readTrajectory(poses), PosesBy::Line, Pose::Identity(), options, description);
}

}  // namespace

Description readFolder(const std::string& folder, const SequenceOptions& options) {
  const Layout* layout = nullptr;
  std::string names;
  for (const Layout& one : kLayouts) {
    if (!isOf(one, folder)) continue;
    layout = &one;
    names += (names.empty() ? "" : " and ") + std::string(one.name);
  }
  // depth/ and calib.yaml are parts of other layouts, too.
  const bool own_parts = !firstOf(folder, {"clouds", "left", "right"}).empty();
  if (own_parts && layout != nullptr) names += " and a sequence folder (clouds/, left/, right/)";
  if (names.find(" and ") != std::string::npos)
    throw IoError(folder, "looks like " + names + "; move what is not meant out of it");
  if (layout == nullptr) layout = isOf(kNative, folder) ? &kNative : &kCloudFiles;

  Description description;
  description.layout = layout->name;
  description.kind = layout->kind;
  layout->list(folder, options, description);
  if (options.calibration_file.empty()) {
    if (layout != &kCloudFiles) description.calibration = ownCalibration(folder);
    const bool needs_one = !description.calibration && description.kind != SequenceKind::Clouds;
    if (needs_one && layout->calibrate != nullptr)
      description.calibration = layout->calibrate(folder, description);
    if (needs_one && !description.calibration)
      throw IoError(folder,
                    "the camera is not known: give its calib.yaml (image_width, image_height, fx, "
                    "fy, cx, cy, depth_scale) by --calib FILE or put it here; a folder whose name "
                    "contains freiburg1, 2 or 3 has the camera of TUM RGB-D, the depth camera of "
                    "7-Scenes has fx = fy = 585, cx = 320, cy = 240, depth_scale 1000");
  }
  if (options.poses_file.empty() && layout->add_poses != nullptr)
    layout->add_poses(folder, options, description);
  return description;
}

bool isSequenceFolder(const std::string& folder) {
  return isOf(kNative, folder) ||
         std::any_of(std::begin(kLayouts), std::end(kLayouts),
                     [&](const Layout& layout) { return isOf(layout, folder); });
}

}  // namespace planar_mapping::io::layouts
