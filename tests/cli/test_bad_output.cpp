// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Output that cannot be written: an exit code, one sentence, what was there stays.
#include <sys/mount.h>
#include <sys/stat.h>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

class BadOutput : public CliTest {
 protected:
  ProgramResult runTo(const std::string& output, std::vector<std::string> more = {},
                      const ProgramOptions& options = {}) const {
    std::vector<std::string> arguments = {
        "run", config("single_pcd.yaml"), "-i", cloud_, "-o", output, "-q"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return planarMap(arguments, options);
  }
  std::string cloud_ = room();
};

TEST_F(BadOutput, DirectoryBelowAFile) {
  const std::string file = write("file", "content");
  const ProgramResult result = runTo(file + "/out");
  EXPECT_EQ(1, result.exit_code);
  expectOneSentence(result, file + "/out");
  EXPECT_EQ("content", read("file"));
}

TEST_F(BadOutput, NameOfAFile) {
  const std::string file = write("file", "content");
  const ProgramResult result = runTo(file);
  EXPECT_EQ(1, result.exit_code);
  expectOneSentence(result, "this is a file");
  EXPECT_EQ("content", read("file"));
}

TEST_F(BadOutput, ReadOnlyDirectory) {
  // Root may write anywhere but into the kernel's own directories.
  std::string output = "/proc/sys";
  if (::geteuid() != 0) {
    output = directory_ / "read_only";
    std::filesystem::create_directory(output);
    ::chmod(output.c_str(), 0555);
  }
  const ProgramResult result = runTo(output);
  EXPECT_EQ(1, result.exit_code);
  expectOneSentence(result, output);
}

TEST_F(BadOutput, ExistingResultsAreKeptWithoutForce) {
  ASSERT_EQ(0, runTo(directory_ / "out").exit_code);
  const std::string map = read("out/map.pmap");
  const ProgramResult refused = runTo(directory_ / "out");
  EXPECT_EQ(2, refused.exit_code);
  expectOneSentence(refused, "--force");
  EXPECT_EQ(map, read("out/map.pmap"));
  const ProgramResult forced = runTo(directory_ / "out", {"--force"});
  EXPECT_EQ(0, forced.exit_code) << forced.err;
  EXPECT_EQ(map, read("out/map.pmap"));
}

TEST_F(BadOutput, EachCommandHasTheSameCodes) {
  ASSERT_EQ(0, runTo(directory_ / "out").exit_code);
  const std::string map = directory_ / "out/map.pmap";
  const std::vector<std::string> commands[] = {
      {"simulate", "room", "--frames", "1", "--width", "8", "--height", "8", "-q", "-o"},
      {"merge", map, map, "-o"},
      {"convert", map}};
  for (std::vector<std::string> command : commands) {
    command.push_back(directory_ / command[0] + (command[0] == "convert" ? ".csv" : ".pmap"));
    ASSERT_EQ(0, planarMap(command).exit_code) << command[0];
    const ProgramResult exists = planarMap(command);
    EXPECT_EQ(2, exists.exit_code) << command[0];
    expectOneSentence(exists, "--force");
    command.back() = command[0] == "convert" ? "/proc/sys/none.csv" : "/proc/sys/none";
    const ProgramResult refused = planarMap(command);
    EXPECT_EQ(1, refused.exit_code) << command[0];
    expectOneSentence(refused, "/proc/sys/none");
  }
}

TEST_F(BadOutput, FilesOfOthersInTheDirectoryAreNoObstacle) {
  write("out/notes.txt", "mine");
  EXPECT_EQ(0, runTo(directory_ / "out").exit_code);
  EXPECT_EQ("mine", read("out/notes.txt"));
}

TEST_F(BadOutput, FileThatMayNotGrow) {
  ProgramOptions options;
  options.file_size_limit = 700;  // some files fit, the map does not
  const ProgramResult result = runTo(directory_ / "out", {}, options);
  EXPECT_EQ(1, result.exit_code) << result.signal;
  expectOneSentence(result, directory_ / "out");
  EXPECT_FALSE(exists("out/map.pmap"));
  for (const std::string& name : list("out")) EXPECT_NE('.', name.front()) << name;
}

TEST_F(BadOutput, FullDiskLeavesTheEarlierMap) {
  const std::string disk = directory_ / "disk";
  std::filesystem::create_directory(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0) {
    GTEST_SKIP() << "a file system of its own cannot be mounted here";
  }
  std::ofstream(disk + "/filler") << std::string(60000, 'x');
  const ProgramResult result = runTo(disk + "/out");
  EXPECT_EQ(1, result.exit_code);
  expectOneSentence(result, "out/");
  EXPECT_FALSE(exists("disk/out/map.pmap"));
  for (const std::string& name : list("disk/out")) EXPECT_NE('.', name.front()) << name;
  ::umount(disk.c_str());
}

}  // namespace
}  // namespace planar_mapping
