// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "planar_mapping/base/random.h"
#include "run_program.h"
#include "temporary_directory.h"

namespace planar_mapping {

/// Bytes of a PCD file with float x, y, z (binary).
inline std::string binaryPcd(const std::vector<float>& xyz) {
  const std::string count = std::to_string(xyz.size() / 3);
  std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
      count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n";
  const std::size_t header = pcd.size();
  pcd.resize(header + xyz.size() * sizeof(float));
  if (!xyz.empty()) std::memcpy(&pcd[header], xyz.data(), xyz.size() * sizeof(float));
  return pcd;
}

/// A PCD file with the given data lines (ascii).
inline std::string asciiPcd(const std::vector<std::string>& lines) {
  const std::string count = std::to_string(lines.size());
  std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
      count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA ascii\n";
  for (const std::string& line : lines) pcd += line + "\n";
  return pcd;
}

/// A floor of 4 m x 3 m and two walls 2 m high around the origin, 5 mm noise, and a box on it.
/// What the box hides from the origin is left out.
inline std::vector<float> roomPoints(std::size_t count, std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<float> xyz;
  xyz.reserve(3 * count);
  const auto add = [&xyz](double x, double y, double z) {
    const double at_board = 2.5 / x;  // seen from the origin
    if (x > 2.6 && std::abs(at_board * y) < 0.4 && at_board * z < 0.1) return;
    xyz.push_back(static_cast<float>(x));
    xyz.push_back(static_cast<float>(y));
    xyz.push_back(static_cast<float>(z));
  };
  while (xyz.size() < 3 * count) {
    const double noise = 0.005 * random.normal();
    const double u = random.uniform();
    const double v = random.uniform();
    switch (random.below(5)) {
      case 0:
      case 1:
        add(1.0 + 4.0 * u, -1.5 + 3.0 * v, -0.5 + noise);
        break;
      case 2:
        add(5.0 + noise, -1.5 + 3.0 * u, -0.5 + 2.0 * v);
        break;
      case 3:
        add(1.0 + 4.0 * u, 1.5 + noise, -0.5 + 2.0 * v);
        break;
      default:
        add(2.5 + noise, -0.4 + 0.8 * u, -0.5 + 0.6 * v);
        break;
    }
  }
  return xyz;
}

/// One list behind the other.
inline std::vector<std::string> joined(std::vector<std::string> first,
                                       const std::vector<std::string>& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

/// Runs the program that was built, in a directory of its own.
class CliTest : public ::testing::Test {
 protected:
  static std::string program() { return std::string(PLANAR_MAPPING_BIN_DIR) + "/planar_map"; }
  static std::string config(const std::string& name) {
    return std::string(PLANAR_MAPPING_SOURCE_DIR) + "/config/" + name;
  }

  ProgramResult planarMap(std::vector<std::string> arguments,
                          const ProgramOptions& options = {}) const {
    arguments.insert(arguments.begin(), program());
    return runProgram(arguments, options);
  }
  /// planar_map run with the file's configuration on one input, results in out/.
  ProgramResult runOn(const std::string& input, const std::vector<std::string>& more = {}) const {
    return planarMap(joined(
        {"run", config("single_pcd.yaml"), "-i", input, "-o", directory_ / "out", "-q"}, more));
  }
  std::string write(const std::string& name, const std::string& content) const {
    const std::string path = directory_ / name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
  std::string read(const std::string& name) const {
    std::ifstream in(directory_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  bool exists(const std::string& name) const { return std::filesystem::exists(directory_ / name); }
  /// Names of what is in a directory, hidden ones too.
  std::vector<std::string> list(const std::string& name) const {
    std::vector<std::string> names;
    if (!exists(name)) return names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_ / name))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  std::string room(const std::string& name = "room.pcd", std::uint64_t seed = 1) const {
    return write(name, binaryPcd(roomPoints(20000, seed)));
  }

  TemporaryDirectory directory_;
};

/// One line on stderr, from the program, with \p part in it.
inline void expectOneSentence(const ProgramResult& result, const std::string& part) {
  EXPECT_EQ(1, std::count(result.err.begin(), result.err.end(), '\n')) << result.err;
  EXPECT_EQ(0u, result.err.find("planar_map: ")) << result.err;
  EXPECT_NE(std::string::npos, result.err.find(part)) << "no '" << part << "' in " << result.err;
  EXPECT_EQ(std::string::npos, result.err.find("internal failure")) << result.err;
}

/// The program ended with this code, and said one sentence with \p part in it if that is given.
inline ProgramResult expectExit(int code, const ProgramResult& result, const std::string& part = "",
                                int line = __builtin_LINE()) {
  SCOPED_TRACE("called from line " + std::to_string(line));
  EXPECT_EQ(code, result.exit_code) << result.err << result.signal;
  if (!part.empty()) expectOneSentence(result, part);
  return result;
}

}  // namespace planar_mapping
