// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/output.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "planar_mapping/base/crc32.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLock = ".lock";
constexpr const char* kSaving = ".saving";  ///< a commit that is not complete
constexpr const char* kSaved = ".saved";    ///< one that is, on the way to its place

[[noreturn]] void fail(const std::string& path, const std::string& action, int error_number) {
  throw OutputError(path + ": " + action + ": " + std::generic_category().message(error_number));
}

/// \return whether there was none
bool createDirectory(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_directory(status))
    throw OutputError(path + ": this is a file; name a directory for the results");
  const bool is_new = fs::create_directories(path, error);
  if (error)
    throw OutputError(path + ": the output directory cannot be made: " + error.message() +
                      "; name another");
  return is_new;
}

/// Of a killed process: `.NAME.<pid>-<n>.tmp`.
bool isTemporaryOf(const std::string& file, const std::string& name) {
  const std::string start = "." + name + ".";
  const std::string end = ".tmp";
  if (file.size() <= start.size() + end.size() || file.compare(0, start.size(), start) != 0 ||
      file.compare(file.size() - end.size(), end.size(), end) != 0) {
    return false;
  }
  const std::string middle = file.substr(start.size(), file.size() - start.size() - end.size());
  return middle.find_first_not_of("0123456789-") == std::string::npos;
}

/// Writes a file and reads it back.
void writeChecked(const std::string& folder, const OutputFile& content) {
  const std::string path = folder + content.name;
  struct Checksum {
    std::size_t bytes = 0;
    std::uint32_t crc = 0;
    void add(std::string_view part) {
      bytes += part.size();
      crc = detail::crc32(crc, reinterpret_cast<const std::uint8_t*>(part.data()), part.size());
    }
  } written, found;
  io::AtomicFile file(path, io::Overwrite::Allow);
  content.write([&](std::string_view part) {
    written.add(part);
    file.write(part);
  });
  file.commit();
  io::readFile(path, [&found](std::string_view part) { found.add(part); });
  if (found.crc != written.crc || found.bytes != written.bytes)
    throw OutputError(path + ": what was read back is not what was written; is the disk faulty?");
}

}  // namespace

OutputFile::OutputFile(std::string file, std::string content)
    : OutputFile(std::move(file),
                 [content = std::move(content)](const io::ByteSink& sink) { sink(content); }) {}

OutputFile::OutputFile(std::string file, std::function<void(const io::ByteSink&)> parts)
    : name(std::move(file)), write(std::move(parts)) {}

OutputError::~OutputError() = default;
OutputExistsError::~OutputExistsError() = default;

OutputDirectory::OutputDirectory(const std::string& path, const std::vector<std::string>& names,
                                 bool overwrite)
    : path_(path), is_new_(createDirectory(path)) {
  lock();
  try {
    recover(names);
    for (const std::string& name : names) {
      std::error_code ignored;
      const fs::file_status status = fs::status(pathOf(name), ignored);
      if (!fs::exists(status)) continue;
      if (!overwrite)
        throw OutputExistsError(pathOf(name) +
                                ": exists already; name another directory, or overwrite it "
                                "(--force, in Python overwrite=True)");
      if (!fs::is_regular_file(status))
        throw OutputError(pathOf(name) + ": is not a regular file; name another directory");
    }
  } catch (...) {
    unlock();
    throw;
  }
}

OutputDirectory::~OutputDirectory() {
  unlock();
}

void OutputDirectory::unlock() {
  if (lock_ < 0) return;
  ::unlink(pathOf(kLock).c_str());  // while it is locked: nobody else can have it
  ::close(lock_);
  lock_ = -1;
  if (is_new_) ::rmdir(path_.c_str());  // only where nothing was written to it
}

void OutputDirectory::lock() {
  const std::string file = pathOf(kLock);
  for (;;) {
    lock_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock_ < 0)
      throw OutputError(path_ + ": cannot be written to: " +
                        std::generic_category().message(errno) + "; name another directory");
    const bool locked = ::flock(lock_, LOCK_EX | LOCK_NB) == 0;
    if (!locked && errno == EWOULDBLOCK) {
      ::close(std::exchange(lock_, -1));
      throw OutputExistsError(path_ +
                              ": another run is writing to this directory; wait for it or name "
                              "another directory");
    }
    // The run before may have removed the file between these two calls.
    struct stat ours {};
    struct stat named {};
    const bool same = ::fstat(lock_, &ours) == 0 && ::stat(file.c_str(), &named) == 0 &&
                      ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
    if (same || !locked) return;  // not locked: this file system has no locks
    ::close(std::exchange(lock_, -1));
  }
}

void OutputDirectory::recover(const std::vector<std::string>& names) const {
  std::error_code error;
  fs::remove_all(pathOf(kSaving), error);
  if (error) fail(pathOf(kSaving), "cannot be removed", error.value());
  for (const auto& entry : fs::directory_iterator(path_, error)) {
    const std::string file = entry.path().filename().string();
    const auto isOurs = [&file](const std::string& name) { return isTemporaryOf(file, name); };
    if (std::any_of(names.begin(), names.end(), isOurs)) fs::remove(entry.path(), error);
  }
  if (fs::exists(pathOf(kSaved), error)) moveIntoPlace();
}

void OutputDirectory::write(const std::string& name, std::string_view content) const {
  detail::writingResult(
      [&]() { io::writeFileAtomically(pathOf(name), content, io::Overwrite::Allow); });
}

void OutputDirectory::commit(const std::vector<OutputFile>& files) const {
  const std::string saving = pathOf(kSaving) + "/";
  try {
    std::error_code error;
    fs::create_directory(saving, error);
    if (error) fail(saving, "cannot be made", error.value());
    for (const OutputFile& file : files) writeChecked(saving, file);
    if (std::rename(saving.c_str(), pathOf(kSaved).c_str()) != 0)
      fail(path_, "cannot be written", errno);
  } catch (const Error& problem) {
    std::error_code ignored;
    fs::remove_all(saving, ignored);
    throw OutputError(problem.what());
  }
  try {
    io::syncDirectory(path_);
    moveIntoPlace();
  } catch (const Error& problem) {
    throw OutputError(std::string(problem.what()) +
                      "; all files of the result are whole, the next run in this directory moves "
                      "them to their places");
  }
}

void OutputDirectory::moveIntoPlace() const {
  const std::string saved = pathOf(kSaved) + "/";
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(saved, error))
    names.push_back(entry.path().filename().string());
  if (error) fail(saved, "cannot be read", error.value());
  for (const std::string& name : names) {
    if (std::rename((saved + name).c_str(), pathOf(name).c_str()) != 0)
      fail(pathOf(name), "cannot be written", errno);
  }
  io::syncDirectory(path_);
  fs::remove(saved, error);
  if (error) fail(saved, "cannot be removed", error.value());
}

void OutputDirectory::removeOthers(const std::string& prefix,
                                   const std::vector<OutputFile>& files) const {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path_, error)) {
    const std::string name = entry.path().filename().string();
    const bool is_new = std::any_of(files.begin(), files.end(),
                                    [&name](const OutputFile& file) { return file.name == name; });
    std::error_code ignored;
    if (name.compare(0, prefix.size(), prefix) == 0 && !is_new) fs::remove(entry.path(), ignored);
  }
}

std::string OutputDirectory::pathOf(const std::string& name) const {
  return (fs::path(path_) / name).string();
}

}  // namespace planar_mapping
