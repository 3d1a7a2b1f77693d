// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping::io {

enum class SequenceKind {
  Clouds,  ///< PCD, PLY or KITTI .bin files
  Rgbd,    ///< depth images, with or without colour
  Stereo   ///< pairs: frames bring images and no cloud
};
/// Where the poses of a sequence come from.
enum class PoseSource {
  None,       ///< nowhere: motion has to be estimated
  Viewpoint,  ///< the VIEWPOINT of each PCD file; identity for PLY
  File,       ///< a file of the folder, or the one given
  Origin      ///< SequenceOptions::sensor_origin: the axes of the world
};

/// One frame, read when asked for.
struct Frame {
  std::size_t index = 0;                ///< in the sequence
  std::string name;                     ///< of the file it was read from, without its directory
  double timestamp = 0.0;               ///< seconds; of the layout or the pose file, else the index
  CloudData cloud;                      ///< sensor frame; empty for SequenceKind::Stereo
  Image left;                           ///< of a pair, or the colour image of RGB-D
  Image right;                          ///< of a pair
  std::optional<Pose> T_world_sensor;   ///< absent with PoseSource::None
  std::optional<PinholeCamera> camera;  ///< where a calibration says so
};

/// What to read of a sequence.
struct SequenceOptions {
  /// TUM or KITTI, T_world_sensor; empty = those of the folder, else VIEWPOINT.
  std::string poses_file;
  /// Taken of a folder that holds several kinds; absent = clouds, else RGB-D, else stereo.
  std::optional<SequenceKind> preferred;
  std::string calibration_file;  ///< a calib.yaml; empty = the calibration of the folder
  double scale = 1.0;            ///< metres a unit of the clouds of files and their VIEWPOINT
  /// Where the sensor stood, world, metres, if the clouds are in the coordinates of the world.
  std::optional<Vector3> sensor_origin;
  /// More frames may come: a sequence ends at its last pose, and may still be empty.
  bool growing = false;
  /// Nobody uses the poses: frames without one are kept, and those of a file with a line a frame
  /// that has too few or too many are left out.
  bool ignore_poses = false;
};

/// Makes the frames of a folder that holds their description, simulation.json, in place of files.
class PLANAR_MAPPING_EXPORT FrameMaker {
 public:
  virtual ~FrameMaker();
  /// Sets the cloud and the gray or colour image, of the size that the calibration says. Of several
  /// threads at once. \throws IoError, InputError
  virtual void make(std::size_t index, Frame& frame) const = 0;
};
/// For all sequences opened from now on. \param open  is given the path of a simulation.json; it is
/// called when the first frame of it is read
PLANAR_MAPPING_EXPORT void setFrameMaker(
    std::unique_ptr<const FrameMaker> (*open)(const std::string& path));

/// A row of frames behind the inputs of the command line, recognised by content:
/// - PCD, PLY and KITTI .bin files, in the order given;
/// - a directory of such files, in name order;
/// - a sequence folder: calib.yaml with clouds/, or depth/ (and rgb/), or left/ and right/, and
///   optionally poses.txt; clouds/ may do without calib.yaml;
/// - simulation.json, calib.yaml and poses.txt: frames that are made when they are read
///   (FrameMaker);
/// - a folder as KITTI, TUM RGB-D, ICL-NUIM, EuRoC (ASL), Middlebury, 3DMatch, 7-Scenes and
///   ScanNet have it.
///
/// Images of one frame have the same name up to the extension, or the same number in it. The
/// frames of a stereo sequence are the names of left and right images together: one with a single
/// image has a place, but cannot be read. Where lists or poses have times, frames without a
/// partner or a pose within 20 ms are left out (notes()).
/// Line i of poses.txt belongs to frame i where there are as many lines as frames; else both need
/// times.
///
/// Opening lists files and reads poses and calibration, not the frames. Const functions may be
/// called from several threads at once.
class PLANAR_MAPPING_EXPORT Sequence {
 public:
  /// \param inputs  files and directories, at least one
  /// \throws IoError if something is missing, unreadable or not recognised, the calibration lacks a
  ///         key, or poses match frames neither in number nor in time; InputError without inputs
  explicit Sequence(const std::vector<std::string>& inputs, const SequenceOptions& options = {});
  ~Sequence();
  Sequence(Sequence&& other) noexcept;
  Sequence& operator=(Sequence&& other) noexcept;

  /// What the input was recognised as: "KITTI odometry", "cloud files" ...
  const std::string& layout() const;
  /// What was left out and why, a sentence each.
  const std::vector<std::string>& notes() const;
  SequenceKind kind() const;
  PoseSource poseSource() const;
  std::size_t size() const;
  /// The file frame \p index is read from: cloud, depth image or left image.
  /// \throws InputError if there is no such frame
  const std::string& path(std::size_t index) const;
  /// All files of the frame: that one and, where there is one, its colour or right image.
  std::vector<std::string> files(std::size_t index) const;
  const std::optional<Calibration>& calibration() const;

  /// Everything of the frame but its images and cloud: name, time, pose, camera. A VIEWPOINT is in
  /// the cloud's file and therefore not known here.
  /// \throws InputError if there is no such frame
  Frame describe(std::size_t index) const;
  /// \param images  whether the colour images of RGB-D are wanted; those of a pair always are
  /// \throws IoError if the frame cannot be read; InputError if there is no such frame
  Frame read(std::size_t index, const CloudChannels& channels = CloudChannels(),
             bool images = true) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping::io
