// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
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
  bool reading = false;
  std::vector<std::uint8_t> bytes;

  bool bit(bool wanted, std::uint32_t chance) {
    const std::uint64_t range = std::uint64_t{high_} - low_;
    const auto middle = static_cast<std::uint32_t>(low_ + range * chance / 65536);
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
    for (int i = count - 1; i >= 0; --i) value = value << 1 | (bit(wanted >> i & 1, 32768) ? 1 : 0);
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

inline std::int64_t roundedDown(std::int64_t value, std::int64_t divisor) {
  return value >= 0 ? value / divisor : -((-value + divisor - 1) / divisor);
}

struct Chance {
  std::int64_t p = 1 << 21;  ///< of 2^22
  int n = 0;
  void learn(bool one) {
    const std::int64_t apart = (one ? (1 << 22) - 1 : 0) - p;
    p += roundedDown(apart * (65536 / (n + 2)), 65536);
    n = std::min(n + 1, 127);
  }
  bool code(PmapBits& bits, bool one = false) {
    one = bits.bit(one, static_cast<std::uint32_t>(std::clamp<std::int64_t>(p / 64, 32, 65504)));
    learn(one);
    return one;
  }
  void forget() { n = std::min(n, 4); }
};

/// Calls forget() of each of a list of models, or of lists of them.
template <typename Models>
void forgetEach(Models& models) {
  for (auto& model : models) model.forget();
}

inline int squash(int x) {
  static const std::vector<int> table = [] {
    std::vector<int> t;
    for (int i = 0; i <= 44; ++i) {
      t.push_back(static_cast<int>(std::lround(65536.0 / (1.0 + std::exp(-i / 4.0)))));
    }
    return t;
  }();
  const auto at = static_cast<std::size_t>(std::abs(x) / 64);
  const int part = std::abs(x) % 64;
  const int chance = (table[at] * (64 - part) + table[at + 1] * part + 32) / 64;
  return x < 0 ? 65536 - chance : chance;
}
/// Of a chance in 1/4096.
inline int stretch(std::int64_t chance) {
  static const std::vector<int> table = [] {
    std::vector<int> t;
    for (int c = 0; c < 4096; ++c) {
      int x = -2047;
      while (x < 2047 && squash(x) < 16 * c + 8) ++x;
      t.push_back(x);
    }
    return t;
  }();
  return table[static_cast<std::size_t>(chance)];
}

struct Mixed {
  std::size_t models;
  std::vector<std::vector<Chance>> chances;                       ///< by model and context
  std::array<std::vector<std::vector<std::int64_t>>, 2> weights;  ///< by mix, set and model

  Mixed(std::size_t m, std::size_t contexts, std::array<std::size_t, 2> sets)
      : models(m), chances(m, std::vector<Chance>(contexts)) {
    const std::vector<std::int64_t> first(m, 98304 / static_cast<int>(m));
    for (std::size_t k = 0; k < 2; ++k) weights[k].assign(sets[k], first);
  }
  bool code(PmapBits& bits, bool one, const std::vector<std::size_t>& context,
            std::array<std::size_t, 2> set) {
    int x[2];
    for (std::size_t k = 0; k < 2; ++k) {
      std::int64_t sum = 0;
      for (std::size_t m = 0; m < models; ++m) {
        sum += weights[k][set[k]][m] * stretch(chances[m].at(context[m]).p / 1024);
      }
      x[k] = static_cast<int>(std::clamp<std::int64_t>(roundedDown(sum, 65536), -2815, 2815));
    }
    const int chance = squash(static_cast<int>(roundedDown(x[0] + x[1], 2)));
    one = bits.bit(one, static_cast<std::uint32_t>(std::clamp(chance, 4, 65532)));
    for (std::size_t k = 0; k < 2; ++k) {
      const std::int64_t error = (one ? 65536 : 0) - squash(x[k]);
      for (std::size_t m = 0; m < models; ++m) {
        const int logit = stretch(chances[m][context[m]].p / 1024);
        weights[k][set[k]][m] += roundedDown(logit * error + 16384, 32768);
      }
    }
    for (std::size_t m = 0; m < models; ++m) chances[m][context[m]].learn(one);
    return one;
  }
  void forget() {
    for (std::vector<Chance>& of_model : chances) forgetEach(of_model);
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
              ((learnt ? upper[length][value].code(bits, one) : bits.bit(one, 32768)) ? 1 : 0);
    }
    return value;
  }
  std::int64_t codeSigned(PmapBits& bits, std::int64_t wanted = 0) {
    const std::uint64_t n =
        code(bits, wanted < 0 ? 2 * static_cast<std::uint64_t>(-(wanted + 1)) + 1
                              : 2 * static_cast<std::uint64_t>(wanted));
    return n % 2 == 0 ? static_cast<std::int64_t>(n / 2) : -static_cast<std::int64_t>(n / 2) - 1;
  }
  void forget() {
    forgetEach(longer);
    for (auto& chances : upper) forgetEach(chances);
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
  void forget() { forgetEach(chances); }
};

}  // namespace planar_mapping::test
