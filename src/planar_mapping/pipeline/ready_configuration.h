// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/layouts/sequence.h"

namespace planar_mapping {

/// A ready configuration for an input.
struct ReadyConfiguration {
  std::string name;                      ///< for findConfiguration()
  std::vector<std::string> assignments;  ///< "stage.key=value"
  std::string why;                       ///< for a user; may be empty
};

/// The one that suits what was recognised. It reads headers of at most ten clouds.
/// \throws IoError if a cloud cannot be read
PLANAR_MAPPING_EXPORT ReadyConfiguration readyConfigurationFor(const io::Sequence& sequence);

}  // namespace planar_mapping
