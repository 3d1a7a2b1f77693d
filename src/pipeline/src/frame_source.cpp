// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/frame_source.h"

namespace planar_mapping {

FrameSource::~FrameSource() = default;

std::size_t FrameSource::skip(std::size_t count) {
  std::size_t skipped = 0;
  while (skipped < count && next()) ++skipped;
  return skipped;
}

std::vector<std::string> FrameSource::notes() const {
  return {};
}

}  // namespace planar_mapping
