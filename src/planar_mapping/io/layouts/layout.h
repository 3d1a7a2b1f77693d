// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/io/pose_file.h"

// A layout is a line of the table in table.cpp: the files it is told by, and a function each that
// lists the frames, reads the calibration and reads the poses.
namespace planar_mapping::io::layouts {

// Files of a folder (folder.cpp).

bool isDirectory(const std::string& path);
bool exists(const std::string& path);
std::string joined(const std::string& folder, const std::string& name);
/// The first of several names that exists, else "".
std::string firstOf(const std::string& folder, const std::vector<std::string>& names);
bool endsWith(const std::string& text, std::string_view end);
/// The last part of a path, also where it ends in "/" or is ".".
std::string nameOf(const std::string& folder);
std::string stemOf(const std::string& path);

/// The regular files of a folder in name order, 2 before 10, without hidden (and so temporary)
/// ones.
std::vector<std::string> filesOf(const std::string& folder);
/// Clouds, and files with the extension of clouds where there is a cloud: to be read, or refused.
std::vector<std::string> cloudFilesOf(const std::string& folder);
std::vector<std::string> imageFilesOf(const std::string& folder);
/// PNG files: the others have no 16 bits. \throws IoError if there is none
std::vector<std::string> depthFilesOf(const std::string& folder);

/// Name order, in which 2 comes before 10: numbers by their value, fractions of them as text.
struct NameOrder {
  bool operator()(const std::string& a, const std::string& b) const;
};
/// Paths by file name without extension.
using FilesByName = std::map<std::string, std::string, NameOrder>;
/// \throws IoError if two files have the same name
FilesByName byName(const std::vector<std::string>& files);
/// "" if there is none of this name.
std::string fileOf(const FilesByName& files, const std::string& name);

/// How many names two folders have in common. Where these are few, but the names of each contain
/// the number of their frame and most numbers are in both, the keys become the numbers: left_7.png
/// and right_0007.png are "7". A number with a fraction is a time and is not used.
std::size_t matchNames(FilesByName& first, FilesByName& second);

struct FrameEntry {
  std::string file;     ///< cloud, depth image or left image
  std::string partner;  ///< colour or right image; "" = none
  std::optional<double> timestamp;
  std::optional<Pose> T_world_sensor;
  std::optional<double> number = {};  ///< of the frame in the whole sequence, where names say it
};

/// What a folder holds, in the one form that Sequence reads frames from.
struct Description {
  std::string layout = {};  ///< as messages call it: "KITTI odometry (gray)"
  SequenceKind kind = SequenceKind::Clouds;
  PoseSource pose_source = PoseSource::None;
  bool has_color = false;  ///< of RGB-D
  bool is_made = false;    ///< frames are made when they are read, see FrameMaker
  std::vector<FrameEntry> frames = {};
  std::optional<Calibration> calibration = {};
  std::vector<std::string> notes = {};  ///< what was left out, a sentence each
};

/// The folder by the one layout it has, or a directory of cloud files.
/// \throws IoError if it has none or several, or if a part is missing
Description readFolder(const std::string& folder, const SequenceOptions& options);
/// Whether it is more than a directory of cloud files.
bool isSequenceFolder(const std::string& folder);

/// Lists the frames; may add to the name of the layout.
using List = void(const std::string& folder, const SequenceOptions& options, Description&);
/// Nothing where there is no file and the data set has no known camera.
using Calibrate = std::optional<Calibration>(const std::string& folder, const Description&);
using AddPoses = void(const std::string& folder, const SequenceOptions& options, Description&);

List listEuroc, listKitti, listKittiRaw, listMiddlebury;  // pairs.cpp
Calibrate calibrateEuroc, calibrateKitti, calibrateKittiRaw, calibrateMiddlebury;
AddPoses addEurocPoses, addKittiPoses;
List listTum, listIcl, listPosedFrames;  // depth.cpp
Calibrate calibrateTum, calibrateIcl, calibratePosedFrames;
AddPoses addTumPoses, addIclPoses;

// Frames (frames.cpp).

/// Frames a second of data sets that number their frames and tell no times.
constexpr double kFramesPerSecond = 30.0;

/// The number that a name ends with.
std::optional<double> numberOf(const std::string& name);

/// Adds a frame for each left image; one with the right image alone has its place, too.
/// \throws IoError if there is no pair
void listStereo(const std::string& folder, const std::string& left, const std::string& right,
                Description& description);
/// Adds a frame for each depth image, with the colour image of its name or number.
/// \param color  folder; "" = none. \throws IoError if there are colour images, but no pair
void listDepth(const std::string& folder, const std::string& color, Description& description);
void listClouds(const std::string& folder, Description& description);

/// A file of a list with times, seconds.
struct StampedFile {
  double timestamp = 0.0;
  std::string file;
};
/// Adds a frame for each of the first files that has a second one within 20 ms, and notes how many
/// have none. \param names  of both lists, for messages. \throws IoError if none has
void listByTime(std::vector<StampedFile> firsts, std::vector<StampedFile> seconds,
                const std::string& folder, const std::string (&names)[2], Description& description);

/// Notes how many of the frames are left out, and why, unless there are none.
void noteLeftOut(std::size_t left_out, std::size_t all, const std::string& what,
                 const std::string& why, Description& description);

/// What tells the frame of a pose.
enum class PosesBy {
  Line,    ///< line i is frame i where there are as many lines as frames, else the time
  Time,    ///< a pose within 20 ms, or between two that are at most 0.1 s apart
  Number,  ///< the time of the pose is FrameEntry::number; that of a file without times its line
};
/// Sets the poses of the frames. By time or number, frames without a pose are left out, with a
/// note, unless poses are ignored; a growing sequence ends at its last pose.
/// \param T_pose_sensor  the sensor in what the poses are of
/// \throws IoError naming \p file if no frame has a pose, or lines are too few or too many
void addPoses(const std::string& file, Trajectory trajectory, PosesBy by, const Pose& T_pose_sensor,
              const SequenceOptions& options, Description& description);

/// calib.yaml of the folder, if there is one.
std::optional<Calibration> ownCalibration(const std::string& folder);
/// \param depth_scale  units a metre
Calibration depthCalibration(const PinholeCamera& camera, double depth_scale);

}  // namespace planar_mapping::io::layouts
