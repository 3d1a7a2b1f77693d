// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/store_rows.h"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"

namespace planar_mapping::detail {
namespace {

using PoseRows = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using CameraNumbers = std::array<double, 7>;

std::string named(const char* kind, std::int64_t id) {
  return std::string(kind) + " " + std::to_string(id);
}

void requireThat(bool holds, const std::string& whose, const char* problem) {
  if (!holds) throw InputError(whose + " " + problem);
}

/// Rigid, and not so far from its origin that covariances lose their digits.
void requirePlaced(const std::string& whose, const char* name, const Pose& pose) {
  constexpr double kFarthest = 1e7;  // metres: coordinates of a country are below it
  requireRigid((whose + ": " + name).c_str(), pose);
  requireThat(pose.translation().cwiseAbs().maxCoeff() <= kFarthest, whose,
              "lies more than 10,000 km from its origin");
}

// What is written and what is read has to be sound.

void requireSound(const AtlasSession& session) {
  requireThat(session.id >= 0, named("session", session.id), "has a negative number");
}

void requireSound(const Submap& submap) {
  const std::string name = named("submap", submap.id);
  requireThat(submap.id >= 0, name, "has a negative number");
  requirePlaced(name, "T_world_submap", submap.T_world_submap);
}

void requireSound(const Keyframe& keyframe) {
  const std::string name = named("keyframe", keyframe.id);
  requireThat(keyframe.id >= 0, name, "has a negative number");
  requireThat(std::isfinite(keyframe.timestamp), name, "has a time that is not finite");
  requirePlaced(name, "T_submap_keyframe", keyframe.T_submap_keyframe);
  try {
    keyframe.camera.validate();
  } catch (const ParameterError& error) {
    throw InputError(name + ": " + error.what());
  }
  requireThat(keyframe.width >= 0 && keyframe.height >= 0 && keyframe.cells_across >= 0, name,
              "has an image of negative size");
  for (const FeatureSighting& sighting : keyframe.sightings)
    requireThat(std::isfinite(sighting.column) && std::isfinite(sighting.row) &&
                    std::isfinite(sighting.inverse_depth),
                name, "has a feature that is not finite");
  requireThat(keyframe.descriptors.size() == keyframe.sightings.size() * keyframe.descriptor_bytes,
              name, "has not a descriptor for each feature");
  const std::size_t cells = keyframe.inverse_depths.size();
  requireThat(cells == 0 || (keyframe.cells_across > 0 &&
                             cells % static_cast<std::size_t>(keyframe.cells_across) == 0),
              name, "has inverse depths that are no whole rows");
  requireThat(keyframe.points.size() % 3 == 0, name, "has a point that is cut short");
  requireThat(
      std::isfinite(keyframe.point_step) && (keyframe.points.empty() || keyframe.point_step > 0.0),
      name, "has points without a unit");
}

void requireSound(const Link& link) {
  const std::string name = named("link", link.id);
  requireThat(link.id >= 0, name, "has a negative number");
  requireThat(link.from_submap != link.to_submap, name, "joins a submap with itself");
  requireThat((link.from_keyframe < 0) == (link.to_keyframe < 0), name, "has one keyframe of two");
  requirePlaced(name, "T_to_from", link.T_to_from);
  requireThat(link.covariance.allFinite(), name, "has a covariance that is not finite");
  requireThat((link.covariance.diagonal().array() > 0.0).all(), name,
              "has a variance that is not above 0");
  requireThat(std::isfinite(link.evidence.agreement) && std::isfinite(link.evidence.seen_through) &&
                  std::isfinite(link.evidence.log_odds) && std::isfinite(link.residual),
              name, "has evidence that is not finite");
}

// Columns of bytes.

template <typename T>
BlobView viewOf(const std::vector<T>& values) {
  return {values.data(), values.size() * sizeof(T)};
}

PoseRows rowsOf(const Pose& pose) {
  return pose.matrix().topRows<3>();
}

BlobView viewOf(const PoseRows& rows) {
  return {rows.data(), sizeof(double) * 12};
}

template <typename T>
std::vector<T> listOf(const BlobView& bytes, const std::string& whose) {
  requireThat(bytes.size % sizeof(T) == 0, whose, "has a list that is cut short");
  std::vector<T> values(bytes.size / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data, bytes.size);
  return values;
}

template <typename T>
T numbersOf(const BlobView& bytes, const std::string& whose) {
  T numbers{};
  requireThat(bytes.size == sizeof(double) * static_cast<std::size_t>(numbers.size()), whose,
              "has a pose, camera or covariance of another size");
  std::memcpy(numbers.data(), bytes.data, bytes.size);
  return numbers;
}

Pose poseOf(const BlobView& bytes, const std::string& whose) {
  Pose pose = Pose::Identity();
  pose.matrix().topRows<3>() = numbersOf<PoseRows>(bytes, whose);
  return pose;
}

template <typename Integer>
Integer countOf(std::int64_t value, const std::string& whose) {
  const auto largest = static_cast<std::uint64_t>(std::min<std::uintmax_t>(
      std::numeric_limits<Integer>::max(), std::numeric_limits<std::int64_t>::max()));
  requireThat(value >= 0 && static_cast<std::uint64_t>(value) <= largest, whose,
              "has a count out of range");
  return static_cast<Integer>(value);
}

template <typename Enum, std::size_t N>
Enum enumOf(const std::string& word, const std::array<const char*, N>& words,
            const std::string& whose) {
  const auto at = std::find(words.begin(), words.end(), word);
  requireThat(at != words.end(), whose, "has a kind or state that is unknown");
  return static_cast<Enum>(at - words.begin());
}

CameraNumbers numbersOf(const FeatureCamera& camera) {
  return {camera.fx,
          camera.fy,
          camera.cx,
          camera.cy,
          camera.pixel_error,
          camera.depth_error,
          camera.depth_error_growth};
}

FeatureCamera cameraOf(const CameraNumbers& numbers) {
  FeatureCamera camera;
  camera.fx = numbers[0];
  camera.fy = numbers[1];
  camera.cx = numbers[2];
  camera.cy = numbers[3];
  camera.pixel_error = numbers[4];
  camera.depth_error = numbers[5];
  camera.depth_error_growth = numbers[6];
  return camera;
}

// Rows.

/// What is wrong with a row is said with its name.
template <typename Write>
void writeRow(const char* kind, std::int64_t id, const SqliteFile& file, const Write& write) {
  try {
    write();
  } catch (const InputError&) {
    switch (sqlite3_extended_errcode(file.handle())) {
      case SQLITE_CONSTRAINT_PRIMARYKEY:
        throw InputError(named(kind, id) + " is in " + file.path() + " already");
      case SQLITE_CONSTRAINT_FOREIGNKEY:
        throw InputError(named(kind, id) + " refers to something that is not in " + file.path());
      default:
        throw;
    }
  }
}

void insertSessions(SqliteFile& file, const AtlasData& part) {
  SqliteStatement insert(file, "INSERT INTO sessions VALUES (?, ?, ?)");
  for (const AtlasSession& session : part.sessions) {
    requireSound(session);
    writeRow("session", session.id, file,
             [&]() { insert.run(session.id, session.source, session.configuration); });
  }
}

void insertSubmaps(SqliteFile& file, const AtlasData& part, const MapBytes& bytes_of) {
  SqliteStatement insert(file, "INSERT INTO submaps VALUES (?, ?, ?, ?)");
  SqliteStatement insert_map(file, "INSERT INTO maps VALUES (?, ?)");
  for (const Submap& submap : part.submaps) {
    requireSound(submap);
    const std::vector<std::uint8_t> bytes = bytes_of(submap);
    writeRow("submap", submap.id, file, [&]() {
      const PoseRows pose = rowsOf(submap.T_world_submap);
      insert.run(submap.id, submap.session, submap.component, viewOf(pose));
      insert_map.run(submap.id, viewOf(bytes));
    });
  }
}

void insertKeyframes(SqliteFile& file, const AtlasData& part) {
  SqliteStatement insert(
      file, "INSERT INTO keyframes VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const Keyframe& keyframe : part.keyframes) {
    requireSound(keyframe);
    writeRow("keyframe", keyframe.id, file, [&]() {
      const PoseRows pose = rowsOf(keyframe.T_submap_keyframe);
      const CameraNumbers camera = numbersOf(keyframe.camera);
      const auto integer = [](auto value) { return static_cast<std::int64_t>(value); };
      insert.run(keyframe.id, keyframe.submap, integer(keyframe.frame), keyframe.source,
                 keyframe.timestamp, viewOf(pose), BlobView{camera.data(), sizeof(camera)},
                 integer(keyframe.width), integer(keyframe.height), viewOf(keyframe.sightings),
                 viewOf(keyframe.descriptors), integer(keyframe.descriptor_bytes),
                 viewOf(keyframe.inverse_depths), integer(keyframe.cells_across),
                 viewOf(keyframe.thumbnail), viewOf(keyframe.points), keyframe.point_step,
                 integer(keyframe.is_scan));
    });
  }
}

void insertLinks(SqliteFile& file, const AtlasData& part) {
  const std::string values = "VALUES (?, ?, ?, ?, ?, nullif(?, -1), nullif(?, -1), ?, ?, ?, ?, ?, ";
  SqliteStatement insert(file, "INSERT INTO links " + values + "?, ?, ?, ?)");
  for (const Link& link : part.links) {
    requireSound(link);
    writeRow("link", link.id, file, [&]() {
      const PoseRows pose = rowsOf(link.T_to_from);
      insert.run(link.id, std::string_view(wordOf(link.kind)), std::string_view(wordOf(link.state)),
                 link.from_submap, link.to_submap, link.from_keyframe, link.to_keyframe,
                 viewOf(pose), BlobView{link.covariance.data(), sizeof(double) * 36},
                 static_cast<std::int64_t>(link.evidence.inliers),
                 static_cast<std::int64_t>(link.evidence.matches),
                 static_cast<std::int64_t>(link.evidence.off_plane), link.evidence.agreement,
                 link.evidence.seen_through, link.evidence.log_odds, link.residual);
    });
  }
}

void readSessions(SqliteFile& file, AtlasData& data) {
  SqliteStatement row(file, "SELECT id, source, configuration FROM sessions ORDER BY id");
  while (row.next()) {
    data.sessions.push_back({row.integer(0), row.text(1), row.text(2)});
    requireSound(data.sessions.back());
  }
}

void readSubmaps(SqliteFile& file, int threads, AtlasContent content, AtlasData& data) {
  const bool with_maps = content == AtlasContent::All;
  SqliteStatement row(
      file, with_maps ? "SELECT id, session, component, T_world_submap, pmap FROM submaps LEFT "
                        "JOIN maps ON submap = id ORDER BY id"
                      : "SELECT id, session, component, T_world_submap FROM submaps ORDER BY id");
  while (row.next()) {
    Submap submap;
    submap.id = row.integer(0);
    const std::string name = named("submap", submap.id);
    submap.session = row.integer(1);
    submap.component = row.integer(2);
    submap.T_world_submap = poseOf(row.blob(3), name);
    requireSound(submap);
    requireThat(!with_maps || !row.isNull(4), name, "has no map");
    if (with_maps) submap.map = mapOf(row.blob(4), submap.id, threads);
    data.submaps.push_back(std::move(submap));
  }
}

void readKeyframes(SqliteFile& file, AtlasContent content, AtlasData& data) {
  const bool is_whole = content != AtlasContent::Outline;
  SqliteStatement row(file,
                      std::string("SELECT id, submap, frame, source, timestamp, T_submap_keyframe, "
                                  "camera, width, height, ") +
                          (is_whole ? "sightings, descriptors, descriptor_bytes, inverse_depths, "
                                      "cells_across, thumbnail, points, point_step, is_scan"
                                    : "x'', x'', 0, x'', 0, x'', x'', 0.0, 0") +
                          " FROM keyframes ORDER BY id");
  while (row.next()) {
    Keyframe keyframe;
    keyframe.id = row.integer(0);
    const std::string name = named("keyframe", keyframe.id);
    keyframe.submap = row.integer(1);
    keyframe.frame = countOf<std::size_t>(row.integer(2), name);
    keyframe.source = row.text(3);
    keyframe.timestamp = row.real(4);
    keyframe.T_submap_keyframe = poseOf(row.blob(5), name);
    keyframe.camera = cameraOf(numbersOf<CameraNumbers>(row.blob(6), name));
    keyframe.width = countOf<int>(row.integer(7), name);
    keyframe.height = countOf<int>(row.integer(8), name);
    keyframe.sightings = listOf<FeatureSighting>(row.blob(9), name);
    keyframe.descriptors = listOf<std::uint8_t>(row.blob(10), name);
    keyframe.descriptor_bytes = countOf<std::uint32_t>(row.integer(11), name);
    keyframe.inverse_depths = listOf<std::uint16_t>(row.blob(12), name);
    keyframe.cells_across = countOf<int>(row.integer(13), name);
    keyframe.thumbnail = listOf<std::uint8_t>(row.blob(14), name);
    keyframe.points = listOf<std::int16_t>(row.blob(15), name);
    keyframe.point_step = row.real(16);
    keyframe.is_scan = row.integer(17) != 0;
    requireSound(keyframe);
    data.keyframes.push_back(std::move(keyframe));
  }
}

void readLinks(SqliteFile& file, AtlasData& data) {
  SqliteStatement row(file,
                      "SELECT id, kind, state, from_submap, to_submap, ifnull(from_keyframe, -1), "
                      "ifnull(to_keyframe, -1), T_to_from, covariance, inliers, matches, "
                      "off_plane, agreement, seen_through, log_odds, residual FROM links "
                      "ORDER BY id");
  while (row.next()) {
    Link link;
    link.id = row.integer(0);
    const std::string name = named("link", link.id);
    link.kind = enumOf<LinkKind>(row.text(1), kLinkKindWords, name);
    link.state = enumOf<LinkState>(row.text(2), kLinkStateWords, name);
    link.from_submap = row.integer(3);
    link.to_submap = row.integer(4);
    link.from_keyframe = row.integer(5);
    link.to_keyframe = row.integer(6);
    link.T_to_from = poseOf(row.blob(7), name);
    link.covariance = numbersOf<Matrix6>(row.blob(8), name);
    link.evidence.inliers = countOf<std::size_t>(row.integer(9), name);
    link.evidence.matches = countOf<std::size_t>(row.integer(10), name);
    link.evidence.off_plane = countOf<std::size_t>(row.integer(11), name);
    link.evidence.agreement = row.real(12);
    link.evidence.seen_through = row.real(13);
    link.evidence.log_odds = row.real(14);
    link.residual = row.real(15);
    requireSound(link);
    data.links.push_back(link);
  }
}

/// Whatever refers to something refers to something that is there.
void requireReferences(SqliteFile& file, const AtlasData& data) {
  SqliteStatement broken(file, "SELECT \"table\", rowid FROM pragma_foreign_key_check");
  if (broken.next())
    throw InputError("row " + std::to_string(broken.integer(1)) + " of its table " +
                     broken.text(0) + " refers to something that is not there");
  std::unordered_map<std::int64_t, std::int64_t> submap_of;
  for (const Keyframe& keyframe : data.keyframes) submap_of[keyframe.id] = keyframe.submap;
  for (const Link& link : data.links) {
    if (link.from_keyframe < 0) continue;
    requireThat(submap_of.at(link.from_keyframe) == link.from_submap &&
                    submap_of.at(link.to_keyframe) == link.to_submap,
                named("link", link.id), "names keyframes of other submaps");
  }
}

}  // namespace

std::vector<std::uint8_t> serialized(const Submap& submap) {
  requireThat(submap.map != nullptr, named("submap", submap.id), "has no map");
  return submap.map->serialize();
}

void insertRows(SqliteFile& file, const AtlasData& part, const MapBytes& bytes_of) {
  insertSessions(file, part);
  insertSubmaps(file, part, bytes_of);
  insertKeyframes(file, part);
  insertLinks(file, part);
}

void updateRows(SqliteFile& file, const AtlasData& solved) {
  const auto requireOne = [&](const char* kind, std::int64_t id, const char* table) {
    if (sqlite3_changes(file.handle()) > 0) return;
    const std::string row = std::string("SELECT count(*) FROM ") + table + " WHERE id = ";
    if (file.number(row + std::to_string(id)) == 0)
      throw InputError(named(kind, id) + " is not in " + file.path());
  };
  SqliteStatement move(file,
                       "UPDATE submaps SET component = ?2, T_world_submap = ?3 WHERE id = ?1 AND "
                       "(component <> ?2 OR T_world_submap <> ?3)");
  for (const Submap& submap : solved.submaps) {
    requireSound(submap);
    const PoseRows pose = rowsOf(submap.T_world_submap);
    writeRow("submap", submap.id, file,
             [&]() { move.run(submap.id, submap.component, viewOf(pose)); });
    requireOne("submap", submap.id, "submaps");
  }
  SqliteStatement weigh(file,
                        "UPDATE links SET state = ?2, residual = ?3 WHERE id = ?1 AND (state <> ?2 "
                        "OR residual <> ?3)");
  for (const Link& link : solved.links) {
    requireSound(link);
    weigh.run(link.id, std::string_view(wordOf(link.state)), link.residual);
    requireOne("link", link.id, "links");
  }
}

std::shared_ptr<const PlanarMap> mapOf(const BlobView& bytes, std::int64_t submap, int threads) {
  try {
    return std::make_shared<PlanarMap>(
        PlanarMap::deserialize(static_cast<const std::uint8_t*>(bytes.data), bytes.size, threads));
  } catch (const ParameterError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(named("submap", submap) + ": its map " + error.what());
  }
}

AtlasData readRows(SqliteFile& file, int threads, AtlasContent content) {
  AtlasData data;
  readSessions(file, data);
  readSubmaps(file, threads, content, data);
  readKeyframes(file, content, data);
  readLinks(file, data);
  requireReferences(file, data);
  return data;
}

}  // namespace planar_mapping::detail
