// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame_source.h"

namespace planar_mapping {

struct WatchOptions {
  double idle = 0.0;                        ///< seconds without a new frame that end it; 0 = never
  const std::atomic<bool>* stop = nullptr;  ///< set by a signal: no further frames
};

/// Waits until the input has a frame that can be read.
/// \throws IoError if there is no such input; InputError if none came in WatchOptions::idle seconds
///         or it was stopped before, with what was still missing
PLANAR_MAPPING_EXPORT io::Sequence waitForFrames(const std::vector<std::string>& inputs,
                                                 const io::SequenceOptions& options,
                                                 const WatchOptions& watch);

/// Frames of a folder while another program writes them, in the order of their names. A frame
/// counts when none of its files was changed for 0.3 s and, where there are poses, its pose is
/// there; one whose name comes before that of a frame already given is left out.
class PLANAR_MAPPING_EXPORT WatchSource : public FrameSource {
 public:
  /// Waits for the first frame. \throws as waitForFrames()
  WatchSource(const Configuration& configuration, const WatchOptions& watch);

  std::vector<std::string> names() const override { return inputs_; }
  std::vector<std::string> notes() const override;
  io::SequenceKind kind() const override { return sequence_.kind(); }
  io::PoseSource poseSource() const override { return sequence_.poseSource(); }
  std::optional<std::size_t> size() const override { return std::nullopt; }
  std::optional<Frame> next() override;

 private:
  std::vector<std::string> inputs_;
  io::SequenceOptions options_;
  WatchOptions watch_;
  FrameSelection selection_;
  bool with_images_ = false;
  io::Sequence sequence_;
  std::size_t next_ = 0;  ///< in sequence_
  std::string last_;      ///< path of the frame before it
};

}  // namespace planar_mapping
