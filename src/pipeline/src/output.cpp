// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/output.h"

#include <filesystem>

#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

void createDirectory(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_directory(status)) {
    throw OutputError(path + ": this is a file; name a directory for the results (-o DIR)");
  }
  fs::create_directories(path, error);
  if (error) {
    throw OutputError(path + ": the output directory cannot be made: " + error.message() +
                      "; name another with -o DIR");
  }
}

}  // namespace

OutputError::~OutputError() = default;
OutputExistsError::~OutputExistsError() = default;

OutputDirectory::OutputDirectory(const std::string& path, const std::vector<std::string>& names,
                                 bool overwrite)
    : path_(path) {
  createDirectory(path);
  if (!overwrite) {
    for (const std::string& name : names) {
      std::error_code ignored;
      if (fs::exists(pathOf(name), ignored)) {
        throw OutputExistsError(pathOf(name) +
                                ": exists already; give --force to overwrite it or "
                                "another directory with -o DIR");
      }
    }
  }
  try {
    // Opens a temporary file and removes it again.
    const io::AtomicFile probe(pathOf(names.front()), io::Overwrite::Allow);
  } catch (const IoError& error) {
    throw OutputError(std::string(error.what()) + "; name another directory with -o DIR");
  }
}

void OutputDirectory::write(const std::string& name, std::string_view content) const {
  try {
    io::writeFileAtomically(pathOf(name), content, io::Overwrite::Allow);
  } catch (const IoError& error) {
    throw OutputError(error.what());
  }
}

std::string OutputDirectory::pathOf(const std::string& name) const {
  return (fs::path(path_) / name).string();
}

}  // namespace planar_mapping
