// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The example of a user's own stage, compiled in and from a shared library.
#include "cli_fixture.h"

namespace planar_mapping {
namespace {

class OwnStage : public CliTest {
 protected:
  std::string yamlWith(const std::string& plugin, const std::string& key) const {
    return write("own.yaml", "version: 1\nplugins: [" + plugin + "]\nstages:\n" +
                                 "  - stage: range_limit\n    " + key + "\n" +
                                 "  - stage: multi_plane_segmentation\n" +
                                 "  - stage: planar_cuboid_approximation\n");
  }
  ProgramResult run(const std::string& yaml) const {
    return planarMap({"run", yaml, "-i", room(), "-o", directory_ / "out", "-q"});
  }
};

TEST_F(OwnStage, RunsFromALibraryBesideTheConfiguration) {
  std::filesystem::copy_file(OWN_STAGE_PLUGIN, directory_ / "libmine.so");
  const std::string yaml = yamlWith("libmine.so", "max_range_m: 3.0");
  expectExit(0, planarMap({"run", yaml, "-i", room(), "-o", directory_ / "out", "-q"}));
  const std::string resolved = read("out/config.resolved.yaml");
  EXPECT_NE(std::string::npos, resolved.find("max_range_m: 3\n")) << resolved;
  EXPECT_NE(std::string::npos, resolved.find(directory_ / "libmine.so")) << resolved;

  expectExit(0, runProgram({OWN_STAGE_PROGRAM, room(), directory_ / "in"}));
  EXPECT_EQ(read("out/map.pmap"), read("in/map.pmap"));
}

TEST_F(OwnStage, ItsParametersAreCheckedLikeOurs) {
  const std::string yaml = yamlWith(OWN_STAGE_PLUGIN, "max_rang_m: 3.0");
  const ProgramResult result = expectExit(3, run(yaml));
  EXPECT_EQ(yaml +
                ":5:5: stage 'range_limit' has no key 'max_rang_m'; did you mean "
                "'max_range_m'?\n",
            result.err);
}

TEST_F(OwnStage, IsDescribedLikeOurs) {
  const ProgramResult result = expectExit(
      0, planarMap({"stages", "--plugin", OWN_STAGE_PLUGIN, "--describe", "range_limit"}));
  EXPECT_NE(std::string::npos, result.out.find("max_range_m")) << result.out;
}

TEST_F(OwnStage, PluginForAnotherInterfaceIsRefused) {
  const ProgramResult result = expectExit(3, run(yamlWith(OLD_PLUGIN, "max_range_m: 3.0")));
  EXPECT_NE(std::string::npos, result.err.find("was built for plugin interface 0")) << result.err;
}

TEST_F(OwnStage, LibraryThatIsNoPluginIsRefused) {
  const std::string core =
      std::string(PLANAR_MAPPING_BIN_DIR) + "/../lib/libplanar_mapping_core.so";
  if (!std::filesystem::exists(core)) GTEST_SKIP() << "the libraries are static";
  const ProgramResult result = expectExit(3, run(yamlWith(core, "max_range_m: 3.0")));
  EXPECT_NE(std::string::npos, result.err.find("no plugin of planar_mapping")) << result.err;
}

TEST_F(OwnStage, TheSamePluginTwiceIsRefused) {
  const std::string both = std::string(OWN_STAGE_PLUGIN) + ", " + OWN_STAGE_PLUGIN;
  const ProgramResult result = expectExit(3, run(yamlWith(both, "max_range_m: 3.0")));
  EXPECT_NE(std::string::npos, result.err.find("a name that is already taken")) << result.err;
}

TEST_F(OwnStage, NothingIsExecutedButByRunOfASoundFile) {
  ::setenv("PLUGIN_MARK", (directory_ / "mark").c_str(), 1);
  const std::string sound = yamlWith(MARKING_PLUGIN, "max_range_m: 3.0");
  const ProgramResult validated = expectExit(0, planarMap({"validate", sound}));
  EXPECT_NE(std::string::npos, validated.err.find("stage 'range_limit' is not checked"));
  EXPECT_EQ(3, planarMap({"config", "--effective", sound}).exit_code);
  const std::string rejected =
      write("rejected.yaml", std::string("version: 99\nplugins: [") + MARKING_PLUGIN +
                                 "]\nstages:\n  - stage: planar_cuboid_approximation\n");
  EXPECT_EQ(3, run(rejected).exit_code);
  EXPECT_EQ(3, planarMap({"validate", rejected}).exit_code);
  EXPECT_FALSE(exists("mark"));
  EXPECT_EQ(3, run(sound).exit_code) << "it has no stage";
  EXPECT_TRUE(exists("mark"));
  ::unsetenv("PLUGIN_MARK");
}

TEST_F(OwnStage, ConfigurationWithoutItsPluginIsCheckedAllTheSame) {
  const ProgramResult result = expectExit(
      3, planarMap({"validate",
                    write("own.yaml", std::string("version: 1\nplugins: [") + OWN_STAGE_PLUGIN +
                                          "]\nstages:\n  - stage: range_limit\n"
                                          "  - stage: voxel_grid\n    leaf: 1\n")}));
  EXPECT_NE(std::string::npos, result.err.find("has no key 'leaf'")) << result.err;
}

}  // namespace
}  // namespace planar_mapping
