// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping {

/// The result cannot be written; the message starts with the path.
class PLANAR_MAPPING_EXPORT OutputError : public Error {
 public:
  using Error::Error;
  ~OutputError() override;
};

namespace detail {

/// Does what writes a result: what cannot be written is a fault of the output.
/// \throws OutputError in place of IoError
template <typename Write>
auto writingResult(const Write& write) {
  try {
    return write();
  } catch (const IoError& error) {
    throw OutputError(error.what());
  }
}

}  // namespace detail

/// The directory was written to before and --force was not given.
class PLANAR_MAPPING_EXPORT OutputExistsError : public OutputError {
 public:
  using OutputError::OutputError;
  ~OutputExistsError() override;
};

/// A file of a result.
struct OutputFile {
  OutputFile(std::string file, std::string content);
  /// \param parts hands its content to a sink
  OutputFile(std::string file, std::function<void(const io::ByteSink&)> parts);

  std::string name;
  std::function<void(const io::ByteSink&)> write;
};

/// The directory a run writes to, which is locked for as long as the object lives.
///
/// commit() replaces a set of files at once: whenever the process is killed or the power fails, the
/// directory has, after the next OutputDirectory was made of it, all of the new files or all of the
/// old ones. New files are written to the folder `.saving`, flushed and read back; renaming that to
/// `.saved` is the commit; then each file is moved to its place, which the next run does if this
/// one cannot.
class PLANAR_MAPPING_EXPORT OutputDirectory {
 public:
  /// Makes and locks the directory, ends a commit that was cut off, removes temporary files of
  /// killed runs, all before any work is done.
  /// \param names     files that are going to be written
  /// \param overwrite whether they may exist
  /// \throws OutputExistsError also where another run has the lock; OutputError
  OutputDirectory(const std::string& path, const std::vector<std::string>& names, bool overwrite);
  ~OutputDirectory();
  OutputDirectory(const OutputDirectory&) = delete;
  OutputDirectory& operator=(const OutputDirectory&) = delete;

  /// One file. \throws OutputError; an earlier file of that name is then as it was
  void write(const std::string& name, std::string_view content) const;
  /// All these files, or none.
  /// \throws OutputError; the earlier files are then as they were, unless the message says that the
  ///         new ones are going to be moved to their places
  void commit(const std::vector<OutputFile>& files) const;
  /// Removes files whose names begin so and that are not among these; what cannot be stays.
  void removeOthers(const std::string& prefix, const std::vector<OutputFile>& files) const;
  std::string pathOf(const std::string& name) const;
  const std::string& path() const { return path_; }

 private:
  void lock();
  void unlock();
  void recover(const std::vector<std::string>& names) const;
  void moveIntoPlace() const;

  std::string path_;
  bool is_new_ = false;
  int lock_ = -1;  ///< descriptor
};

}  // namespace planar_mapping
