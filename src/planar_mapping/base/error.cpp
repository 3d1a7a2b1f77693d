// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/base/error.h"

#include <cmath>
#include <limits>
#include <sstream>

#include "planar_mapping/base/number_text.h"

namespace planar_mapping {
namespace {

std::string withUnit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + " " + unit;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += (all.empty() ? "" : "\n") + line;
  return all;
}

}  // namespace

std::string detail::numberText(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << value;
  return out.str();
}

// Defined here so that each type has one vtable and is caught across shared libraries.
Error::~Error() = default;
ParameterError::~ParameterError() = default;
InputError::~InputError() = default;
IoError::~IoError() = default;
ConfigError::~ConfigError() = default;
RenderError::~RenderError() = default;

ParameterError::ParameterError(const std::string& name, double value, const std::string& range,
                               const std::string& unit)
    : Error(name + " = " + withUnit(detail::numberText(value), unit) +
            " is out of range, allowed: " + withUnit(range, unit)) {}

IoError::IoError(const std::string& path, const std::string& problem)
    : Error(path + ": " + problem), path_(path) {}

ConfigError::ConfigError(std::vector<std::string> problems)
    : Error(joined(problems)), problems_(std::move(problems)) {}

void requireInRange(const char* name, double value, double low, double high, const char* unit) {
  if (value >= low && value <= high) return;
  const std::string range =
      std::isinf(high) ? ">= " + detail::numberText(low)
                       : "[" + detail::numberText(low) + ", " + detail::numberText(high) + "]";
  throw ParameterError(name, value, range, unit);
}

void requirePositive(const char* name, double value, const char* unit) {
  if (value > 0.0 && value <= std::numeric_limits<double>::max()) return;
  throw ParameterError(name, value, "> 0", unit);
}

}  // namespace planar_mapping
