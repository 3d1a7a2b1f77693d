// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "hostile_map_file.h"
#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using test::Bytes;
using test::crc;
using test::expectSaysWhatIsWrong;
using test::load;
using test::loadsOrFailsCleanly;

/// A file written by the release before version 3.
Bytes smallFile() {
  std::ifstream stream(std::string(PLANAR_MAPPING_SOURCE_DIR) + "/tests/data/version2_compact.pmap",
                       std::ios::binary);
  return Bytes((std::istreambuf_iterator<char>(stream)), {});
}

/// Calls visit(position of the section header, size of its payload) while sections fit.
void forEachSection(const Bytes& file, const std::function<void(std::size_t, std::size_t)>& visit) {
  for (std::size_t at = 12; at + 16 <= file.size();) {
    std::uint64_t size = 0;
    std::memcpy(&size, &file[at + 8], 8);
    if (size > file.size() - at - 16) return;
    visit(at, static_cast<std::size_t>(size));
    at += 16 + static_cast<std::size_t>(size);
  }
}

void fixChecksums(Bytes& file) {
  forEachSection(file, [&](std::size_t at, std::size_t size) {
    const std::uint32_t c = crc(file.data() + at + 16, size);
    std::memcpy(&file[at + 4], &c, 4);
  });
}

/// A section's payload replaced, with a right checksum.
Bytes withSection(const Bytes& file, const std::string& tag, const Bytes& payload) {
  Bytes result(file.begin(), file.begin() + 12);
  forEachSection(file, [&](std::size_t at, std::size_t size) {
    const bool replace = std::equal(tag.begin(), tag.end(), file.begin() + at);
    const Bytes own(file.begin() + at + 16, file.begin() + at + 16 + size);
    const Bytes& wanted = replace ? payload : own;
    result.insert(result.end(), file.begin() + at, file.begin() + at + 8);
    const std::uint64_t length = wanted.size();
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&length);
    result.insert(result.end(), raw, raw + 8);
    result.insert(result.end(), wanted.begin(), wanted.end());
  });
  fixChecksums(result);
  return result;
}

TEST(HostileVersion2File, IsRejectedAtEveryLengthItIsCutTo) {
  test::expectRejectedAtEveryOtherLength(smallFile());
}

TEST(HostileVersion2File, IsRejectedWhenABitFlips) {
  test::expectRejectedWhenABitFlips(smallFile());
}

TEST(HostileVersion2File, DoesNoHarmWhenItsChecksumsAreRight) {
  const std::size_t loaded = test::loadedWhenSpoilt(smallFile(), 12, fixChecksums);
  EXPECT_GT(loaded, 0u);
  EXPECT_LT(loaded, 4000u);
}

TEST(HostileVersion2File, IsRejectedWithHugeLengths) {
  const Bytes whole = smallFile();
  std::vector<std::size_t> headers;
  forEachSection(whole, [&](std::size_t at, std::size_t) { headers.push_back(at); });
  ASSERT_EQ(headers.size(), 6u);
  for (const std::size_t at : headers) {
    for (const std::uint64_t size : {~std::uint64_t{0}, std::uint64_t{1} << 63,
                                     std::uint64_t{1} << 40, std::uint64_t{whole.size()}}) {
      Bytes spoilt = whole;
      std::memcpy(&spoilt[at + 8], &size, 8);
      EXPECT_FALSE(loadsOrFailsCleanly(spoilt));
    }
  }
  // Counts within the sections.
  const Bytes many{0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01};
  EXPECT_FALSE(loadsOrFailsCleanly(withSection(whole, "TRAJ", many)));
  Bytes planes = many;
  planes.insert(planes.begin(), 5);
  EXPECT_FALSE(loadsOrFailsCleanly(withSection(whole, "PLAN", planes)));
}

TEST(HostileVersion2File, IsRejectedWithTreesTooDeep) {
  const Bytes whole = smallFile();
  for (const int levels : {0, 1, 5, 18, 19, 20, 21, 63, 64, 255}) {
    Bytes tree{0, 0, 0, static_cast<std::uint8_t>(levels)};
    tree.insert(tree.end(), 4096, 0xff);  // inner nodes all the way down
    EXPECT_FALSE(loadsOrFailsCleanly(withSection(whole, "UNKN", tree)));
    EXPECT_FALSE(loadsOrFailsCleanly(withSection(whole, "SEEN", tree)));
    Bytes leaves{0, 0, 0, static_cast<std::uint8_t>(levels)};
    leaves.insert(leaves.end(), 4096, 0xaa);  // a leaf as large as the world
    if (levels > 0) {
      EXPECT_FALSE(loadsOrFailsCleanly(withSection(whole, "UNKN", leaves)));
    }
  }
}

