// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>

#include "cuboids/raster/cell_mask.h"
#include "cuboids/raster/chord_selection.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

// Minimum partition of a rectilinear region (Lipski, Lodi, Luccio, Mugnai, Pagli 1979; Ohtsuki
// 1982; Ferrari, Sankar, Sklansky 1984): a cut from a concave vertex removes one concavity, a
// chord between two of them removes two for the price of one cut, and chords that do not touch each
// other keep that gain. So: as many disjoint chords as possible, then one cut for each concave
// vertex left over.
//
// On a raster a concave vertex has three occupied cells around it. Where two cells touch at a
// corner only, both corners are convex and nothing needs cutting: the region is the union of the
// open cells and the edges between them.
namespace planar_mapping {
namespace {

using detail::Chord;

/// Vertex (x, y) is the corner shared by cells (x - 1, y - 1) and (x, y) of the mask.
class Partitioner {
 public:
  explicit Partitioner(const CellMask& mask)
      : mask_(mask),
        width_(mask.width),
        height_(mask.height),
        pitch_(width_ + 1),
        vertex_(static_cast<std::size_t>(pitch_) * (height_ + 1), 0) {}

  std::vector<CellRectangle> run() {
    if (findConcaveVertices()) {
      cutAlongChords();
      cutFromVerticesLeftOver();
    }
    return collectRectangles();
  }

 private:
  // Bits of a vertex. A cut belongs to the vertex at its low end.
  static constexpr std::uint8_t kConcave = 1;
  static constexpr std::uint8_t kInteriorRight =
      2;                                          ///< the edge to (x + 1, y) has cells both sides
  static constexpr std::uint8_t kInteriorUp = 4;  ///< the edge to (x, y + 1) has cells both sides
  static constexpr std::uint8_t kCutRight = 8;
  static constexpr std::uint8_t kCutUp = 16;
  static constexpr std::uint8_t kResolved = 32;  ///< lies on a cut already

  std::size_t at(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y) * pitch_ + x;
  }

  bool findConcaveVertices() {
    bool any = false;
    const std::vector<std::uint8_t> empty_row(width_, 0);
    for (std::int32_t y = 0; y <= height_; ++y) {
      const std::uint8_t* below = y > 0 ? row(y - 1) : empty_row.data();
      const std::uint8_t* above = y < height_ ? row(y) : empty_row.data();
      std::uint8_t* out = &vertex_[at(0, y)];
      bool below_left = false;
      bool above_left = false;
      for (std::int32_t x = 0; x <= width_; ++x) {
        const bool below_right = x < width_ && below[x] != 0;
        const bool above_right = x < width_ && above[x] != 0;
        std::uint8_t bits = 0;
        if (below_left + below_right + above_left + above_right == 3) bits |= kConcave;
        if (below_right && above_right) bits |= kInteriorRight;
        if (above_left && above_right) bits |= kInteriorUp;
        any |= (bits & kConcave) != 0;
        out[x] = bits;
        below_left = below_right;
        above_left = above_right;
      }
    }
    return any;
  }

  // A concave vertex has one interior edge in each direction, so it ends at most one chord of each
  // direction, and no chord passes through it: walking along a line pairs neighbours.
  std::vector<Chord> horizontalChords() const {
    std::vector<Chord> chords;
    for (std::int32_t y = 1; y < height_; ++y) {
      std::int32_t start = -1;
      for (std::int32_t x = 1; x < width_; ++x) {
        const std::uint8_t bits = vertex_[at(x, y)];
        if (bits & kConcave) {
          if (start >= 0) chords.push_back({y, start, x});
          start = (bits & kInteriorRight) ? x : -1;
        } else if (!(bits & kInteriorRight)) {
          start = -1;
        }
      }
    }
    return chords;
  }

  std::vector<Chord> verticalChords() const {
    std::vector<Chord> chords;
    std::vector<std::int32_t> start(width_, -1);
    for (std::int32_t y = 1; y < height_; ++y) {
      for (std::int32_t x = 1; x < width_; ++x) {
        const std::uint8_t bits = vertex_[at(x, y)];
        if (bits & kConcave) {
          if (start[x] >= 0) chords.push_back({x, start[x], y});
          start[x] = (bits & kInteriorUp) ? y : -1;
        } else if (!(bits & kInteriorUp)) {
          start[x] = -1;
        }
      }
    }
    return chords;
  }

