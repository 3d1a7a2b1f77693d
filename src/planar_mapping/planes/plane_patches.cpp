// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/grid/cell_table.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping::detail {

namespace {

// Pixels are half a gap wide and connected over two pixels in each direction.
constexpr double kPixelsPerGap = 2.0;
constexpr int kReach = 2;

/// Renames patches 0 .. count - 1 by size, largest first from 0, ties in order of appearance.
void nameBySize(int count, std::vector<std::int32_t>& patches) {
  std::vector<std::pair<std::int64_t, int>> sizes(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) sizes[static_cast<std::size_t>(i)] = {0, i};
  for (const std::int32_t patch : patches) --sizes[static_cast<std::size_t>(patch)].first;
  std::sort(sizes.begin(), sizes.end());
  std::vector<std::int32_t> name(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    name[static_cast<std::size_t>(sizes[static_cast<std::size_t>(i)].second)] = i;
  }
  for (std::int32_t& patch : patches) patch = name[static_cast<std::size_t>(patch)];
}

}  // namespace

double automaticPatchGap(const PlaneMoments::Fit& fit, double inliers, double distance_threshold) {
  // A uniform rectangle of sides a, b has eigenvalues a^2 / 12 and b^2 / 12.
  const double area = 12.0 * std::sqrt(fit.eigenvalues[1] * fit.eigenvalues[2]);
  return 4.0 * std::max(distance_threshold, std::sqrt(area / std::max(1.0, inliers)));
}

void findPatches(const PointsView& points, double gap, PlaneSegment& segment) {
  const Indices& inliers = segment.inliers;
  segment.patches.clear();
  segment.number_of_patches = inliers.empty() ? 0 : 1;
  if (inliers.empty() || !(gap > 0.0)) return;

  const Vector3 n = segment.plane.normal;
  const Vector3 u = n.unitOrthogonal() * (kPixelsPerGap / gap);
  const Vector3 v = n.cross(u);
  const Vector3 origin = segment.moments.mean();
  // In pixels; float would do near the mean but not for clouds kilometres wide.
  constexpr double kFarthest = (1 << 30) - 1;
  CellTable pixels(inliers.size() / 8);
  segment.patches.resize(inliers.size());
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    const Vector3 p = points.point(static_cast<std::size_t>(inliers[i])) - origin;
    CellKey pixel;
    cellOf({std::clamp(u.dot(p), -kFarthest, kFarthest),
            std::clamp(v.dot(p), -kFarthest, kFarthest), 0.0},
           pixel);
    segment.patches[i] = pixels.insert(pixel);
  }
  const std::vector<std::int32_t> component = componentsOf(pixels, {kReach, kReach, 0});
  const int count = 1 + *std::max_element(component.begin(), component.end());
  for (std::int32_t& patch : segment.patches) patch = component[static_cast<std::size_t>(patch)];
  if (count == 1) {
    segment.patches.clear();
    segment.patches.shrink_to_fit();
    return;
  }
  nameBySize(count, segment.patches);
  segment.number_of_patches = count;
}

}  // namespace planar_mapping::detail
