// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// A small evaluation of the compact profile on the simulated scenes, compared with evaluation.txt
// beside this file: figures may get better, not worse. `golden_evaluation_slow --update` rewrites
// that file; the commit says why it moved.

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "run_program.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

const std::string kSource = PLANAR_MAPPING_SOURCE_DIR;
const std::string kGoldenFile = kSource + "/tests/golden/evaluation.txt";

/// How much worse a figure may be than on record; instruction sets differ in the last digits, and
/// those decide a few cells.
struct Tolerance {
  const char* figure;
  double sign;      ///< +1: less is better
  double absolute;  ///< in the figure's unit
  double relative;  ///< of the value on record
};
constexpr Tolerance kTolerances[] = {
    {"combination_efficiency", -1.0, 0.004, 0.0},
    {"error_percent", 1.0, 0.15, 0.05},
    {"completeness", -1.0, 0.004, 0.0},
    {"coverage", -1.0, 0.004, 0.0},
    {"memory_bytes", 1.0, 0.0, 0.03},
    {"file_bytes", 1.0, 0.0, 0.03},
    {"finished_bytes", 1.0, 0.0, 0.03},
};

using Figures = std::map<std::string, double>;  ///< by "scene cell figure"

/// The rows of an evaluation, which is made once.
const nlohmann::json& evaluated() {
  static const nlohmann::json rows = [] {
    const TemporaryDirectory directory;
    ProgramOptions options;
    options.timeout_s *= 5.0;
    const ProgramResult result =
        runProgram({std::string(PLANAR_MAPPING_BIN_DIR) + "/planar_map", "evaluate",
                    kSource + "/config/evaluate.yaml", "--places", "2", "--frames-per-place", "4",
                    "--cells", "0.1,0.3", "--json", "--no-figures", "-o", directory / "out"},
                   options);
    if (result.exit_code != 0) throw std::runtime_error(result.err);
    return nlohmann::json::parse(result.out).at("results");
  }();
  return rows;
}

Figures measured() {
  Figures figures;
  for (const auto& row : evaluated()) {
    if (row.at("method") != "PG") continue;
    const std::string name =
        row.at("scene").get<std::string>() + " " + row.at("cell_m").dump() + " ";
    for (const Tolerance& one : kTolerances) figures[name + one.figure] = row.at(one.figure);
  }
  return figures;
}

Figures onRecord() {
  Figures figures;
  std::ifstream in(kGoldenFile);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t space = line.rfind(' ');
    std::istringstream value(line.substr(space + 1));
    value.imbue(std::locale::classic());
    value >> figures[line.substr(0, space)];
  }
  return figures;
}

TEST(Evaluation, NoFigureOfTheCompactProfileIsWorseThanOnRecord) {
  const Figures golden = onRecord();
  ASSERT_FALSE(golden.empty()) << kGoldenFile << " is missing: run with --update";
  const Figures now = measured();
  ASSERT_EQ(golden.size(), now.size());
  for (const auto& [name, before] : golden) {
    ASSERT_EQ(1u, now.count(name)) << name;
    for (const Tolerance& one : kTolerances) {
      if (name.substr(name.rfind(' ') + 1) != one.figure) continue;
      const double worse = one.sign * (now.at(name) - before);
      EXPECT_LE(worse, one.absolute + one.relative * before)
          << name << " was " << before << ", is " << now.at(name);
    }
  }
}

TEST(Evaluation, AFinishedMapTakesLessThanABtAndAFullOneAFifthOfAnOt) {
  std::map<std::string, nlohmann::json> octree;
  std::size_t compared = 0;
  for (const auto& row : evaluated()) {
    if (row.at("cell_m") != 0.1) continue;
    const std::string scene = row.at("scene");
    if (row.at("method") == "OG") octree[scene] = row;
    if (row.at("method") != "PG" || octree.count(scene) == 0) continue;
    // Outdoors we say of space up to 200 m what it is, the octree as far as points are mapped.
    const double budget = scene == "outdoor" ? 2.0 : 1.0;
    EXPECT_LE(row.at("finished_bytes").get<double>(),
              budget * octree[scene].at("file_bytes").get<double>())
        << scene;
    EXPECT_LE(5.0 * row.at("file_bytes").get<double>(), octree[scene].at("ot_bytes")) << scene;
    ++compared;
  }
  if (compared == 0) GTEST_SKIP() << "no OctoMap";
}

void update() {
  const Figures figures = measured();
  std::ofstream out(kGoldenFile);
  out.imbue(std::locale::classic());
  out << "# Written by golden_evaluation_slow --update: scene, cell size, figure, median\n";
  for (const auto& [name, value] : figures) out << name << ' ' << value << '\n';
}

}  // namespace
}  // namespace planar_mapping

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--update") {
      try {
        planar_mapping::update();
        return 0;
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
      }
    }
  }
  return RUN_ALL_TESTS();
}
