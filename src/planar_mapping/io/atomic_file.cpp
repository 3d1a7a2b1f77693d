// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include "planar_mapping/io/input_file.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 18;
constexpr int kAttempts = 1000;

std::string directoryOf(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

/// Renames without replacing; false if \p to exists.
bool renameIfAbsent(const std::string& from, const std::string& to) {
#ifdef RENAME_NOREPLACE
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno == EEXIST) return false;
  if (errno != EINVAL && errno != ENOSYS)
    throw IoError(to, "cannot be written: " + std::generic_category().message(errno));
#endif
  // File systems without that call know hard links, which never replace either.
  if (::link(from.c_str(), to.c_str()) == 0) {
    ::unlink(from.c_str());
    return true;
  }
  if (errno == EEXIST) return false;
  struct stat status {};
  if (::lstat(to.c_str(), &status) == 0) return false;
  if (std::rename(from.c_str(), to.c_str()) != 0)
    throw IoError(to, "cannot be written: " + std::generic_category().message(errno));
  return true;
}

}  // namespace

FileExistsError::FileExistsError(const std::string& path)
    : IoError(path, "exists already and is not overwritten (--force, in Python overwrite=True)") {}
FileExistsError::~FileExistsError() = default;

AtomicFile::AtomicFile(const std::string& path, Overwrite overwrite)
    : path_(path), directory_(directoryOf(path)), overwrite_(overwrite) {
  const std::string name = path.substr(path.find_last_of('/') + 1);
  if (name.empty() || name == "." || name == "..") throw IoError(path, "does not name a file");
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) throw IoError(path, "is a directory");
    if (!S_ISREG(status.st_mode)) throw IoError(path, "is not a regular file");
    if (overwrite == Overwrite::Refuse) throw FileExistsError(path);
  }
  static std::atomic<unsigned> counter{0};
  for (int attempt = 0; descriptor_ < 0; ++attempt) {
    temporary_path_ = directory_ + "/." + name + "." + std::to_string(::getpid()) + "-" +
                      std::to_string(counter.fetch_add(1)) + ".tmp";
    descriptor_ = ::open(temporary_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0 && (errno != EEXIST || attempt >= kAttempts))
      fail("cannot be created", errno);
  }
  buffer_.reserve(kBufferSize);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_path_.c_str());
}

void AtomicFile::fail(const char* action, int error_number) const {
  throw IoError(path_, std::string(action) + ": " + std::generic_category().message(error_number));
}

void AtomicFile::writeAll(const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t count = ::write(descriptor_, data, size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail("cannot be written", errno);
    data += count;
    size -= static_cast<std::size_t>(count);
  }
}

void AtomicFile::flush() {
  writeAll(buffer_.data(), buffer_.size());
  buffer_.clear();
}

void AtomicFile::write(const void* data, std::size_t size) {
  const char* bytes = static_cast<const char*>(data);
  if (buffer_.size() + size > kBufferSize) flush();
  if (size >= kBufferSize) {
    writeAll(bytes, size);
  } else {
    buffer_.insert(buffer_.end(), bytes, bytes + size);
  }
}

std::vector<std::uint8_t> AtomicFile::readBack() {
  flush();
  return readWholeFile(temporary_path_);
}

void AtomicFile::commit() {
  flush();
  if (::fsync(descriptor_) != 0) fail("cannot be written", errno);
  if (overwrite_ == Overwrite::Allow) {
    if (std::rename(temporary_path_.c_str(), path_.c_str()) != 0) fail("cannot be written", errno);
  } else if (!renameIfAbsent(temporary_path_, path_)) {
    throw FileExistsError(path_);
  }
  const int done = descriptor_;
  descriptor_ = -1;
  // Some network file systems report a full disk only here.
  if (::close(done) != 0 && errno != EINTR) fail("cannot be written", errno);
  syncDirectory(directory_);
}

void syncDirectory(const std::string& path) {
  const int directory = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory < 0) return;
  const bool failed = ::fsync(directory) != 0 && errno == EIO;
  ::close(directory);
  if (failed) throw IoError(path, "cannot be written: " + std::generic_category().message(EIO));
}

void writeFileAtomically(const std::string& path, const void* data, std::size_t size,
                         Overwrite overwrite) {
  AtomicFile file(path, overwrite);
  file.write(data, size);
  file.commit();
}

void writeFileAtomically(const std::string& path, std::string_view text, Overwrite overwrite) {
  writeFileAtomically(path, text.data(), text.size(), overwrite);
}

std::vector<std::uint8_t> readWholeFile(const std::string& path, std::size_t largest_size) {
  InputFile file(path);
  if (file.size() > largest_size)
    throw IoError(path, "is larger than the " + std::to_string(largest_size) + " bytes expected");
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(file.size()));
  file.readExactly(bytes.data(), bytes.size());
  return bytes;
}

std::string readWholeText(const std::string& path, std::size_t largest_size) {
  const std::vector<std::uint8_t> bytes = readWholeFile(path, largest_size);
  return {bytes.begin(), bytes.end()};
}

void readFile(const std::string& path, const ByteSink& sink) {
  InputFile file(path);
  std::vector<char> part(kBufferSize);
  while (const std::size_t size = file.read(part.data(), part.size())) sink({part.data(), size});
}

}  // namespace planar_mapping::io
