// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/io/layouts/sequence.h"

namespace planar_mapping::io::layouts {

bool isDirectory(const std::string& path);
bool exists(const std::string& path);
std::string joined(const std::string& folder, const std::string& name);
/// The first of several names that is there, else "".
std::string firstOf(const std::string& folder, const std::vector<std::string>& names);
/// Whether something stands before the end, too.
bool endsWith(const std::string& text, std::string_view end);
/// The last part of a path, also where it ends in "/" or is ".".
std::string nameOf(const std::string& folder);
std::string stemOf(const std::string& path);

/// The regular files of a folder in name order, 2 before 10; hidden ones (and so temporary ones)
/// are left out.
std::vector<std::string> filesOf(const std::string& folder);
/// Those of clouds, and those that are called so where there are some: to be read, or refused.
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
FilesByName imagesByName(const std::string& folder);
/// "" if there is none of this name.
std::string fileOf(const FilesByName& files, const std::string& name);

/// How many names of two folders are in both. Where few are, but the names of each hold the number
/// of their frame and most numbers are in both, files are called by the number from here on:
/// left_7.png and right_0007.png are "7". A number with a fraction is a time and counts for
/// nothing.
std::size_t matchNames(FilesByName& first, FilesByName& second);
/// Whether so many names in common are most of what could be.
bool areMost(std::size_t common, const FilesByName& first, const FilesByName& second);

struct FrameEntry {
  std::string file;     ///< cloud, depth image or left image
  std::string partner;  ///< colour or right image; "" = none
  std::optional<double> timestamp;
  std::optional<Pose> T_world_sensor;
  std::string confidence = {};  ///< of depth, an image of 0 to 2; "" = none
};

/// What a folder holds, in the one form that Sequence reads frames from. Each layout has a reader
/// that makes one.
struct Description {
  Description(const std::string& name, SequenceKind what) : layout(name), kind(what) {}

  std::string layout;  ///< as messages call it: "KITTI odometry"
  SequenceKind kind;
  PoseSource pose_source = PoseSource::None;
  bool has_color = false;       ///< of RGB-D
  bool drops_unpaired = false;  ///< frames without a colour image, once they are counted
  std::vector<FrameEntry> frames;
  std::optional<Calibration> calibration;
  std::vector<std::string> notes;  ///< what was left out, a sentence each
};

// A reader for each layout. has...() looks at names only; read...() lists files and reads
// calibration and poses.
using Has = bool(const std::string& folder);
using Read = Description(const std::string& folder, const SequenceOptions& options);
Has hasEuroc, hasIcl, hasKitti, hasKittiRaw, hasMiddlebury, hasOpen3d, hasReplica, hasStray, hasTum;
Read readEuroc, readIcl, readKitti, readKittiRaw, readMiddlebury, readOpen3d, readReplica,
    readStray, readTum;

/// 3DMatch, 7-Scenes and others with a pose file for each frame; ScanNet.
Has isScannet, hasPosedFrames;
Read readPosedFrames;

/// Our own sequence folder.
Has hasNative;
Read readNative;

/// The folder by the one layout it has, or a directory of cloud files.
/// \throws IoError if it has none or several, or if a part is missing
Read readFolder;

/// What to do with files that are there but not read as they are; "" = there are none.
std::string adviceOnFiles(const std::string& folder);

/// Whether it is more than a directory of cloud files.
bool isSequenceFolder(const std::string& folder);

constexpr double kMaxTimeDifference = 0.02;  ///< seconds between what belongs together

/// A file of a list with times.
struct StampedFile {
  double timestamp = 0.0;
  std::string file;
};

/// The file nearest in time, if one is near enough; \p files ascend in time.
const StampedFile* nearestFile(const std::vector<StampedFile>& files, double timestamp);

/// Sets the pose of each frame by its time and leaves frames without one out, with a note, unless
/// poses are ignored.
/// \param T_pose_sensor  of the sensor in what the poses are of
/// \throws IoError naming \p file if no frame has a pose
void addPosesByTime(const std::string& file, std::vector<StampedPose> poses,
                    const Pose& T_pose_sensor, const SequenceOptions& options,
                    Description& description);

/// Notes that some of what there is are left out, and why, unless there is nothing to note.
void noteLeftOut(std::size_t left_out, std::size_t all, const std::string& what,
                 const std::string& why, Description& description);

/// calib.yaml of the folder, if there is one.
std::optional<Calibration> ownCalibration(const std::string& folder);
/// \param depth_scale  units a metre
Calibration depthCalibration(const PinholeCamera& camera, double depth_scale);

/// Lists the files, each with the partner of its name, if there is one.
/// \returns how many have one
std::size_t listFiles(const FilesByName& files, const FilesByName& partners,
                      Description& description);
/// Lists the depth images, each with the colour image of its name, if there is one, and notes what
/// has no partner and is left out once files that count frames are read.
void listPairs(const FilesByName& depths, const FilesByName& colors, Description& description);
/// Leaves frames without a colour image out.
void dropUnpaired(Description& description);
void dropWithoutPose(Description& description);

/// Notes that the poses of a file do not fit the frames and are left out.
void notUsed(const std::string& file, std::size_t poses, Description& description);

/// Puts the poses of \p file on the frames: line by line where there are as many, else by time
/// where frames have times. A growing sequence ends at the last pose; see SequenceOptions.
void addPoses(const std::string& file, const SequenceOptions& options, Description& description);

}  // namespace planar_mapping::io::layouts
