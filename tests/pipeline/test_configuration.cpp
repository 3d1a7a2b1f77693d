// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/configuration.h"

#include <gtest/gtest.h>

#include <sstream>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping {
namespace {

constexpr const char* kChain =
    "version: 1\n"
    "stages:\n"
    "  - stage: multi_plane_segmentation\n"
    "  - stage: planar_cuboid_approximation\n";

Configuration parse(const std::string& yaml, const ConfigurationOverrides& overrides = {}) {
  StageTable table;
  registerBuiltinStages(table);
  return parseConfiguration(yaml, "/some/where/test.yaml", table, overrides);
}

std::string valueOf(const Configuration& configuration, std::size_t stage, const std::string& key) {
  return toYaml(configuration.stages[stage].parameters.find(key)->get());
}

TEST(Configuration, ReadingTheEffectiveTextGivesTheSameText) {
  for (const char* profile : {"paper", "compact"}) {
    ConfigurationOverrides overrides;
    overrides.profile = profile;
    overrides.assignments = {"planar_cuboid_approximation.association_angle_deg=7.123456789012345",
                             "planar_cuboid_approximation.resolution_m=0.1234567890123",
                             "planar_cuboid_approximation.up=[0, -1, 0.25]", "seed=99"};
    const std::string text = effectiveYaml(parse(kChain, overrides));
    EXPECT_EQ(text, effectiveYaml(parse(text)));
    EXPECT_NE(std::string::npos, text.find("association_angle_deg: 7.123456789012345\n")) << text;
    EXPECT_NE(std::string::npos, text.find("up: [0, -1, 0.25]\n")) << text;
  }
}

/// Files of `config --effective` that were kept: no key is lost without a word in the change log.
TEST(Configuration, KeptConfigurationsAreRead) {
  const std::string folder =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/tests/fuzz/corpus/configuration/effective_";
  for (const char* name : {"evaluate", "pcd_sequence", "rgbd_indoor", "single_pcd", "stereo_indoor",
                           "stereo_outdoor"}) {
    SCOPED_TRACE(name);
    const std::string text = io::readWholeText(folder + name);
    EXPECT_NO_THROW({
      const std::string again = effectiveYaml(parse(text));
      // Every key of the kept file is one of those that are written.
      std::istringstream lines(text);
      for (std::string line; std::getline(lines, line);) {
        const std::string key = line.substr(0, line.find(':') + 1);
        EXPECT_NE(again.find(key), std::string::npos) << key;
      }
    });
  }
}

TEST(Configuration, ProfileSetsDefaultsThatKeysOverrule) {
  const std::string paper = std::string("profile: paper\n") + kChain;
  EXPECT_EQ("multi_ransac", valueOf(parse(paper), 0, "method"));
  EXPECT_EQ("automatic", valueOf(parse(kChain), 0, "method"));
  const std::string overruled =
      "profile: paper\nversion: 1\nstages:\n  - stage: multi_plane_segmentation\n    method: "
      "sequential\n";
  EXPECT_EQ("sequential", valueOf(parse(overruled), 0, "method"));
  EXPECT_EQ(Profile::Paper, parse(paper).settings.profile);
}

TEST(Configuration, PaperProfileHasNothingOfOurOwn) {
  const Configuration paper = parse(std::string("profile: paper\n") +
                                    "version: 1\nstages:\n  - stage: multi_plane_segmentation\n"
                                    "  - stage: kl_occupancy\n"
                                    "  - stage: planar_cuboid_approximation\n");
  EXPECT_EQ("none", valueOf(paper, 0, "noise"));
  EXPECT_EQ("1000", valueOf(paper, 0, "features"));
  EXPECT_EQ("0", valueOf(paper, 1, "range_floor_cells"));
  EXPECT_EQ("0", valueOf(paper, 2, "hole_size_m"));
}

TEST(Configuration, PathsAreRelativeToTheFile) {
  const Configuration configuration =
      parse(std::string("inputs: [a.pcd, /b.pcd, ../c]\nposes: p.txt\n") + kChain);
  EXPECT_EQ((std::vector<std::string>{"/some/where/a.pcd", "/b.pcd", "/some/c"}),
            configuration.inputs);
  EXPECT_EQ("/some/where/p.txt", configuration.poses);
}

TEST(Configuration, EveryParameterChecksItsRangeAndType) {
  StageTable table;
  registerBuiltinStages(table);
  for (const StageEntry& entry : table.entries()) {
    const auto stage = entry.make();
    ParameterTable parameters;
    stage->declare(parameters);
    for (const Parameter& parameter : parameters.parameters()) {
      EXPECT_FALSE(parameter.meaning.empty()) << entry.name << "." << parameter.name;
      const std::string head =
          "version: 1\nstages:\n  - stage: " + entry.name + "\n    " + parameter.name + ": ";
      const bool takes_text = parameter.type == ParameterType::Text;
      for (const char* wrong : {".nan", "[1, 2]", "{a: b}", "~", "no such word"}) {
        if (takes_text && std::string(wrong) == "no such word") continue;
        if (takes_text && std::string(wrong) == ".nan") continue;
        EXPECT_THROW(parse(head + wrong + "\n"), ConfigError)
            << entry.name << "." << parameter.name << ": " << wrong;
      }
      // Every default is a value that may be written.
      EXPECT_NO_THROW(parse(head + toYaml(parameter.get()) + "\n"))
          << entry.name << "." << parameter.name;
    }
  }
}

TEST(Configuration, FrameSelectionReadsEveryForm) {
  const auto expect = [](const std::string& text, std::int64_t first, std::int64_t last,
                         std::int64_t step) {
    const FrameSelection selection = parseFrameSelection(text);
    EXPECT_EQ(first, selection.first) << text;
    EXPECT_EQ(last, selection.last) << text;
    EXPECT_EQ(step, selection.step) << text;
  };
  expect("2:10:3", 2, 10, 3);
  expect("2:10", 2, 10, 1);
  expect(":10", 0, 10, 1);
  expect("3:", 3, -1, 1);
  expect("::2", 0, -1, 2);
  expect("5", 5, 6, 1);
  for (const char* wrong : {"", "a", "3:1", "3:3", "1:2:0", "1:2:3:4", "-1:3", "1:-3", "1.5"})
    EXPECT_THROW(parseFrameSelection(wrong), InputError) << wrong;
}

TEST(Configuration, CombinationsThatMakeNoSenseAreReportedAtTheStage) {
  try {
    parse("version: 1\nstages:\n  - stage: pass_through\n    min_m: 3\n    max_m: 1\n");
    FAIL();
  } catch (const ConfigError& error) {
    ASSERT_EQ(1u, error.problems().size());
    EXPECT_EQ(
        "/some/where/test.yaml:3:12: stage 'pass_through': min_m = 3 m is out of range, "
        "allowed: <= max_m m",
        error.problems().front());
  }
}

}  // namespace
}  // namespace planar_mapping
