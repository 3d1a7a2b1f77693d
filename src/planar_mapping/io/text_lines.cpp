// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/text_lines.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 18;
constexpr std::size_t kLongestQuote = 40;
constexpr std::size_t kLongestLine = 4096;

template <typename T>
std::errc parse(std::string_view word, T& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(word.data(), end, value);
  if (result.ec == std::errc() && result.ptr != end) return std::errc::invalid_argument;
  return result.ec;
}

}  // namespace

LineReader::LineReader(InputFile& file, std::size_t longest_line)
    : file_(file),
      longest_line_(longest_line),
      buffer_(static_cast<std::size_t>(std::clamp<std::uint64_t>(file.size(), 1, kBlock))) {}

bool LineReader::fill() {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (end_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
  const std::size_t count = file_.read(buffer_.data() + end_, buffer_.size() - end_);
  end_ += count;
  return count > 0;
}

bool LineReader::next(std::string_view& line) {
  std::size_t searched = 0;
  for (;;) {
    const char* const first = buffer_.data() + begin_;
    const std::size_t available = end_ - begin_;
    const void* newline = std::memchr(first + searched, '\n', available - searched);
    std::size_t length = available;
    if (newline != nullptr)
      length = static_cast<std::size_t>(static_cast<const char*>(newline) - first);
    if (length > longest_line_)
      throw IoError(file_.path(), "line " + std::to_string(number_ + 1) + " is longer than " +
                                      std::to_string(longest_line_) + " bytes");
    if (newline == nullptr) {
      searched = available;
      if (fill()) continue;
      if (available == 0) return false;
    }
    // fill() may have moved what was found before it.
    line = std::string_view(buffer_.data() + begin_, length);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    begin_ += length + (newline != nullptr ? 1 : 0);
    ++number_;
    // Editors of Windows begin a text with a byte order mark.
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (number_ == 1 && line.substr(0, kByteOrderMark.size()) == kByteOrderMark)
      line.remove_prefix(kByteOrderMark.size());
    return true;
  }
}

Words splitWords(std::string_view text) {
  Words words;
  for (std::string_view word = takeWord(text); !word.empty(); word = takeWord(text))
    words.push_back(word);
  return words;
}

bool parseNumber(std::string_view word, double& value) {
  return parse(word, value) == std::errc();
}

bool parseNumber(std::string_view word, float& value) {
  const std::errc problem = parse(word, value);
  if (problem == std::errc()) return true;
  if (problem != std::errc::result_out_of_range) return false;
  // Too small or too large for a float is still a number.
  double wide = 0.0;
  if (!parseNumber(word, wide)) return false;
  const bool overflow = std::abs(wide) > std::numeric_limits<float>::max();
  value = overflow ? std::copysign(std::numeric_limits<float>::infinity(),
                                   static_cast<float>(wide > 0 ? 1 : -1))
                   : static_cast<float>(wide);
  return true;
}

bool parseNumber(std::string_view word, std::uint64_t& value) {
  return parse(word, value) == std::errc();
}

std::optional<Matrix3> rotationOf(const Matrix3& R) {
  constexpr double kTolerance = 1e-3;
  constexpr double kRounding = 1e-12;
  const double error = (R * R.transpose() - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kTolerance) || R.determinant() < 0.0) return std::nullopt;
  return error <= kRounding ? R : Matrix3(Eigen::Quaterniond(R).normalized().toRotationMatrix());
}

std::optional<Pose> poseOf(const Eigen::Matrix<double, 3, 4>& rows) {
  const std::optional<Matrix3> exact = rotationOf(Matrix3(rows.leftCols<3>()));
  if (!exact) return std::nullopt;
  Pose pose = Pose::Identity();
  pose.linear() = *exact;
  pose.translation() = rows.col(3);
  return pose;
}

Pose poseOf(const Vector3& position, const Eigen::Quaterniond& rotation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix();
  pose.translation() = position;
  return pose;
}

void requirePose(const Pose& pose, const std::string& what) {
  if (!pose.translation().allFinite() || !rotationOf(Matrix3(pose.linear())))
    throw InputError("the pose of " + what + " is not finite or no rigid motion");
}

void failAtLine(const std::string& path, std::size_t line, const std::string& problem) {
  throw IoError(path, "line " + std::to_string(line) + ": " + problem);
}

std::string quoted(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, kLongestQuote)) text += c >= ' ' && c <= '~' ? c : '?';
  if (word.size() > kLongestQuote) text += "...";
  return text + "'";
}

void forEachLine(const std::string& path, const std::string& separators,
                 const std::function<void(const Words&, std::size_t)>& visit) {
  InputFile file(path);
  LineReader lines(file, kLongestLine);
  std::string_view line;
  std::string text;
  while (lines.next(line)) {
    text = line.substr(0, line.find('#'));
    for (const char separator : separators) std::replace(text.begin(), text.end(), separator, ' ');
    const Words words = splitWords(text);
    if (!words.empty()) visit(words, lines.number());
  }
}

double finiteNumber(std::string_view word, const std::string& path, std::size_t line) {
  double value = 0.0;
  if (!parseNumber(word, value) || !std::isfinite(value))
    failAtLine(path, line, quoted(word) + " is no finite number");
  return value;
}

void finiteNumbers(const Words& words, std::size_t first, double* values, std::size_t count,
                   const std::string& path, std::size_t line) {
  if (words.size() < first + count)
    failAtLine(
        path, line,
        "needs " + std::to_string(first + count) + " values, has " + std::to_string(words.size()));
  for (std::size_t i = 0; i < count; ++i) values[i] = finiteNumber(words[first + i], path, line);
}

}  // namespace planar_mapping::io
