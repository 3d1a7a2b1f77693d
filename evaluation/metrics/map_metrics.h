// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "evaluation/metrics/surface_truth.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/map/cuboids/cuboid_distance.h"
#include "planar_mapping/map/store/cell_key.h"

namespace planar_mapping::evaluation {

// Figures of merit (the paper, IV-B; METHOD 9). Each takes what a method marks as occupied as a
// list of cuboids, whatever the method is. World frame, metres; s is the side of a standard cell.

/// eta = 1 - N_f / A_S: \p cells of the method, \p standard_cells of SG. Negative for a method with
/// more cells than SG.
/// \throws InputError for no standard cells: there is nothing to divide by
PLANAR_MAPPING_EXPORT double combinationEfficiency(std::size_t cells, std::size_t standard_cells);

/// What is marked occupied where there is no surface.
struct MappingError {
  double percent = 0.0;       ///< e = 100 N_e / A_S
  double wrong_cells = 0.0;   ///< N_e, in standard cells
  double marked_cells = 0.0;  ///< all that is marked, in standard cells
  /// N_e over what the method itself marks, in [0, 1]; 0 where it marks nothing.
  double wrongFraction() const { return marked_cells > 0.0 ? wrong_cells / marked_cells : 0.0; }
};

/// Mapping error e = N_e / A_S * 100 % (METHOD 9): N_e is what is marked occupied farther than s
/// from the true surface, in standard cells.
///
/// [ours] Defined so that a cell of SG and a tilted cuboid are counted alike: each cuboid is cut
/// along its own axes into equal parts of at most s / 4, and stands for the centres of its parts.
/// Each part weighs its volume over s^3, where a cuboid thinner than s along an axis counts as s
/// thick along it: nobody gains by thin cells. Parts whose centre is inside a cuboid earlier in the
/// list do not count again. So N_e of SG is the number of its wrong cells, cells that are wrong in
/// part counted by that part.
/// \param index           of \p cuboids
/// \param standard_cells  A_S
/// \throws ParameterError; InputError for no standard cells, or an index of another list
PLANAR_MAPPING_EXPORT MappingError mappingError(const std::vector<Cuboid>& cuboids,
                                                const CuboidDistance& index,
                                                const SurfaceTruth& truth, double s,
                                                std::size_t standard_cells);

/// Fraction of the visible true-surface cells whose surface (the mean of its seen points) is within
/// the margin (s, s / 2 and s / 4 in the tables) of a cuboid, in [0, 1]; 1 if nothing was visible.
/// \param visible  SurfaceTruth::visibleCells(s)
PLANAR_MAPPING_EXPORT double completeness(const CuboidDistance& index,
                                          const std::vector<VisibleCell>& visible, double margin);

/// Fraction of the points inside a cuboid or within the margin (s / 2 in the tables) of one, in [0,
/// 1]; 1 without points. Points that are not finite do not count.
PLANAR_MAPPING_EXPORT double coverage(const CuboidDistance& index,
                                      const std::vector<Vector3>& points, double margin);

/// Distances from points that were not inserted to the nearest cuboid, 0 inside. Metres.
struct HeldBackDistance {
  double median = 0.0;  ///< nearest rank, like the next; infinite without cuboids
  double percentile_95 = 0.0;
  double fraction_within = 1.0;       ///< of the points within the margin
  double fraction_within_half = 1.0;  ///< within half of it
  double fraction_inside = 1.0;       ///< inside a cuboid
};

/// \param margin  of fraction_within, s / 2 in the tables
PLANAR_MAPPING_EXPORT HeldBackDistance heldBackDistance(const CuboidDistance& index,
                                                        const std::vector<Vector3>& points,
                                                        double margin);

/// A measurement: from the sensor to the point it saw.
struct MeasuredRay {
  Vector3 origin = Vector3::Zero();
  Vector3 end = Vector3::Zero();
};

/// How far what the sensor sees of the cuboids is from the true surface: where each ray enters the
/// first cuboid, which is its origin where the sensor stands in one.
struct SurfaceDistance {
  double median = 0.0;  ///< metres, nearest rank, like the next; infinite where most rays miss
  double percentile_95 = 0.0;
};
/// \param step      every so many-th ray is followed, >= 1, up to 2 m behind its end
/// \param to_truth  distance of a point to the true surface, metres
PLANAR_MAPPING_EXPORT SurfaceDistance
surfaceDistance(const CuboidDistance& index, const std::vector<MeasuredRay>& rays, std::size_t step,
                const std::function<double(const Vector3&)>& to_truth);

/// Space that rays crossed, by its volume: pieces of a lattice, each with the first point at which
/// a ray was sampled in it. Of a lattice as coarse as the maps are, each cell of which a single ray
/// cuts a corner would count in full. Made once and asked for each method.
class PLANAR_MAPPING_EXPORT CrossedSpace {
 public:
  /// \param side       side of a piece, > 0; s / 4 in the tables
  /// \param clearance  the last piece of each ray that is left out: the surface is there, and its
  ///                   noise; 2 s in the tables, >= 0
  /// \param every      so many pieces, spread as if by chance, have one that is kept, >= 1; 64 in
  ///                   the tables
  /// \throws ParameterError
  CrossedSpace(double side, double clearance, std::uint64_t every = 1);

  /// Samples each ray at every half side from its origin, beginning half a step from it, up to the
  /// clearance before its end. Rays that are not finite, or longer than 10^4 m, are left out.
  void add(const std::vector<MeasuredRay>& rays);

  std::size_t pieces() const { return samples_.size(); }
  /// Number of crossed pieces whose sample is what is asked for.
  std::size_t count(const std::function<bool(const Vector3&)>& holds) const;

 private:
  struct Sample {
    float offset[3] = {-1.0f, 0.0f, 0.0f};  ///< from the low corner of the piece; < 0 = none yet
  };
  double side_;
  double clearance_;
  std::uint64_t every_;
  planar_mapping::detail::KeyMap<Sample> samples_;
};

/// Fraction of the volume that rays crossed, well before their end, that is marked occupied, in
/// [0, 1]; 0 where nothing was crossed. See CrossedSpace.
PLANAR_MAPPING_EXPORT double freeSpaceViolation(const CuboidDistance& index,
                                                const CrossedSpace& crossed);

}  // namespace planar_mapping::evaluation
