// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/sqlite_file.h"

#include <cerrno>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>

namespace planar_mapping::detail {
namespace {

namespace fs = std::filesystem;

/// How long another program may take for what it is at, milliseconds.
constexpr int kPatience = 1000;

/// No transaction waits beside the file, in either of SQLite's ways.
bool isWithoutLog(const std::string& path) {
  std::error_code error;
  for (const char* end : {"-wal", "-journal"}) {
    const std::uintmax_t size = fs::file_size(path + end, error);
    if (!error && size > 0) return false;
  }
  return true;
}

/// As a URI, in which a few characters have a meaning.
std::string uriOf(const std::string& path) {
  const char* const digits = "0123456789ABCDEF";
  std::string uri = "file:";
  if (path.substr(0, 2) == "//") uri += "//";
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '#') {
      const auto byte = static_cast<unsigned char>(c);
      uri += {'%', digits[byte >> 4], digits[byte & 15]};
    } else {
      uri += c;
    }
  }
  return uri;
}

}  // namespace

SqliteFile::SqliteFile(std::string path, SqliteMode mode, Closed)
    : path_(std::move(path)), mode_(mode) {}

SqliteFile::SqliteFile(std::string path, SqliteMode mode)
    : SqliteFile(std::move(path), mode, Closed()) {
  if (mode == SqliteMode::Memory) {
    open(SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_MEMORY, false);
    return;
  }
  std::error_code error;
  const fs::file_type type = fs::status(path_, error).type();
  if (type == fs::file_type::not_found) throw IoError(path_, "no such file");
  if (type == fs::file_type::directory) throw IoError(path_, "is a directory, no atlas");
  if (type != fs::file_type::regular) throw IoError(path_, "is not a file that can be read");
  open(SQLITE_OPEN_READWRITE, false);  // readers too: they tidy up after a crash
  if (mode == SqliteMode::Write) {
    if (sqlite3_db_readonly(handle_, "main") == 1) fail(SQLITE_READONLY);
    return;
  }
  execute("PRAGMA query_only = ON");
  // A file in a folder that cannot be written, left in write-ahead mode: nobody can change it.
  const int code =
      sqlite3_exec(handle_, "SELECT count(*) FROM sqlite_schema", nullptr, nullptr, nullptr) & 0xff;
  if ((code == SQLITE_CANTOPEN || code == SQLITE_READONLY) && isWithoutLog(path_)) {
    sqlite3_close(std::exchange(handle_, nullptr));
    open(SQLITE_OPEN_READONLY, true);
  }
}

void SqliteFile::open(int flags, bool is_immutable) {
  const std::string name = mode_ == SqliteMode::Memory
                               ? ":memory:"
                               : uriOf(path_) + (is_immutable ? "?immutable=1" : "");
  const int code = sqlite3_open_v2(name.c_str(), &handle_,
                                   flags | SQLITE_OPEN_URI | SQLITE_OPEN_EXRESCODE, nullptr);
  if (handle_ == nullptr) throw std::bad_alloc();
  if (code != SQLITE_OK) fail(code);
  sqlite3_busy_timeout(handle_, kPatience);
  // What a file that a stranger made could run is switched off.
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  execute("PRAGMA cell_size_check = ON; PRAGMA foreign_keys = ON");
}

SqliteFile::~SqliteFile() {
  // Without a log beside it the file can be copied, and read where nothing can be written.
  if (has_log_) sqlite3_exec(handle_, "PRAGMA journal_mode = DELETE", nullptr, nullptr, nullptr);
  sqlite3_close_v2(handle_);
}

void SqliteFile::useLog() {
  has_log_ = true;
  execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL");
}

