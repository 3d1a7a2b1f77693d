// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "bit_coder.h"

#include <algorithm>

#include "planar_mapping/core/error.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kLargestLogit = 2047;

/// 4096 / (1 + exp(-x / 256)), by lines between 33 points.
std::int32_t squash(std::int32_t x) {
  static constexpr std::int32_t kTable[33] = {1,    2,    3,    6,    10,   16,   27,   45,   73,
                                              120,  194,  310,  488,  747,  1101, 1546, 2047, 2549,
                                              2994, 3348, 3607, 3785, 3901, 3975, 4024, 4050, 4068,
                                              4079, 4085, 4089, 4092, 4093, 4094};
  if (x > kLargestLogit) return 4095;
  if (x < -kLargestLogit) return 0;
  const std::int32_t part = x & 127;
  const std::int32_t at = (x >> 7) + 16;
  return (kTable[at] * (128 - part) + kTable[at + 1] * part + 64) >> 7;
}

/// Its inverse: the smallest x with squash(x) >= chance.
struct Stretch {
  std::array<std::int16_t, 4096> table{};
  Stretch() {
    std::int32_t next = 0;
    for (std::int32_t x = -kLargestLogit; x <= kLargestLogit; ++x) {
      for (const std::int32_t v = squash(x); next <= v; ++next) {
        table[static_cast<std::size_t>(next)] = static_cast<std::int16_t>(x);
      }
    }
    for (; next < 4096; ++next) table[static_cast<std::size_t>(next)] = kLargestLogit;
  }
};

const Stretch& stretchTable() {
  static const Stretch stretch;
  return stretch;
}

/// 4096 / (n + 1.6): how far the n-th bit moves a chance, but no less than 1/60.
struct Rates {
  std::array<std::int32_t, 59> of{};
  constexpr Rates() {
    for (std::size_t n = 0; n < of.size(); ++n) {
      of[n] = static_cast<std::int32_t>(40960 / (10 * n + 16));
    }
  }
};
constexpr Rates kRates;

constexpr std::uint32_t kLeastChance = 2;  // of 4096: bounds what a byte can stand for

std::uint32_t clampChance(std::int64_t chance) {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(chance, kLeastChance, 4096 - kLeastChance));
}

}  // namespace

BitCoder::BitCoder(const std::uint8_t* data, std::size_t size, std::string what)
    : data_(data), size_(size), what_(std::move(what)) {
  for (std::size_t i = 0; i < 4; ++i) window_ = (window_ << 8u) | (i < size ? data[i] : 0u);
}

bool BitCoder::code(bool bit, std::uint32_t chance) {
  const std::uint32_t range = high_ - low_;
  const std::uint32_t middle =
      low_ + (range >> 12u) * chance + (((range & 0xfffu) * chance) >> 12u);
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
    coded = (coded << 1u) | (code(((value >> i) & 1u) != 0, 2048) ? 1u : 0u);
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
  const std::int32_t target = bit ? 65535 : 0;
  chance_ = static_cast<std::uint16_t>(chance_ + (((target - chance_) * kRates.of[seen_]) >> 12));
  if (seen_ + 1u < kRates.of.size()) ++seen_;
}

bool AdaptiveBit::code(BitCoder& coder, bool bit) {
  bit = coder.code(bit, clampChance(chance_ >> 4u));
  update(bit);
  return bit;
}

MixedBit::MixedBit(std::size_t models, std::size_t contexts, std::size_t selectors)
    : models_(models), contexts_(contexts), bits_(models * contexts) {
  weights_.assign(models * selectors, static_cast<std::int32_t>(98304 / models));
}

bool MixedBit::code(BitCoder& coder, bool bit, const std::uint32_t* context, std::size_t selector) {
  AdaptiveBit* used[kMostModels];
  std::int32_t logit[kMostModels];
  std::int32_t* weight = &weights_[selector * models_];
  std::int64_t sum = 0;
  const std::int16_t* stretch = stretchTable().table.data();
  for (std::size_t m = 0; m < models_; ++m) {
    used[m] = &bits_[m * contexts_ + context[m]];
    logit[m] = stretch[used[m]->chance() >> 4u];
    sum += std::int64_t{weight[m]} * logit[m];
  }
  const std::uint32_t chance = clampChance(
      squash(static_cast<std::int32_t>(std::clamp<std::int64_t>(sum >> 16, -2047, 2047))));
  bit = coder.code(bit, chance);
  const std::int32_t error = ((bit ? 4096 : 0) - static_cast<std::int32_t>(chance)) * 24;
  for (std::size_t m = 0; m < models_; ++m) {
    weight[m] += (logit[m] * error + 0x8000) >> 16;
    used[m]->update(bit);
  }
  return bit;
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
      read = coder.code(bit, 2048);
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
