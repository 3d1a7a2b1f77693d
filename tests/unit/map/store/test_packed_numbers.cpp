// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/packed_numbers.h"

#include <gtest/gtest.h>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::detail {
namespace {

/// Of any size from a bit to all 64.
std::uint64_t anyNumber(Random& random) {
  std::uint64_t number = 0;
  for (int i = 0; i < 8; ++i) {
    number = number << 8u | static_cast<std::uint64_t>(random.uniform(0.0, 256.0));
  }
  return number >> static_cast<unsigned>(random.uniform(0.0, 64.0));
}

TEST(PackedBits, ComeBackAsTheyWere) {
  Random random(1);
  std::vector<std::uint64_t> numbers{0, 1, 2, UINT64_MAX, UINT64_MAX - 1, std::uint64_t{1} << 63u};
  for (int i = 0; i < 2000; ++i) numbers.push_back(anyNumber(random));
  PackWriter out;
  out.byte(77);  // what comes before
  BitWriter bits(out);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto k = static_cast<unsigned>(i % 20);
    bits.number(numbers[i], k);
    bits.difference(static_cast<std::int64_t>(numbers[i]), k);
    bits.bits(numbers[i], static_cast<unsigned>(i % 65));
  }
  out.byte(78);  // and behind
  PackReader in(out.bytes.data());
  EXPECT_EQ(in.byte(), 77);
  BitReader back(in);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto k = static_cast<unsigned>(i % 20);
    ASSERT_EQ(back.number(k), numbers[i]) << i;
    ASSERT_EQ(back.difference(k), static_cast<std::int64_t>(numbers[i])) << i;
    const auto count = static_cast<unsigned>(i % 65);
    const std::uint64_t kept =
        count == 64 ? numbers[i] : numbers[i] & ((std::uint64_t{1} << count) - 1);
    ASSERT_EQ(back.bits(count), kept) << i;
  }
  EXPECT_EQ(in.byte(), 78);
  EXPECT_EQ(in.at(), out.bytes.data() + out.bytes.size());
}

TEST(PackedBits, TakeABitMoreThanUsualNumbersNeed) {
  PackWriter out;
  BitWriter bits(out);
  for (unsigned i = 0; i < 800; ++i) bits.number(i % 16, 4);
  EXPECT_EQ(out.bytes.size(), 500u);  // 4 + 1 bits each
}

}  // namespace
}  // namespace planar_mapping::detail
