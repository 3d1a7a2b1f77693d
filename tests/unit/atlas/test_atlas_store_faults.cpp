// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Files that are no atlas, damaged, locked, or that cannot be written: a sentence, nothing lost.
#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "atlas_scene.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

using namespace test;
namespace fs = std::filesystem;

void changeBySql(const std::string& path, const std::string& sql) {
  sqlite3* file = nullptr;
  ASSERT_EQ(SQLITE_OK, sqlite3_open(path.c_str(), &file));
  EXPECT_EQ(SQLITE_OK, sqlite3_exec(file, sql.c_str(), nullptr, nullptr, nullptr))
      << sql << ": " << sqlite3_errmsg(file);
  sqlite3_close(file);
}

/// A pose that lies so far along x, as SQL.
std::string poseAt(double x) {
  const std::array<double, 12> rows = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0};
  std::ostringstream sql;
  sql << std::hex << std::setfill('0');
  for (std::size_t i = 0; i < sizeof rows; ++i)
    sql << std::setw(2) << int{reinterpret_cast<const unsigned char*>(rows.data())[i]};
  return "x'" + sql.str() + "'";
}

class AtlasFaults : public ::testing::Test {
 protected:
  void SetUp() override { saveAtlas(data_, sound_); }

  /// A copy of the sound file.
  std::string copy() const {
    fs::copy_file(sound_, path_, fs::copy_options::overwrite_existing);
    return path_;
  }
  /// \p act throws IoError about the file with \p part in the message.
  template <typename Act>
  void expectProblem(const std::string& part, const Act& act) const {
    try {
      act();
      ADD_FAILURE() << "no error, expected: " << part;
    } catch (const IoError& error) {
      const std::string message = error.what();
      EXPECT_EQ(path_, error.path());
      EXPECT_EQ(0u, message.find(path_)) << message;
      EXPECT_NE(std::string::npos, message.find(part)) << message;
      EXPECT_EQ(std::string::npos, message.find('\n')) << message;
    }
  }
  void expectUnreadable(const std::string& part) const {
    expectProblem(part, [this]() { loadAtlas(path_); });
  }

  TemporaryDirectory directory_;
  const std::string sound_ = directory_ / "sound.atlas";
  const std::string path_ = directory_ / "a.atlas";
  const AtlasData data_ = walkedAtlas(3);
};

TEST_F(AtlasFaults, WhatIsNoAtlasIsRefused) {
  expectUnreadable("no such file");
  fs::create_directory(path_);
  expectUnreadable("is a directory");
  fs::remove(path_);
  io::writeFileAtomically(path_, "");
  expectUnreadable("is no atlas");
  io::writeFileAtomically(path_, std::string(5000, 'x'), io::Overwrite::Allow);
  expectUnreadable("is no SQLite file");
  fs::remove(path_);
  changeBySql(path_, "CREATE TABLE other (a)");
  expectUnreadable("of another program");
  expectProblem("of another program", [this]() { AtlasStore::open(path_, AtlasAccess::Write); });
  changeBySql(copy(), "PRAGMA user_version = 1");
  expectUnreadable("is an atlas of version 1, but this program reads version 4");
  changeBySql(copy(), "ALTER TABLE sessions ADD COLUMN more TEXT");
  expectUnreadable("tables");
  changeBySql(copy(), "DROP TABLE links");
  expectUnreadable("tables");
}

TEST_F(AtlasFaults, FilesCutShortOrDamagedAreRefusedOrRead) {
  const std::vector<std::uint8_t> whole = io::readWholeFile(sound_);
  for (std::size_t size = 100; size < whole.size(); size += 1 + whole.size() / 37) {
    io::writeFileAtomically(path_, whole.data(), size, io::Overwrite::Allow);
    EXPECT_THROW(loadAtlas(path_), IoError) << size;
    EXPECT_THROW(AtlasStore::open(path_, AtlasAccess::Write).load(), IoError) << size;
  }
  Random random(1);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<std::uint8_t> bytes = whole;
    for (int flips = 0; flips < 3; ++flips)
      bytes[random.below(bytes.size())] ^= static_cast<std::uint8_t>(1u << random.below(8));
    io::writeFileAtomically(path_, bytes.data(), bytes.size(), io::Overwrite::Allow);
    try {
      loadAtlas(path_);
    } catch (const IoError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 150);  // maps are most of it, and have checksums
}

