// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/space_region.h"

#include <cstring>

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
/// A row of blocks with the same label.
constexpr std::uint64_t kEach = 0x5555555555555555u;

/// How many labels of a row are mixed.
std::size_t countMixed(std::uint64_t labels) {
  return static_cast<std::size_t>(__builtin_popcountll(labels & (labels >> 1u) & kEach));
}

// The cells of a block: a byte with two bits for each slice, then those that need their own bits.
enum Slice : std::uint8_t { kEmpty, kFull, kAsBelow, kOwn };

void putCells(std::uint64_t cells, std::vector<std::uint8_t>& bytes) {
  const std::size_t head = bytes.size();
  bytes.push_back(0);
  std::uint64_t below = 0;
  for (int z = 0; z < 4; ++z) {
    const std::uint64_t slice = cells >> (16 * z) & 0xffffu;
    const Slice code = slice == 0         ? kEmpty
                       : slice == 0xffffu ? kFull
                       : slice == below   ? kAsBelow
                                          : kOwn;
    bytes[head] = static_cast<std::uint8_t>(bytes[head] | code << (2 * z));
    if (code == kOwn) {
      bytes.push_back(static_cast<std::uint8_t>(slice));
      bytes.push_back(static_cast<std::uint8_t>(slice >> 8u));
    }
    below = slice;
  }
}

std::uint64_t takeCells(const std::uint8_t*& at) {
  const std::uint8_t head = *at++;
  std::uint64_t cells = 0;
  std::uint64_t slice = 0;
  for (int z = 0; z < 4; ++z) {
    const auto code = static_cast<Slice>(head >> (2 * z) & 3u);
    if (code == kEmpty) slice = 0;
    if (code == kFull) slice = 0xffffu;
    if (code == kOwn) {
      slice = at[0] | std::uint64_t{at[1]} << 8u;
      at += 2;
    }
    cells |= slice << (16 * z);
  }
  return cells;
}

void skipCells(const std::uint8_t*& at) {
  at += 1 + 2 * countMixed(*at);  // the code of a slice of its own is that of a mixed label
}

}  // namespace

SpaceBlock SpaceRegion::takeBlock(Kinds kinds, const std::uint8_t*& at) {
  SpaceBlock b;
  if (kinds != kUnknownOrNever) b.free = takeCells(at);
  if (kinds == kUnknownOrNever || kinds == kAllThree) b.unknown = takeCells(at);
  if (kinds == kFreeOrUnknown) b.unknown = ~b.free;
  return b;
}

std::uint64_t SpaceRegion::labelsOf(std::size_t row, std::size_t own) const {
  if (isAlike(row)) return kEach * (row_labels_ >> (2 * row) & 3u);
  std::uint64_t labels = 0;
  std::memcpy(&labels, bytes_.data() + 8 * own, sizeof labels);
  return labels;
}

void SpaceRegion::pack(const Blocks& blocks) {
  row_labels_ = 0;
  alike_ = 0;
  mixed_ = 0;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(1024);
  for (std::size_t row = 0; row < kRows; ++row) {
    std::uint64_t labels = 0;
    for (std::size_t i = 0; i < kRow; ++i) {
      labels |= std::uint64_t{blocks.labels[row * kRow + i]} << (2 * i);
    }
    mixed_ = static_cast<std::uint16_t>(mixed_ + countMixed(labels));
    const auto first = static_cast<std::uint32_t>(labels & 3u);
    if (first != kMixed && labels == kEach * first) {
      alike_ = static_cast<std::uint16_t>(alike_ | 1u << row);
      row_labels_ |= first << (2 * row);
    } else {
      bytes.resize(bytes.size() + sizeof labels);
      std::memcpy(&bytes[bytes.size() - sizeof labels], &labels, sizeof labels);
    }
  }
  const std::size_t kinds = bytes.size();
  bytes.resize(kinds + (mixed_ + kKindsPerByte - 1) / kKindsPerByte);
  std::size_t mixed = 0;
  for (std::size_t i = 0; i < kBlocks; ++i) {
    if (blocks.labels[i] != kMixed) continue;
    const SpaceBlock& b = blocks.cells[i];
    const Kinds k = b.unknown == 0                 ? kFreeOrNever
                    : b.free == 0                  ? kUnknownOrNever
                    : (b.free | b.unknown) == kAll ? kFreeOrUnknown
                                                   : kAllThree;
    std::uint8_t& byte = bytes[kinds + mixed / kKindsPerByte];
    byte = static_cast<std::uint8_t>(byte | k << (2 * (mixed % kKindsPerByte)));
    ++mixed;
    if (k != kUnknownOrNever) putCells(b.free, bytes);
    if (k == kUnknownOrNever || k == kAllThree) putCells(b.unknown, bytes);
  }
  bytes_ = std::vector<std::uint8_t>(bytes);  // without spare capacity
}

void SpaceRegion::unpack(Blocks& blocks) const {
  std::size_t own = 0;
  std::size_t mixed = 0;
  const std::uint8_t* at = firstCells();
  for (std::size_t row = 0; row < kRows; ++row) {
    if (isAlike(row)) {
      const int label = static_cast<int>(row_labels_ >> (2 * row) & 3u);
      std::memset(&blocks.labels[row * kRow], label, kRow);
      continue;
    }
    const std::uint64_t labels = labelsOf(row, own++);
    for (std::size_t i = 0; i < kRow; ++i) {
      const auto label = static_cast<std::uint8_t>(labels >> (2 * i) & 3u);
      blocks.labels[row * kRow + i] = label;
      if (label != kMixed) continue;
      blocks.cells[row * kRow + i] = takeBlock(kindsOf(mixed++), at);
    }
  }
}

SpaceRegion SpaceRegion::allOf(Label label) {
  SpaceRegion region;
  region.row_labels_ = 0x55555555u * label;
  return region;
}

SpaceBlock SpaceRegion::cellsOf(std::size_t block) const {
  const std::size_t row = block / kRow;
  const std::size_t place = 2 * (block % kRow);
  std::size_t mixed = 0;
  std::size_t own = 0;
  for (std::size_t r = 0; r < row; ++r) {
    if (!isAlike(r)) mixed += countMixed(labelsOf(r, own++));
  }
  const std::uint64_t labels = labelsOf(row, own);
  const std::uint64_t label = labels >> place & 3u;
  if (label != kMixed) return {label == kFree ? kAll : 0, label == kUnknown ? kAll : 0};
  mixed += countMixed(labels & ((std::uint64_t{1} << place) - 1));

  const std::uint8_t* at = firstCells();
  for (std::size_t m = 0; m < mixed; ++m) {
    if (kindsOf(m) == kAllThree) skipCells(at);
    skipCells(at);
  }
  return takeBlock(kindsOf(mixed), at);
}

}  // namespace planar_mapping::detail
