// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <system_error>

#include "planar_mapping/base/error.h"

namespace planar_mapping::io {

InputFile::InputFile(const std::string& path) : path_(path) {
  // Asked before opening: opening a pipe without a writer would wait for ever.
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0)
    throw IoError(path, errno == ENOENT
                            ? "no such file"
                            : "cannot be read: " + std::generic_category().message(errno));
  if (S_ISDIR(status.st_mode)) throw IoError(path, "is a directory, not a file");
  if (!S_ISREG(status.st_mode)) throw IoError(path, "is not a regular file");
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0)
    throw IoError(path, "cannot be read: " + std::generic_category().message(errno));
  size_ = static_cast<std::uint64_t>(status.st_size);
  // What a clone without Git LFS has in place of a large file.
  constexpr std::string_view kPointer = "version https://git-lfs";
  char first[kPointer.size()] = {};
  if (::pread(descriptor_, first, sizeof first, 0) == sizeof first &&
      kPointer == std::string_view(first, sizeof first)) {
    ::close(descriptor_);
    throw IoError(path, "is a pointer of Git LFS, not the file itself: git lfs pull fetches it");
  }
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::size_t InputFile::read(void* data, std::size_t size) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t count = ::pread(descriptor_, static_cast<char*>(data) + done, size - done,
                                  static_cast<off_t>(position_));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      throw IoError(path_, "cannot be read: " + std::generic_category().message(errno));
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
    position_ += static_cast<std::uint64_t>(count);
  }
  return done;
}

void InputFile::readExactly(void* data, std::size_t size) {
  if (read(data, size) != size) throw IoError(path_, "is cut short");
}

void InputFile::seek(std::uint64_t position) {
  position_ = position;
}

}  // namespace planar_mapping::io
