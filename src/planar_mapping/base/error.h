// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"

namespace planar_mapping {

/// Base of everything this library throws on purpose.
class PLANAR_MAPPING_EXPORT Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  ~Error() override;
};

/// A parameter outside its range. The message names parameter, value, range and unit.
class PLANAR_MAPPING_EXPORT ParameterError : public Error {
 public:
  using Error::Error;
  ParameterError(const std::string& name, double value, const std::string& range,
                 const std::string& unit = "");
  ~ParameterError() override;
};

/// Input that cannot be used: a missing cloud, an index outside it, sizes that disagree.
class PLANAR_MAPPING_EXPORT InputError : public Error {
 public:
  using Error::Error;
  ~InputError() override;
};

/// A file or directory that cannot be read or written. The message starts with the path.
class PLANAR_MAPPING_EXPORT IoError : public Error {
 public:
  IoError(const std::string& path, const std::string& problem);
  ~IoError() override;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Every problem of a configuration, one `file:line:col: ...` string each.
class PLANAR_MAPPING_EXPORT ConfigError : public Error {
 public:
  explicit ConfigError(std::vector<std::string> problems);
  ~ConfigError() override;
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  std::vector<std::string> problems_;
};

/// No rendering backend, or a picture that could not be drawn.
class PLANAR_MAPPING_EXPORT RenderError : public Error {
 public:
  using Error::Error;
  ~RenderError() override;
};

/// Range checks for params.validate() and setters: NaN is never in range.
/// \throws ParameterError naming \p name, the value, the range and \p unit
PLANAR_MAPPING_EXPORT void requireInRange(const char* name, double value, double low, double high,
                                          const char* unit = "");
/// As requireInRange(), for the open interval (0, infinity).
PLANAR_MAPPING_EXPORT void requirePositive(const char* name, double value, const char* unit = "");

}  // namespace planar_mapping
