// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include "bit_stream.h"
#include "label_tree.h"
#include "map_data.h"

namespace planar_mapping::detail {

inline void writeVector(ByteWriter& out, const Vector3& v) {
  for (int i = 0; i < 3; ++i) out.f64(v[i]);
}
inline Vector3 readVector(ByteReader& in) {
  Vector3 v;
  for (int i = 0; i < 3; ++i) v[i] = in.f64();
  if (!v.allFinite()) in.fail("holds a vector that is not finite");
  return v;
}
inline double readFinite(ByteReader& in) {
  const double v = in.f64();
  if (!std::isfinite(v)) in.fail("holds a number that is not finite");
  return v;
}

// Beliefs: runs of equal bytes.

inline void writeRuns(const std::vector<std::uint8_t>& values, ByteWriter& out) {
  for (std::size_t i = 0; i < values.size();) {
    std::size_t end = i + 1;
    while (end < values.size() && values[end] == values[i]) ++end;
    out.varint(end - i);
    out.u8(values[i]);
    i = end;
  }
}

/// Calls take(value) for each of \p count values.
template <typename Take>
void readRuns(std::size_t count, ByteReader& in, Take&& take) {
  while (count > 0) {
    const std::uint64_t run = in.varint();
    const std::uint8_t value = in.u8();
    if (run == 0 || run > count) in.fail("has a run of beliefs of the wrong length");
    if (value == 0) in.fail("gives an occupied cell no belief");
    for (std::uint64_t i = 0; i < run; ++i) take(value);
    count -= static_cast<std::size_t>(run);
  }
}

inline std::size_t countCells(const std::vector<CellBundle>& bundles) {
  std::size_t count = 0;
  for (const CellBundle& b : bundles) {
    count += static_cast<std::size_t>(__builtin_popcountll(b.cells));
  }
  return count;
}

/// Calls visit(bundle, bit) for every set cell, in the order of the tree.
template <typename Visit>
void forEachCell(TreeKind kind, const std::vector<CellBundle>& bundles, Visit&& visit) {
  const std::uint8_t* order = cellOrder(kind);
  for (const CellBundle& b : bundles) {
    for (int path = 0; path < 64; ++path) {
      if (((b.cells >> order[path]) & 1u) != 0) visit(b, order[path]);
    }
  }
}

/// The sections of the file that hold cells; readers throw Error.
void writePlanes(const MapData& map, ByteWriter& out);
void readPlanes(MapData& map, ByteReader& in);
void writeCells(const MapData& map, ByteWriter& out);
void readCells(MapData& map, ByteReader& in);
/// Unknown space, or what was seen free.
void writeSpace(const MapData& map, bool free, ByteWriter& out);
void readSpace(MapData& map, bool free, ByteReader& in);

}  // namespace planar_mapping::detail
