// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "space_region.h"

namespace planar_mapping::detail {
namespace {

/// A row of blocks with the same label.
constexpr std::uint64_t kEach = 0x5555555555555555u;

/// The low bits of the labels that are mixed.
std::uint64_t mixedOf(std::uint64_t labels) {
  return labels & (labels >> 1u) & kEach;
}

std::size_t countOf(std::uint64_t bits) {
  return static_cast<std::size_t>(__builtin_popcountll(bits));
}

}  // namespace

/// \param word position of the row's labels, if it has its own
std::uint64_t SpaceRegion::labelsOf(std::size_t row, std::size_t word) const {
  return isAlike(row) ? kEach * (row_labels_ >> (2 * row) & 3u) : words_[word];
}

void SpaceRegion::pack(const Blocks& blocks) {
  row_labels_ = 0;
  alike_ = 0;
  mixed_ = 0;
  std::array<std::uint64_t, kRows> own{};
  std::array<std::uint64_t, kRows> kinds{};
  std::size_t rows = 0;
  std::size_t cells = 0;
  for (std::size_t row = 0; row < kRows; ++row) {
    std::uint64_t labels = 0;
    for (std::size_t i = 0; i < kRow; ++i) {
      const std::uint64_t label = blocks.labels[row * kRow + i];
      labels |= label << (2 * i);
      if (label != kMixed) continue;
      const SpaceBlock& b = blocks.cells[row * kRow + i];
      const Kinds k = b.unknown == 0                              ? kFreeOrNever
                      : b.free == 0                               ? kUnknownOrNever
                      : (b.free | b.unknown) == ~std::uint64_t{0} ? kFreeOrUnknown
                                                                  : kAllThree;
      kinds[mixed_ / kRow] |= std::uint64_t{k} << (2 * (mixed_ % kRow));
      ++mixed_;
      cells += k == kAllThree ? 2 : 1;
    }
    const auto first = static_cast<std::uint32_t>(labels & 3u);
    if (first != kMixed && labels == kEach * first) {
      alike_ = static_cast<std::uint16_t>(alike_ | 1u << row);
      row_labels_ |= first << (2 * row);
    } else {
      own[rows++] = labels;
    }
  }
  const std::size_t kind_words = (mixed_ + kRow - 1) / kRow;
  std::vector<std::uint64_t> words;
  words.reserve(rows + kind_words + cells);  // and not more: there are many regions
  words.insert(words.end(), own.begin(), own.begin() + static_cast<std::ptrdiff_t>(rows));
  words.insert(words.end(), kinds.begin(), kinds.begin() + static_cast<std::ptrdiff_t>(kind_words));
  for (std::size_t i = 0; i < kBlocks; ++i) {
    if (blocks.labels[i] != kMixed) continue;
    const SpaceBlock& b = blocks.cells[i];
    if (b.free != 0) words.push_back(b.free);
    if (b.free == 0 || (b.unknown != 0 && (b.free | b.unknown) != ~std::uint64_t{0})) {
      words.push_back(b.unknown);
    }
  }
  words_ = std::move(words);
}

void SpaceRegion::unpack(Blocks& blocks) const {
  std::size_t word = 0;
  std::size_t mixed = 0;
  std::size_t next = firstKinds() + (mixed_ + kRow - 1) / kRow;
  for (std::size_t row = 0; row < kRows; ++row) {
    const std::uint64_t labels = labelsOf(row, word);
    word += isAlike(row) ? 0 : 1;
    for (std::size_t i = 0; i < kRow; ++i) {
      const auto label = static_cast<std::uint8_t>(labels >> (2 * i) & 3u);
      blocks.labels[row * kRow + i] = label;
      if (label != kMixed) continue;
      const Kinds kinds = kindsOf(mixed++);
      const std::uint64_t cells = words_[next++];
      blocks.cells[row * kRow + i] = {kinds == kUnknownOrNever ? 0 : cells,
                                      kinds == kUnknownOrNever  ? cells
                                      : kinds == kFreeOrUnknown ? ~cells
                                      : kinds == kAllThree      ? words_[next++]
                                                                : 0};
    }
  }
}

bool SpaceRegion::isUnknown(std::size_t block, int bit) const {
  const std::size_t row = block / kRow;
  const std::size_t at = 2 * (block % kRow);
  const std::uint32_t before = (1u << row) - 1;
  const std::size_t word = row - countOf(alike_ & before);
  const std::uint64_t labels = labelsOf(row, word);
  const auto label = labels >> at & 3u;
  if (label != kMixed) return label == kUnknown;
  std::size_t mixed = countOf(mixedOf(labels) & ((std::uint64_t{1} << at) - 1));
  for (std::size_t w = 0; w < word; ++w) mixed += countOf(mixedOf(words_[w]));
  const std::size_t first = firstKinds();
  std::size_t place = first + (mixed_ + kRow - 1) / kRow + mixed;
  // Blocks of all three kinds take two words; their two bits are those of a mixed label.
  for (std::size_t w = 0; w < mixed / kRow; ++w) place += countOf(mixedOf(words_[first + w]));
  if (mixed % kRow != 0) {
    const std::uint64_t below = (std::uint64_t{1} << (2 * (mixed % kRow))) - 1;
    place += countOf(mixedOf(words_[first + mixed / kRow]) & below);
  }
  const Kinds kinds = kindsOf(mixed);
  if (kinds == kFreeOrNever) return false;
  const std::uint64_t cells = words_[kinds == kAllThree ? place + 1 : place];
  return (cells >> bit & 1u) != (kinds == kFreeOrUnknown ? 1u : 0u);
}

}  // namespace planar_mapping::detail