TEST_F(AtlasFaults, RowsThatAreNotSoundAreNamed) {
  const std::vector<std::array<std::string, 2>> cases = {
      {"submap 1: its map", "UPDATE maps SET pmap = x'00' WHERE submap = 1"},
      {"submap 1: its map", "UPDATE maps SET pmap = substr(pmap, 1, 999) WHERE submap = 1"},
      {"submap 2 has no map", "DELETE FROM maps WHERE submap = 2"},
      {"submap 0 has a pose", "UPDATE submaps SET T_world_submap = x'' WHERE id = 0"},
      {"submap 0: T_world_submap", "UPDATE submaps SET T_world_submap = zeroblob(96)"},
      {"submap 1 lies", "UPDATE submaps SET T_world_submap = " + poseAt(-1e300) + " WHERE id = 1"},
      {"keyframe 3 lies",
       "UPDATE keyframes SET T_submap_keyframe = " + poseAt(2e7) + " WHERE id = 3"},
      {"link 1 lies", "UPDATE links SET T_to_from = " + poseAt(1.1e7) + " WHERE id = 1"},
      {"table submaps refers", "UPDATE submaps SET session = 4 WHERE id = 0"},
      {"table keyframes refers", "UPDATE keyframes SET submap = 99 WHERE id = 3"},
      {"table links refers", "UPDATE links SET to_keyframe = 99 WHERE id = 0"},
      {"keyframes of other submaps", "UPDATE links SET to_keyframe = 0 WHERE id = 0"},
      {"keyframe 3 has a list", "UPDATE keyframes SET sightings = x'00' WHERE id = 3"},
      {"keyframe 3 has not a descriptor", "UPDATE keyframes SET descriptor_bytes = 7 WHERE id = 3"},
      {"keyframe 3 has a count", "UPDATE keyframes SET descriptor_bytes = 1 << 62 WHERE id = 3"},
      {"keyframe 3 has a count", "UPDATE keyframes SET width = -1 WHERE id = 3"},
      {"keyframe 3 has a count", "UPDATE keyframes SET frame = -1 WHERE id = 3"},
      {"keyframe 3 has a pose, camera", "UPDATE keyframes SET camera = x'01' WHERE id = 3"},
      {"keyframe 3: ", "UPDATE keyframes SET camera = zeroblob(56) WHERE id = 3"},
      {"keyframe 3 has a time", "UPDATE keyframes SET timestamp = 9e999 WHERE id = 3"},
      {"keyframe 3 has inverse", "UPDATE keyframes SET cells_across = 4 WHERE id = 3"},
      {"keyframe -5 has a negative", "UPDATE keyframes SET id = -5 WHERE id = 1"},
      {"link 1 has a variance", "UPDATE links SET covariance = zeroblob(288) WHERE id = 1"},
      {"link 1 has evidence", "UPDATE links SET agreement = -9e999 WHERE id = 1"},
      {"link 1 has a count", "UPDATE links SET inliers = -1 WHERE id = 1"},
      {"link 1 joins", "UPDATE links SET to_submap = from_submap WHERE id = 1"},
      {"link 1 has one keyframe", "UPDATE links SET to_keyframe = NULL WHERE id = 1"},
      {"kind or state", "PRAGMA ignore_check_constraints = 1; UPDATE links SET kind = 'x'"}};
  for (const auto& [problem, sql] : cases) {
    SCOPED_TRACE(sql);
    changeBySql(copy(), sql);
    expectUnreadable("is damaged: ");
    expectUnreadable(problem);
  }
}

