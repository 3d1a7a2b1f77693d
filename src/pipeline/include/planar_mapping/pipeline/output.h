// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/base/export.h"

namespace planar_mapping {

/// The result cannot be written; the message starts with the path.
class PLANAR_MAPPING_EXPORT OutputError : public Error {
 public:
  using Error::Error;
  ~OutputError() override;
};

/// The directory was written to before and --force was not given.
class PLANAR_MAPPING_EXPORT OutputExistsError : public OutputError {
 public:
  using OutputError::OutputError;
  ~OutputExistsError() override;
};

/// The directory a run writes to. Files appear whole or not at all.
class PLANAR_MAPPING_EXPORT OutputDirectory {
 public:
  /// Makes the directory and tries whether it can be written, before any work is done.
  /// \param names     files that are going to be written
  /// \param overwrite whether they may exist
  /// \throws OutputExistsError, OutputError
  OutputDirectory(const std::string& path, const std::vector<std::string>& names, bool overwrite);

  /// \throws OutputError; an earlier file of that name is then as it was
  void write(const std::string& name, std::string_view content) const;
  std::string pathOf(const std::string& name) const;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace planar_mapping
