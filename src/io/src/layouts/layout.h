// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "layouts/folder.h"
#include "planar_mapping/core/base/types.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/io/sequence.h"

namespace planar_mapping::io::layouts {

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
  std::string layout;  ///< as messages call it: "KITTI odometry"
  SequenceKind kind = SequenceKind::Clouds;
  PoseSource pose_source = PoseSource::None;
  bool has_color = false;       ///< of RGB-D
  bool drops_unpaired = false;  ///< frames without a colour image, once they are counted
  std::vector<FrameEntry> frames;
  std::optional<Calibration> calibration;
  std::vector<std::string> notes;  ///< what was left out, a sentence each
};

// A reader for each layout. has...() looks at names only; read...() lists files and reads
// calibration and poses.

bool hasKitti(const std::string& folder);
Description readKitti(const std::string& folder, const SequenceOptions& options);

bool hasTum(const std::string& folder);
Description readTum(const std::string& folder, const SequenceOptions& options);

bool hasIcl(const std::string& folder);
Description readIcl(const std::string& folder, const SequenceOptions& options);

bool hasEuroc(const std::string& folder);
Description readEuroc(const std::string& folder, const SequenceOptions& options);

bool hasMiddlebury(const std::string& folder);
Description readMiddlebury(const std::string& folder, const SequenceOptions& options);

bool hasOpen3d(const std::string& folder);
Description readOpen3d(const std::string& folder, const SequenceOptions& options);

bool hasReplica(const std::string& folder);
Description readReplica(const std::string& folder, const SequenceOptions& options);

bool hasKittiRaw(const std::string& folder);
Description readKittiRaw(const std::string& folder, const SequenceOptions& options);

bool hasStray(const std::string& folder);
Description readStray(const std::string& folder, const SequenceOptions& options);

/// 3DMatch, 7-Scenes and others with a pose file for each frame; ScanNet.
bool isScannet(const std::string& folder);
bool hasPosedFrames(const std::string& folder);
Description readPosedFrames(const std::string& folder, const SequenceOptions& options);

/// Our own sequence folder.
bool hasNative(const std::string& folder);
Description readNative(const std::string& folder, const SequenceOptions& options);

/// The folder by the one layout it has, or a directory of cloud files.
/// \throws IoError if it has none or several, or if a part is missing
Description readFolder(const std::string& folder, const SequenceOptions& options);

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

/// Lists the depth images, each with the colour image of its name, if there is one, and notes what
/// has no partner and is left out once files that count frames are read.
void listPairs(const FilesByName& depths, const FilesByName& colors, Description& description);
/// Leaves frames without a colour image out.
void dropUnpaired(Description& description);

/// Notes that the poses of a file do not fit the frames and are left out.
void notUsed(const std::string& file, std::size_t poses, Description& description);

/// Puts the poses of \p file on the frames: line by line where there are as many, else by time
/// where frames have times. A growing sequence ends at the last pose; see SequenceOptions.
void addPoses(const std::string& file, const SequenceOptions& options, Description& description);

}  // namespace planar_mapping::io::layouts
