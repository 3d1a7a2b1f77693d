// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping {

/// Parameters of CloudFeatureSampler; all [ours].
struct PLANAR_MAPPING_EXPORT CloudFeatureParams {
  double cell = 0.1;         ///< side of the cells, metres
  int min_points = 4;        ///< of the cloud in a cell that has a feature
  int max_features = 2000;   ///< cells with most points first
  int remember_frames = 50;  ///< cells not seen for so many frames are forgotten

  /// \throws ParameterError
  void validate() const;
};

/// Features of clouds without an image: one in each cell of a grid, at the mean of its points.
///
/// With a pose the grid is fixed in the world and a cell is the identity of its feature, as
/// tracking would give. Without one the grid is that of the sensor and every feature is new.
/// Deterministic; memory is bounded by remember_frames * max_features.
class PLANAR_MAPPING_EXPORT CloudFeatureSampler {
 public:
  /// \throws ParameterError
  explicit CloudFeatureSampler(const CloudFeatureParams& params = {});

  /// \param cloud    sensor frame; points that are not finite are left out
  /// \param indices  points that count; null = all
  /// \return features with column and row NaN, in the order of their first points
  std::vector<KeyFeature> sample(const PointsView& cloud, const Indices* indices,
                                 const std::optional<Pose>& T_world_sensor);

  void reset();

 private:
  struct Cell {
    std::int64_t track = 0;
    std::int32_t sightings = 0;
    std::int64_t last_frame = 0;
  };

  CloudFeatureParams params_;
  std::int64_t frame_ = 0;
  std::int64_t next_track_ = 0;
  std::unordered_map<std::uint64_t, Cell> cells_;
};

}  // namespace planar_mapping
