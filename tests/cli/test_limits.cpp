// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Every row of the table of limits in docs/reliability.md.
#include <cctype>
#include <functional>
#include <map>
#include <sstream>

#include "cli_fixture.h"
#include "planar_mapping/core/base/detail/crc32.h"

namespace planar_mapping {
namespace {

struct Row {
  std::string input;
  int exit_code = -1;
  std::string sentence;
};

std::vector<Row> rowsOfTheTable() {
  std::ifstream page(std::string(PLANAR_MAPPING_SOURCE_DIR) + "/docs/reliability.md");
  std::vector<Row> rows;
  bool here = false;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("## ", 0) == 0) here = line == "## Limits";
    const std::size_t code = line.find("| exit ");
    if (!here || code == std::string::npos) continue;
    Row row;
    row.input = line.substr(2, line.find(" | ", 2) - 2);
    row.exit_code = std::stoi(line.substr(code + 7));
    const std::size_t quote = line.find('"');
    row.sentence = line.substr(quote + 1, line.rfind('"') - quote - 1);
    rows.push_back(row);
  }
  return rows;
}

class Limits : public CliTest {
 protected:
  ProgramResult validated(const std::string& text) const {
    return planarMap({"validate", write("limit.yaml", text)});
  }
  ProgramResult sequence(const std::string& calibration) const {
    write("seq/calib.yaml",
          "image_width: 4\nimage_height: 4\nfx: 4\nfy: 4\ncx: 2\ncy: 2\n" + calibration);
    write("seq/left/0.png", "");
    write("seq/right/0.png", "");
    return planarMap({"run", config("stereo_indoor.yaml"), "-i", directory_ / "seq", "-o",
                      directory_ / "out", "-q"});
  }
  ProgramResult cloud(std::vector<float> xyz, const std::string& what = "",
                      const std::string& by = "") const {
    std::string pcd = binaryPcd(xyz);
    if (!what.empty()) pcd.replace(pcd.find(what), what.size(), by);
    return runOn(write("limit.pcd", pcd));
  }
  /// One point, and a header that says otherwise.
  ProgramResult cloudOfCount(const std::string& count) const {
    const std::string between = "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ";
    return cloud({0, 0, 1}, " 1" + between + "1", " " + count + between + count);
  }
  std::vector<float> roomTimes(float factor, float offset) const {
    std::vector<float> xyz = roomPoints(5000);
    for (float& value : xyz) value = factor * value + offset;
    return xyz;
  }
  ProgramResult query(const std::string& option, const std::string& value) const {
    runOn(room(), {"--force"});
    return planarMap({"query", directory_ / "out/map.pmap", option, value, "--range", "1e9"});
  }
  /// A header that is right but for the size of what it holds.
  ProgramResult mapFile() const {
    std::string file = std::string("PMAP\5\0\0\0", 8) + std::string("\0\0\0\0\0\1\0\0", 8);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(file.data());
    const std::uint32_t crc = detail::crc32(0, bytes, file.size());
    for (int i = 0; i < 4; ++i) file += static_cast<char>(crc >> (8 * i));
    return planarMap({"info", write("limit.pmap", file)});
  }
};

TEST_F(Limits, AreThoseOfTheDocumentation) {
  const std::string head = "version: 1\nstages:\n  - stage: planar_cuboid_approximation\n";
  const std::multimap<std::string, std::function<ProgramResult()>> beyond = {
      {"configuration, size",
       [&] { return validated(head + "#" + std::string(2 << 20, 'x') + "\n"); }},
      {"configuration, levels",
       [&] { return validated(std::string(40, '[') + std::string(40, ']')); }},
      {"configuration, values",
       [&] {
         std::string list = "inputs: [a";
         for (int i = 0; i < 100001; ++i) list += ",a";
         return validated(head + list + "]\n");
       }},
      {"calib.yaml, size", [&] { return sequence("#" + std::string(2 << 20, 'x') + "\n"); }},
      {"calib.yaml, baseline", [&] { return sequence("baseline_m: 101\n"); }},
      {"poses, line",
       [&] {
         const std::string poses = write("poses.txt", "#" + std::string(5000, 'x') + "\n");
         return runOn(room(), {"--poses", poses});
       }},
      {"cloud, points", [&] { return cloudOfCount("3000000000"); }},
      {"cloud, points", [&] { return cloudOfCount("1000000"); }},
      {"cloud, header line",
       [&] {
         return cloud({0, 0, 1}, "FIELDS", "# " + std::string(70000, 'x') + "\nFIELDS");
       }},
      {"cloud, x y z as floats", [&] { return cloud(roomTimes(1.0f, 4e6f)); }},
      {"cloud, scale", [&] { return cloud(roomTimes(1e-9f, 0.0f)); }},
      {"map, reach",
       [&] {
         std::vector<float> xyz = roomPoints(20000);
         xyz.insert(xyz.end(), {3e6f, 0.0f, 0.0f});
         return cloud(xyz);
       }},
      {"map file, content", [&] { return mapFile(); }},
      {"query, ray", [&] { return query("--ray", "1e6,0,0,-1,0.001,0"); }},
  };
  const std::vector<Row> rows = rowsOfTheTable();
  EXPECT_EQ(beyond.size(), rows.size());
  std::map<std::string, int> number;
  for (const Row& row : rows) {
    SCOPED_TRACE(row.input + ": " + row.sentence);
    const auto [first, last] = beyond.equal_range(row.input);
    const int place = number[row.input]++;
    if (std::distance(first, last) <= place) {
      ADD_FAILURE() << "is not tested";
      continue;
    }
    std::filesystem::remove_all(directory_ / "out");
    const ProgramResult result = std::next(first, place)->second();
    EXPECT_EQ(row.exit_code, result.exit_code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find(row.sentence)) << result.err;
    EXPECT_LT(result.peak_kilobytes, 500000);
  }
}

}  // namespace
}  // namespace planar_mapping