TEST(HostileVersion2File, DecodesToMemoryInProportionToItsSize) {
  // As much as the format can ask for: cubes with one full block in each.
  const Bytes whole = smallFile();
  Bytes tree{0, 0, 0, 7};
  int bits = 0;
  const auto label = [&](int l) {
    if (bits % 8 == 0) tree.push_back(0);
    tree.back() |= static_cast<std::uint8_t>(l << (bits % 8));
    bits += 2;
  };
  const std::function<void(int)> node = [&](int level) {
    label(3);
    for (int c = 0; c < 8; ++c) {
      if (level > 1) {
        node(level - 1);
      } else {
        label(c == 0 ? 2 : 0);
      }
    }
  };
  node(6);
  tree[3] = 6;
  const Bytes file = withSection(whole, "UNKN", tree);
  const PlanarMap map = load(file);
  EXPECT_LT(map.memoryBytes(), 256 * file.size());
}

TEST(HostileVersion2File, IsRejectedWhenItIsSixtyFourMegabytesOfNothing) {
  Bytes file(64u << 20, 0xff);
  EXPECT_FALSE(loadsOrFailsCleanly(file));
  const Bytes whole = smallFile();
  std::copy(whole.begin(), whole.begin() + 12, file.begin());
  EXPECT_FALSE(loadsOrFailsCleanly(file));
}

/// Labels of a tree, four in a byte.
struct Labels {
  Bytes& bytes;
  int bits = 0;
  void put(int label) {
    if (bits % 8 == 0) bytes.push_back(0);
    bytes.back() |= static_cast<std::uint8_t>(label << (bits % 8));
    bits += 2;
  }
  /// The children of a node of a quadtree of 2^level cells with one cell, in a corner of it.
  void cellInCorner(int level, int corner) {
    put(level == 0 ? 1 : 3);
    for (int c = 0; level > 0 && c < 4; ++c) {
      if (c == corner) {
        cellInCorner(level - 1, corner);
      } else {
        put(0);
      }
    }
  }
};

TEST(HostileVersion2File, LoadsQuicklyWithManyPatchesThatAreAlmostEmpty) {
  // Thousands of patches of 128 x 128 cells, two of which are there, in opposite corners.
  Bytes plan{1, 1, 0, 1};
  const auto put = [&](auto value) {
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    plan.insert(plan.end(), raw, raw + sizeof value);
  };
  for (int i = 0; i < 3; ++i) put(0.0);                                     // origin
  for (const float axis : {1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 1.0f}) put(axis);  // u and n
  put(2048.0);                                                              // weight
  for (int i = 0; i < 3; ++i) put(0.0);                                     // mean
  for (int i = 0; i < 6; ++i) put(0.0f);                                    // scatter
  const int levels_above = 5;
  plan.insert(plan.end(), {0, 0, 0, 0, 5 + levels_above});  // anchor; corner, levels
  Labels labels{plan};
  const std::function<void(int)> node = [&](int level) {
    labels.put(3);
    for (int c = 0; c < 4; ++c) {
      if (level > 0) {
        node(level - 1);
      } else if (c == 0 || c == 3) {
        labels.cellInCorner(7, c);
      } else {
        labels.put(0);
      }
    }
  };
  node(levels_above);
  plan.insert(plan.end(), {0x80, 0x10, 255});  // 2048 beliefs of 1
  const Bytes file = withSection(smallFile(), "PLAN", plan);
  const auto start = std::chrono::steady_clock::now();
  const PlanarMap map = load(file);
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  // Corners of neighbouring patches that touch share a cuboid.
  EXPECT_GE(map.cuboids().size(), 1024u);
  EXPECT_LE(map.cuboids().size(), 2048u);
  EXPECT_LT(file.size(), 40000u);
  // As one raster each they would take 1 s and more; the limit leaves room for sanitizers.
  EXPECT_LT(time.count(), 0.5);
}

TEST(HostileVersion2File, SaysWhatIsWrong) {
  expectSaysWhatIsWrong(smallFile(), 8, 9);
}

}  // namespace
}  // namespace planar_mapping
