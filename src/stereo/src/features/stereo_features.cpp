// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "features/stereo_features.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "features/feature_refinement.h"
#include "planar_mapping/core/base/detail/parallel.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

}  // namespace

std::vector<int> matchAlongRows(const DetectedFeatures& left, const DetectedFeatures& right,
                                const RowSearch& search) {
  // The same place is often detected at several scales: no rival of itself.
  constexpr float kSamePlace = 2.0f;
  constexpr float kSameRows = 4.0f;  // what the usual tolerance leaves between two of them
  std::vector<std::size_t> by_row(right.size());
  std::iota(by_row.begin(), by_row.end(), std::size_t{0});
  std::stable_sort(by_row.begin(), by_row.end(), [&](std::size_t a, std::size_t b) {
    return right.places[a].row < right.places[b].row;
  });
  const auto tolerance = static_cast<float>(search.epipolar_tolerance);
  struct Owner {
    int left = -1;
    std::int32_t distance = kFar;
  };
  std::vector<Owner> owners(right.size());
  std::vector<int> matches(left.size(), -1);
  std::vector<std::pair<std::int32_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const Detection& place = left.places[i];
    const auto first =
        std::lower_bound(by_row.begin(), by_row.end(), place.row - tolerance,
                         [&](std::size_t j, float row) { return right.places[j].row < row; });
    candidates.clear();
    for (auto it = first; it != by_row.end(); ++it) {
      const Detection& other = right.places[*it];
      if (other.row > place.row + tolerance) break;
      const double disparity = double{place.column} - double{other.column};
      if (disparity < search.low || disparity > search.high) continue;
      const std::int32_t distance = left.descriptors.distance(i, right.descriptors, *it);
      candidates.emplace_back(distance, *it);
      Owner& owner = owners[*it];
      if (distance < owner.distance) owner = {static_cast<int>(i), distance};
    }
    if (candidates.empty()) continue;
    const auto best = *std::min_element(candidates.begin(), candidates.end());
    std::int32_t rival = kFar;
    for (const auto& candidate : candidates) {
      const Detection& rival_place = right.places[candidate.second];
      const Detection& best_place = right.places[best.second];
      const bool same = std::abs(rival_place.column - best_place.column) < kSamePlace &&
                        std::abs(rival_place.row - best_place.row) <= kSameRows;
      if (!same) rival = std::min(rival, candidate.first);
    }
    if (isDistinct(best.first, rival, search.ratio, left.descriptors.isBinary()))
      matches[i] = static_cast<int>(best.second);
  }
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i] >= 0 && owners[static_cast<std::size_t>(matches[i])].left != static_cast<int>(i))
      matches[i] = -1;
  }
  return matches;
}

std::vector<float> refineAlongRows(const cv::Mat& left, const cv::Mat& right,
                                   const std::vector<RowPlace>& places, int window,
                                   float max_residual, int threads) {
  constexpr std::size_t kPlacesPerChunk = 64;
  constexpr float kReach = 3.0f;  // detections are this good, pixels
  std::vector<float> columns(places.size(), kNaN);
  const std::size_t chunks = (places.size() + kPlacesPerChunk - 1) / kPlacesPerChunk;
  parallelFor(chunks, threads, [&](std::size_t chunk) {
    const std::size_t last = std::min((chunk + 1) * kPlacesPerChunk, places.size());
    for (std::size_t i = chunk * kPlacesPerChunk; i < last; ++i) {
      const RowPlace& place = places[i];
      const Patch patch(left, {place.column, place.row}, window);
      const auto found =
          patch.findAlongRow(right, {place.right_column, place.row}, kReach, max_residual);
      if (found) columns[i] = found->x;
    }
  });
  return columns;
}

}  // namespace planar_mapping::detail
