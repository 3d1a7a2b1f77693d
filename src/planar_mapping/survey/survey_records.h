// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"

namespace planar_mapping::detail {

using SurveyJson = nlohmann::ordered_json;

SurveyJson toJson(const Pose& pose);
SurveyJson toJson(const Matrix6& matrix);
/// Between keyframes; without ids, which are those of the two pieces.
SurveyJson toJson(const Link& link);
Pose poseOf(const SurveyJson& json);
Matrix6 matrixOf(const SurveyJson& json);
Link linkOf(const SurveyJson& json);

/// {"file", "bytes", "crc32"} of a file. \throws IoError
SurveyJson fileRecord(const std::string& path);

/// A checksum as people read it, and the CRC-32 of a text so.
std::string hexText(std::uint32_t checksum);
std::string checksumText(const std::string& text);

/// What a job says when it is done, *.json beside its result: the plan it belongs to, what it read
/// and wrote. The record is written last, so that a result without one is none.
class SurveyRecord {
 public:
  SurveyRecord(std::string path, std::uint32_t plan, SurveyJson read);

  /// What an earlier call of write() left, if it read the same and its result is still whole.
  std::optional<SurveyJson> done() const;
  /// \param result  file that was written, in the same folder or absolute; empty = all is in \p
  /// json
  SurveyJson write(const SurveyJson& json, const std::string& result = "") const;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::uint32_t plan_;
  SurveyJson read_;
};

/// \throws InputError for a record that is damaged or of another plan
SurveyJson readRecord(const std::string& path, std::uint32_t plan);

}  // namespace planar_mapping::detail
