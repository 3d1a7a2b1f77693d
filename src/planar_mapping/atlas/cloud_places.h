// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/localization/registration/surface_map.h"

namespace planar_mapping::detail {

/// A cloud without an image, and where it was seen from.
struct SeenCloud {
  std::int64_t submap = 0;
  Pose T_submap_sensor = Pose::Identity();
  PointsView points;     ///< sensor's frame
  bool is_scan = false;  ///< of a scanner, which looks all around
};

/// Recognises places by the surfaces that clouds without images show: a cloud is registered to
/// those of earlier submaps that saw the same surroundings as far as the poses tell.
///
/// Rooms repeat, and surfaces alone do not tell one from the next. So submaps are looked at only
/// that links join with the cloud's own: the way between them says whether a link may be right.
/// Clouds are of the session at hand and are not stored.
class CloudPlaces {
 public:
  /// Some 30 kB of memory.
  void add(const SeenCloud& cloud);

  /// The links from the submap of a new cloud to the two that saw its surroundings from nearest.
  /// \param excluded  ids of submaps that are left out, such as its neighbours
  std::vector<Link> links(const SeenCloud& cloud, const AtlasData& data,
                          const std::vector<std::int64_t>& excluded) const;

 private:
  struct Kept {
    std::int64_t submap = 0;
    Pose T_submap_sensor = Pose::Identity();
    std::vector<float> xyz;
    Vector3 middle = Vector3::Zero();  ///< of its points, submap's frame
  };
  SurfaceMap mapOf(std::int64_t submap, const SurfaceMapParams& params) const;

  std::vector<Kept> clouds_;
};

}  // namespace planar_mapping::detail