  void cutAlongChords() {
    const std::vector<Chord> horizontal = horizontalChords();
    const std::vector<Chord> vertical = verticalChords();
    const detail::ChordChoice choice =
        detail::largestDisjointChords(horizontal, vertical, pitch_, height_ + 1);
    for (std::size_t i = 0; i < horizontal.size(); ++i) {
      if (!choice.horizontal[i]) continue;
      const Chord& chord = horizontal[i];
      for (std::int32_t x = chord.from; x < chord.to; ++x) vertex_[at(x, chord.line)] |= kCutRight;
      for (std::int32_t x = chord.from; x <= chord.to; ++x) vertex_[at(x, chord.line)] |= kResolved;
    }
    for (std::size_t i = 0; i < vertical.size(); ++i) {
      if (!choice.vertical[i]) continue;
      const Chord& chord = vertical[i];
      for (std::int32_t y = chord.from; y < chord.to; ++y) vertex_[at(chord.line, y)] |= kCutUp;
      for (std::int32_t y = chord.from; y <= chord.to; ++y) vertex_[at(chord.line, y)] |= kResolved;
    }
  }

  /// Number of steps from the concave vertex along its interior edge to the boundary or to a cut.
  std::int32_t freeLength(std::int32_t x, std::int32_t y, std::int32_t dx, std::int32_t dy) const {
    std::int32_t length = 0;
    do {
      x += dx;
      y += dy;
      ++length;
    } while (isCrossing(x, y));
    return length;
  }

  /// Inside the region and on no cut: a cut from elsewhere may go on through it.
  bool isCrossing(std::int32_t x, std::int32_t y) const {
    const std::uint8_t bits = vertex_[at(x, y)];
    constexpr std::uint8_t interior = kInteriorRight | kInteriorUp;
    return (bits & (interior | kConcave | kResolved)) == interior &&
           (vertex_[at(x - 1, y)] & kInteriorRight) && (vertex_[at(x, y - 1)] & kInteriorUp);
  }

  void cutFromVerticesLeftOver() {
    for (std::int32_t y = 1; y < height_; ++y) {
      for (std::int32_t x = 1; x < width_; ++x) {
        const std::uint8_t bits = vertex_[at(x, y)];
        if ((bits & (kConcave | kResolved)) != kConcave) continue;
        const std::int32_t dx = (bits & kInteriorRight) ? 1 : -1;
        const std::int32_t dy = (bits & kInteriorUp) ? 1 : -1;
        // Either way is optimal; the shorter cut leaves the larger rectangles in one piece.
        const std::int32_t along_u = freeLength(x, y, dx, 0);
        const std::int32_t along_v = freeLength(x, y, 0, dy);
        if (along_u <= along_v) {
          const std::int32_t from = dx > 0 ? x : x - along_u;
          for (std::int32_t i = 0; i < along_u; ++i) vertex_[at(from + i, y)] |= kCutRight;
          for (std::int32_t i = 0; i <= along_u; ++i) vertex_[at(from + i, y)] |= kResolved;
        } else {
          const std::int32_t from = dy > 0 ? y : y - along_v;
          for (std::int32_t i = 0; i < along_v; ++i) vertex_[at(x, from + i)] |= kCutUp;
          for (std::int32_t i = 0; i <= along_v; ++i) vertex_[at(x, from + i)] |= kResolved;
        }
      }
    }
  }

  /// May one walk from cell (x - 1, y) to (x, y); from cell (x, y - 1) to (x, y)?
  bool openAcross(std::int32_t x, std::int32_t y) const {
    return (vertex_[at(x, y)] & (kInteriorUp | kCutUp)) == kInteriorUp;
  }
  bool openUpwards(std::int32_t x, std::int32_t y) const {
    return (vertex_[at(x, y)] & (kInteriorRight | kCutRight)) == kInteriorRight;
  }

  std::vector<CellRectangle> collectRectangles() const {
    std::vector<CellRectangle> rectangles;
    for (std::int32_t y = 0; y < height_; ++y) {
      const std::uint8_t* cells = row(y);
      for (std::int32_t x = 0; x < width_; ++x) {
        if (!cells[x] || openUpwards(x, y)) continue;  // not the lowest row of its rectangle
        std::int32_t width = 1;
        while (x + width < width_ && openAcross(x + width, y)) ++width;
        std::int32_t height = 1;
        while (y + height < height_ && openUpwards(x, y + height)) ++height;
        rectangles.push_back({mask_.a0 + x, mask_.b0 + y, width, height});
        x += width - 1;
      }
    }
    return rectangles;
  }

  const std::uint8_t* row(std::int32_t y) const {
    return mask_.cells.data() + static_cast<std::size_t>(y) * width_;
  }

  const CellMask& mask_;
  const std::int32_t width_;
  const std::int32_t height_;
  const std::int32_t pitch_;
  std::vector<std::uint8_t> vertex_;
};

}  // namespace

std::vector<CellRectangle> minimumRectanglePartition(const CellMask& mask) {
  detail::requireConsistent(mask);
  if (mask.cells.empty()) return {};
  return Partitioner(mask).run();
}

}  // namespace planar_mapping
