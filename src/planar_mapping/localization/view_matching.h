// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/view.h"

namespace planar_mapping::detail {

/// A view and where it lies.
struct PlacedView {
  const View* view = nullptr;
  Pose T_map_view = Pose::Identity();
};
/// What a frame is registered to: the nearest view first, whose frame is that of the map.
using LocalMap = std::vector<PlacedView>;

/// A feature of a view of the map with one of the frame.
struct FeaturePair {
  std::size_t view = 0;
  std::size_t before = 0;
  std::size_t now = 0;
};

/// Features with depth that are each other's most alike, clearly more than the second.
std::vector<FeaturePair> matchFeatures(const LocalMap& map, const View& now);

/// Each feature of the map with the most alike one near where it should be seen.
struct GuidedPairs {
  std::vector<FeaturePair> pairs;
  /// Features that should be seen: inside the image, not hidden, of about the same size.
  std::vector<FeaturePair> expected;  ///< now is not set
};
GuidedPairs guidedPairs(const LocalMap& map, const View& now, const Pose& T_now_map);

/// Whether a feature of a view should be seen again: inside the image, not hidden, of about the
/// same size. \param place  where
bool isExpected(const View& before, const ViewFeature& feature, const View& now,
                const Pose& T_now_view, FeatureSighting& place);

/// A match of a feature of the map, without what is seen now.
FeatureMatch mapSide(const PlacedView& placed, const ViewFeature& feature);
std::vector<FeatureMatch> featureMatches(const LocalMap& map, const View& now,
                                         const std::vector<FeaturePair>& pairs);

}  // namespace planar_mapping::detail
