// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/parameter.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <type_traits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"

namespace planar_mapping {
namespace {

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Radians of a default to degrees a person would write: 4.99999999999999 becomes 5.
double toFile(double value, double factor) {
  if (factor == 1.0) return value;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.12g", value / factor);
  return std::strtod(text.data(), nullptr);
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' ? "\\n" : std::string(1, c);
  }
  return out + "\"";
}

/// Plain scalars need no quotes; anything that YAML could read otherwise gets them.
std::string textToYaml(const std::string& text) {
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || c == '_' || c == '-';
    if (!plain) return quoted(text);
  }
  const bool reserved = text.empty() || text.front() == '-' || text == "auto" || text == "true" ||
                        text == "false" || text == "yes" || text == "no" || text == "on" ||
                        text == "off" || text == "null" || text == "y" || text == "n";
  return reserved ? quoted(text) : text;
}

/// \tparam Stored  the alternative of ParameterValue that holds it
template <typename Stored, typename Value>
void bind(Parameter& parameter, Value& value) {
  parameter.get = [&value]() -> ParameterValue { return static_cast<Stored>(value); };
  parameter.set = [&value](const ParameterValue& v) {
    value = static_cast<Value>(std::get<Stored>(v));
  };
}

template <typename Stored, typename Value>
void bind(Parameter& parameter, std::optional<Value>& value) {
  parameter.automatic = true;
  parameter.get = [&value]() -> ParameterValue {
    if (!value) return std::monostate{};
    return static_cast<Stored>(*value);
  };
  parameter.set = [&value](const ParameterValue& v) {
    value.reset();
    if (const auto* stored = std::get_if<Stored>(&v)) value = static_cast<Value>(*stored);
  };
}

/// \tparam Value  double or std::optional<double>
template <typename Value>
void bindNumber(Parameter& parameter, Value& value) {
  parameter.automatic = !std::is_same_v<Value, double>;
  const double factor = endsWith(parameter.name, "_deg") ? kRadiansPerDegree : 1.0;
  const auto current = [&value]() { return std::optional<double>(value); };
  // What the file said is kept, for no rounding of value / factor gives it back for certain. The
  // default goes through the file's unit too, so that writing and reading it changes no bit.
  const auto written = std::make_shared<double>(toFile(current().value_or(0.0), factor));
  if (current()) value = *written * factor;
  parameter.get = [current, factor, written]() -> ParameterValue {
    const std::optional<double> now = current();
    if (!now) return std::monostate{};
    return *now == *written * factor ? *written : toFile(*now, factor);
  };
  parameter.set = [&value, factor, written](const ParameterValue& v) {
    value = Value();
    if (const auto* number = std::get_if<double>(&v)) {
      *written = *number;
      value = *number * factor;
    }
  };
}

}  // namespace

std::string formatNumber(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  std::array<char, 64> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

std::string Range::text() const {
  if (std::isinf(low) && std::isinf(high)) return "any number";
  if (std::isinf(high)) return (low_open ? "> " : ">= ") + formatNumber(low);
  if (std::isinf(low)) return "<= " + formatNumber(high);
  return (low_open ? "(" : "[") + formatNumber(low) + ", " + formatNumber(high) + "]";
}

std::string Parameter::unit() const {
  for (const char* unit : {"m", "deg", "s", "px"})
    if (endsWith(name, std::string("_") + unit)) return unit;
  return "";
}

std::string Parameter::allowed() const {
  const std::string end = automatic ? ", or auto" : "";
  switch (type) {
    case ParameterType::Flag:
      return "true or false" + end;
    case ParameterType::Integer:
      return "an integer" + (std::isinf(range.low) ? std::string() : " " + range.text()) + end;
    case ParameterType::Number:
      return range.text() + (unit().empty() ? "" : " " + unit()) + end;
    case ParameterType::Text:
      return "text" + end;
    case ParameterType::Vector:
      return (isPoint() ? "three numbers [x, y, z]" : "three numbers [x, y, z], not all zero") +
             end;
    case ParameterType::Word:
      break;
  }
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) list += i + 1 == words.size() ? " or " : ", ";
    list += words[i];
  }
  return list + end;
}

