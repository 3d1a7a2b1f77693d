// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/atlas/place_finder.h"
#include "planar_mapping/base/export.h"

namespace planar_mapping {

/// Where a frame was found in an atlas, and by what.
struct Place {
  std::int64_t component = 0;
  std::int64_t session = 0;                ///< of the keyframe
  std::int64_t submap = 0;                 ///< of the keyframe
  std::int64_t keyframe = 0;               ///< the one that speaks for it most
  Pose T_world_sensor = Pose::Identity();  ///< in the world of the component
  /// Of the sensor's position and of turns about it, along the axes of the world, with the submap
  /// taken for exact; order as in Matrix6.
  Matrix6 covariance = Matrix6::Identity();
  LinkEvidence evidence;
};

/// Finds single frames in a known building. Const functions may be called from several threads.
class PLANAR_MAPPING_EXPORT AtlasLocalizer {
 public:
  /// \param atlas  has to outlive it and to stay as it is
  /// \throws InputError as PlaceFinder::add()
  explicit AtlasLocalizer(const AtlasData& atlas);

  /// By the keyframe that it agrees with best of the most alike ones; a cloud without an image has
  /// to be a scan. Ids and pose of \p frame do not matter.
  /// \return nothing where too little agrees, or another place of the same component fits nearly as
  ///         well: rooms of one look. Components are not compared, since nothing says that they are
  ///         different places: the one with the most evidence answers.
  /// \throws InputError as PlaceFinder::add()
  std::optional<Place> find(Keyframe frame) const;

 private:
  const AtlasData& atlas_;
  PlaceFinder places_;
};

}  // namespace planar_mapping
