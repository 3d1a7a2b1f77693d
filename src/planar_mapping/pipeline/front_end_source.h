// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame_source.h"

namespace planar_mapping {

/// The part of a configuration that a front-end in another process needs: stages through the last
/// Images or Features stage (without any, the first one, which the front-end does not run), frame
/// selection, profile and seed; nothing that names a file.
PLANAR_MAPPING_EXPORT std::string frontEndYaml(const Configuration& configuration);

/// Input of a front-end.
struct FrontEndInput {
  std::vector<std::string> inputs;  ///< as of `planar_map run -i`
  std::string poses;                ///< TUM or KITTI file; empty = of the input
  int threads = -1;                 ///< -1 = 1, 0 = all cores; changes no result
  std::string calibration;          ///< a calib.yaml; empty = of the input
};

/// Frames of files after the stages through Features (Frame::front_end_done). The same input and
/// configuration give the same frames, bit for bit.
/// \param yaml  frontEndYaml(), perhaps from a peer that is not trusted
/// \throws ConfigError if it cannot be run here: unknown stages, or keys that would make this
///         machine load files or libraries the peer names; IoError, InputError for the input
PLANAR_MAPPING_EXPORT std::unique_ptr<FrameSource> makeFrontEndSource(const std::string& yaml,
                                                                      const FrontEndInput& input);

}  // namespace planar_mapping
