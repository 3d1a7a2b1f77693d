// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/ground/up.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping {

/// Where the frames of a run come from: files, or a front-end in another process. One call at a
/// time.
class PLANAR_MAPPING_EXPORT FrameSource {
 public:
  virtual ~FrameSource();

  /// What a person calls the input, for run.log and messages: paths, or an address. At least one.
  virtual std::vector<std::string> names() const = 0;
  /// What there is to say of the input, a sentence each, for run.log.
  virtual std::vector<std::string> notes() const;
  /// What frames bring before any stage has seen them. Frames of SequenceKind::Stereo have images
  /// and no cloud, so that the configuration needs a stage that makes one.
  virtual io::SequenceKind kind() const = 0;
  /// Where poses come from. With PoseSource::None the configuration needs a Motion stage.
  /// May wait for the other process.
  virtual io::PoseSource poseSource() const = 0;
  /// Where images have upwards, on average over all frames that next() is going to give. Nothing
  /// where their poses are not known beforehand, or not given.
  virtual std::optional<ImagesUp> meanUp() const;
  /// Frames that next() is going to give in all, where that is known.
  virtual std::optional<std::size_t> size() const = 0;
  /// The next frame, or nothing at the end, or where the source was told to stop. `number`,
  /// `source`, `timestamp`, `given_pose`, `T_world_sensor` (= given_pose or identity), `camera`,
  /// `baseline`, `images` and `cloud` (never null) are set; so is `skip_reason` where the frame
  /// exists but cannot be used, e.g. because one of its images is damaged: mapping goes on with the
  /// next. Frames that went through the front-end elsewhere have `front_end_done`.
  /// \throws IoError, InputError if no further frame can be had; what was done so far is saved
  virtual std::optional<Frame> next() = 0;
  /// No frame is asked for from here on, and a result is about to be saved: what the source holds
  /// of the system is given back.
  virtual void close() {}
  /// The result is safe: who sent the frames may hear of it.
  virtual void confirm() {}
};

}  // namespace planar_mapping
