// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/disparity/disparity_cells.h"
#include "planes/organized/organized_refinement.h"

namespace planar_mapping::detail {

/// Gives pixels to the plane nearest in disparity, in the tiles a plane was found in and those
/// beside them.
class DisparityAssigner {
 public:
  explicit DisparityAssigner(const TiledCloud& cloud);

  /// Label per pixel in tile order, -1 = none.
  const std::vector<std::int16_t>& labels() const { return labels_; }
  /// The pixels of each plane in each tile, ascending by tile; their `finite` counts the quarters
  /// that hold the plane only.
  const std::vector<TilePart>& parts() const { return parts_; }

  /// Cells of \p grid (tiles or quarters of them) are part of planes, -1 = of none.
  void addCells(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels);
  /// Assigns all pixels anew.
  /// \param share of d_T and \p factor of the noise: the band that is a plane's, whichever is wider
  void assign(const std::vector<DisparityPlane>& planes, const DisparityParams& params,
              double share, double factor, int threads);
  /// Renames labels; -1 frees the pixels.
  void relabel(const std::vector<std::int16_t>& target);

 private:
  PlaneList candidatesOf(int tile) const;
  /// Per tile: its one candidate, kNoCandidate or kCandidates for more than one.
  void findOnlyCandidates();

  const TiledCloud& cloud_;
  std::vector<std::int16_t> labels_;
  std::vector<PlaneList> presence_;  ///< planes that a tile holds
  std::vector<std::int16_t> only_;   ///< see findOnlyCandidates()
  std::vector<TilePart> parts_;
  std::vector<char> joined_;  ///< tiles in which parts have become one since they were assigned
};

}  // namespace planar_mapping::detail
