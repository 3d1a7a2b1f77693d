// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "planar_mapping/localization/registration/surface_shape.h"

namespace planar_mapping::detail {

/// What a cloud is registered to: the cells of a map and what of them is near.
struct MappedSurfaces {
  const SurfaceCells& fine;
  const SurfaceCells& edges;
  PlaneNeighbours coarse_nearby;
  PlaneNeighbours edges_nearby;
};

/// Robust normal equations of a cloud on a map.
struct RegistrationEquations {
  Matrix6 hessian = Matrix6::Zero();
  Matrix6 noise = Matrix6::Zero();  ///< what errors of the normals contribute to it
  Vector6 gradient = Vector6::Zero();
  double squared_distance = 0.0;  ///< of the planes that matched
  double squared_error = 0.0;     ///< the same in variances
  double score = 0.0;             ///< how well all lies, each direction counting the same
  double balanced = 0.0;          ///< sum of the weights of the planes that matched
  std::size_t matched = 0;        ///< planes
  std::size_t edges = 0;          ///< that matched
};

/// A pose of a cloud and how well it lies there.
struct RegistrationCandidate {
  Pose T_sensor_world = Pose::Identity();
  RegistrationEquations at_end;
};

/// Draws a cloud to a map: planes to planes that face the same way, edges to
/// edges.
class SurfaceRegistration {
 public:
  SurfaceRegistration(const SurfaceMapParams& params, const CloudShape& shape,
                      const MappedSurfaces& map)
      : params_(params), shape_(shape), map_(map) {}

  /// The best pose from a guess and, where that is not good, from guesses
  /// turned a little.
  RegistrationCandidate run(const Pose& guess) const;
  /// The pose T_sensor_world next to this one.
  RegistrationCandidate settle(const Pose& guess) const;
  CloudRegistration resultOf(const RegistrationCandidate& candidate) const;
  /// A pose as it is, and how well the cloud lies there.
  RegistrationCandidate at(const Pose& T_sensor_world) const {
    return {T_sensor_world, equations(T_sensor_world, 0.0, false)};
  }

 private:
  bool isGood(const RegistrationCandidate& candidate) const;
  bool approach(Pose& pose) const;
  bool refine(Pose& pose) const;
  RegistrationEquations equations(const Pose& T_sensor_world, double tolerance,
                                  bool balanced) const;

  const SurfaceMapParams& params_;
  const CloudShape& shape_;
  const MappedSurfaces& map_;
};

}  // namespace planar_mapping::detail
