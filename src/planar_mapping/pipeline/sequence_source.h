// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame_source.h"

namespace planar_mapping {

/// What a configuration asks of its inputs: poses, calibration, the kind its stages need.
PLANAR_MAPPING_EXPORT io::SequenceOptions sequenceOptions(const Configuration& configuration);
/// What was recognised and what was left out, a sentence each.
PLANAR_MAPPING_EXPORT std::vector<std::string> describe(const io::Sequence& sequence);

/// Frame \p index as FrameSource::next() gives it.
/// \throws IoError if a cloud cannot be read
PLANAR_MAPPING_EXPORT Frame readFrame(const io::Sequence& sequence, std::size_t index,
                                      bool with_images);

/// The frames of files and folders, as a configuration asks for them: inputs, poses, which frames.
/// A folder that holds several kinds is read as what the stages need: pairs with an Images stage,
/// depth and colour images with a Features stage, else clouds. A damaged or missing image makes a
/// frame with a `skip_reason`; a damaged cloud file ends the run.
class PLANAR_MAPPING_EXPORT SequenceSource : public FrameSource {
 public:
  /// \throws IoError if something is missing or not recognised; InputError without inputs, or if
  ///         the selection leaves no frame
  explicit SequenceSource(const Configuration& configuration);

  std::vector<std::string> names() const override { return names_; }
  std::vector<std::string> notes() const override { return describe(sequence_); }
  io::SequenceKind kind() const override { return sequence_.kind(); }
  io::PoseSource poseSource() const override { return sequence_.poseSource(); }
  std::optional<ImagesUp> meanUp() const override;
  std::optional<std::size_t> size() const override { return selected_.size(); }
  std::optional<Frame> next() override;

 private:
  std::vector<std::string> names_;
  io::Sequence sequence_;
  bool with_images_ = false;
  std::vector<std::size_t> selected_;
  std::size_t position_ = 0;  ///< in selected_, of the next frame
};

}  // namespace planar_mapping
