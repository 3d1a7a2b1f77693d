// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/survey/survey_records.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/base/crc32.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping::detail {
namespace {

template <typename Matrix>
SurveyJson numbersOf(const Matrix& matrix) {
  return std::vector<double>(matrix.data(), matrix.data() + matrix.size());
}

template <typename Matrix>
Matrix matrixFrom(const SurveyJson& json) {
  const auto numbers = json.get<std::vector<double>>();
  Matrix matrix;
  if (numbers.size() != static_cast<std::size_t>(matrix.size()))
    throw InputError("a pose or covariance has " + std::to_string(numbers.size()) + " numbers");
  std::copy(numbers.begin(), numbers.end(), matrix.data());
  return matrix;
}

/// A name is of the same folder, so that the folder can be moved.
std::string beside(const std::string& record, const std::string& result) {
  return (std::filesystem::path(record).parent_path() / result).string();
}

using PoseColumns = Eigen::Matrix<double, 3, 4>;

}  // namespace

SurveyJson toJson(const Pose& pose) {
  return numbersOf(PoseColumns(pose.matrix().topRows<3>()));
}
SurveyJson toJson(const Matrix6& matrix) {
  return numbersOf(matrix);
}
SurveyJson toJson(const Link& link) {
  const LinkEvidence& evidence = link.evidence;
  return {{"kind", wordOf(link.kind)},
          {"from_submap", link.from_submap},
          {"to_submap", link.to_submap},
          {"from_keyframe", link.from_keyframe},
          {"to_keyframe", link.to_keyframe},
          {"T_to_from", toJson(link.T_to_from)},
          {"covariance", toJson(link.covariance)},
          {"inliers", evidence.inliers},
          {"matches", evidence.matches},
          {"off_plane", evidence.off_plane},
          {"agreement", evidence.agreement},
          {"seen_through", evidence.seen_through},
          {"log_odds", evidence.log_odds}};
}

Pose poseOf(const SurveyJson& json) {
  Pose pose = Pose::Identity();
  pose.matrix().topRows<3>() = matrixFrom<PoseColumns>(json);
  return pose;
}
Matrix6 matrixOf(const SurveyJson& json) {
  return matrixFrom<Matrix6>(json);
}
Link linkOf(const SurveyJson& json) {
  Link link;
  const std::string kind = json.at("kind");
  link.kind = kind == wordOf(LinkKind::Surface) ? LinkKind::Surface : LinkKind::Loop;
  link.from_submap = json.at("from_submap");
  link.to_submap = json.at("to_submap");
  link.from_keyframe = json.at("from_keyframe");
  link.to_keyframe = json.at("to_keyframe");
  link.T_to_from = poseOf(json.at("T_to_from"));
  link.covariance = matrixOf(json.at("covariance"));
  link.evidence.inliers = json.at("inliers");
  link.evidence.matches = json.at("matches");
  link.evidence.off_plane = json.at("off_plane");
  link.evidence.agreement = json.at("agreement");
  link.evidence.seen_through = json.at("seen_through");
  link.evidence.log_odds = json.at("log_odds");
  return link;
}

SurveyJson fileRecord(const std::string& path) {
  std::uint32_t crc = 0;
  std::size_t bytes = 0;
  io::readFile(path, [&](std::string_view part) {
    crc = crc32(crc, reinterpret_cast<const std::uint8_t*>(part.data()), part.size());
    bytes += part.size();
  });
  return {
      {"file", path.substr(path.find_last_of('/') + 1)}, {"bytes", bytes}, {"crc32", hexText(crc)}};
}

std::string hexText(std::uint32_t checksum) {
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%08x", checksum);
  return text.data();
}

std::string checksumText(const std::string& text) {
  return hexText(crc32(0, reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

SurveyRecord::SurveyRecord(std::string path, std::uint32_t plan, SurveyJson read)
    : path_(std::move(path)), plan_(plan), read_(std::move(read)) {}

std::optional<SurveyJson> SurveyRecord::done() const {
  try {
    SurveyJson json = SurveyJson::parse(io::readWholeText(path_));
    if (json.at("plan") != plan_ || json.at("read") != read_) return std::nullopt;
    const std::string result = json.at("result");
    if (!result.empty() && fileRecord(beside(path_, result)) != json.at("wrote"))
      return std::nullopt;
    return json;
  } catch (const SurveyJson::exception&) {
    return std::nullopt;
  } catch (const IoError&) {
    return std::nullopt;
  }
}

SurveyJson SurveyRecord::write(const SurveyJson& json, const std::string& result) const {
  SurveyJson record = {{"plan", plan_}, {"read", read_}, {"result", result}};
  if (!result.empty()) record["wrote"] = fileRecord(beside(path_, result));
  record.update(json);
  io::writeFileAtomically(path_, record.dump(1) + "\n", io::Overwrite::Allow);
  return record;
}

SurveyJson readRecord(const std::string& path, std::uint32_t plan) {
  SurveyJson json;
  try {
    json = SurveyJson::parse(io::readWholeText(path));
    if (json.at("plan") != plan) throw InputError(path + ": is the result of another plan");
  } catch (const SurveyJson::exception&) {
    throw InputError(path + ": is damaged or cut short; do its job again");
  }
  return json;
}

SurveyReport reportOf(const std::string& job, const SurveyRecord& record, const SurveyJson& said,
                      bool was_done) {
  const SurveyJson& read = said.at("read");
  const std::size_t files = read.is_array() ? read.size() : read.at("files").get<std::size_t>();
  const SurveyJson wrote = said.contains("wrote") ? said.at("wrote") : fileRecord(record.path());
  return {was_done,
          job + ": read " + counted(files, "file") + ", CRC-32 " + checksumText(read.dump()) +
              "; " + (was_done ? "done before: " : "wrote ") + wrote.at("file").get<std::string>() +
              ", " + wrote.at("bytes").dump() + " bytes, CRC-32 " +
              wrote.at("crc32").get<std::string>(),
          said.dump(1)};
}

PieceRows addPiece(AtlasData& all, AtlasData piece) {
  PieceRows rows;
  rows.submap = nextId(all.submaps);
  rows.keyframe = nextId(all.keyframes);
  rows.first_submap = all.submaps.size();
  rows.first_keyframe = all.keyframes.size();
  rows.first_link = all.links.size();
  addAtlas(all, std::move(piece));
  rows.end_submap = all.submaps.size();
  rows.end_keyframe = all.keyframes.size();
  rows.end_link = all.links.size();
  return rows;
}

std::optional<Link> tieBetween(const SurveyJson& piece, const SurveyJson& next) {
  if (!piece.contains("end") || !next.contains("begin")) return std::nullopt;
  const SurveyJson& end = piece.at("end");
  Link link;
  link.kind = LinkKind::Neighbour;
  link.from_submap = end.at("submap");
  link.to_submap = next.at("begin").at("submap");
  link.T_to_from =
      poseOf(next.at("begin").at("T_session_frame")) * poseOf(end.at("T_session_frame")).inverse();
  link.covariance = turnedCovariance(link.T_to_from, matrixOf(end.at("covariance")));
  return link;
}

}  // namespace planar_mapping::detail
