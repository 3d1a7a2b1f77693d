// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/occupancy.h"

namespace planar_mapping {

/// Parameters of SurfaceMap; all [ours]. Lengths in metres, angles in radians.
struct PLANAR_MAPPING_EXPORT SurfaceMapParams {
  double cell = 0.05;  ///< side of the cells, > 0
  /// Standard deviation of a point along its ray: depth_error + depth_error_growth * depth^2; at
  /// least one of them > 0.
  double depth_error = 0.003;
  double depth_error_growth = 0.002;  ///< 1/m
  /// Direction in which depth is measured; zero = depth is the range (laser scanners).
  Vector3 optical_axis = Vector3::UnitZ();
  double reach = 0.3;  ///< from how far the planes of a guess are drawn to the map, > 0
  /// Of the cloud's planes that must lie on the map's, in [0, 1]; of a laser scanner's also where
  /// each direction counts the same.
  double min_fraction = 0.4;
  /// A cloud that fits but whose rays go through what the map has there, or that fills what was
  /// seen free before, is at a wrong place: the largest such fraction of the planes, in [0, 1].
  double max_seen_through = 0.1;
  /// Where a cloud is not found near the guess, it is looked for so far around it, metres, turned
  /// anyhow, by the directions and offsets of its planes; 0 = it is not.
  double search_reach = 4.0;
  int max_cells = 200000;  ///< kept, >= 1000; those not seen for longest go first

  /// Those that suit a scanner, which looks all around. The range is as exact far away, but there
  /// rays lie far apart, so that small planes are less exact, and a turn during a scan shifts more.
  static SurfaceMapParams ofScanner();
  /// \throws ParameterError
  void validate() const;
};

/// The side of the cells that suits a cloud: the least of params.cell and 2, 4, 8 and 16 times it
/// with which half of the points are in a cell that has a plane; of a laser scanner half of the
/// points weighted by their squared range, as its rings are too far apart for cells that suit what
/// is near. O(points looked at).
PLANAR_MAPPING_EXPORT double surfaceCellFor(const PointsView& cloud,
                                            const SurfaceMapParams& params);
/// \p params with that side, and a reach that grows with it.
PLANAR_MAPPING_EXPORT SurfaceMapParams surfaceParamsFor(const PointsView& cloud,
                                                        SurfaceMapParams params);

/// Where a cloud lies on a SurfaceMap.
struct CloudRegistration {
  bool found = false;
  Pose T_world_sensor = Pose::Identity();
  /// In the sensor's frame, see Matrix6; 1 m and 0.5 rad in directions the cloud says nothing
  /// about.
  Matrix6 covariance = Matrix6::Zero();
  std::size_t planes = 0;   ///< of the cloud, edges not counted
  std::size_t matched = 0;  ///< of those, on a plane of the map
  double fraction = 0.0;    ///< of the planes that matched, each direction counting the same
  double rms = 0.0;         ///< distance of the matched ones, metres
  /// Of the map's planes where this cloud looked, the fraction that its rays went through, or of
  /// its planes where clouds before looked, if that is larger; zero where too few can be compared.
  /// A scan does not count planes that one before it went through, unless others were lost since.
  double seen_through = 0.0;
  bool known = true;  ///< of a place far from the guess: distinct planes enough fix it
};

/// What registers clouds that have no features to go by: a bounded local map of small planes, one
/// per cell of a grid, and of the edges where they end; robust registration to both.
///
/// Independent of the planar map: that is the result of the poses, this is what they come from.
/// Deterministic. Copyable. Not thread safe.
class PLANAR_MAPPING_EXPORT SurfaceMap {
 public:
  explicit SurfaceMap(const SurfaceMapParams& params = SurfaceMapParams());
  ~SurfaceMap();
  SurfaceMap(const SurfaceMap& other);
  SurfaceMap& operator=(const SurfaceMap& other);
  SurfaceMap(SurfaceMap&&) noexcept;
  SurfaceMap& operator=(SurfaceMap&&) noexcept;

  const SurfaceMapParams& params() const;

  /// Adds a cloud. Of a scanner (without an optical axis) not again from where the last one was
  /// added: a scanner that creeps would draw its map along. O(points looked at).
  /// \param cloud  sensor's frame; non-finite points are skipped
  /// \throws InputError if the pose is not finite
  void insert(const PointsView& cloud, const Pose& T_world_sensor);

  /// Finds the pose of a cloud near \p guess: planes are drawn to the next ones that face the same
  /// way, first from afar; see SurfaceMapParams::reach. Where that fails the cloud is looked for
  /// farther around; see SurfaceMapParams::search_reach. It is not found where it fits twice.
  /// \param lost  clouds before that were not found: so many times farther around
  /// \throws InputError if the guess is not finite
  CloudRegistration locate(const PointsView& cloud, const Pose& guess, int lost = 0) const;
  /// The same near the guess alone.
  CloudRegistration locateNear(const PointsView& cloud, const Pose& guess, int lost = 0) const;
  /// The place where the cloud fits best, of \p near and of those far from the guess; not found
  /// where it fits nearly as well in another, nor, of a scanner, where hardly anything fits, nor,
  /// of a camera, where a near place that rays contradict fits as well.
  CloudRegistration locateFar(const PointsView& cloud, const Pose& guess,
                              const CloudRegistration& near, int lost = 0) const;
  std::size_t cells() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace planar_mapping