TEST_F(AtlasFaults, OneRunHasTheFileAlone) {
  copy();
  {
    AtlasStore store = AtlasStore::open(path_, AtlasAccess::Write);
    expectProblem("is open in another run",
                  [this]() { AtlasStore::open(path_, AtlasAccess::Write); });
    expectUnreadable("is open in another run");
    expectProblem("is open in another run",
                  [this]() { saveAtlas({}, path_, io::Overwrite::Allow); });
    expectSame(data_, store.load());
  }
  const AtlasStore one = AtlasStore::open(path_);
  expectSame(data_, loadAtlas(path_));
}

/// The rights of nobody, where the tests run as root.
class AsNobody {
 public:
  AsNobody() { is_root_ = ::geteuid() == 0 && ::seteuid(65534) == 0; }
  ~AsNobody() {
    if (is_root_ && ::seteuid(0) != 0) ADD_FAILURE();
  }

 private:
  bool is_root_ = false;
};

TEST_F(AtlasFaults, WhereNothingCanBeWrittenItIsReadOnly) {
  copy();
  fs::permissions(path_, fs::perms(0444));
  fs::permissions(directory_.path(), fs::perms(0555));
  {
    const AsNobody nobody;
    expectSame(data_, loadAtlas(path_));
    const auto opened = []() {
      return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
    };
    const auto before = opened();
    expectProblem("read-only", [this]() { AtlasStore::open(path_, AtlasAccess::Write); });
    EXPECT_EQ(before, opened());
    expectProblem("cannot be created", [this]() { saveAtlas({}, path_, io::Overwrite::Allow); });
  }
  // As the sqlite3 program leaves it, and as a crash does.
  fs::permissions(directory_.path(), fs::perms(0755));
  fs::permissions(path_, fs::perms(0644));
  changeBySql(path_, "PRAGMA journal_mode = WAL");
  fs::permissions(directory_.path(), fs::perms(0555));
  {
    const AsNobody nobody;
    expectSame(data_, loadAtlas(path_));
  }
  fs::permissions(directory_.path(), fs::perms(0755));
  io::writeFileAtomically(path_ + "-wal", "a log");
  fs::permissions(directory_.path(), fs::perms(0555));
  {
    const AsNobody nobody;
    expectUnreadable("was not closed, and it or its folder is read-only");
  }
  fs::permissions(directory_.path(), fs::perms(0755));
}

/// No file may grow beyond some bytes, which is met as a full disk is.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit = {bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(AtlasFaults, WhatWasCommittedBeforeTheDiskWasFullIsKept) {
  {
    AtlasStore store = AtlasStore::create(path_);
    store.append(submapOf(data_, 0));
    {
      const FileSizeLimit limit(fs::file_size(path_ + "-wal") + 5000);
      expectProblem("what was committed before is kept",
                    [&]() { store.append(submapOf(data_, 1)); });
    }
    EXPECT_EQ(1u, store.load().submaps.size());
    store.append(submapOf(data_, 1));  // there is space again
    store.append(submapOf(data_, 2));
  }
  expectSame(data_, loadAtlas(path_));
  const FileSizeLimit limit(5000);
  expectProblem("cannot be written", [this]() { saveAtlas(data_, path_, io::Overwrite::Allow); });
  expectSame(data_, loadAtlas(path_));
}

TEST_F(AtlasFaults, TheLogOfAnEarlierFileIsNotTakenForThatOfANewOne) {
  // A run that died leaves its log; its file is deleted, or overwritten.
  copy();
  {
    AtlasStore store = AtlasStore::open(path_, AtlasAccess::Write);
    store.update(data_);
    AtlasData moved = data_;
    moved.submaps[2].T_world_submap.translation().x() += 1.0;
    store.update(moved);
    fs::copy_file(path_ + "-wal", path_ + ".kept");
  }
  fs::copy_file(path_ + ".kept", path_ + "-wal");
  saveAtlas(data_, path_, io::Overwrite::Allow);
  expectSame(data_, loadAtlas(path_));
  fs::remove(path_);
  fs::copy_file(path_ + ".kept", path_ + "-wal", fs::copy_options::overwrite_existing);
  saveAtlas(data_, path_);
  expectSame(data_, loadAtlas(path_));
}

}  // namespace
}  // namespace planar_mapping
