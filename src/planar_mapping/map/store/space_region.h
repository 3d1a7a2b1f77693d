// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace planar_mapping::detail {

/// 4 x 4 x 4 cells, bit 16 z + 4 y + x.
struct SpaceBlock {
  std::uint64_t free = 0;
  std::uint64_t unknown = 0;
};

/// 8 x 8 x 8 blocks in few bytes: a label of two bits a block, of a whole row of 32 where they are
/// alike, and for each mixed block 64 bits, or twice 64 where its cells are of all three kinds,
/// which take one to nine bytes: most slices of 4 x 4 cells are empty, full, or like the one below.
class SpaceRegion {
 public:
  static constexpr std::size_t kBlocks = 512;
  /// What the cells of a block are; mixed: not all the same.
  enum Label : std::uint8_t { kNever, kFree, kUnknown, kMixed };

  /// A region to be worked on.
  struct Blocks {
    std::array<std::uint8_t, kBlocks> labels{};
    std::array<SpaceBlock, kBlocks> cells;  ///< of the mixed blocks

    SpaceBlock cellsOf(std::size_t block) const {
      constexpr std::uint64_t kAll = ~std::uint64_t{0};
      const std::uint8_t label = labels[block];
      if (label == kMixed) return cells[block];
      return {label == kFree ? kAll : 0, label == kUnknown ? kAll : 0};
    }
  };

  void pack(const Blocks& blocks);
  void unpack(Blocks& blocks) const;
  /// The cells of a block.
  SpaceBlock cellsOf(std::size_t block) const;
  /// A region whose blocks all have this label, which is not mixed.
  static SpaceRegion allOf(Label label);
  /// The label of all its blocks; mixed where they are not alike.
  Label label() const {
    const std::uint32_t first = row_labels_ & 3u;
    const bool is_alike = alike_ == 0xffff && row_labels_ == 0x55555555u * first;
    return is_alike ? static_cast<Label>(first) : kMixed;
  }
  bool isAllFree() const { return label() == kFree; }
  std::size_t memoryBytes() const { return bytes_.capacity(); }

 private:
  static constexpr std::size_t kRow = 32;  ///< blocks
  static constexpr std::size_t kRows = kBlocks / kRow;
  static constexpr std::size_t kKindsPerByte = 4;

  /// Of what kinds the cells of a mixed block are, and so what its bits say.
  enum Kinds : std::uint8_t { kFreeOrNever, kUnknownOrNever, kFreeOrUnknown, kAllThree };

  /// The cells of a mixed block, whose bytes are passed.
  static SpaceBlock takeBlock(Kinds kinds, const std::uint8_t*& at);
  bool isAlike(std::size_t row) const { return (alike_ >> row & 1u) != 0; }
  /// \param own number of the row among those that are not alike, if it is one
  std::uint64_t labelsOf(std::size_t row, std::size_t own) const;
  std::size_t ownRows() const {
    return kRows - static_cast<std::size_t>(__builtin_popcount(alike_));
  }
  Kinds kindsOf(std::size_t mixed) const {
    const std::uint8_t byte = bytes_.data()[8 * ownRows() + mixed / kKindsPerByte];
    return static_cast<Kinds>(byte >> (2 * (mixed % kKindsPerByte)) & 3u);
  }
  const std::uint8_t* firstCells() const {
    return bytes_.data() + 8 * ownRows() + (mixed_ + kKindsPerByte - 1) / kKindsPerByte;
  }

  std::uint32_t row_labels_ = 0;  ///< two bits for each row that is alike
  std::uint16_t alike_ = 0xffff;  ///< a bit for each row
  std::uint16_t mixed_ = 0;       ///< how many blocks are
  /// The labels of the other rows, the kinds of the mixed blocks by two bits, their cells.
  std::vector<std::uint8_t> bytes_;
};

}  // namespace planar_mapping::detail
