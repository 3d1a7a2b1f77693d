// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/layouts/layout.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io::layouts {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> filesEndingWith(const std::vector<std::string>& ends,
                                         const std::string& folder) {
  std::vector<std::string> files;
  for (const std::string& file : filesOf(folder))
    if (std::count(ends.begin(), ends.end(), fs::path(file).extension().string()) > 0)
      files.push_back(file);
  return files;
}

bool isDigit(const std::string& text, std::size_t at) {
  return at < text.size() && std::isdigit(static_cast<unsigned char>(text[at])) != 0;
}

/// The digits from \p at on without leading zeros; \p at moves behind them.
std::string_view takeNumber(const std::string& text, std::size_t& at) {
  while (text[at] == '0' && isDigit(text, at + 1)) ++at;
  const std::size_t first = at;
  while (isDigit(text, at)) ++at;
  return std::string_view(text).substr(first, at - first);
}

/// The whole numbers in a name, without leading zeros.
std::vector<std::string> wholeNumbersIn(const std::string& name) {
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!isDigit(name, i)) continue;
    const bool is_fraction = i > 1 && name[i - 1] == '.' && isDigit(name, i - 2);
    const std::string number(takeNumber(name, i));
    const bool has_fraction = i < name.size() && name[i] == '.' && isDigit(name, i + 1);
    if (!has_fraction && !is_fraction) numbers.push_back(number);
  }
  return numbers;
}

/// Files by the first number in their names that tells them apart; none if there is no such one.
/// Of one file it is the last: the first may be that of its camera.
FilesByName byNumber(const FilesByName& files) {
  if (files.size() == 1) {
    const auto& [name, path] = *files.begin();
    const std::vector<std::string> numbers = wholeNumbersIn(name);
    return numbers.empty() ? FilesByName() : FilesByName{{numbers.back(), path}};
  }
  for (std::size_t which = 0; !files.empty(); ++which) {
    FilesByName numbered;
    for (const auto& [name, path] : files) {
      const std::vector<std::string> numbers = wholeNumbersIn(name);
      if (which >= numbers.size()) return {};
      numbered.emplace(numbers[which], path);
    }
    if (numbered.size() == files.size()) return numbered;
  }
  return {};
}

std::size_t countCommon(const FilesByName& first, const FilesByName& second) {
  std::size_t common = 0;
  for (const auto& entry : first) common += second.count(entry.first);
  return common;
}

/// Whether this many names in common are most of what could be.
bool areMost(std::size_t common, const FilesByName& first, const FilesByName& second) {
  return common > 0 && 2 * common >= std::min(first.size(), second.size());
}

}  // namespace

std::size_t matchNames(FilesByName& first, FilesByName& second) {
  const std::size_t same = countCommon(first, second);
  if (areMost(same, first, second)) return same;
  FilesByName first_numbers = byNumber(first), second_numbers = byNumber(second);
  const std::size_t common = countCommon(first_numbers, second_numbers);
  if (common <= same || !areMost(common, first_numbers, second_numbers)) return same;
  first = std::move(first_numbers);
  second = std::move(second_numbers);
  return common;
}

bool NameOrder::operator()(const std::string& a, const std::string& b) const {
  std::size_t i = 0, k = 0;
  for (; i < a.size() && k < b.size(); ++i, ++k) {
    const bool is_fraction =
        i > 0 && (isDigit(a, i - 1) || (i > 1 && a[i - 1] == '.' && isDigit(a, i - 2)));
    if (isDigit(a, i) && isDigit(b, k) && !is_fraction) {
      const std::string_view x = takeNumber(a, i), y = takeNumber(b, k);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    }
    if (i >= a.size() || k >= b.size()) break;
    if (a[i] != b[k]) return a[i] < b[k];
  }
  const bool a_ended = i >= a.size(), b_ended = k >= b.size();
  if (a_ended != b_ended) return a_ended;
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

bool isDirectory(const std::string& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

bool exists(const std::string& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

std::string joined(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

std::string firstOf(const std::string& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names)
    if (exists(joined(folder, name))) return joined(folder, name);
  return "";
}

bool endsWith(const std::string& text, std::string_view end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string nameOf(const std::string& folder) {
  std::error_code ignored;
  fs::path path = fs::absolute(folder, ignored).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  return path.filename().string();
}

std::string stemOf(const std::string& path) {
  const std::string name = path.substr(path.rfind('/') + 1);  // quicker than fs::path
  const std::size_t dot = name.rfind('.');
  return dot == 0 ? name : name.substr(0, dot);
}

std::vector<std::string> filesOf(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    const std::string name = entry->path().filename().string();
    if (name.front() != '.' && entry->is_regular_file(ignored)) names.push_back(name);
  }
  if (error) throw IoError(folder, "cannot be listed: " + error.message());
  std::sort(names.begin(), names.end(), NameOrder());
  const std::string prefix = joined(folder, "");
  for (std::string& name : names) name.insert(0, prefix);
  return names;
}

std::vector<std::string> cloudFilesOf(const std::string& folder) {
  std::vector<std::string> files;
  bool holds_clouds = false;
  for (const std::string& file : filesOf(folder)) {
    const bool is_cloud = recognizeCloudFile(file) != CloudFormat::None;
    const bool is_called_so =
        endsWith(file, ".pcd") || endsWith(file, ".ply") || endsWith(file, ".bin");
    if (is_cloud || is_called_so) files.push_back(file);
    holds_clouds = holds_clouds || is_cloud;
  }
  return holds_clouds ? files : std::vector<std::string>();
}

std::vector<std::string> imageFilesOf(const std::string& folder) {
  return filesEndingWith({".png", ".jpg", ".jpeg", ".pgm", ".ppm"}, folder);
}

std::vector<std::string> depthFilesOf(const std::string& folder) {
  const std::vector<std::string> depths = filesEndingWith({".png"}, folder);
  if (depths.empty())
    throw IoError(folder,
                  "holds no PNG images; depth of other kinds (.npy, .exr, .tiff, .raw) is to be "
                  "written as PNG of 16 bits, metres times depth_scale (calib.yaml), 0 = none");
  return depths;
}

FilesByName byName(const std::vector<std::string>& files) {
  FilesByName named;
  for (const std::string& file : files) {
    const std::size_t before = named.size();
    named.emplace_hint(named.end(), stemOf(file), file);  // they are in order
    if (named.size() == before) throw IoError(file, "another image of this name stands beside it");
  }
  return named;
}

std::string fileOf(const FilesByName& files, const std::string& name) {
  const auto found = files.find(name);
  return found == files.end() ? "" : found->second;
}

}  // namespace planar_mapping::io::layouts
