// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/atomic_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "planar_mapping/base/error.h"
#include "temporary_directory.h"

namespace planar_mapping::io {
namespace {

namespace fs = std::filesystem;

std::string contents(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::size_t entries(const std::string& directory) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(directory), fs::directory_iterator()));
}

std::string problemOf(const std::string& path, Overwrite overwrite = Overwrite::Refuse) {
  try {
    writeFileAtomically(path, "new", overwrite);
  } catch (const IoError& error) {
    EXPECT_EQ(error.path(), path);
    return error.what();
  }
  return "";
}

TEST(AtomicFile, AppearsWholeOnCommitOnly) {
  const TemporaryDirectory dir;
  const std::string path = dir / "map.bin";
  const std::string large(3 << 20, 'x');
  {
    AtomicFile file(path);
    file.write("head");
    file.write(large);
    file.write("tail");
    EXPECT_FALSE(fs::exists(path));
    file.commit();
  }
  EXPECT_EQ(contents(path), "head" + large + "tail");
  EXPECT_EQ(entries(dir.path()), 1u);
}

TEST(AtomicFile, WithoutCommitLeavesNothing) {
  const TemporaryDirectory dir;
  {
    AtomicFile file(dir / "map.bin");
    file.write("half");
  }
  EXPECT_EQ(entries(dir.path()), 0u);
}

TEST(AtomicFile, RefusesToOverwriteUnlessAllowed) {
  const TemporaryDirectory dir;
  const std::string path = dir / "map.bin";
  writeFileAtomically(path, "old");
  EXPECT_NE(problemOf(path).find("exists already"), std::string::npos);
  EXPECT_EQ(contents(path), "old");
  writeFileAtomically(path, "new", Overwrite::Allow);
  EXPECT_EQ(contents(path), "new");
}

TEST(AtomicFile, RefusesToOverwriteAFileThatCameMeanwhile) {
  const TemporaryDirectory dir;
  const std::string path = dir / "map.bin";
  AtomicFile file(path);
  file.write("mine");
  std::ofstream(path) << "theirs";
  EXPECT_THROW(file.commit(), IoError);
  EXPECT_EQ(contents(path), "theirs");
}

TEST(AtomicFile, SaysWhyAPathCannotBeWritten) {
  const TemporaryDirectory dir;
  EXPECT_NE(problemOf(dir / "no_such/map.bin").find("No such file or directory"),
            std::string::npos);
  EXPECT_NE(problemOf(dir.path(), Overwrite::Allow).find("is a directory"), std::string::npos);
  EXPECT_NE(problemOf(dir.path() + "/").find("does not name a file"), std::string::npos);
  EXPECT_NE(problemOf("").find("does not name a file"), std::string::npos);
  EXPECT_NE(problemOf("/dev/null", Overwrite::Allow).find("is not a regular file"),
            std::string::npos);
  EXPECT_NE(problemOf("/proc/map.bin").find("cannot be created"), std::string::npos);
}

TEST(AtomicFile, KeepsTheOldFileWhenTheDiskIsFull) {
  const TemporaryDirectory dir;
  const std::string path = dir / "map.bin";
  writeFileAtomically(path, "old");
  // A file size limit makes write() fail half way, as a full disk does.
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1 << 20, 1 << 20};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    int code = 1;
    try {
      writeFileAtomically(path, std::string(4 << 20, 'x'), Overwrite::Allow);
    } catch (const IoError&) {
      code = 0;
    }
    ::_exit(code);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(contents(path), "old");
  EXPECT_EQ(entries(dir.path()), 1u);
}

TEST(AtomicFile, KilledProcessLeavesTheOldFile) {
  const TemporaryDirectory dir;
  const std::string path = dir / "map.bin";
  writeFileAtomically(path, "old");
  const pid_t child = ::fork();
  if (child == 0) {
    AtomicFile file(path, Overwrite::Allow);
    file.write(std::string(1 << 20, 'x'));
    ::kill(::getpid(), SIGKILL);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(contents(path), "old");
  writeFileAtomically(path, "new", Overwrite::Allow);
  EXPECT_EQ(contents(path), "new");
}

TEST(AtomicFile, HonoursTheUmask) {
  const TemporaryDirectory dir;
  const mode_t before = ::umask(027);
  writeFileAtomically(dir / "map.bin", "x");
  ::umask(before);
  struct stat status {};
  ASSERT_EQ(::stat((dir / "map.bin").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
}

TEST(ReadWholeFile, BoundsTheSizeAndNamesTheProblem) {
  const TemporaryDirectory dir;
  writeFileAtomically(dir / "a", "12345");
  EXPECT_EQ(readWholeFile(dir / "a").size(), 5u);
  EXPECT_THROW(readWholeFile(dir / "a", 4), IoError);
  EXPECT_THROW(readWholeFile(dir / "b"), IoError);
  EXPECT_THROW(readWholeFile(dir.path()), IoError);
  EXPECT_THROW(readWholeFile("/dev/zero"), IoError);
}

}  // namespace
}  // namespace planar_mapping::io
