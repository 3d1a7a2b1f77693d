// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/view_matching.h"

namespace planar_mapping::detail {

/// Depths of one view beside what another measured there: how many of them agree.
struct DepthComparison {
  enum class Depth : std::uint8_t { None, Agrees, Differs };

  double compared = 0.0;  ///< something is measured there
  double agreeing = 0.0;
  double through = 0.0;  ///< the other saw farther there

  /// Looks at the 3 x 3 cells of the other view around the place of a depth.
  /// \param inverse_depth  of what should be there
  /// \param cell           (column, row) -> {inverse depth, tolerance}; inverse depth 0 = none
  /// \return what was found there
  template <typename Cell>
  Depth look(int column, int row, int across, int down, double inverse_depth, const Cell& cell) {
    bool any = false;
    bool agrees = false;
    bool farther = true;
    for (int v = std::max(0, row - 1); v <= std::min(down - 1, row + 1); ++v) {
      for (int u = std::max(0, column - 1); u <= std::min(across - 1, column + 1); ++u) {
        const std::pair<double, double> there = cell(u, v);
        if (!(there.first > 0.0)) continue;
        const double off = there.first - inverse_depth;
        any = true;
        agrees = agrees || std::abs(off) <= there.second;
        farther = farther && off < -there.second;
      }
    }
    if (!any) return Depth::None;
    compared += 1.0;
    if (agrees) agreeing += 1.0;
    if (farther) through += 1.0;
    return agrees ? Depth::Agrees : Depth::Differs;
  }
  void add(const DepthComparison& other) {
    compared += other.compared;
    agreeing += other.agreeing;
    through += other.through;
  }
  double agreement() const { return compared > 0.0 ? agreeing / compared : 0.0; }
  /// One of few cells says less than many of many.
  double seenThrough() const { return (through + 1.0) / (compared + 20.0); }
};

/// Inliers that are not on the plane which holds most of them.
PLANAR_MAPPING_EXPORT std::size_t offPlane(const std::vector<FeatureMatch>& matches,
                                           const std::vector<std::uint8_t>& is_inlier,
                                           Random& random);

/// Depths and gray values of the cells that the map and the frame both see, both ways, the worse
/// counts: the part of PoseEvidence that does not depend on how the pose was found.
void weighCells(const LocalMap& map, const View& now, const Pose& T_now_map,
                PoseEvidence& evidence);

/// How much likelier a pose is right than wrong (natural logarithm) by features and by what lies
/// where the other view saw through. The weights were fitted to links with known motion.
PLANAR_MAPPING_EXPORT double featureLogOdds(std::size_t off_plane, double seen_again,
                                            double seen_through);

/// The same with gray values, without what was expected beforehand. \param by_features  else by
/// surfaces alone
double logOdds(const PoseEvidence& evidence, bool by_features);

}  // namespace planar_mapping::detail
