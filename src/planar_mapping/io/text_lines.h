// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/io/input_file.h"

namespace planar_mapping::io {

/// Up to four numbers with a text between them.
struct NumberList {
  std::size_t count;
  const char* separator;
  std::array<double, 4> values;
};
inline NumberList listOf(const Vector3& v, const char* separator = " ") {
  return {3, separator, {v.x(), v.y(), v.z()}};
}
/// x, y, z, w.
inline NumberList listOf(const Quaternion& q, const char* separator = " ") {
  return {4, separator, {q.x(), q.y(), q.z(), q.w()}};
}

inline void appendPart(std::string& out, std::string_view text) {
  out += text;
}
inline void appendPart(std::string& out, char c) {
  out += c;
}
/// Shortest text that reads back as the same value; std::to_chars knows no locale.
template <typename Number, std::enable_if_t<std::is_arithmetic_v<Number>, int> = 0>
void appendPart(std::string& out, Number value) {
  char text[40];
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
  out.append(text, end.ptr);
}
inline void appendPart(std::string& out, const NumberList& list) {
  for (std::size_t i = 0; i < list.count; ++i) {
    if (i > 0) out += list.separator;
    appendPart(out, list.values[i]);
  }
}
/// Texts and numbers, one after the other.
template <typename... Parts>
void append(std::string& out, const Parts&... parts) {
  (appendPart(out, parts), ...);
}
template <typename... Parts>
std::string concatenated(const Parts&... parts) {
  std::string text;
  append(text, parts...);
  return text;
}

/// Lines of a file, read in blocks: an ascii cloud of gigabytes never lies in memory as text.
class LineReader {
 public:
  /// \param longest_line  bytes; a longer one is an IoError (a binary file taken for text)
  LineReader(InputFile& file, std::size_t longest_line);

  /// The next line without its end (LF or CR LF), valid until the next call; false at the end.
  bool next(std::string_view& line);
  /// Number of the last line, counted from 1.
  std::size_t number() const { return number_; }
  /// Where in the file the next line begins.
  std::uint64_t position() const { return file_.position() - (end_ - begin_); }
  void setLongestLine(std::size_t bytes) { longest_line_ = bytes; }

 private:
  bool fill();

  InputFile& file_;
  std::size_t longest_line_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t number_ = 0;
};

/// Takes the next word (separated by blanks and tabs) from the front of \p text; empty at its end.
inline std::string_view takeWord(std::string_view& text) {
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end && (*p == ' ' || *p == '\t' || *p == '\r')) ++p;
  const char* const word = p;
  while (p != end && *p != ' ' && *p != '\t' && *p != '\r') ++p;
  text = std::string_view(p, static_cast<std::size_t>(end - p));
  return {word, static_cast<std::size_t>(p - word)};
}

using Words = std::vector<std::string_view>;

Words splitWords(std::string_view text);

/// Numbers as text, whatever the locale; the whole word must be the number. "nan" and "inf" are.
bool parseNumber(std::string_view word, float& value);
bool parseNumber(std::string_view word, double& value);
bool parseNumber(std::string_view word, std::uint64_t& value);

/// A rotation that was written with few digits, made exact; one of full precision stays as it is.
/// Nothing for a matrix that is no rotation.
std::optional<Matrix3> rotationOf(const Matrix3& R);
/// The pose [R t]; nothing where R is no rotation.
std::optional<Pose> poseOf(const Eigen::Matrix<double, 3, 4>& rows);
/// The pose of a position and a quaternion, which is normalised.
Pose poseOf(const Vector3& position, const Eigen::Quaterniond& rotation);

/// For writers: readers refuse other poses. \param what  whose pose, for the message
/// \throws InputError unless the pose is finite and its rotation is one
void requirePose(const Pose& pose, const std::string& what);

[[noreturn]] void failAtLine(const std::string& path, std::size_t line, const std::string& problem);

/// \p word fit for an error message: printable and not long.
std::string quoted(std::string_view word);
/// Rather than std::quoted.
inline std::string quoted(const std::string& word) {
  return quoted(std::string_view(word));
}

/// Calls \p visit with the words of each line that is not empty, and the number of the line; what
/// follows a # is left out.
/// \param separators  characters between words beside blanks and tabs
void forEachLine(const std::string& path, const std::string& separators,
                 const std::function<void(const Words&, std::size_t)>& visit);
/// \throws IoError naming path and line
double finiteNumber(std::string_view word, const std::string& path, std::size_t line);
/// As many finite numbers as there are in \p values.
void finiteNumbers(const Words& words, std::size_t first, double* values, std::size_t count,
                   const std::string& path, std::size_t line);

}  // namespace planar_mapping::io
