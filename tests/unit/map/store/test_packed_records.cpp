// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/packed_records.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::detail {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes anyBytes(Random& random) {
  // Mostly as short as planes and covers are, now and then longer than a page.
  const double draw = random.uniform(0.0, 1.0);
  const auto size = static_cast<std::size_t>(
      draw < 0.9 ? random.uniform(1.0, 200.0)
                 : random.uniform(1.0, 3.0 * static_cast<double>(PackedRecords::kPage)));
  Bytes bytes(size);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.uniform(0.0, 256.0));
  return bytes;
}

std::vector<Bytes> contentOf(const PackedRecords& records) {
  std::vector<Bytes> content;
  for (const PackedRecords::Record& r : records.list())
    content.emplace_back(r.data, r.data + r.size);
  return content;
}

TEST(PackedRecords, HoldWhatAPlainListWould) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    PackedRecords records;
    std::vector<Bytes> expected;
    for (int step = 0; step < 40; ++step) {
      const std::vector<PackedRecords::Record> before = records.list();
      PackedRecords::Change change(before);
      std::vector<Bytes> after;
      const double share = random.uniform(0.0, 0.3);  // of the records that change
      for (std::size_t i = 0; i <= before.size(); ++i) {
        while (random.uniform(0.0, 1.0) < (i == before.size() ? 0.6 : 0.2 * share)) {
          after.push_back(anyBytes(random));
          change.put(after.back());
        }
        if (i == before.size()) break;
        const double draw = random.uniform(0.0, 1.0);
        if (draw < 0.3 * share) continue;  // gone
        if (draw < share) {
          after.push_back(anyBytes(random));
          change.put(after.back());
        } else {
          after.push_back(expected[i]);
          change.keep(i);
        }
      }
      records.apply(change);
      expected = after;
      ASSERT_EQ(contentOf(records), expected) << "seed " << seed << " step " << step;
    }
  }
}

TEST(PackedRecords, KeepPagesThatDidNotChange) {
  PackedRecords records;
  const std::vector<PackedRecords::Record> none;
  PackedRecords::Change first(none);
  for (int i = 0; i < 200; ++i) first.put(Bytes(100, static_cast<std::uint8_t>(i)));
  records.apply(first);
  const std::vector<PackedRecords::Record> before = records.list();
  PackedRecords::Change change(before);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (i == 100) {
      change.put(Bytes(90, 7));
    } else {
      change.keep(i);
    }
  }
  records.apply(change);
  const std::vector<PackedRecords::Record> after = records.list();
  ASSERT_EQ(after.size(), before.size());
  std::set<std::uint32_t> moved;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (after[i].data != before[i].data) moved.insert(before[i].page);
  }
  EXPECT_EQ(moved.size(), 1u);
}

TEST(PackedRecords, TakeLittleMoreThanTheirBytes) {
  // One is added at a time, as planes are.
  PackedRecords records;
  std::size_t bytes = 0;
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const std::vector<PackedRecords::Record> before = records.list();
    PackedRecords::Change change(before);
    for (std::size_t r = 0; r < before.size(); ++r) change.keep(r);
    const Bytes added(static_cast<std::size_t>(random.uniform(20.0, 100.0)));
    change.put(added);
    bytes += added.size();
    records.apply(change);
  }
  EXPECT_EQ(records.list().size(), 500u);
  EXPECT_LT(static_cast<double>(records.memoryBytes()), 1.1 * static_cast<double>(bytes));
}

TEST(PackedRecords, CanBeChangedInPlace) {
  PackedRecords records;
  const std::vector<PackedRecords::Record> none;
  PackedRecords::Change change(none);
  change.put({1, 2, 3});
  change.put({4, 5, 6});
  records.apply(change);
  records.bytesOf(records.list()[1])[2] = 9;
  EXPECT_EQ(contentOf(records), (std::vector<Bytes>{{1, 2, 3}, {4, 5, 9}}));
}

}  // namespace
}  // namespace planar_mapping::detail
