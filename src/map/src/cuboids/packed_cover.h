// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "store/packed_records.h"
#include "planar_mapping/core/cuboids/detail/compact_cover.h"

namespace planar_mapping::detail {

/// What was made of a patch of a plane.
struct PatchCover {
  struct Rectangle {
    HalfCellRectangle place;
    float probability = 1.0f;
  };
  // What it was made of.
  std::int32_t plane = 0;            ///< its id
  std::uint64_t key = 0;             ///< of the patch
  std::uint32_t revision = 0;        ///< of the patch
  std::uint32_t frame_revision = 0;  ///< of the plane
  std::uint8_t spread = 0;           ///< surfaceSpread() of the plane

  std::vector<Rectangle> rectangles;
  std::vector<LooseQuarter> loose;
  std::vector<std::uint64_t> regions;  ///< in which it has or absorbs something; ascending
};

/// The cover in few bytes: about six a rectangle, less than one a loose quarter. At first no
/// rectangle is replaced.
std::vector<std::uint8_t> packCover(const PatchCover& cover);

/// Reads a record that packCover() wrote.
class PackedCover {
 public:
  explicit PackedCover(const PackedRecords::Record& record)
      : data_(record.data), size_(record.size) {}

  PatchCover unpacked() const;
  /// Without the lists: much quicker than unpacked().
  PatchCover head() const;
  std::vector<std::uint64_t> regions() const;
  /// Rectangles that are not replaced.
  std::size_t count() const;
  // Boxes of a region may take the place of a rectangle. Several threads may say so, each of
  // rectangles of its own, while others unpack the cover.
  bool isReplaced(std::size_t rectangle) const { return data_[size_ - 1 - rectangle] != 0; }
  static void setReplaced(std::uint8_t* data, std::size_t size, std::size_t rectangle,
                          bool replaced) {
    data[size - 1 - rectangle] = replaced ? 1 : 0;
  }

 private:
  /// In the order of PatchCover; at the end, the last one first, which rectangles are replaced.
  const std::uint8_t* data_;
  std::size_t size_;
};

}  // namespace planar_mapping::detail
