// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/planes/tiles/plane_fit.h"

namespace planar_mapping::detail {

constexpr int kMinCells = 3;  ///< of a region

/// What growing needs to know of a cell.
struct CellState {
  float normal[3];         ///< of the window or the cell, metres; zero if neither is planar
  float min_cosine;        ///< between the normal and that of a plane the cell may join
  float residual;          ///< of the widest planar window, in units of the noise
  float noise_over_range;  ///< sigma(r) / r, in metres only
  std::uint8_t planarity;  ///< 0 none, 1 the cell, 2 its 3 x 3 and 3 its 5 x 5 window
};

struct GrownCells {
  std::vector<std::int16_t> labels;  ///< candidate per cell, -1 = none
  std::size_t seeds = 0;
  std::size_t too_small = 0;
};

/// Grows planes over the cells of a grid, from the most planar windows first.
class CellGrower {
 public:
  CellGrower(const CellGrid& grid, const PlaneFit& fit);
  virtual ~CellGrower() = default;

  /// Appends to \p planes.
  /// \param min_points of a plane
  GrownCells grow(double min_points, std::vector<PlaneCandidate>& planes);

 protected:
  /// Fills the states.
  virtual void classify() = 0;
  /// Whether the sums of a cell and its normal fit a plane.
  virtual bool accepts(const PlaneCandidate& plane, const MomentSums& sums,
                       const CellState& state) const = 0;

  const CellGrid& grid_;
  std::vector<CellState> states_;

 private:
  std::vector<std::pair<float, int>> seedOrder() const;
  void collect(int seed, PlaneCandidate plane, bool refit, const std::vector<std::int16_t>& labels,
               std::vector<int>& cells, MomentSums& sums);

  const PlaneFit& fit_;
  std::vector<int> visited_;
  int visit_ = 0;
};

/// Joins candidates that are one plane within the noise and what surfaces may bend: each with the
/// larger one that it fits best. What has become part of another is no longer valid.
/// \param labels candidate per cell of a grid, -1 = none
/// \return new candidate per old one
std::vector<std::int16_t> mergeCandidates(std::vector<PlaneCandidate>& planes,
                                          const std::vector<std::int16_t>& labels, int columns,
                                          int rows, const PlaneFit& fit);

}  // namespace planar_mapping::detail
