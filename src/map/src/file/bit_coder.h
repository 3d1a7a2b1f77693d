// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace planar_mapping::detail {

/// Binary arithmetic coder of the map file (docs/file_format.md, "Coded bits"). One class for both
/// directions, so that what is written and what is read cannot differ: code() returns the bit that
/// was coded, which is the argument when writing and comes from the file when reading.
class BitCoder {
 public:
  BitCoder() = default;  ///< writes
  /// Reads. \param what name of the bytes for messages
  BitCoder(const std::uint8_t* data, std::size_t size, std::string what);

  bool isReading() const { return data_ != nullptr; }
  /// \param chance of a one, in 1/65536, within [1, 65535]
  bool code(bool bit, std::uint32_t chance);
  /// \p count <= 64 bits, all equally likely.
  std::uint64_t plain(std::uint64_t value, int count);

  /// Ends the writing with at least \p fewest bytes.
  std::vector<std::uint8_t> finish(std::size_t fewest);
  /// Checks that the bytes end where the coded bits do. \throws Error
  void finishReading(std::size_t fewest) const;
  std::size_t size() const { return size_; }  ///< of the bytes that are read
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  /// The shortest bytes that stand for any value between low_ and high_.
  std::array<std::uint8_t, 4> tail(std::size_t& count) const;

  std::uint32_t low_ = 0;
  std::uint32_t high_ = 0xffffffffu;
  std::vector<std::uint8_t> bytes_;
  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t at_ = 0;  ///< bytes shifted out
  std::uint32_t window_ = 0;
  std::string what_;
};

/// A chance that learns, quickly at first.
class AdaptiveBit {
 public:
  /// Of a one, in 1/65536.
  std::uint32_t chance() const { return state_ >> 16u; }
  void update(bool bit);
  bool code(BitCoder& coder, bool bit);
  /// Keeps the chance, but lets the next bits move it as if few had been seen.
  void forget();

 private:
  static constexpr std::uint32_t kCountBits = 10;
  static constexpr std::uint32_t kCountMask = (1u << kCountBits) - 1;

  std::uint32_t state_ = 1u << 31u;  ///< the chance in 1/2^22, then how many bits were seen
};

/// Several contexts' chances for one bit, weighed by how well they did so far (logistic mixing, as
/// in the PAQ programs), in integers so that every machine computes the same. There are two mixes,
/// with weights of their own that are chosen by a selector each; the bit is coded by their mean.
class MixedBit {
 public:
  static constexpr std::size_t kMostModels = 11;
  /// Which weights the two mixes take.
  struct Selectors {
    std::size_t first;
    std::size_t second;
  };
  /// \param contexts  numbers of contexts of each model
  /// \param selectors numbers of sets of weights of each mix
  MixedBit(std::size_t models, std::size_t contexts, Selectors selectors);
  /// \param context one of each model
  bool code(BitCoder& coder, bool bit, const std::uint32_t* context, Selectors selected);
  void forget();

 private:
  static constexpr std::size_t kLanes = 12;  ///< weights of a set: loops of one length are fast
  static_assert(kLanes >= kMostModels);

  std::size_t models_;
  std::size_t contexts_;
  std::vector<AdaptiveBit> bits_;
  std::array<std::vector<std::int32_t>, 2> weights_;
};

/// Numbers of unknown size: how many bits, then the bits, the upper ones of them learnt.
class NumberModel {
 public:
  std::uint64_t code(BitCoder& coder, std::uint64_t value);
  std::int64_t codeSigned(BitCoder& coder, std::int64_t value);
  /// A signed number within [low, high]. \throws Error when reading another one
  std::int64_t codeWithin(BitCoder& coder, std::int64_t value, std::int64_t low, std::int64_t high);
  void forget();

 private:
  std::array<AdaptiveBit, 65> length_;
  std::array<AdaptiveBit, 65 * 4> upper_;
};

/// A number of few bits, each learnt given those above it.
template <int kBits>
class SymbolModel {
 public:
  std::uint32_t code(BitCoder& coder, std::uint32_t value) {
    std::uint32_t node = 1;
    for (int i = kBits - 1; i >= 0; --i) {
      node = 2 * node + (bits_[node].code(coder, ((value >> i) & 1u) != 0) ? 1u : 0u);
    }
    return node - (1u << kBits);
  }
  void forget() {
    for (AdaptiveBit& bit : bits_) bit.forget();
  }

 private:
  std::array<AdaptiveBit, std::size_t{1} << kBits> bits_;
};

/// Calls forget() of each.
template <typename... Models>
void forgetAll(Models&... models) {
  (models.forget(), ...);
}

}  // namespace planar_mapping::detail
