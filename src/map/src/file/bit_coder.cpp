// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/bit_coder.h"

#include <algorithm>
#include <cstdlib>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kLargestLogit = 2047;  // of a model
constexpr std::int32_t kLargestMix = 2815;    // of what they say together

/// 65536 / (1 + exp(-x / 256)), by lines between points that are 64 apart.
std::int32_t squash(std::int32_t x) {
  static constexpr std::int32_t kTable[45] = {
      32768, 36843, 40793, 44511, 47911, 50941, 53581, 55834, 57724, 59287, 60565, 61598,
      62428, 63090, 63615, 64030, 64357, 64614, 64816, 64974, 65097, 65194, 65269, 65328,
      65374, 65410, 65438, 65459, 65476, 65489, 65500, 65508, 65514, 65519, 65523, 65526,
      65528, 65530, 65531, 65532, 65533, 65534, 65534, 65535, 65535};
  const std::int32_t size = std::abs(x);
  const std::int32_t part = size & 63;
  const std::int32_t* at = &kTable[size >> 6];
  const std::int32_t chance = (at[0] * (64 - part) + at[1] * part + 32) >> 6;
  return x < 0 ? 65536 - chance : chance;
}

/// Its inverse, of chances in 1/4096: the smallest x whose chance is in the middle of the step or
/// above.
struct Stretch {
  std::array<std::int16_t, 4096> table{};
  Stretch() {
    std::int32_t x = -kLargestLogit;
    for (std::size_t c = 0; c < table.size(); ++c) {
      while (x < kLargestLogit && squash(x) < static_cast<std::int32_t>(16 * c + 8)) ++x;
      table[c] = static_cast<std::int16_t>(x);
    }
  }
};

const Stretch& stretchTable() {
  static const Stretch stretch;
  return stretch;
}

constexpr std::uint32_t kMostSeen = 127;  // so a bit moves a chance by 1/129 at least
constexpr std::uint32_t kPriorSeen = 4;   // what prior maps count for

/// 65536 / (n + 2): how far the n-th bit moves a chance.
struct Rates {
  std::array<std::int32_t, kMostSeen + 1> of{};
  constexpr Rates() {
    for (std::size_t n = 0; n < of.size(); ++n) of[n] = static_cast<std::int32_t>(65536 / (n + 2));
  }
};
constexpr Rates kRates;

/// The chance stays this far from certain, of 65536.
constexpr std::uint32_t kLeastChance = 32;
constexpr std::uint32_t kLeastMixedChance = 4;
constexpr std::int32_t kLargestWeight = 1 << 24;  // 256: only what is made to do harm comes there

}  // namespace

BitCoder::BitCoder(const std::uint8_t* data, std::size_t size, std::string what)
    : data_(data), size_(size), what_(std::move(what)) {
  for (std::size_t i = 0; i < 4; ++i) window_ = (window_ << 8u) | (i < size ? data[i] : 0u);
}

bool BitCoder::code(bool bit, std::uint32_t chance) {
  const auto middle =
      static_cast<std::uint32_t>(low_ + ((std::uint64_t{high_ - low_} * chance) >> 16u));
  if (isReading()) bit = window_ <= middle;
  if (bit) {
    high_ = middle;
  } else {
    low_ = middle + 1;
  }
  while (((low_ ^ high_) & 0xff000000u) == 0) {
    if (isReading()) {
      // Beyond the end there are zeros, but only as many as the coder looks ahead.
      if (at_ > size_) fail("ends too early");
      const std::size_t next = at_ + 4;
      window_ = (window_ << 8u) | (next < size_ ? data_[next] : 0u);
      ++at_;
    } else {
      bytes_.push_back(static_cast<std::uint8_t>(high_ >> 24u));
    }
    low_ <<= 8u;
    high_ = (high_ << 8u) | 0xffu;
  }
  return bit;
}

std::uint64_t BitCoder::plain(std::uint64_t value, int count) {
  std::uint64_t coded = 0;
  for (int i = count - 1; i >= 0; --i) {
    coded = (coded << 1u) | (code(((value >> i) & 1u) != 0, 32768) ? 1u : 0u);
  }
  return coded;
}

