// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/organized/organized_cells.h"

namespace planar_mapping::detail {

/// A plane while it is looked for, relative to the origin of the tiled cloud.
struct PlaneCandidate {
  MomentSums sums = {};
  double normal[3] = {0.0, 0.0, 0.0};
  double offset = 0.0;    ///< metres
  double residual = 0.0;  ///< root mean square, metres
  double width = 0.0;     ///< root mean square extent along the shorter axis, metres
  bool valid = false;

  /// Fits the plane to the sums; valid is false if they are too few or collinear.
  void fit(const Vector3& sensor);
  double distance(const double* point) const {
    return normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] + offset;
  }
  /// Mean square distance of other sums to this plane, square metres.
  double meanSquare(const MomentSums& other) const;
};

void addSums(MomentSums& sums, const CellGrid& grid, int cell);
inline void addSums(MomentSums& sums, const MomentSums& other) {
  for (std::size_t m = 0; m < kMoments; ++m) sums[m] += other[m];
}

/// What growing needs to know of a cell.
struct CellState {
  float normal[3];         ///< of the window or the cell, zero if neither is planar
  float min_cosine;        ///< between the normal and that of a plane the cell may join
  float squared_range;     ///< of the mean, from the sensor, square metres
  float noise_over_range;  ///< sigma(r) / r
  std::uint8_t planarity;  ///< 0 none, 1 the cell, 2 its 3 x 3 and 3 its 5 x 5 window
};

struct GrownCells {
  std::vector<std::int16_t> labels;  ///< candidate per cell, -1 = none
  std::size_t seeds = 0;
  std::size_t too_small = 0;
  std::size_t not_coherent = 0;
};

/// Grows planes over the cells of a grid, from the most planar windows first, and appends them to
/// \p planes. \p noise may be unset on the first call: it is then estimated.
class CellGrower {
 public:
  /// \param wide cells are tiles, not quarters: also look at 5 x 5 windows, which make better seeds
  /// \param room for the sums of windows while they are fitted
  CellGrower(const CellGrid& grid, bool wide, double* room, const Vector3& sensor,
             const OrganizedParams& params);

  const RangeNoise& noise() const { return noise_; }
  void estimateNoise();
  void setNoise(const RangeNoise& noise) { noise_ = noise; }
  GrownCells grow(std::vector<PlaneCandidate>& planes);

 private:
  void classify();
  std::vector<int> seedOrder() const;
  PlaneCandidate seedPlane(int cell) const;
  bool accepts(const PlaneCandidate& plane, double sensor_distance, int cell) const;
  void collect(int seed, PlaneCandidate plane, bool refit, const std::vector<std::int16_t>& labels,
               std::vector<int>& cells, MomentSums& sums);

  const CellGrid& grid_;
  Vector3 sensor_;
  OrganizedParams params_;
  RangeNoise noise_;
  double least_noise_;  ///< below it noise is not told apart from none, metres
  std::vector<CellFit> fits_;
  std::vector<CellFit> window_fits_;
  std::vector<CellFit> wide_fits_;
  std::vector<CellState> states_;
  std::vector<int> visited_;
  int visit_ = 0;
};

/// Candidate per cell of a grid, -1 = none.
struct CellLabels {
  int columns = 0;
  int rows = 0;
  std::vector<std::int16_t> labels;
};

/// Joins candidates that are one plane within the noise and what surfaces may bend: more where
/// they touch, which noise and dents part, than where they are apart.
/// \param cells where the candidates are
/// \return new candidate per old one
std::vector<std::int16_t> mergeCandidates(std::vector<PlaneCandidate>& planes,
                                          const CellLabels& cells, const RangeNoise& noise,
                                          const Vector3& sensor, const OrganizedParams& params);

}  // namespace planar_mapping::detail
