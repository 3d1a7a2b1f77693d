// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping {

/// Depth and gray values of a view in cells of some pixels: what tells whether two views agree.
struct PLANAR_MAPPING_EXPORT ViewCells {
  PinholeCamera camera;                 ///< of the cells: its pixels are cells
  std::vector<Eigen::Vector3f> points;  ///< measured in the middle of the cell; z = 0: none
  std::vector<float> nearest;           ///< depth in the cell and around it; 0: none in the cell
  std::vector<float> farthest;          ///< likewise
  std::vector<float> tones;             ///< gray values freed of local mean and contrast
  /// Mean of n n^T over the normals of points so far apart that noise turns them little.
  Matrix3 facing = Matrix3::Zero();
  Matrix3 facing_nearby = Matrix3::Zero();  ///< likewise, of neighbours, however noise turns them

  bool empty() const { return points.empty(); }
};

/// \param gray   row major, of the size of the camera; null = no image, tones are zero
/// \param cloud  organized, of that size, camera frame
/// \param noise  its depth error
/// \throws InputError if the cloud has another size
PLANAR_MAPPING_EXPORT ViewCells viewCellsOf(const std::uint8_t* gray, const PointsView& cloud,
                                            const PinholeCamera& camera,
                                            const FeatureCamera& noise);

/// How far two views agree under a motion.
struct ViewAgreement {
  std::size_t cells = 0;     ///< of the smaller view, with depth
  std::size_t compared = 0;  ///< cells that the other view looks at
  std::size_t agreeing = 0;  ///< of those, at the depth that the other view measured
  std::size_t through = 0;   ///< of those, where the other view saw through
  /// Of through, those not clearly nearer than what has gray values that agree. What moves hides
  /// the room: where it seems to be the room that has moved, what agrees moves with the camera.
  std::size_t behind = 0;
  /// Distance from the depth in the middle of the other view's cell, in tolerances, at most 1 of a
  /// cell; mean over those compared that have one. 1 where there are none.
  double misfit = 1.0;
  double texture = 0.0;      ///< mean squared tone of the agreeing cells, in [0, 1]
  double correlation = 0.0;  ///< of the tones of the agreeing cells, in [-1, 1]

  double fraction(std::size_t count) const {
    return compared == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(compared);
  }
};

/// Both ways: of each figure the worse one counts.
/// \param noise  its depth error
/// \param step   every n-th row and column of cells, >= 1
PLANAR_MAPPING_EXPORT ViewAgreement agreementOf(const ViewCells& now, const ViewCells& before,
                                                const Pose& T_before_now,
                                                const FeatureCamera& noise, int step = 1);

/// Axes along which the surfaces of a view leave it open where it is, its own frame, unit length.
/// \param facing  of ViewCells
PLANAR_MAPPING_EXPORT std::vector<Vector3> openAxes(const Matrix3& facing);

/// The shift that moves what is seen by one cell, metres.
PLANAR_MAPPING_EXPORT double shiftOfACell(const ViewCells& view);

}  // namespace planar_mapping
