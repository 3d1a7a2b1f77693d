// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_store.h"

#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "planar_mapping/atlas/sqlite_file.h"
#include "planar_mapping/atlas/store_rows.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

using detail::SqliteFile;
using detail::SqliteMode;
using detail::SqliteStatement;
using detail::SqliteTransaction;

constexpr std::int64_t kApplicationId = 0x504d4154;  // "PMAT"
constexpr std::int64_t kFormatVersion = 4;

/// Poses and maps apart from one another: moving a submap does not write its map again.
constexpr std::array<const char*, 8> kSchema = {
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
  thumbnail BLOB NOT NULL,
  points BLOB NOT NULL,
  point_step REAL NOT NULL,
  is_scan INTEGER NOT NULL
) STRICT)sql",
    R"sql(CREATE TABLE links (
  id INTEGER PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('neighbour', 'loop', 'surface')),
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
) STRICT)sql",
    R"sql(CREATE TABLE open_session (
  id INTEGER PRIMARY KEY REFERENCES sessions
) STRICT)sql"};

/// A session begins: how it finds the rows of those before it.
constexpr const char* kRememberBefore =
    R"sql(DELETE FROM submaps_before;
INSERT INTO submaps_before SELECT id, component, T_world_submap FROM submaps;
DELETE FROM links_before;
INSERT INTO links_before SELECT id, state, residual FROM links;)sql";
constexpr const char* kOpenSession =
    R"sql(DELETE FROM open_session;
INSERT INTO open_session SELECT max(id) FROM sessions;)sql";
constexpr const char* kCloseSession =
    R"sql(DELETE FROM open_session;
DELETE FROM submaps_before;
DELETE FROM links_before;)sql";

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
         gone + "DELETE FROM submaps WHERE id " + gone + "DELETE FROM open_session;" +
         "DELETE FROM sessions WHERE id = (SELECT max(id) FROM sessions);";
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
  /// \param begins  a session, that may be taken back
  void append(const AtlasData& part, const AtlasData& solved, Append how, bool begins,
              const detail::MapBytes& bytes_of);
  /// Calls \p use with the bytes of a map. \throws InputError if there is none
  template <typename Use>
  auto withMap(std::int64_t submap, const Use& use) {
    SqliteStatement row(file, "SELECT pmap FROM maps WHERE submap = ?");
    row.start(submap);
    if (!row.next()) throw InputError(file.path() + ": has no submap " + std::to_string(submap));
    return use(row.blob(0));
  }

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
  try {
    return detail::readRows(file, threads, content);
  } catch (const InputError& error) {
    throw IoError(file.path(), std::string("is damaged: ") + error.what());
  }
}

void AtlasStore::Impl::append(const AtlasData& part, const AtlasData& solved, Append how,
                              bool begins, const detail::MapBytes& bytes_of) {
  SqliteTransaction transaction(file, "BEGIN IMMEDIATE");
  if (how == Append::InPlaceOfLastSession) file.execute(takingBack());
  if (begins) file.execute(kRememberBefore);
  detail::insertRows(file, part, bytes_of);
  if (begins) file.execute(kOpenSession);
  detail::updateRows(file, solved);
  transaction.commit();
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

bool AtlasStore::isLastSessionOpen() {
  return impl_->file.number("SELECT count(*) FROM open_session") != 0;
}

void AtlasStore::closeSession() {
  SqliteTransaction transaction(impl_->file, "BEGIN IMMEDIATE");
  impl_->file.execute(kCloseSession);
  transaction.commit();
}

std::shared_ptr<const PlanarMap> AtlasStore::map(std::int64_t submap, int threads) {
  return impl_->withMap(
      submap, [&](const detail::BlobView& bytes) { return detail::mapOf(bytes, submap, threads); });
}

void AtlasStore::append(const AtlasData& part, const AtlasData& solved, Append how) {
  impl_->append(part, solved, how, !part.sessions.empty(), detail::serialized);
}

void AtlasStore::appendWithMapsOf(AtlasStore& other, std::int64_t offset, const AtlasData& part) {
  impl_->append(part, {}, Append::ToAll, false, [&](const Submap& submap) {
    return other.impl_->withMap(submap.id - offset, [](const detail::BlobView& bytes) {
      const auto* first = static_cast<const std::uint8_t*>(bytes.data);
      return std::vector<std::uint8_t>(first, first + bytes.size);
    });
  });
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
  detail::insertRows(memory, data);
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
