// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/output.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "planar_mapping/core/base/error.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

class Output : public ::testing::Test {
 protected:
  OutputDirectory open(bool overwrite = true) const {
    return OutputDirectory(directory_.path(), {"a", "b", "manifest.json"}, overwrite);
  }
  void write(const std::string& name, const std::string& content) const {
    fs::create_directories(fs::path(directory_ / name).parent_path());
    std::ofstream(directory_ / name) << content;
  }
  std::string read(const std::string& name) const {
    std::ifstream in(directory_ / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::vector<std::string> hidden() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(directory_.path())) {
      const std::string name = entry.path().filename().string();
      if (name.front() == '.') names.push_back(name);
    }
    return names;
  }
  TemporaryDirectory directory_;
};

TEST_F(Output, CommitReplacesAllFiles) {
  open().commit({{"a", "1"}, {"b", "1"}});
  open().commit({{"a", "2"}, {"b", "2"}});
  EXPECT_EQ("2", read("a"));
  EXPECT_EQ("2", open().read("b"));
  EXPECT_TRUE(hidden().empty());
}

TEST_F(Output, FileThatIsNotTheCommittedOneIsNotRead) {
  open().commit({{"a", "1"}, {"b", "1"}});
  write("a", "2");
  const OutputDirectory output = open();
  EXPECT_THROW(output.read("a"), InputError);
  EXPECT_EQ("1", output.read("b"));
  write("manifest.json", "{");
  EXPECT_THROW(output.read("b"), InputError);
  fs::remove(directory_ / "manifest.json");
  EXPECT_THROW(output.read("b"), InputError);
}

TEST_F(Output, CommitThatWasCutOffIsEndedOrUndone) {
  open().commit({{"a", "old"}, {"b", "old"}});
  write(".saving/a", "half");
  { const OutputDirectory output = open(); }
  EXPECT_EQ("old", read("a"));
  EXPECT_TRUE(hidden().empty());
  // One file was moved before the kill.
  write("a", "new");
  write(".saved/b", "new");
  write(".saved/manifest.json", "new");
  { const OutputDirectory output = open(); }
  EXPECT_EQ("new", read("b"));
  EXPECT_EQ("new", read("manifest.json"));
  EXPECT_TRUE(hidden().empty());
}

TEST_F(Output, TemporaryFilesOfKilledRunsAreRemovedAndNoOthers) {
  write(".a.123-4.tmp", "");
  write(".a.mine.tmp", "");
  write(".c.123-4.tmp", "");
  { const OutputDirectory output = open(); }
  EXPECT_EQ(2u, hidden().size());
  EXPECT_FALSE(fs::exists(directory_ / ".a.123-4.tmp"));
}

TEST_F(Output, SecondRunIsRefusedAsLongAsTheFirstLives) {
  {
    const OutputDirectory first = open();
    try {
      open();
      FAIL() << "two at once";
    } catch (const OutputExistsError& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find("another run")) << error.what();
    }
  }
  EXPECT_NO_THROW(open());
}

TEST_F(Output, LockOfAKilledRunIsNoObstacle) {
  write(".lock", "");
  EXPECT_NO_THROW(open());
}

TEST_F(Output, FolderOfTheNameOfAFileIsRefusedBeforeAnyWork) {
  fs::create_directory(directory_ / "b");
  EXPECT_THROW(open(), OutputError);
}

}  // namespace
}  // namespace planar_mapping
