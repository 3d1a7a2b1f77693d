// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/base/spelling.h"

#include "planar_mapping/pipeline/yaml_source.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <sstream>

namespace planar_mapping::detail {
namespace {

constexpr int kMaxNodes = 100000;
constexpr int kMaxDepth = 32;

template <typename Number>
bool parse(const std::string& text, Number& value) {
  const char* first = text.data() + (!text.empty() && text.front() == '+' ? 1 : 0);
  const char* last = text.data() + text.size();
  const auto result = std::from_chars(first, last, value);
  return result.ec == std::errc() && result.ptr == last;
}

/// Decimal numbers only: from_chars also takes "nan", "inf" and so would we.
bool parseNumber(const std::string& text, double& value) {
  return text.find_first_not_of("0123456789+-.eE") == std::string::npos && parse(text, value) &&
         std::isfinite(value);
}

/// A scalar without quotes.
bool isPlain(const YAML::Node& node) {
  return node.Tag() != "!";
}

std::string defaultOf(const Parameter& parameter) {
  return "; default " + toYaml(parameter.get());
}

// Both return false: the value cannot be read.
bool reportType(const Parameter& parameter, const YAML::Node& node, const std::string& wanted,
                const Report& report) {
  const std::string size = node.IsSequence() ? " of " + std::to_string(node.size()) : "";
  report(parameter.name + " must be " + wanted + ", not " + describe(node) + size +
         "; allowed: " + parameter.allowed() + defaultOf(parameter));
  return false;
}
bool reportRange(const Parameter& parameter, const std::string& text, const Report& report) {
  report(parameter.name + " = " + text + " is out of range; allowed: " + parameter.allowed() +
         defaultOf(parameter));
  return false;
}

bool readVector(const Parameter& parameter, const YAML::Node& node, ParameterValue& value,
                const Report& report) {
  Vector3 vector = Vector3::Zero();
  bool sound = node.IsSequence() && node.size() == 3;
  for (int i = 0; sound && i < 3; ++i) {
    const YAML::Node item = node[static_cast<std::size_t>(i)];
    sound = item.IsScalar() && isPlain(item) && parseNumber(item.Scalar(), vector[i]);
  }
  if (!sound) return reportType(parameter, node, "three numbers [x, y, z]", report);
  if (!parameter.isPoint() && !(vector.norm() > 0.0))
    return reportRange(parameter, "[0, 0, 0]", report);
  value = vector;
  return true;
}

bool readWord(const Parameter& parameter, const std::string& text, ParameterValue& value,
              const Report& report) {
  const auto& words = parameter.words;
  if (std::find(words.begin(), words.end(), text) == words.end()) {
    report(parameter.name + " cannot be '" + text + "'" + didYouMean(text, words) +
           (didYouMean(text, words).empty() ? "; " : " ") + "allowed: " + parameter.allowed() +
           defaultOf(parameter));
    return false;
  }
  value = text;
  return true;
}

/// Counts what a text holds before memory is taken for it. \throws YAML::Exception
class DocumentGuard : public YAML::EventHandler {
 public:
  YAML::Mark start;      ///< of the last document
  bool is_empty = true;  ///< so far

