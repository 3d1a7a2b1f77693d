// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "planar_mapping/atlas/sqlite_file.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

using detail::BlobView;
using detail::SqliteFile;
using detail::SqliteMode;
using detail::SqliteStatement;
using detail::SqliteTransaction;

constexpr std::int64_t kApplicationId = 0x504d4154;  // "PMAT"
constexpr std::int64_t kFormatVersion = 2;

/// Poses and maps apart from one another: moving a submap does not write its map again.
constexpr std::array<const char*, 7> kSchema = {
    R"sql(CREATE TABLE sessions (
  id INTEGER PRIMARY KEY,
  source TEXT NOT NULL,
  configuration TEXT NOT NULL
) STRICT)sql",
    R"sql(CREATE TABLE submaps (
  id INTEGER PRIMARY KEY,
  session INTEGER NOT NULL REFERENCES sessions,
  component INTEGER NOT NULL REFERENCES submaps CHECK (component <= id),
  T_world_submap BLOB NOT NULL
) STRICT)sql",
    R"sql(CREATE TABLE maps (
  submap INTEGER PRIMARY KEY REFERENCES submaps,
  pmap BLOB NOT NULL
) STRICT)sql",
    R"sql(CREATE TABLE keyframes (
  id INTEGER PRIMARY KEY,
  submap INTEGER NOT NULL REFERENCES submaps,
  frame INTEGER NOT NULL,
  source TEXT NOT NULL,
  timestamp REAL NOT NULL,
  T_submap_keyframe BLOB NOT NULL,
  camera BLOB NOT NULL,
  width INTEGER NOT NULL,
  height INTEGER NOT NULL,
  sightings BLOB NOT NULL,
  descriptors BLOB NOT NULL,
  descriptor_bytes INTEGER NOT NULL,
  inverse_depths BLOB NOT NULL,
  cells_across INTEGER NOT NULL,
  thumbnail BLOB NOT NULL
) STRICT)sql",
    R"sql(CREATE TABLE links (
  id INTEGER PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('neighbour', 'loop', 'plane')),
  state TEXT NOT NULL CHECK (state IN ('used', 'rejected', 'refused')),
  from_submap INTEGER NOT NULL REFERENCES submaps,
  to_submap INTEGER NOT NULL REFERENCES submaps,
  from_keyframe INTEGER REFERENCES keyframes,
  to_keyframe INTEGER REFERENCES keyframes,
  T_to_from BLOB NOT NULL,
  covariance BLOB NOT NULL,
  inliers INTEGER NOT NULL,
  matches INTEGER NOT NULL,
  off_plane INTEGER NOT NULL,
  agreement REAL NOT NULL,
  seen_through REAL NOT NULL,
  log_odds REAL NOT NULL,
  residual REAL NOT NULL
) STRICT)sql",
    R"sql(CREATE TABLE submaps_before (
  submap INTEGER PRIMARY KEY REFERENCES submaps,
  component INTEGER NOT NULL,
  T_world_submap BLOB NOT NULL
) STRICT)sql",
    R"sql(CREATE TABLE links_before (
  link INTEGER PRIMARY KEY REFERENCES links,
  state TEXT NOT NULL,
  residual REAL NOT NULL
) STRICT)sql"};

/// A session begins: how it finds the rows of those before it.
constexpr const char* kRememberBefore =
    R"sql(DELETE FROM submaps_before;
INSERT INTO submaps_before SELECT id, component, T_world_submap FROM submaps;
DELETE FROM links_before;
INSERT INTO links_before SELECT id, state, residual FROM links;)sql";

/// The newest session goes, and what it has moved goes back.
std::string takingBack() {
  const std::string gone =
      "IN (SELECT id FROM submaps WHERE session = (SELECT max(id) FROM sessions));";
  return "UPDATE submaps SET component = b.component, T_world_submap = b.T_world_submap "
         "FROM submaps_before AS b WHERE b.submap = id;"
         "UPDATE links SET state = b.state, residual = b.residual "
         "FROM links_before AS b WHERE b.link = id;"
         "DELETE FROM links WHERE max(from_submap, to_submap) " +
         gone + "DELETE FROM keyframes WHERE submap " + gone + "DELETE FROM maps WHERE submap " +
         gone + "DELETE FROM submaps WHERE id " + gone +
         "DELETE FROM sessions WHERE id = (SELECT max(id) FROM sessions);";
}

using PoseRows = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using CameraNumbers = std::array<double, 7>;

std::string named(const char* kind, std::int64_t id) {
  return std::string(kind) + " " + std::to_string(id);
}

void requireThat(bool holds, const std::string& whose, const char* problem) {
  if (!holds) throw InputError(whose + " " + problem);
}

// What is written and what is read has to be sound.

