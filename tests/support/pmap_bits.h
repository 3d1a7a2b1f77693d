// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace planar_mapping::test {

/// The coded bits of a .pmap, written from docs/file_format.md ("Coded bits") alone: reads what the
/// library writes, and writes what it must survive to read.
class PmapBits {
 public:
  PmapBits() = default;  ///< writes
  explicit PmapBits(std::vector<std::uint8_t> payload) : reading(true), bytes(std::move(payload)) {
    for (std::size_t i = 0; i < 4; ++i) value_ = value_ << 8 | byteAt(i);
  }
  const bool reading = false;
  std::vector<std::uint8_t> bytes;

  bool bit(bool wanted, std::uint32_t chance) {
    const std::uint64_t range = std::uint64_t{high_} - low_;
    const auto middle = static_cast<std::uint32_t>(low_ + range * chance / 4096);
    const bool is_one = reading ? value_ <= middle : wanted;
    (is_one ? high_ : low_) = is_one ? middle : middle + 1;
    while (low_ >> 24 == high_ >> 24) {
      if (reading) {
        value_ = value_ << 8 | byteAt(at_ + 4);
        ++at_;
        if (at_ > bytes.size()) throw std::runtime_error("read beyond the end");
      } else {
        bytes.push_back(static_cast<std::uint8_t>(low_ >> 24));
      }
      low_ <<= 8;
      high_ = high_ << 8 | 0xff;
    }
    return is_one;
  }
  std::uint64_t plain(std::uint64_t wanted, int count) {
    std::uint64_t value = 0;
    for (int i = count - 1; i >= 0; --i) value = value << 1 | (bit(wanted >> i & 1, 2048) ? 1 : 0);
    return value;
  }
  /// Bytes that the coded bits take.
  std::size_t end() const { return at_ + tail().size(); }
  std::vector<std::uint8_t> finish() {
    const std::vector<std::uint8_t> last = tail();
    bytes.insert(bytes.end(), last.begin(), last.end());
    return bytes;
  }

 private:
  std::uint32_t byteAt(std::size_t i) const { return i < bytes.size() ? bytes[i] : 0; }
  /// The fewest bytes, followed by zeros, that lie between low and high.
  std::vector<std::uint8_t> tail() const {
    for (int count = 0; count <= 4; ++count) {
      const std::uint64_t step = std::uint64_t{1} << (32 - 8 * count);
      const std::uint64_t v = (low_ + step - 1) / step * step;
      if (v > high_) continue;
      std::vector<std::uint8_t> last;
      for (int i = 0; i < count; ++i) last.push_back(static_cast<std::uint8_t>(v >> (24 - 8 * i)));
      return last;
    }
    return {};
  }
  std::uint32_t low_ = 0;
  std::uint32_t high_ = 0xffffffffu;
  std::uint32_t value_ = 0;
  std::size_t at_ = 0;
};

struct Chance {
  int p = 32768;
  int n = 0;
  void learn(bool one) {
    const int rate = 40960 / (10 * n + 16);
    const int apart = ((one ? 65535 : 0) - p) * rate;
    p += apart >= 0 ? apart / 4096 : -((-apart + 4095) / 4096);  // rounded down
    n = std::min(n + 1, 58);
  }
  bool code(PmapBits& bits, bool one = false) {
    one = bits.bit(one, static_cast<std::uint32_t>(std::clamp(p / 16, 2, 4094)));
    learn(one);
    return one;
  }
};

inline int squash(int x) {
  static const int table[33] = {1,    2,    3,    6,    10,   16,   27,   45,   73,   120,  194,
                                310,  488,  747,  1101, 1546, 2047, 2549, 2994, 3348, 3607, 3785,
                                3901, 3975, 4024, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094};
  const int at = (x + 2048) / 128, part = (x + 2048) % 128;
  return (table[at] * (128 - part) + table[at + 1] * part + 64) / 128;
}
inline int stretch(int chance) {
  static const std::vector<int> table = [] {
    std::vector<int> t(4096, 2047);
    for (int x = 2047; x >= -2047; --x) {
      for (int c = 0; c <= squash(x); ++c) t[static_cast<std::size_t>(c)] = x;
    }
    return t;
  }();
  return table[static_cast<std::size_t>(chance)];
}

struct Mixed {
  std::size_t models;
  std::vector<std::vector<Chance>> chances;  ///< by model and context
  std::vector<std::vector<int>> weights;     ///< by set and model

  Mixed(std::size_t m, std::size_t contexts, std::size_t sets)
      : models(m),
        chances(m, std::vector<Chance>(contexts)),
        weights(sets, std::vector<int>(m, 98304 / static_cast<int>(m))) {}
  bool code(PmapBits& bits, bool one, const std::vector<std::size_t>& context, std::size_t set) {
    std::int64_t sum = 0;
    for (std::size_t m = 0; m < models; ++m) {
      sum += std::int64_t{weights[set][m]} * stretch(chances[m][context[m]].p / 16);
    }
    const auto x = static_cast<int>(std::clamp<std::int64_t>(
        static_cast<std::int64_t>(std::floor(sum / 65536.0)), -2047, 2047));
    const int chance = std::clamp(squash(x), 2, 4094);
    one = bits.bit(one, static_cast<std::uint32_t>(chance));
    const int error = ((one ? 4096 : 0) - chance) * 24;
    for (std::size_t m = 0; m < models; ++m) {
      Chance& c = chances[m][context[m]];
      weights[set][m] +=
          static_cast<int>(std::floor((std::int64_t{stretch(c.p / 16)} * error + 32768) / 65536.0));
      c.learn(one);
    }
    return one;
  }
};

struct Number {
  std::array<Chance, 65> longer;
  std::array<std::array<Chance, 4>, 65> upper;
  std::uint64_t code(PmapBits& bits, std::uint64_t wanted = 0) {
    std::size_t wanted_length = 0, length = 0;
    while (wanted_length < 64 && wanted >> wanted_length != 0) ++wanted_length;
    while (length < 64 && longer[length].code(bits, length < wanted_length)) ++length;
    if (length < 2) return length;
    std::uint64_t value = 1;
    for (std::size_t i = length - 1; i-- > 0;) {
      const bool one = wanted >> i & 1;
      const bool learnt = value < 4 && length - 2 - i < 2;
      value = value << 1 |
              ((learnt ? upper[length][value].code(bits, one) : bits.bit(one, 2048)) ? 1 : 0);
    }
    return value;
  }
  std::int64_t codeSigned(PmapBits& bits, std::int64_t wanted = 0) {
    const std::uint64_t n =
        code(bits, wanted < 0 ? 2 * static_cast<std::uint64_t>(-(wanted + 1)) + 1
                              : 2 * static_cast<std::uint64_t>(wanted));
    return n % 2 == 0 ? static_cast<std::int64_t>(n / 2) : -static_cast<std::int64_t>(n / 2) - 1;
  }
};

template <int bits_of_it>
struct Symbol {
  std::array<Chance, std::size_t{1} << bits_of_it> chances;
  unsigned code(PmapBits& bits, unsigned wanted = 0) {
    unsigned node = 1;
    for (int i = bits_of_it - 1; i >= 0; --i) {
      node = 2 * node + (chances[node].code(bits, wanted >> i & 1) ? 1 : 0);
    }
    return node - (1u << bits_of_it);
  }
};

}  // namespace planar_mapping::test