  void OnDocumentStart(const YAML::Mark& mark) override { start = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { count(mark, 0, false); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { count(mark, 0, true); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string&) override {
    count(mark, 0, true);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    count(mark, 1, true);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    count(mark, 1, true);
  }
  void OnMapEnd() override { --depth_; }

 private:
  void count(const YAML::Mark& mark, int levels, bool has_content) {
    depth_ += levels;
    is_empty = is_empty && !has_content;
    if (++nodes_ > kMaxNodes || depth_ > kMaxDepth)
      throw YAML::ParserException(mark, "there are more than 100,000 values or 32 levels");
  }
  int nodes_ = 0;
  int depth_ = 0;
};

}  // namespace

void ProblemList::add(const YAML::Mark& mark, const std::string& text) {
  const int line = std::max(mark.line, 0) + 1;
  const int column = std::max(mark.column, 0) + 1;
  problems_.push_back(
      {line, column,
       file_ + ":" + std::to_string(line) + ":" + std::to_string(column) + ": " + text});
}

Report ProblemList::elsewhere(const std::string& where) {
  return [this, where](const std::string& text) {
    problems_.push_back({std::numeric_limits<int>::max(), 0, where + ": " + text});
  };
}

std::vector<std::string> ProblemList::sorted() const {
  std::vector<Problem> ordered = problems_;
  std::stable_sort(ordered.begin(), ordered.end(), [](const Problem& a, const Problem& b) {
    return a.line != b.line ? a.line < b.line : a.column < b.column;
  });
  std::vector<std::string> lines;
  for (const Problem& problem : ordered) lines.push_back(problem.text);
  return lines;
}

YAML::Node loadDocument(const std::string& text, ProblemList& problems) {
  const YAML::Node nothing(YAML::NodeType::Undefined);
  try {
    // YAML::LoadAll() does not end where a document takes nothing from the text, as in ",".
    std::istringstream in(text);
    YAML::Parser parser(in);
    DocumentGuard guard;
    if (parser.HandleNextDocument(guard) && !guard.is_empty && parser.HandleNextDocument(guard)) {
      problems.add(guard.start, "a configuration is one YAML document, here is a second");
      return nothing;
    }
    const YAML::Node document = YAML::Load(text);
    if (!document.IsNull()) return document;
  } catch (const YAML::Exception& error) {
    problems.add(error.mark, "this is no YAML: " + error.msg);
    return nothing;
  }
  problems.add(YAML::Mark(), "the configuration is empty; it starts with 'version: 1'");
  return nothing;
}

std::vector<std::pair<YAML::Node, YAML::Node>> entriesOf(const YAML::Node& mapping,
                                                         const std::string& what,
                                                         ProblemList& problems) {
  std::vector<std::pair<YAML::Node, YAML::Node>> entries;
  std::map<std::string, int> first_line;
  for (const auto& entry : mapping) {
    if (!entry.first.IsScalar()) {
      problems.add(entry.first.Mark(), what + ": a key must be a word");
      continue;
    }
    const std::string& key = entry.first.Scalar();
    const auto inserted = first_line.emplace(key, entry.first.Mark().line + 1);
    if (!inserted.second) {
      problems.add(entry.first.Mark(), what + ": key '" + key +
                                           "' stands here a second time; the "
                                           "first is in line " +
                                           std::to_string(inserted.first->second));
      continue;
    }
    entries.emplace_back(entry.first, entry.second);
  }
  return entries;
}

std::string describe(const YAML::Node& node) {
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list";
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  constexpr std::size_t kLongest = 60;
  const std::string& text = node.Scalar();
  return "'" + (text.size() > kLongest ? text.substr(0, kLongest) + "..." : text) + "'";
}

bool readValue(const Parameter& parameter, const YAML::Node& node, ParameterValue& value,
               const Report& report) {
  if (parameter.automatic && node.IsScalar() && isPlain(node) && node.Scalar() == "auto") {
    value = std::monostate{};
    return true;
  }
  if (parameter.type == ParameterType::Vector) return readVector(parameter, node, value, report);
  const bool is_text =
      parameter.type == ParameterType::Text || parameter.type == ParameterType::Word;
  const std::string text = node.IsScalar() ? node.Scalar() : "";
  if (!node.IsScalar() || (!is_text && !isPlain(node))) {
    const std::string wanted = is_text                                    ? "a word"
                               : parameter.type == ParameterType::Flag    ? "true or false"
                               : parameter.type == ParameterType::Integer ? "an integer"
                                                                          : "a number";
    return reportType(parameter, node, wanted, report);
  }
  switch (parameter.type) {
    case ParameterType::Text:
      value = text;
      return true;
    case ParameterType::Word:
      return readWord(parameter, text, value, report);
    case ParameterType::Flag:
      if (text != "true" && text != "false")
        return reportType(parameter, node, "true or false", report);
      value = text == "true";
      return true;
    case ParameterType::Integer: {
      std::int64_t number = 0;
      if (!parse(text, number)) return reportType(parameter, node, "an integer", report);
      constexpr auto kLargest = std::numeric_limits<int>::max();
      const Range& range = parameter.range;
      value = number;
      return ((number <= kLargest || !std::isinf(range.high)) && number >= -kLargest &&
              range.contains(static_cast<double>(number))) ||
             reportRange(parameter, text, report);
    }
    case ParameterType::Number: {
      double number = 0.0;
      if (!parseNumber(text, number)) return reportType(parameter, node, "a finite number", report);
      value = number;
      return parameter.range.contains(number) || reportRange(parameter, text, report);
    }
    case ParameterType::Vector:
      break;
  }
  return false;
}

}  // namespace planar_mapping::detail
