// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/odometry/frame_features.h"

#include <algorithm>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"

namespace planar_mapping::detail {

std::vector<SeenFeature> usableFeatures(const std::vector<KeyFeature>& features,
                                        const FeatureCamera& camera) {
  std::vector<SeenFeature> seen;
  for (std::size_t i = 0; i < features.size(); ++i) {
    SeenFeature one;
    one.feature = i;
    one.track = features[i].track;
    if (sightingOf(camera, features[i], one.sighting)) seen.push_back(one);
  }
  std::sort(seen.begin(), seen.end(),
            [](const SeenFeature& a, const SeenFeature& b) { return a.track < b.track; });
  // Of a track that is in two places at once, nobody knows which.
  std::vector<SeenFeature> unique;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const bool repeated = (i > 0 && seen[i - 1].track == seen[i].track) ||
                          (i + 1 < seen.size() && seen[i + 1].track == seen[i].track);
    if (!repeated) unique.push_back(seen[i]);
  }
  return unique;
}

std::string reasonFor(const MotionEstimate& estimate, std::size_t features, std::size_t matches,
                      const MotionParams& params) {
  switch (estimate.status) {
    case MotionStatus::TooFewMatches:
      return "only " + std::to_string(matches) + " of " + counted(features, "feature") +
             " are known from earlier frames, " + std::to_string(params.min_matches) +
             " are needed";
    case MotionStatus::TooFewInliers:
      return "only " + std::to_string(estimate.inliers) + " of " +
             counted(matches, "known feature") +
             " agree on a motion: wrong matches or moving things";
    case MotionStatus::Uncertain:
      return "the " + counted(estimate.inliers, "known feature") +
             " that agree do not fix the pose well enough";
    case MotionStatus::Found:
      break;
  }
  return "only " + std::to_string(estimate.inliers) + " of " + counted(matches, "known feature") +
         " agree on a jump";
}

void requireTracks(const std::vector<KeyFeature>& features) {
  for (const KeyFeature& feature : features) {
    if (feature.track < 0) {
      throw InputError("a key feature has the track " + std::to_string(feature.track) +
                       ", below 0");
    }
  }
}

}  // namespace planar_mapping::detail
