// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "evaluation/baselines/grid_cell.h"
#include "evaluation/simulation/ray_caster.h"
#include "evaluation/simulation/scene.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/map/store/cell_key.h"

namespace planar_mapping::evaluation {

/// What of the true surface counts as visible.
struct PLANAR_MAPPING_EXPORT VisibleSurfaceParams {
  double max_depth = 8.0;       ///< z in the camera frame, metres, > 0
  double ground_height = 0.05;  ///< surface up to here is ground and left out, metres
  double min_incidence = 0.0;   ///< cosine between ray and normal below which nothing is measured

  /// \throws ParameterError
  void validate() const;
};

/// A piece of true surface that was seen: what fell into one cell of the standard lattice.
struct VisibleCell {
  GridCell cell;
  Vector3 point = Vector3::Zero();  ///< mean of the surface points in it, world frame, metres
  std::size_t pixels = 0;           ///< that hit it, of all frames
};

/// True geometry of a simulated scene: how far is a point from any surface, and which of it could
/// be seen. The surface is that of every solid that is there in at least one of the frames, each
/// solid by itself (where two overlap, the inner part counts too), ground included.
class PLANAR_MAPPING_EXPORT SurfaceTruth {
 public:
  /// \param first_frame, last_frame  solids that are there in none of them are left out
  /// \throws InputError for first > last, or an object that is not finite or of negative size
  explicit SurfaceTruth(const Scene& scene, int first_frame = 0,
                        int last_frame = std::numeric_limits<int>::max());

  /// Distance from a point of the world to the nearest surface, from inside a solid as well;
  /// exact for boxes, cylinders and spheres. Infinite without objects. Metres.
  double distance(const Vector3& point) const;
  /// distance(point) <= margin, faster.
  bool isNear(const Vector3& point, double margin) const;

  /// Takes note of what a frame saw.
  /// \param view  SimulatedFrame::truth or render(); without noise
  /// \throws ParameterError; InputError for a view without the pixels of its camera
  void addView(const Rendering& view, const Pose& T_world_camera,
               const VisibleSurfaceParams& params = VisibleSurfaceParams());
  /// The cells of the standard lattice of side \p s with visible surface, ascending. Seen points
  /// are thinned to the mean of each cubic centimetre. They lie 10^-4 m behind the surface along
  /// their ray, so that a wall on the border between two layers of cells is in one of them.
  /// \throws ParameterError
  std::vector<VisibleCell> visibleCells(double s) const;

 private:
  struct Solid {
    Shape shape;
    Vector3 center;
    Matrix3 to_local;
    Vector3 half;
    Vector3 reach;  ///< half of the axis-aligned bounding box
  };
  static double surfaceDistance(const Solid& solid, const Vector3& point);

  std::vector<Solid> solids_;
  struct Seen {
    Vector3 sum = Vector3::Zero();
    std::size_t pixels = 0;
  };
  planar_mapping::detail::KeyMap<Seen> seen_;  ///< by cubic centimetre
};

}  // namespace planar_mapping::evaluation