void requireSound(const AtlasSession& session) {
  requireThat(session.id >= 0, named("session", session.id), "has a negative number");
}

void requireSound(const Submap& submap) {
  const std::string name = named("submap", submap.id);
  requireThat(submap.id >= 0, name, "has a negative number");
  requireRigid((name + ": T_world_submap").c_str(), submap.T_world_submap);
}

void requireSound(const Keyframe& keyframe) {
  const std::string name = named("keyframe", keyframe.id);
  requireThat(keyframe.id >= 0, name, "has a negative number");
  requireThat(std::isfinite(keyframe.timestamp), name, "has a time that is not finite");
  requireRigid((name + ": T_submap_keyframe").c_str(), keyframe.T_submap_keyframe);
  try {
    keyframe.camera.validate();
  } catch (const ParameterError& error) {
    throw InputError(name + ": " + error.what());
  }
  requireThat(keyframe.width >= 0 && keyframe.height >= 0, name, "has an image of negative size");
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
}

void requireSound(const Link& link) {
  const std::string name = named("link", link.id);
  requireThat(link.id >= 0, name, "has a negative number");
  requireThat(link.from_submap != link.to_submap, name, "joins a submap with itself");
  requireThat((link.from_keyframe < 0) == (link.to_keyframe < 0), name, "has one keyframe of two");
  requireRigid((name + ": T_to_from").c_str(), link.T_to_from);
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

void insertSubmaps(SqliteFile& file, const AtlasData& part) {
  SqliteStatement insert(file, "INSERT INTO submaps VALUES (?, ?, ?, ?)");
  SqliteStatement insert_map(file, "INSERT INTO maps VALUES (?, ?)");
  for (const Submap& submap : part.submaps) {
    requireSound(submap);
    requireThat(submap.map != nullptr, named("submap", submap.id), "has no map");
    const std::vector<std::uint8_t> bytes = submap.map->serialize();
    writeRow("submap", submap.id, file, [&]() {
      const PoseRows pose = rowsOf(submap.T_world_submap);
      insert.run(submap.id, submap.session, submap.component, viewOf(pose));
      insert_map.run(submap.id, viewOf(bytes));
    });
  }
}

void insertKeyframes(SqliteFile& file, const AtlasData& part) {
  SqliteStatement insert(
      file, "INSERT INTO keyframes VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
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
                 viewOf(keyframe.thumbnail));
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

void insertAll(SqliteFile& file, const AtlasData& part) {
  insertSessions(file, part);
  insertSubmaps(file, part);
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

void readSessions(SqliteFile& file, AtlasData& data) {
  SqliteStatement row(file, "SELECT id, source, configuration FROM sessions ORDER BY id");
  while (row.next()) {
    data.sessions.push_back({row.integer(0), row.text(1), row.text(2)});
    requireSound(data.sessions.back());
  }
}

std::shared_ptr<const PlanarMap> mapOf(const BlobView& bytes, const std::string& name,
                                       int threads) {
  try {
    return std::make_shared<PlanarMap>(
        PlanarMap::deserialize(static_cast<const std::uint8_t*>(bytes.data), bytes.size, threads));
  } catch (const ParameterError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(name + ": its map " + error.what());
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
    if (with_maps) submap.map = mapOf(row.blob(4), name, threads);
    data.submaps.push_back(std::move(submap));
  }
}

void readKeyframes(SqliteFile& file, AtlasContent content, AtlasData& data) {
  const bool is_whole = content != AtlasContent::Outline;
  SqliteStatement row(file,
                      std::string("SELECT id, submap, frame, source, timestamp, T_submap_keyframe, "
                                  "camera, width, height, ") +
                          (is_whole ? "sightings, descriptors, descriptor_bytes, inverse_depths, "
                                      "cells_across, thumbnail"
                                    : "x'', x'', 0, x'', 0, x''") +
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

/// \throws IoError if it is no atlas of this version
void requireFormat(SqliteFile& file) {
  const std::int64_t id = file.number("PRAGMA application_id");
  if (id != kApplicationId)
    throw IoError(file.path(), "is no atlas (*.atlas): it is a SQLite file of another program");
  const std::int64_t version = file.number("PRAGMA user_version");
  if (version != kFormatVersion)
    throw IoError(file.path(), "is an atlas of version " + std::to_string(version) +
                                   ", but this program reads version " +
                                   std::to_string(kFormatVersion) + ": map it anew");
  SqliteStatement table(file, "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND sql = ?");
  for (const std::string_view sql : kSchema) {
    table.start(sql);
    if (!table.next())
      throw IoError(file.path(), "is damaged: its tables are not those of version " +
                                     std::to_string(kFormatVersion));
  }
}

/// No run has the file, and no log lies beside it that would be taken for that of the next one.
void removeLogs(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) {
    try {
      AtlasStore::open(path, AtlasAccess::Write);
    } catch (const detail::SqliteBusyError&) {
      throw;
    } catch (const Error&) {  // what is to be overwritten need not be an atlas
    }
  }
  for (const char* end : {"-wal", "-shm", "-journal"}) std::filesystem::remove(path + end, ignored);
}

}  // namespace

struct AtlasStore::Impl {
  Impl(const std::string& path, SqliteMode mode) : file(path, mode) {}
  AtlasData read(int threads, AtlasContent content);

  SqliteFile file;
};

AtlasStore::AtlasStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AtlasStore::AtlasStore(AtlasStore&& other) noexcept = default;
AtlasStore& AtlasStore::operator=(AtlasStore&& other) noexcept = default;
AtlasStore::~AtlasStore() = default;

const std::string& AtlasStore::path() const {
  return impl_->file.path();
}

AtlasStore AtlasStore::create(const std::string& path, io::Overwrite overwrite) {
  saveAtlas({}, path, overwrite);
  return open(path, AtlasAccess::Write);
}

AtlasStore AtlasStore::open(const std::string& path, AtlasAccess access) {
  const bool writes = access == AtlasAccess::Write;
  auto impl = std::make_unique<Impl>(path, writes ? SqliteMode::Write : SqliteMode::Read);
  if (writes) impl->file.execute("PRAGMA locking_mode = EXCLUSIVE");
  {
    SqliteTransaction look(impl->file, writes ? "BEGIN EXCLUSIVE" : "BEGIN");
    requireFormat(impl->file);
    look.commit();
  }
  if (writes) impl->file.useLog();
  return AtlasStore(std::move(impl));
}

AtlasData AtlasStore::Impl::read(int threads, AtlasContent content) {
  AtlasData data;
  try {
    readSessions(file, data);
    readSubmaps(file, threads, content, data);
    readKeyframes(file, content, data);
    readLinks(file, data);
    requireReferences(file, data);
  } catch (const InputError& error) {
    throw IoError(file.path(), std::string("is damaged: ") + error.what());
  }
  return data;
}

AtlasData AtlasStore::load(int threads, AtlasContent content) {
  SqliteTransaction reading(impl_->file, "BEGIN");
  AtlasData data = impl_->read(threads, content);
  reading.commit();
  return data;
}

AtlasData AtlasStore::loadWithoutLastSession(int threads) {
  SqliteTransaction never_committed(impl_->file, "BEGIN IMMEDIATE");
  impl_->file.execute(takingBack());
  return impl_->read(threads, AtlasContent::All);
}

bool AtlasStore::knowsBeforeLastSession() {
  return impl_->file.number(
             "SELECT (SELECT count(*) FROM sessions) > 0 AND (SELECT count(*) FROM submaps_before) "
             "= (SELECT count(*) FROM submaps WHERE session < (SELECT max(id) FROM sessions))") !=
         0;
}

std::shared_ptr<const PlanarMap> AtlasStore::map(std::int64_t submap, int threads) {
  SqliteStatement row(impl_->file, "SELECT pmap FROM maps WHERE submap = ?");
  row.start(submap);
  if (!row.next()) throw InputError(path() + ": has no submap " + std::to_string(submap));
  return mapOf(row.blob(0), named("submap", submap), threads);
}

void AtlasStore::append(const AtlasData& part, const AtlasData& solved, Append how) {
  SqliteTransaction transaction(impl_->file, "BEGIN IMMEDIATE");
  if (how == Append::InPlaceOfLastSession) impl_->file.execute(takingBack());
  if (!part.sessions.empty()) impl_->file.execute(kRememberBefore);
  insertAll(impl_->file, part);
  updateRows(impl_->file, solved);
  transaction.commit();
}

void AtlasStore::update(const AtlasData& solved) {
  append({}, solved);
}

void saveAtlas(const AtlasData& data, const std::string& path, io::Overwrite overwrite) {
  io::AtomicFile out(path, overwrite);
  SqliteFile memory(path, SqliteMode::Memory);
  memory.execute("PRAGMA application_id = " + std::to_string(kApplicationId) +
                 "; PRAGMA user_version = " + std::to_string(kFormatVersion));
  SqliteTransaction transaction(memory, "BEGIN");
  for (const char* sql : kSchema) memory.execute(sql);
  insertAll(memory, data);
  transaction.commit();
  const std::vector<std::uint8_t> bytes = memory.serialize();
  out.write(bytes.data(), bytes.size());
  removeLogs(path);
  out.commit();
}

AtlasData loadAtlas(const std::string& path, int threads, AtlasContent content) {
  return AtlasStore::open(path).load(threads, content);
}

}  // namespace planar_mapping
