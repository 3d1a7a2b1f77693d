// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/run_statistics.h"
#include "temporary_directory.h"

namespace planar_mapping::detail {
namespace {

namespace fs = std::filesystem;

class Output : public ::testing::Test {
 protected:
  OutputDirectory open(bool overwrite = true) const {
    return OutputDirectory(directory_.path(), {"a", "b"}, overwrite);
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
  EXPECT_EQ("2", read("b"));
  EXPECT_TRUE(hidden().empty());
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
  { const OutputDirectory output = open(); }
  EXPECT_EQ("new", read("b"));
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

TEST(StandardCells, AgreeWithASet) {
  Random random(3);
  StandardCells cells(0.1);
  std::set<std::array<int, 3>> expected;
  for (int i = 0; i < 50000; ++i) {
    const Vector3 p(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-1, 1));
    cells.add(p);
    expected.insert({static_cast<int>(std::floor(p.x() / 0.1)),
                     static_cast<int>(std::floor(p.y() / 0.1)),
                     static_cast<int>(std::floor(p.z() / 0.1))});
  }
  EXPECT_EQ(expected.size(), cells.size());
}

TEST(StandardCells, PointsBeyondTheGridAreLeftOut) {
  StandardCells cells(0.1);
  cells.add({1e12, -1e12, 3.0});
  cells.add({1e4, -1e4, 3.0});
  cells.add({1e4, -1e4, 3.0});
  EXPECT_EQ(1u, cells.size());
}

}  // namespace
}  // namespace planar_mapping::detail
