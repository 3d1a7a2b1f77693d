// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "hostile_map_file.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/file/columns.h"
#include "planar_mapping/map/file/label_tree.h"

namespace planar_mapping {
namespace {

using detail::CellLabels;
using detail::Columns;
using detail::LabelTree;
using test::Bytes;

TEST(Columns, HoldTheLowestBytesOfAllNumbersFirst) {
  std::vector<std::uint32_t> numbers = {0x04030201, 0x14131211};
  Columns columns("NUMBERS");
  columns.size(numbers, 4);
  columns.column(numbers);
  EXPECT_EQ(columns.written(),
            (Bytes{2, 0, 0, 0, 0, 0, 0, 0, 0x01, 0x11, 0x02, 0x12, 0x03, 0x13, 0x04, 0x14}));
}

TEST(Columns, AreReadAsTheyWereWritten) {
  std::vector<double> doubles = {1.0 / 3.0, -0.0, 1e300};
  std::vector<std::int16_t> shorts = {-1, 0, 32767};
  std::vector<std::uint8_t> labels = {0, 1, 2, 3, 2};
  Columns out("NUMBERS");
  out.size(doubles, 8);
  out.column(doubles);
  out.column(shorts);
  out.labels(labels, labels.size());
  EXPECT_EQ(out.written().size(), 8u + 24u + 6u + 2u);
  Columns in("NUMBERS", out.written().data(), out.written().size());
  std::vector<double> read_doubles;
  std::vector<std::int16_t> read_shorts(3);
  std::vector<std::uint8_t> read_labels;
  in.size(read_doubles, 8);
  in.column(read_doubles);
  in.column(read_shorts);
  in.labels(read_labels, 5);
  in.end();
  EXPECT_EQ(read_doubles, doubles);
  EXPECT_TRUE(std::signbit(read_doubles[1]));
  EXPECT_EQ(read_shorts, shorts);
  EXPECT_EQ(read_labels, labels);
  EXPECT_THROW(in.column(read_shorts), Error);
}

std::vector<CellLabels> randomLabels(int dimensions, Random& random) {
  std::vector<CellLabels> bundles;
  for (int i = 0; i < 300; ++i) {
    const auto coordinate = [&] { return static_cast<std::int32_t>(random.below(40)) - 20; };
    CellLabels b{{coordinate(), coordinate(), dimensions == 2 ? 0 : coordinate()}, 0, 0};
    const bool is_known = std::any_of(bundles.begin(), bundles.end(),
                                      [&](const CellLabels& other) { return other.at == b.at; });
    if (is_known) continue;
    for (int bit = 0; bit < 64; ++bit) b.low |= std::uint64_t{random.below(2)} << bit;
    for (int bit = 0; bit < 64; ++bit) b.high |= std::uint64_t{random.below(2)} << bit;
    b.high &= ~b.low;
    if (i % 3 == 0) b.low = ~std::uint64_t{0}, b.high = 0;
    bundles.push_back(b);
  }
  return bundles;
}

TEST(LabelTree, GivesBackTheLabelsAndTheBackground) {
  Random random(2);
  for (const int dimensions : {2, 3}) {
    LabelTree tree(dimensions);
    std::vector<CellLabels> bundles = randomLabels(dimensions, random);
    std::uint64_t occupied = 0;
    for (const CellLabels& b : bundles)
      occupied += static_cast<std::uint64_t>(__builtin_popcountll(b.low));
    tree.add(bundles, detail::kUnknown);
    EXPECT_EQ(tree.occupied(), occupied);
    Columns out("TREE");
    tree.code(out);
    Columns in("TREE", out.written().data(), out.written().size());
    LabelTree read(dimensions);
    read.code(in);
    in.end();
    ASSERT_EQ(read.regions(), tree.regions());
    LabelTree::Walk walk(read);
    std::size_t next = 0;
    for (std::size_t r = 0; r < read.regions(); ++r) {
      walk.next([&](const CellLabels& b) {
        if (next < bundles.size() && b.at == bundles[next].at) {
          EXPECT_EQ(b.low, bundles[next].low);
          EXPECT_EQ(b.high, bundles[next].high);
          ++next;
        } else {
          EXPECT_EQ(b.low, 0u);
          EXPECT_EQ(b.high, ~std::uint64_t{0});
        }
      });
    }
    EXPECT_EQ(next, bundles.size());
  }
}

TEST(LabelTree, TakesTwoBitsForARegionOfOneLabel) {
  std::vector<CellLabels> bundles;
  for (int i = 0; i < 512; ++i)
    bundles.push_back({{i & 7, i >> 3 & 7, i >> 6}, 0, ~std::uint64_t{0}});
  LabelTree tree(3);
  tree.add(bundles, detail::kFree);
  Columns columns("TREE");
  tree.code(columns);
  EXPECT_EQ(columns.written().size(), 8u + 3u * 2u + 1u);
}

}  // namespace
}  // namespace planar_mapping
