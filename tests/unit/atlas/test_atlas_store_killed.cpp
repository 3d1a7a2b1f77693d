// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Runs that are killed at any moment: what was committed is there, nothing is half there.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "atlas_scene.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/base/random.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

using namespace test;
namespace fs = std::filesystem;

/// Poses of the submaps before \p count after that one was committed: all of them move each time.
AtlasData movedBy(const AtlasData& data, std::size_t count) {
  AtlasData moved;
  for (std::size_t i = 0; i < count; ++i) {
    moved.submaps.push_back(data.submaps[i]);
    moved.submaps[i].T_world_submap.translation().z() = 0.01 * static_cast<double>(count);
  }
  return moved;
}

/// The first \p count submaps of \p data, as committed.
AtlasData stateAfter(const AtlasData& data, std::size_t count) {
  AtlasData state = movedBy(data, count);
  state.sessions = count > 0 ? data.sessions : state.sessions;
  for (std::size_t i = 0; i < count; ++i) {
    const AtlasData part = submapOf(data, static_cast<std::int64_t>(i));
    state.keyframes.insert(state.keyframes.end(), part.keyframes.begin(), part.keyframes.end());
    state.links.insert(state.links.end(), part.links.begin(), part.links.end());
  }
  return state;
}

/// Goes on with the file to its end, and says on \p report what is committed.
[[noreturn]] void runToItsEnd(const AtlasData& data, const std::string& path, int report) {
  AtlasStore store =
      fs::exists(path) ? AtlasStore::open(path, AtlasAccess::Write) : AtlasStore::create(path);
  const auto say = [report](std::size_t count) {
    const auto done = static_cast<std::uint8_t>(count);
    if (::write(report, &done, 1) != 1) ::_exit(1);
  };
  for (std::size_t next = store.load().submaps.size(); next < data.submaps.size(); ++next) {
    store.append(submapOf(data, static_cast<std::int64_t>(next)), movedBy(data, next + 1));
    say(next + 1);
  }
  for (;;) {
    store.update(movedBy(data, data.submaps.size()));
    say(data.submaps.size());
  }
}

TEST(AtlasStoreKilled, FiftyKillsLoseNothingThatWasCommitted) {
  constexpr int kKills = 50;
  const TemporaryDirectory directory;
  const std::string path = directory / "a.atlas";
  const AtlasData data = walkedAtlas(12, 0.3);
  Random random(7);
  std::vector<int> kills_at(data.submaps.size() + 1, 0);
  std::size_t before = 0;
  for (int kill = 0; kill < kKills; ++kill) {
    int report[2];
    ASSERT_EQ(0, ::pipe(report));
    const pid_t child = ::fork();
    if (child == 0) {
      ::close(report[0]);
      runToItsEnd(data, path, report[1]);
    }
    ::close(report[1]);
    // Some commits later, at any moment of the next; or while the file is made or opened.
    std::size_t committed = before;
    std::uint8_t done = 0;
    for (std::size_t commits = random.below(4); commits > 0; --commits)
      if (::read(report[0], &done, 1) == 1) committed = done;
    ::usleep(static_cast<useconds_t>(random.below(20000)));
    ASSERT_EQ(0, ::kill(child, SIGKILL));
    int status = 0;
    ASSERT_EQ(child, ::waitpid(child, &status, 0));
    ASSERT_TRUE(WIFSIGNALED(status)) << "it ended by itself";
    while (::read(report[0], &done, 1) == 1) committed = done;
    ::close(report[0]);
    if (!fs::exists(path)) {
      EXPECT_EQ(0u, committed);
      continue;
    }
    const AtlasData found =
        kill % 2 == 0 ? loadAtlas(path) : AtlasStore::open(path, AtlasAccess::Write).load();
    EXPECT_GE(found.submaps.size(), committed);
    EXPECT_LE(found.submaps.size(), committed + 1);
    expectSame(stateAfter(data, found.submaps.size()), found);
    ASSERT_FALSE(::testing::Test::HasFailure()) << "kill " << kill;
    ++kills_at[found.submaps.size()];
    before = found.submaps.size();
    if (before < data.submaps.size()) continue;
    fs::remove(path);  // from the start
    before = 0;
  }
  int different = 0;
  for (const int count : kills_at) different += count > 0 ? 1 : 0;
  EXPECT_GT(different, 3) << "the kills came at the same moment";
}

}  // namespace
}  // namespace planar_mapping