void SqliteFile::execute(const std::string& sql) {
  const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

std::int64_t SqliteFile::number(const std::string& sql) {
  SqliteStatement statement(*this, sql);
  return statement.next() ? statement.integer(0) : 0;
}

std::vector<std::uint8_t> SqliteFile::serialize() {
  sqlite3_int64 size = 0;
  unsigned char* bytes = sqlite3_serialize(handle_, "main", &size, 0);
  if (bytes == nullptr) throw std::bad_alloc();
  std::vector<std::uint8_t> all(bytes, bytes + size);
  sqlite3_free(bytes);
  return all;
}

void SqliteFile::fail(int code) const {
  const int error_number = sqlite3_system_errno(handle_);
  const std::string reason =
      error_number == 0 ? sqlite3_errmsg(handle_) : std::generic_category().message(error_number);
  const std::string kept = "; what was committed before is kept";
  switch (code & 0xff) {
    case SQLITE_NOMEM:
      throw std::bad_alloc();
    case SQLITE_CONSTRAINT:
      throw InputError(path_ + ": " + sqlite3_errmsg(handle_));
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw SqliteBusyError(path_, "is open in another run: wait until that has ended");
    case SQLITE_NOTADB:
      throw IoError(path_, "is no atlas (*.atlas): it is no SQLite file");
    case SQLITE_CORRUPT:
      throw IoError(path_,
                    "is damaged or cut short: take a copy, or save what is left with 'sqlite3 FILE "
                    ".recover'");
    case SQLITE_FULL:
      throw IoError(path_, "cannot be written: the disk is full" + kept);
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_CANTOPEN:
      if (mode_ == SqliteMode::Read && !isWithoutLog(path_))
        throw IoError(path_,
                      "was not closed, and it or its folder is read-only: copy it with what lies "
                      "beside it (-wal, -journal) to where it can be written");
      if ((code & 0xff) == SQLITE_CANTOPEN) throw IoError(path_, "cannot be opened: " + reason);
      throw IoError(path_, "cannot be written: the file or its folder is read-only");
    case SQLITE_IOERR:
      throw IoError(path_, (mode_ == SqliteMode::Write ? "cannot be written: " + reason + kept
                                                       : "cannot be read: " + reason));
    default:
      throw IoError(path_, mode_ == SqliteMode::Read ? "cannot be read: " + reason
                                                     : "cannot be written: " + reason);
  }
}

SqliteTransaction::SqliteTransaction(SqliteFile& file, const char* begin) : file_(file) {
  file_.execute(begin);
}

SqliteTransaction::~SqliteTransaction() {
  if (is_open_) sqlite3_exec(file_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void SqliteTransaction::commit() {
  file_.execute("COMMIT");
  is_open_ = false;
}

SqliteStatement::SqliteStatement(SqliteFile& file, const std::string& sql) : file_(file) {
  require(sqlite3_prepare_v2(file.handle(), sql.c_str(), -1, &handle_, nullptr));
}

void SqliteStatement::require(int code) {
  if (code != SQLITE_OK) file_.fail(code);
}

bool SqliteStatement::next() {
  const int code = sqlite3_step(handle_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) file_.fail(code);
  return false;
}

std::string SqliteStatement::text(int column) {
  const BlobView bytes = blob(column);
  return {static_cast<const char*>(bytes.data), bytes.size};
}

BlobView SqliteStatement::blob(int column) {
  const void* data = sqlite3_column_blob(handle_, column);
  if (data == nullptr) return {"", 0};
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(handle_, column))};
}

void SqliteStatement::bind(int index, std::int64_t value) {
  require(sqlite3_bind_int64(handle_, index, value));
}

void SqliteStatement::bind(int index, double value) {
  require(sqlite3_bind_double(handle_, index, value));
}

void SqliteStatement::bind(int index, std::string_view value) {
  require(sqlite3_bind_text64(handle_, index, value.empty() ? "" : value.data(), value.size(),
                              SQLITE_STATIC, SQLITE_UTF8));
}

void SqliteStatement::bind(int index, BlobView value) {
  require(sqlite3_bind_blob64(handle_, index, value.size == 0 ? "" : value.data, value.size,
                              SQLITE_STATIC));
}

void SqliteStatement::bind(int index, std::nullptr_t) {
  require(sqlite3_bind_null(handle_, index));
}

}  // namespace planar_mapping::detail
