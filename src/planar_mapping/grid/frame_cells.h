// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/types.h"

namespace planar_mapping::detail {

inline std::uint64_t hashOf(std::uint64_t key) {
  key = (key ^ (key >> 32u)) * 0x9E3779B97F4A7C15ULL;
  return key ^ (key >> 29u);
}

/// Numbers the cells of a grid fixed in the world that the points of a frame lie in, each plane on
/// its own, with one look-up a run of points. Cells two million apart share a number.
class FrameCells {
 public:
  static constexpr std::uint64_t kNoCell = ~std::uint64_t{0};
  struct Group {
    std::uint64_t cell = kNoCell;
    std::int32_t label = -1;
  };

  /// Points one after the other in the indices that are in one group, up to \ref end.
  struct Run {
    std::uint32_t end = 0;
    std::int32_t group = -1;  ///< -1 where a point is in no cell
  };

  /// Groups of the points, numbered in order of appearance; forgets those before.
  /// \param labels  plane per point of the cloud, negative = none
  /// \param threads 0 = all cores; never changes the result
  void number(const PointsView& points, const Indices& indices,
              const std::vector<std::int32_t>& labels, const Pose& T_world_sensor,
              double resolution, int threads = 1);
  /// Cell of a point in the frame of number(); kNoCell beyond a million cells or if not finite.
  std::uint64_t cellOf(const Vector3& point) const;
  /// Number of the group, which is added if it is new.
  std::int32_t insert(std::uint64_t cell, std::int32_t label);
  /// Number of the group, -1 if there is none.
  std::int32_t find(std::uint64_t cell, std::int32_t label) const {
    const std::uint64_t hint = hashOfGroup(cell, label) >> (64 - kHintBits);
    if (((hints_[hint / 64] >> (hint % 64)) & 1u) == 0) return -1;
    return slots_[slotOf(cell, label)].number;
  }
  const std::vector<Group>& groups() const { return groups_; }
  /// The indices of number() in runs: neighbouring pixels are mostly in the same cell.
  const std::vector<Run>& runs() const { return runs_; }
  /// Gives the points the value of their group, those in no cell \p otherwise.
  /// \param indices of number()
  /// \param values  per point of the cloud; those of other points stay
  void giveToPoints(const Indices& indices, const std::vector<float>& of_group, float otherwise,
                    std::vector<float>& values) const;

  /// Of the 26 cells around a cell the 13 that come after it, x first, then y, then z: each pair of
  /// cells is one of these for one of the two.
  static constexpr std::size_t kFollowing = 13;
  static std::array<std::uint64_t, kFollowing> following(std::uint64_t cell) {
    constexpr std::uint64_t kBefore = ~std::uint64_t{0};  // wraps to one less
    const auto parts = [cell](unsigned shift) {
      const std::uint64_t at = cell >> shift;
      return std::array<std::uint64_t, 3>{((at + kBefore) & kPart) << shift, (at & kPart) << shift,
                                          ((at + 1) & kPart) << shift};
    };
    const std::array<std::uint64_t, 3> x = parts(42), y = parts(21), z = parts(0);
    std::array<std::uint64_t, kFollowing> cells;
    std::size_t number = 0;
    cells[number++] = x[2] | y[1] | z[1];
    for (const std::uint64_t along_x : x) cells[number++] = along_x | y[2] | z[1];
    for (const std::uint64_t along_y : y) {
      for (const std::uint64_t along_x : x) cells[number++] = along_x | along_y | z[2];
    }
    return cells;
  }

 private:
  static constexpr std::uint64_t kPart = 0x1FFFFFu;  ///< 21 bits an axis
  struct Slot {
    std::uint64_t cell = kNoCell;
    std::int32_t label = -1;
    std::int32_t number = -1;
  };
  /// Where points of another cell begin.
  struct Start {
    std::uint32_t at;
    std::int32_t number[3];  ///< of the cell, from the sensor's
    std::int32_t label;
  };
  void findStarts(const PointsView& points, const Indices& indices,
                  const std::vector<std::int32_t>& labels, std::size_t first, std::size_t last,
                  std::vector<Start>& starts) const;
  std::int32_t addRuns(const std::vector<Start>& starts, std::int32_t group);
  std::int32_t groupOf(const Start& start);
  static std::uint64_t hashOfGroup(std::uint64_t cell, std::int32_t label) {
    return hashOf(cell + static_cast<std::uint64_t>(label));
  }
  std::size_t slotOf(std::uint64_t cell, std::int32_t label) const;
  void grow();

  float rows_[3][3] = {};
  float offset_[3] = {};
  std::int64_t origin_[3] = {};  ///< cell of the sensor
  std::vector<Group> groups_;
  std::vector<Run> runs_;
  std::vector<std::vector<Start>> starts_;  ///< of stretches of the indices; kept for their memory
  std::vector<Slot> slots_;
  /// A bit for each value of the upper part of the hash of a group: most cells that find() is asked
  /// for are empty, and these bits stay in the first cache.
  static constexpr unsigned kHintBits = 16;
  std::array<std::uint64_t, (std::size_t{1} << kHintBits) / 64> hints_{};
};

}  // namespace planar_mapping::detail
