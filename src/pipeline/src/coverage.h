// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/cuboid.h"

namespace planar_mapping::detail {

/// Answers for very many points whether any cuboid is within a margin of them: each cuboid is
/// entered into the cells of a coarse grid that it touches.
class CoverageIndex {
 public:
  /// \param cuboids must outlive the index
  /// \param cell    side of a grid cell, metres
  CoverageIndex(const std::vector<Cuboid>& cuboids, double margin, double cell);
  bool covers(const Vector3& point) const;

 private:
  struct Box {
    Vector3 center;
    Matrix3 to_local;
    Vector3 half;  ///< margin not included
  };
  struct Entry {
    std::uint64_t cell;
    std::uint32_t box;
  };
  bool within(const Box& box, const Vector3& point) const;
  void enter(std::uint32_t box);

  double margin_;
  double cell_;
  std::vector<Box> boxes_;
  std::vector<Entry> entries_;              ///< by cell
  std::vector<std::uint32_t> first_entry_;  ///< hash table of the cells' first entries
  std::vector<std::uint32_t> large_;        ///< boxes too large to be entered cell by cell
};

}  // namespace planar_mapping::detail
