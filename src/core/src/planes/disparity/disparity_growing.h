// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "planes/disparity/disparity_cells.h"

namespace planar_mapping::detail {

/// Planes over the cells of a grid.
struct DisparityRegions {
  std::vector<std::int16_t> labels;  ///< plane per cell, -1 = none
  std::size_t seeds = 0;
  std::size_t too_small = 0;
};

/// Grows planes over the cells of a grid in disparity space, from the most planar windows first.
class DisparityGrower {
 public:
  /// \param room for the sums of windows while they are fitted
  DisparityGrower(const CellGrid& grid, double* room);

  double estimateNoise(const DisparityParams& params);
  /// Appends to \p planes.
  DisparityRegions grow(const DisparityParams& params, std::vector<DisparityPlane>& planes);

 private:
  /// What growing needs to know of a cell.
  struct State {
    float normal[3];         ///< of the window or the cell, zero if neither is planar
    float min_cosine;        ///< between the normal and that of a plane the cell may join
    float residual;          ///< of the widest planar window, pixels
    std::uint8_t planarity;  ///< 0 none, 1 the cell, 2 its 3 x 3 and 3 its 5 x 5 window
  };

  /// The fit of the window of (2 radius + 1)^2 cells; the same numbers as of windowSums().
  DisparityFit fitWindow(int cell, int radius) const;
  /// Which cells hold points enough to be planar: kAlone, kTogether with those around, or both.
  std::vector<std::uint8_t> findFilled() const;
  void classify(const DisparityParams& params);
  std::vector<int> seedOrder(const DisparityParams& params) const;
  DisparityPlane seedPlane(int cell, const DisparityParams& params) const;
  bool accepts(const DisparityPlane& plane, int cell, const DisparityParams& params) const;
  void collect(int seed, DisparityPlane plane, bool refit, const DisparityParams& params,
               const std::vector<std::int16_t>& labels, std::vector<int>& cells, MomentSums& sums);

  const CellGrid& grid_;
  /// Of 3 x 3 and 5 x 5 windows, of those that may be planar at least; empty = not made yet.
  std::vector<DisparityFit> fits_[2];
  std::vector<State> states_;
  std::vector<int> visited_;
  int visit_ = 0;
};

/// Pairs of planes whose cells lie beside each other, the lower label first, ascending.
using PlanePairs = std::vector<std::pair<std::int16_t, std::int16_t>>;
PlanePairs adjacentPlanes(const std::vector<std::int16_t>& labels, int columns, int rows);

/// Joins planes that are one within the noise, more readily where they are \p adjacent.
/// \return new plane per old one
std::vector<std::int16_t> mergePlanes(std::vector<DisparityPlane>& planes,
                                      const PlanePairs& adjacent, const DisparityParams& params);

}  // namespace planar_mapping::detail
