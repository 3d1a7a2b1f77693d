// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <vector>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/features/feature_detection.h"
#include "planar_mapping/stereo/features/stereo_features.h"
#include "planar_mapping/stereo/rectification.h"

namespace planar_mapping {

std::optional<double> rowsApart(const io::Image& left, const io::Image& right,
                                const io::Calibration& calibration) {
  constexpr int kFeatures = 1000;
  constexpr double kReach = 0.06;       // of the height: the largest offset looked for
  constexpr std::size_t kFewest = 60;   // features that agree
  constexpr double kMinFraction = 0.6;  // of those that match
  constexpr float kSameOffset = 1.5f;   // pixels, in a quarter of the image
  detail::requirePair(left, right);
  FeatureTrackerParams params;
  params.detector = FeatureDetector::Orb;
  const io::Image grays[2] = {io::toGray(left), io::toGray(right)};
  const detail::DetectedFeatures here =
      detail::detectFeatures(detail::matOf(grays[0]), params, kFeatures);
  const detail::DetectedFeatures there =
      detail::detectFeatures(detail::matOf(grays[1]), params, kFeatures);
  detail::RowSearch search;
  search.low = calibration.camera.cx - calibration.cx_right;
  search.high = search.low + params.max_disparity_fraction * left.width;
  search.epipolar_tolerance = kReach * left.height;
  search.ratio = params.track_ratio;
  const std::vector<int> matches = detail::matchAlongRows(here, there, search);

  // A turned camera is off by more rows on one side than on the other.
  std::array<std::vector<float>, 4> quarters;
  std::size_t matched = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i] < 0) continue;
    const detail::Detection& place = here.places[i];
    const int quarter = (2.0f * place.row < static_cast<float>(left.height) ? 0 : 2) +
                        (2.0f * place.column < static_cast<float>(left.width) ? 0 : 1);
    quarters[static_cast<std::size_t>(quarter)].push_back(
        there.places[static_cast<std::size_t>(matches[i])].row - place.row);
    ++matched;
  }
  std::vector<float> apart;
  for (std::vector<float>& offsets : quarters) {
    if (offsets.empty()) continue;
    const float usual = detail::ranked(offsets, offsets.size() / 2);
    for (const float offset : offsets)
      if (std::abs(offset - usual) <= kSameOffset) apart.push_back(std::abs(offset));
  }
  if (apart.size() < kFewest ||
      static_cast<double>(apart.size()) < kMinFraction * static_cast<double>(matched)) {
    return std::nullopt;
  }
  return double{detail::ranked(apart, apart.size() / 2)};
}

}  // namespace planar_mapping
