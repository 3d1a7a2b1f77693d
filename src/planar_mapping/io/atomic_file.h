// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/export.h"

namespace planar_mapping::io {

/// Takes the parts of a file, one after the other.
using ByteSink = std::function<void(std::string_view)>;

/// What to do when the file to be written exists already.
enum class Overwrite { Refuse, Allow };

/// The file to be written exists already and must not be overwritten.
class PLANAR_MAPPING_EXPORT FileExistsError : public IoError {
 public:
  explicit FileExistsError(const std::string& path);
  ~FileExistsError() override;
};

/// A file that appears whole or not at all.
///
/// Bytes go to a temporary name in the same directory (`.NAME.<pid>-<n>.tmp`); commit() flushes
/// them to the disk and renames. Whatever happens before commit() - an exception, a full disk, a
/// killed process - leaves the file that was there before as it was. The destructor removes the
/// temporary file; only a killed process leaves one behind.
///
/// Every function throws IoError (with the final path) when the directory is missing or read-only,
/// the disk is full, or the path names something that is not a regular file.
class PLANAR_MAPPING_EXPORT AtomicFile {
 public:
  /// \throws IoError; FileExistsError if \p overwrite is Refuse
  explicit AtomicFile(const std::string& path, Overwrite overwrite = Overwrite::Refuse);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, std::size_t size);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// What the file holds so far, as the file system gives it back.
  std::vector<std::uint8_t> readBack();
  /// Makes the file appear under its name. Nothing may be written afterwards.
  /// \throws IoError; FileExistsError if it came into being meanwhile
  void commit();

  const std::string& path() const { return path_; }

 private:
  void flush();
  void writeAll(const char* data, std::size_t size);
  [[noreturn]] void fail(const char* action, int error_number) const;

  std::string path_;
  std::string directory_;
  std::string temporary_path_;
  Overwrite overwrite_;
  std::vector<char> buffer_;
  int descriptor_ = -1;
};

/// Writes a whole file as AtomicFile does. \throws IoError
PLANAR_MAPPING_EXPORT void writeFileAtomically(const std::string& path, const void* data,
                                               std::size_t size,
                                               Overwrite overwrite = Overwrite::Refuse);
PLANAR_MAPPING_EXPORT void writeFileAtomically(const std::string& path, std::string_view text,
                                               Overwrite overwrite = Overwrite::Refuse);

/// Makes what was renamed within a directory survive a power failure, where the file system offers
/// that. \throws IoError if the disk reports an error
PLANAR_MAPPING_EXPORT void syncDirectory(const std::string& path);

/// Reads a whole regular file. \throws IoError if it is missing, no regular file, unreadable or
/// larger than \p largest_size bytes
PLANAR_MAPPING_EXPORT std::vector<std::uint8_t> readWholeFile(
    const std::string& path, std::size_t largest_size = static_cast<std::size_t>(-1));

/// The same as text.
PLANAR_MAPPING_EXPORT std::string readWholeText(
    const std::string& path, std::size_t largest_size = static_cast<std::size_t>(-1));

/// The same, part by part. \throws IoError
PLANAR_MAPPING_EXPORT void readFile(const std::string& path, const ByteSink& sink);

}  // namespace planar_mapping::io
