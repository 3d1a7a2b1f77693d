// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <vector>

#include "file/finished_coder.h"
#include "planar_mapping/core/base/detail/random.h"
#include "file/prior_maps.h"
#include "file/record_coder.h"

namespace planar_mapping::detail {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// The prior maps in the order of the format.
template <typename Record, typename Coder>
std::vector<Record> priorMaps(const std::uint8_t* data, std::size_t size, std::size_t count) {
  BitCoder in(data, size, "the prior maps");
  Coder learning;
  std::vector<Record> maps(count);
  for (Record& map : maps) learning.code(in, map);
  in.finishReading(0);
  return maps;
}
std::vector<MapRecord> priorMaps() {
  return priorMaps<MapRecord, RecordCoder>(kPriorMaps, kPriorMapsSize, kPriorMapCount);
}
std::vector<FinishedRecord> priorFinishedMaps() {
  return priorMaps<FinishedRecord, FinishedCoder>(kPriorFinishedMaps, kPriorFinishedMapsSize,
                                                  kPriorFinishedMapCount);
}

template <typename Coder, typename Record>
Bytes coded(const std::vector<Record>& maps) {
  BitCoder out;
  Coder learning;
  for (Record map : maps) learning.code(out, map);
  return out.finish(0);
}

template <typename Coder, typename Record>
void expectSmallerWithExperience(Record map) {
  BitCoder with, without;
  Coder::experienced().code(with, map);
  Coder().code(without, map);
  EXPECT_LT(with.finish(0).size() * 4, without.finish(0).size() * 3);
}

// These fail where contexts or rates of a coder change: then the version must, and the maps be made
// again (scripts/prior_maps.sh).

TEST(PriorMaps, AreWhatACoderWithoutExperienceWrites) {
  const std::vector<MapRecord> maps = priorMaps();
  ASSERT_GE(maps.size(), 4u);
  for (const MapRecord& map : maps) EXPECT_EQ(map.trajectory.size(), 10u);
  EXPECT_EQ(coded<RecordCoder>(maps), Bytes(kPriorMaps, kPriorMaps + kPriorMapsSize));
}

TEST(PriorMaps, OfFinishedMapsAreWhatACoderWithoutExperienceWrites) {
  const std::vector<FinishedRecord> maps = priorFinishedMaps();
  ASSERT_GE(maps.size(), 4u);
  for (const FinishedRecord& map : maps) EXPECT_FALSE(map.planes.empty());
  EXPECT_EQ(coded<FinishedCoder>(maps),
            Bytes(kPriorFinishedMaps, kPriorFinishedMaps + kPriorFinishedMapsSize));
}

TEST(PriorMaps, MakeSmallFilesSmaller) {
  expectSmallerWithExperience<RecordCoder>(priorMaps()[2]);
  expectSmallerWithExperience<FinishedCoder>(priorFinishedMaps()[2]);
}

TEST(BitCoder, ReadsWhatWasWrittenAtTheRimsOfChances) {
  Random random(2);
  std::vector<std::pair<bool, std::uint32_t>> bits;
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t chance = i % 3 == 0 ? 1 : i % 3 == 1 ? 65535 : 1 + random.below(65535);
    bits.emplace_back(random.below(65536) < chance, chance);
  }
  bits.emplace_back(true, 1);
  bits.emplace_back(false, 65535);
  BitCoder out;
  for (const auto& [bit, chance] : bits) out.code(bit, chance);
  const Bytes bytes = out.finish(0);
  BitCoder in(bytes.data(), bytes.size(), "bytes");
  for (const auto& [bit, chance] : bits) EXPECT_EQ(in.code(false, chance), bit);
  EXPECT_NO_THROW(in.finishReading(0));
}

TEST(AdaptiveBit, LearnsAndForgetsHowSureItIs) {
  AdaptiveBit bit;
  EXPECT_EQ(bit.chance(), 32768u);
  for (int i = 0; i < 1000; ++i) bit.update(true);
  EXPECT_GT(bit.chance(), 65400u);
  AdaptiveBit unsure = bit;
  unsure.forget();
  EXPECT_EQ(unsure.chance(), bit.chance());
  bit.update(false);
  unsure.update(false);
  EXPECT_GT(bit.chance(), 64500u);
  EXPECT_LT(unsure.chance(), 55000u);
  for (int i = 0; i < 5000; ++i) bit.update(false);
  EXPECT_LT(bit.chance(), 100u);  // no rounding keeps it from either end
}

TEST(MixedBit, FindsTheModelThatIsRight) {
  // Of three models one has the bit as its context.
  Random random(5);
  MixedBit mixed(3, 4, {1, 2});
  BitCoder out;
  for (int i = 0; i < 4000; ++i) {
    const std::uint32_t bit = random.below(2);
    const std::uint32_t context[3] = {random.below(4), 2 + bit, random.below(4)};
    mixed.code(out, bit == 1, context, {0, static_cast<std::size_t>(i % 2)});
  }
  EXPECT_LT(out.finish(0).size(), 25u);
}

}  // namespace
}  // namespace planar_mapping::detail
