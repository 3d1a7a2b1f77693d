// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/simulation/simulation.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping::evaluation {

struct SimulatedFeatureParams {
  int per_frame = 400;         ///< features looked for in each frame, in [1, 100000]
  double noise_px = 0.3;       ///< of column, row and disparity, standard deviation, in [0, 100]
  double miss_fraction = 0.1;  ///< of those in view that a detector does not find, in [0, 1]
  std::uint64_t seed = 1;

  /// \throws ParameterError
  void validate() const;
};

/// Key features of known identity in the frames of a simulation, as a stereo front-end would track
/// them: places on the scene's surfaces that are in view, in both images and not hidden. Frames are
/// asked for in their order; the same parameters give the same features.
class SimulatedFeatures {
 public:
  /// \p simulation must outlive this object. \throws ParameterError
  SimulatedFeatures(const Simulation& simulation, const SimulatedFeatureParams& params);

  /// Features of a frame of that simulation, by ascending track. New landmarks are taken up
  /// where the frame shows fewer known ones than there should be.
  /// \throws InputError if the frame has no truth or comes before one that was asked for already
  std::vector<KeyFeature> next(const SimulatedFrame& frame);

 private:
  struct Landmark {
    Vector3 position;  ///< world
    int object;        ///< it is on
    std::int32_t sightings;
  };
  struct Sight;

  std::vector<Sight> landmarksInView(const SimulatedFrame& frame) const;
  void findNewLandmarks(const SimulatedFrame& frame, std::size_t count, Random& random);

  const Simulation& simulation_;
  SimulatedFeatureParams params_;
  std::vector<Landmark> landmarks_;
  std::int64_t next_frame_ = 0;
};

}  // namespace planar_mapping::evaluation
