// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/localization/registration/surface_map.h"

namespace planar_mapping::detail {

/// Recognises places by the surfaces that clouds without images show: a cloud is registered to
/// those of submaps that may have seen the same surroundings.
///
/// In its own component these are the submaps whose surroundings are nearest by the poses. In
/// others, those with a scan of much the same ranges; the cloud has to be a scan itself, as
/// surfaces in one direction do not tell one room from the next. Rooms repeat all the same: it is
/// up to the pose graph how many such links join components.
class CloudPlaces {
 public:
  /// \param key  with points
  void add(const Keyframe& key);
  std::size_t size() const { return clouds_.size(); }

  /// Scans of most alike ranges, the most alike first, one of each submap.
  /// \param n         at most
  /// \param excluded  ids of submaps
  std::vector<std::int64_t> candidates(const Keyframe& key, std::size_t n,
                                       const std::vector<std::int64_t>& excluded) const;

  /// The links from the submap of a new cloud to those that show its surroundings, and doubts.
  /// \param data      with all keyframes that were added, and their submaps
  /// \param excluded  ids of submaps that are left out, such as its neighbours
  /// \param most      submaps of other components that it is compared with
  std::vector<Link> links(const Keyframe& key, const AtlasData& data,
                          const std::vector<std::int64_t>& excluded, std::size_t most) const;

 private:
  /// How many of the points lie within each range, in half octaves from 0.5 m.
  using Ranges = std::array<double, 16>;
  struct Kept {
    std::int64_t id = 0;
    std::int64_t submap = 0;
    bool is_scan = false;
    Vector3 middle = Vector3::Zero();  ///< of its points, submap's frame
    Ranges ranges{};
  };
  static Ranges rangesOf(const PointsView& points);
  std::vector<std::int64_t> nearest(const Keyframe& key, const AtlasData& data, const Submap& own,
                                    const std::vector<std::int64_t>& excluded, double reach,
                                    bool of_own_session) const;
  std::optional<double> seenThrough(const Keyframe& key, const Pose& T_world_key,
                                    const Submap& beside, bool within_submap,
                                    const AtlasData& data) const;
  SurfaceMap mapOf(std::int64_t submap, const AtlasData& data,
                   const SurfaceMapParams& params) const;

  std::vector<Kept> clouds_;
};

}  // namespace planar_mapping::detail