Parameter& ParameterTable::add(const std::string& name, ParameterType type, const Range& range,
                               const std::string& meaning) {
  Parameter& parameter = parameters_.emplace_back();
  parameter.name = name;
  parameter.type = type;
  parameter.range = range;
  parameter.meaning = meaning;
  return parameter;
}

void ParameterTable::flag(const std::string& name, bool& value, const std::string& meaning) {
  bind<bool>(add(name, ParameterType::Flag, Range::any(), meaning), value);
}

void ParameterTable::integer(const std::string& name, int& value, const Range& range,
                             const std::string& meaning) {
  bind<std::int64_t>(add(name, ParameterType::Integer, range, meaning), value);
}

void ParameterTable::integer(const std::string& name, std::int64_t& value, const Range& range,
                             const std::string& meaning) {
  bind<std::int64_t>(add(name, ParameterType::Integer, range, meaning), value);
}

void ParameterTable::integer(const std::string& name, std::optional<int>& value, const Range& range,
                             const std::string& meaning) {
  bind<std::int64_t>(add(name, ParameterType::Integer, range, meaning), value);
}

void ParameterTable::number(const std::string& name, double& value, const Range& range,
                            const std::string& meaning) {
  bindNumber(add(name, ParameterType::Number, range, meaning), value);
}

void ParameterTable::number(const std::string& name, std::optional<double>& value,
                            const Range& range, const std::string& meaning) {
  bindNumber(add(name, ParameterType::Number, range, meaning), value);
}

void ParameterTable::text(const std::string& name, std::string& value, const std::string& meaning) {
  bind<std::string>(add(name, ParameterType::Text, Range::any(), meaning), value);
}

void ParameterTable::vector(const std::string& name, Vector3& value, const std::string& meaning) {
  bind<Vector3>(add(name, ParameterType::Vector, Range::any(), meaning), value);
}

void ParameterTable::vector(const std::string& name, std::optional<Vector3>& value,
                            const std::string& meaning) {
  bind<Vector3>(add(name, ParameterType::Vector, Range::any(), meaning), value);
}

void ParameterTable::addWord(const std::string& name, std::vector<std::string> words,
                             const std::string& meaning, std::function<std::string()> get,
                             std::function<void(const std::string&)> set) {
  Parameter& parameter = add(name, ParameterType::Word, Range::any(), meaning);
  parameter.words = std::move(words);
  parameter.get = [get = std::move(get)]() -> ParameterValue { return get(); };
  parameter.set = [set = std::move(set)](const ParameterValue& v) {
    set(std::get<std::string>(v));
  };
}

void ParameterTable::basic(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const auto of_name = [&](const Parameter& parameter) { return parameter.name == name; };
    const auto found = std::find_if(parameters_.begin(), parameters_.end(), of_name);
    if (found == parameters_.end()) throw InputError("there is no parameter '" + name + "'");
    found->basic = true;
  }
}

const Parameter* ParameterTable::find(const std::string& name) const {
  for (const Parameter& parameter : parameters_)
    if (parameter.name == name) return &parameter;
  return nullptr;
}

std::string toYaml(const ParameterValue& value) {
  struct Writer {
    std::string operator()(std::monostate) const { return "auto"; }
    std::string operator()(bool flag) const { return flag ? "true" : "false"; }
    std::string operator()(std::int64_t number) const { return std::to_string(number); }
    std::string operator()(double number) const { return formatNumber(number); }
    std::string operator()(const std::string& text) const { return textToYaml(text); }
    std::string operator()(const Vector3& v) const {
      return "[" + formatNumber(v.x()) + ", " + formatNumber(v.y()) + ", " + formatNumber(v.z()) +
             "]";
    }
  };
  return std::visit(Writer{}, value);
}

}  // namespace planar_mapping
