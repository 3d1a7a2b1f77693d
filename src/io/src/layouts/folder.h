// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace planar_mapping::io::layouts {

bool isDirectory(const std::string& path);
bool exists(const std::string& path);
std::string joined(const std::string& folder, const std::string& name);
/// The first of several names that is there, else "".
std::string firstOf(const std::string& folder, const std::vector<std::string>& names);
/// Whether something stands before the end, too.
bool endsWith(const std::string& text, std::string_view end);
/// The last part of a path, also where it ends in "/" or is ".".
std::string nameOf(const std::string& folder);
std::string stemOf(const std::string& path);

/// The regular files of a folder in name order, 2 before 10; hidden ones (and so temporary ones)
/// are left out.
std::vector<std::string> filesOf(const std::string& folder);
/// Those of clouds, and those that are called so where there are some: to be read, or refused.
std::vector<std::string> cloudFilesOf(const std::string& folder);
std::vector<std::string> imageFilesOf(const std::string& folder);
/// PNG files: the others have no 16 bits. \throws IoError if there is none
std::vector<std::string> depthFilesOf(const std::string& folder);

/// Name order, in which 2 comes before 10: numbers by their value, fractions of them as text.
struct NameOrder {
  bool operator()(const std::string& a, const std::string& b) const;
};
/// Paths by file name without extension.
using FilesByName = std::map<std::string, std::string, NameOrder>;
/// \throws IoError if two files have the same name
FilesByName byName(const std::vector<std::string>& files);
FilesByName imagesByName(const std::string& folder);

/// How many names of two folders are in both. Where few are, but the names of each hold the number
/// of their frame and most numbers are in both, files are called by the number from here on:
/// left_7.png and right_0007.png are "7". A number with a fraction is a time and counts for
/// nothing.
std::size_t matchNames(FilesByName& first, FilesByName& second);
/// Whether so many names in common are most of what could be.
bool areMost(std::size_t common, const FilesByName& first, const FilesByName& second);

/// Calls \p visit with the words of each line that is not empty, and the number of the line; what
/// follows a # is left out.
/// \param separators  characters between words beside blanks and tabs
void forEachLine(
    const std::string& path, const std::string& separators,
    const std::function<void(const std::vector<std::string_view>&, std::size_t)>& visit);
/// \throws IoError naming path and line
double finiteNumber(std::string_view word, const std::string& path, std::size_t line);
/// As many finite numbers as there are in \p values.
void finiteNumbers(const std::vector<std::string_view>& words, std::size_t first, double* values,
                   std::size_t count, const std::string& path, std::size_t line);

}  // namespace planar_mapping::io::layouts
