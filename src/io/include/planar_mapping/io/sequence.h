// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping {
namespace io {

enum class SequenceKind {
  Clouds,  ///< PCD or PLY files
  Rgbd,    ///< depth images, with or without colour
  Stereo   ///< rectified pairs: frames bring images and no cloud
};
/// Where the poses of a sequence come from.
enum class PoseSource {
  None,       ///< nowhere: motion has to be estimated
  Viewpoint,  ///< the VIEWPOINT of each PCD file; identity for PLY
  File        ///< poses.txt or the file given
};

/// One frame, read when asked for.
struct Frame {
  std::size_t index = 0;                ///< in the sequence
  std::string name;                     ///< of the file it was read from, without its directory
  double timestamp = 0.0;               ///< seconds; of the pose file, else the index
  CloudData cloud;                      ///< sensor frame; empty for SequenceKind::Stereo
  Image left;                           ///< of a pair, or the colour image of RGB-D
  Image right;                          ///< of a pair
  std::optional<Pose> T_world_sensor;   ///< absent with PoseSource::None
  std::optional<PinholeCamera> camera;  ///< where a calibration says so
};

/// What to read of a sequence.
struct SequenceOptions {
  std::string poses_file;  ///< TUM, T_world_sensor; empty = poses.txt of the folder, else VIEWPOINT
  /// Taken of a folder that holds several kinds; absent = clouds, else RGB-D, else stereo.
  std::optional<SequenceKind> preferred;
};

/// A row of frames behind the inputs of the command line, recognised by content:
/// - PCD and PLY files, in the order given;
/// - a directory of such files, in name order;
/// - a sequence folder: calib.yaml with clouds/, or depth/ (and rgb/), or left/ and right/, and
///   optionally poses.txt; clouds/ may do without calib.yaml.
/// Images of one frame have the same name up to the extension. The frames of a stereo sequence are
/// the names in left/ and right/ together: one with a single image has a place, but cannot be read.
/// Line i of the pose file belongs to frame i; there must be as many as frames.
///
/// Opening lists files and reads poses and calibration, not the frames. Const functions may be
/// called from several threads at once.
class PLANAR_MAPPING_EXPORT Sequence {
 public:
  /// \param inputs  files and directories, at least one
  /// \throws IoError if something is missing, unreadable or not recognised, the calibration lacks a
  ///         key, or poses do not match frames in number; InputError without inputs
  explicit Sequence(const std::vector<std::string>& inputs, const SequenceOptions& options = {});
  Sequence(const std::vector<std::string>& inputs, const std::string& poses_file);
  ~Sequence();
  Sequence(Sequence&& other) noexcept;
  Sequence& operator=(Sequence&& other) noexcept;

  SequenceKind kind() const;
  PoseSource poseSource() const;
  std::size_t size() const;
  /// The file frame \p index is read from: cloud, depth image or left image.
  /// \throws InputError if there is no such frame
  const std::string& path(std::size_t index) const;
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

}  // namespace io
}  // namespace planar_mapping