std::array<std::uint8_t, 4> BitCoder::tail(std::size_t& count) const {
  for (count = 0; count < 4; ++count) {
    const std::uint64_t step = std::uint64_t{1} << (32 - 8 * count);
    const std::uint64_t value = (low_ + step - 1) / step * step;
    if (value > high_) continue;
    std::array<std::uint8_t, 4> bytes{};
    for (std::size_t i = 0; i < 4; ++i) {
      bytes[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
    }
    return bytes;
  }
  return {static_cast<std::uint8_t>(low_ >> 24u), static_cast<std::uint8_t>(low_ >> 16u),
          static_cast<std::uint8_t>(low_ >> 8u), static_cast<std::uint8_t>(low_)};
}

std::vector<std::uint8_t> BitCoder::finish(std::size_t fewest) {
  std::size_t count = 0;
  const std::array<std::uint8_t, 4> last = tail(count);
  bytes_.insert(bytes_.end(), last.begin(), last.begin() + static_cast<std::ptrdiff_t>(count));
  if (bytes_.size() < fewest) bytes_.resize(fewest, 0);
  return std::move(bytes_);
}

void BitCoder::finishReading(std::size_t fewest) const {
  std::size_t count = 0;
  const std::array<std::uint8_t, 4> last = tail(count);
  const std::size_t end = at_ + count;
  if (end > size_) fail("ends too early");
  if (std::max(end, fewest) != size_) fail("has bytes left over");
  bool same =
      std::equal(last.begin(), last.begin() + static_cast<std::ptrdiff_t>(count), data_ + at_);
  for (std::size_t i = end; i < size_; ++i) same &= data_[i] == 0;
  if (!same) fail("does not end as it should");
}

void BitCoder::fail(const std::string& problem) const {
  throw Error(what_ + " " + problem);
}

void AdaptiveBit::update(bool bit) {
  const std::uint32_t seen = state_ & kCountMask;
  const auto chance = static_cast<std::int64_t>(state_ >> kCountBits);
  const std::int64_t target = bit ? (1 << 22) - 1 : 0;
  const std::int64_t next = chance + (((target - chance) * kRates.of[seen]) >> 16);
  state_ = static_cast<std::uint32_t>(next) << kCountBits | std::min(seen + 1, kMostSeen);
}

bool AdaptiveBit::code(BitCoder& coder, bool bit) {
  bit = coder.code(bit, std::clamp(chance(), kLeastChance, 65536 - kLeastChance));
  update(bit);
  return bit;
}

void AdaptiveBit::forget() {
  state_ = (state_ & ~kCountMask) | std::min(state_ & kCountMask, kPriorSeen);
}

MixedBit::MixedBit(std::size_t models, std::size_t contexts, Selectors selectors)
    : models_(models), contexts_(contexts), bits_(models * contexts) {
  const auto weight = static_cast<std::int32_t>(98304 / models);
  weights_[0].assign(kLanes * selectors.first, weight);
  weights_[1].assign(kLanes * selectors.second, weight);
}

bool MixedBit::code(BitCoder& coder, bool bit, const std::uint32_t* context, Selectors selected) {
  AdaptiveBit* used[kMostModels];
  std::int32_t logit[kLanes] = {};  // 0 where there is no model: its weight does not matter
  const std::int16_t* stretch = stretchTable().table.data();
  for (std::size_t m = 0; m < models_; ++m) {
    used[m] = &bits_[m * contexts_ + context[m]];
    logit[m] = stretch[used[m]->chance() >> 4u];
  }
  std::int32_t* const weights[2] = {&weights_[0][selected.first * kLanes],
                                    &weights_[1][selected.second * kLanes]};
  std::int32_t mixed[2];
  for (std::size_t i = 0; i < 2; ++i) {
    std::int64_t sum = 0;
    for (std::size_t m = 0; m < kLanes; ++m) sum += std::int64_t{weights[i][m]} * logit[m];
    mixed[i] =
        static_cast<std::int32_t>(std::clamp<std::int64_t>(sum >> 16, -kLargestMix, kLargestMix));
  }
  const auto chance = static_cast<std::uint32_t>(squash((mixed[0] + mixed[1]) >> 1));
  bit = coder.code(bit, std::clamp(chance, kLeastMixedChance, 65536 - kLeastMixedChance));
  for (std::size_t i = 0; i < 2; ++i) {
    std::int32_t* weight = weights[i];
    const std::int32_t error = (bit ? 65536 : 0) - squash(mixed[i]);
    for (std::size_t m = 0; m < kLanes; ++m) {
      const std::int32_t learnt = weight[m] + ((logit[m] * error + (1 << 14)) >> 15);
      weight[m] = std::clamp(learnt, -kLargestWeight, kLargestWeight);
    }
  }
  for (std::size_t m = 0; m < models_; ++m) used[m]->update(bit);
  return bit;
}

void MixedBit::forget() {
  for (AdaptiveBit& bit : bits_) bit.forget();
}

void NumberModel::forget() {
  for (AdaptiveBit& bit : length_) bit.forget();
  for (AdaptiveBit& bit : upper_) bit.forget();
}

std::uint64_t NumberModel::code(BitCoder& coder, std::uint64_t value) {
  int length = 0;
  while (length < 64 && (value >> length) != 0) ++length;
  int coded = 0;
  while (coded < 64 && length_[static_cast<std::size_t>(coded)].code(coder, coded < length)) {
    ++coded;
  }
  if (coded <= 1) return static_cast<std::uint64_t>(coded);
  std::uint64_t result = 1;
  std::size_t node = 1;
  for (int i = coded - 2; i >= 0; --i) {
    const bool bit = ((value >> i) & 1u) != 0;
    bool read = false;
    if (node < 4) {
      read = upper_[4 * static_cast<std::size_t>(coded) + node].code(coder, bit);
      node = 2 * node + (read ? 1 : 0);
    } else {
      read = coder.code(bit, 32768);
    }
    result = (result << 1u) | (read ? 1u : 0u);
  }
  return result;
}

std::int64_t NumberModel::codeSigned(BitCoder& coder, std::int64_t value) {
  const std::uint64_t folded =
      (static_cast<std::uint64_t>(value) << 1u) ^ static_cast<std::uint64_t>(value >> 63);
  const std::uint64_t read = code(coder, folded);
  return static_cast<std::int64_t>(read >> 1u) ^ -static_cast<std::int64_t>(read & 1u);
}

std::int64_t NumberModel::codeWithin(BitCoder& coder, std::int64_t value, std::int64_t low,
                                     std::int64_t high) {
  const std::int64_t read = codeSigned(coder, value);
  if (read < low || read > high) coder.fail("holds a number outside its range");
  return read;
}

}  // namespace planar_mapping::detail
