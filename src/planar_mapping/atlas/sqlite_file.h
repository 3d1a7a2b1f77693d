// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sqlite3.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/error.h"

namespace planar_mapping::detail {

/// Bytes somebody else owns.
struct BlobView {
  const void* data = nullptr;
  std::size_t size = 0;
};

enum class SqliteMode { Read, Write, Memory };

/// Another program has the file.
struct SqliteBusyError : IoError {
  using IoError::IoError;
};

/// A connection to a SQLite file whose errors are sentences.
class SqliteFile {
 public:
  /// \throws IoError if there is no such file or it is none
  SqliteFile(std::string path, SqliteMode mode);
  ~SqliteFile();
  SqliteFile(const SqliteFile&) = delete;
  SqliteFile& operator=(const SqliteFile&) = delete;

  const std::string& path() const { return path_; }
  sqlite3* handle() const { return handle_; }
  /// Commits go to a log beside the file, until it is closed.
  void useLog();
  void execute(const std::string& sql);
  std::int64_t number(const std::string& sql);
  /// The bytes of the file.
  std::vector<std::uint8_t> serialize();
  /// \throws IoError that says what SQLite's result code means; InputError where data break a rule
  ///         of the schema
  [[noreturn]] void fail(int code) const;

 private:
  /// The other constructor goes on from here: what it opens is closed, also where it throws.
  struct Closed {};
  SqliteFile(std::string path, SqliteMode mode, Closed);
  void open(int flags, bool is_immutable);

  std::string path_;
  SqliteMode mode_;
  bool has_log_ = false;
  sqlite3* handle_ = nullptr;
};

/// All of it is committed, or nothing.
class SqliteTransaction {
 public:
  SqliteTransaction(SqliteFile& file, const char* begin);
  ~SqliteTransaction();
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;
  void commit();

 private:
  SqliteFile& file_;
  bool is_open_ = true;
};

class SqliteStatement {
 public:
  SqliteStatement(SqliteFile& file, const std::string& sql);
  ~SqliteStatement() { sqlite3_finalize(handle_); }
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  /// Begins it with these values for ?1, ?2, ..., which have to outlive it.
  template <typename... Values>
  void start(const Values&... values) {
    sqlite3_reset(handle_);
    int index = 0;
    (bind(++index, values), ...);
  }
  /// Runs one that gives no rows.
  template <typename... Values>
  void run(const Values&... values) {
    start(values...);
    next();
    sqlite3_reset(handle_);
  }
  /// \return false after the last row
  bool next();
  std::int64_t integer(int column) { return sqlite3_column_int64(handle_, column); }
  double real(int column) { return sqlite3_column_double(handle_, column); }
  std::string text(int column);
  /// Valid until next().
  BlobView blob(int column);
  bool isNull(int column) { return sqlite3_column_type(handle_, column) == SQLITE_NULL; }

 private:
  void bind(int index, std::int64_t value);
  void bind(int index, double value);
  void bind(int index, std::string_view value);
  void bind(int index, BlobView value);
  void bind(int index, std::nullptr_t);
  void require(int code);

  SqliteFile& file_;
  sqlite3_stmt* handle_ = nullptr;
};

}  // namespace planar_mapping::detail
