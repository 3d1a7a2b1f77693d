// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace planar_mapping::io {

/// A regular file opened for reading. It is read, not mapped: a file that another process cuts
/// short meanwhile must end in an IoError, not in SIGBUS.
class InputFile {
 public:
  /// \throws IoError if it is missing, unreadable, a directory or another special file
  explicit InputFile(const std::string& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t position() const { return position_; }

  /// Reads up to \p size bytes and returns how many there were; 0 only at the end.
  std::size_t read(void* data, std::size_t size);
  /// Reads exactly \p size bytes. \throws IoError "is cut short ..."
  void readExactly(void* data, std::size_t size);
  void seek(std::uint64_t position);

 private:
  std::string path_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  int descriptor_ = -1;
};

}  // namespace planar_mapping::io
