// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/survey/survey_jobs.h"

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

SurveyReport reportOf(const std::string& job, const SurveyRecord& record, const SurveyJson& said,
                      bool was_done);

/// Does a job unless its result is there.
/// \param act  gives what is said in the record, and the name of the file that it wrote
template <typename Act>
SurveyReport doJob(const std::string& job, const SurveyRecord& record, const Act& act) {
  if (const std::optional<SurveyJson> done = record.done())
    return reportOf(job, record, *done, true);
  const std::pair<SurveyJson, std::string> made = act();
  return reportOf(job, record,
                  writingResult([&]() { return record.write(made.first, made.second); }), false);
}

/// \throws InputError for a record that is damaged or of another plan
SurveyJson readRecord(const std::string& path, std::uint32_t plan);

/// Where the rows of a piece begin and end in one atlas of several.
struct PieceRows {
  std::int64_t submap = 0;                       ///< number of its first
  std::int64_t keyframe = 0;                     ///< likewise
  std::size_t first_submap = 0, end_submap = 0;  ///< in the list
  std::size_t first_keyframe = 0, end_keyframe = 0;
  std::size_t first_link = 0, end_link = 0;
};
PieceRows addPiece(AtlasData& all, AtlasData piece);

/// The link from the last submap of a piece to the first one of the next, by the frame they share:
/// of their records.
std::optional<Link> tieBetween(const SurveyJson& piece, const SurveyJson& next);

}  // namespace planar_mapping::detail
