// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cloud_layout.h"
#include "text_lines.h"

namespace planar_mapping {
namespace io {

struct PcdHeader {
  std::vector<CloudField> fields;
  std::uint64_t width = 0;
  std::uint64_t height = 0;
  Pose T_world_sensor = Pose::Identity();
  std::string encoding;             ///< "ascii", "binary" or "binary_compressed"
  std::uint64_t data_position = 0;  ///< where in the file the points begin
};

/// Reads up to and including the DATA line. \throws IoError
PcdHeader readPcdHeader(const std::string& path, LineReader& lines);

}  // namespace io
}  // namespace planar_mapping
