// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/plane_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace planar_mapping::detail {

namespace {

// Pixels are half a gap wide and connected over two pixels in each direction.
constexpr double kPixelsPerGap = 2.0;
constexpr int kReach = 2;

struct Pixel {
  std::int64_t row;
  std::int64_t column;
  bool operator<(const Pixel& other) const {
    return row != other.row ? row < other.row : column < other.column;
  }
  bool operator==(const Pixel& other) const { return row == other.row && column == other.column; }
};

/// Components of the occupied pixels of a dense bitmap; \p bitmap holds 0 where empty and -1 where
/// occupied, and gets 1 + component.
int labelDense(std::vector<std::int32_t>& bitmap, std::size_t pitch,
               const std::vector<std::int32_t>& pixel_of) {
  int components = 0;
  std::vector<std::size_t> open;
  for (const std::int32_t start : pixel_of) {
    if (bitmap[static_cast<std::size_t>(start)] != -1) continue;
    ++components;
    bitmap[static_cast<std::size_t>(start)] = components;
    open.assign(1, static_cast<std::size_t>(start));
    while (!open.empty()) {
      const std::size_t pixel = open.back();
      open.pop_back();
      for (int row = -kReach; row <= kReach; ++row) {
        const std::size_t left =
            pixel + static_cast<std::size_t>(row) * pitch - static_cast<std::size_t>(kReach);
        for (std::size_t next = left; next <= left + 2 * kReach; ++next) {
          if (bitmap[next] != -1) continue;
          bitmap[next] = components;
          open.push_back(next);
        }
      }
    }
  }
  return components;
}

/// The same for few pixels in a huge rectangle; \p occupied is sorted.
int labelSparse(const std::vector<Pixel>& occupied, std::vector<std::int32_t>& component) {
  int components = 0;
  component.assign(occupied.size(), 0);
  std::vector<std::size_t> open;
  for (std::size_t start = 0; start < occupied.size(); ++start) {
    if (component[start] != 0) continue;
    component[start] = ++components;
    open.assign(1, start);
    while (!open.empty()) {
      const Pixel pixel = occupied[open.back()];
      open.pop_back();
      for (std::int64_t row = pixel.row - kReach; row <= pixel.row + kReach; ++row) {
        auto next =
            std::lower_bound(occupied.begin(), occupied.end(), Pixel{row, pixel.column - kReach});
        for (; next != occupied.end() && next->row == row && next->column <= pixel.column + kReach;
             ++next) {
          const auto index = static_cast<std::size_t>(next - occupied.begin());
          if (component[index] != 0) continue;
          component[index] = components;
          open.push_back(index);
        }
      }
    }
  }
  return components;
}

/// Renames patches 1 .. count by size, largest first from 0, ties in order of appearance.
void nameBySize(int count, std::vector<std::int32_t>& patches) {
  std::vector<std::pair<std::int64_t, int>> sizes(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) sizes[static_cast<std::size_t>(i)] = {0, i};
  for (const std::int32_t patch : patches) --sizes[static_cast<std::size_t>(patch - 1)].first;
  std::sort(sizes.begin(), sizes.end());
  std::vector<std::int32_t> name(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    name[static_cast<std::size_t>(sizes[static_cast<std::size_t>(i)].second)] = i;
  }
  for (std::int32_t& patch : patches) patch = name[static_cast<std::size_t>(patch - 1)];
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
  const double u0 = -u.dot(origin), v0 = -v.dot(origin);
  // In pixels; float would do near the mean but not for clouds kilometres wide. Calculated anew
  // where needed: kept, it would be as large as the cloud.
  const auto at = [&](std::size_t i) {
    const float* p = points[static_cast<std::size_t>(inliers[i])];
    const double x = p[0], y = p[1], z = p[2];
    return std::pair<double, double>(u[0] * x + u[1] * y + u[2] * z + u0,
                                     v[0] * x + v[1] * y + v[2] * z + v0);
  };
  double low_u = std::numeric_limits<double>::max(), high_u = -low_u;
  double low_v = low_u, high_v = -low_u;
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    const auto [pu, pv] = at(i);
    low_u = std::min(low_u, pu);
    high_u = std::max(high_u, pu);
    low_v = std::min(low_v, pv);
    high_v = std::max(high_v, pv);
  }
  const double columns = std::floor(high_u - low_u) + 1.0 + 2 * kReach;
  const double rows = std::floor(high_v - low_v) + 1.0 + 2 * kReach;
  const double affordable = 4.0 * static_cast<double>(inliers.size()) + 65536.0;

  int count = 0;
  segment.patches.resize(inliers.size());
  if (columns * rows <= std::min(affordable, 2e9)) {
    const auto pitch = static_cast<std::size_t>(columns);
    std::vector<std::int32_t> bitmap(pitch * static_cast<std::size_t>(rows), 0);
    for (std::size_t i = 0; i < inliers.size(); ++i) {
      const auto [pu, pv] = at(i);
      const auto column = static_cast<std::size_t>(pu - low_u) + kReach;
      const auto row = static_cast<std::size_t>(pv - low_v) + kReach;
      segment.patches[i] = static_cast<std::int32_t>(row * pitch + column);
      bitmap[row * pitch + column] = -1;
    }
    count = labelDense(bitmap, pitch, segment.patches);
    for (std::int32_t& patch : segment.patches) patch = bitmap[static_cast<std::size_t>(patch)];
  } else {
    constexpr double kFar = 4e18;
    const auto pixelOf = [&](std::size_t i) {
      const auto [pu, pv] = at(i);
      return Pixel{static_cast<std::int64_t>(std::min(pv - low_v, kFar)),
                   static_cast<std::int64_t>(std::min(pu - low_u, kFar))};
    };
    std::vector<Pixel> occupied(inliers.size());
    for (std::size_t i = 0; i < inliers.size(); ++i) occupied[i] = pixelOf(i);
    std::sort(occupied.begin(), occupied.end());
    occupied.erase(std::unique(occupied.begin(), occupied.end()), occupied.end());
    std::vector<std::int32_t> component;
    count = labelSparse(occupied, component);
    for (std::size_t i = 0; i < inliers.size(); ++i) {
      const auto found = std::lower_bound(occupied.begin(), occupied.end(), pixelOf(i));
      segment.patches[i] = component[static_cast<std::size_t>(found - occupied.begin())];
    }
  }
  if (count == 1) {
    segment.patches.clear();
    segment.patches.shrink_to_fit();
    return;
  }
  nameBySize(count, segment.patches);
  segment.number_of_patches = count;
}

}  // namespace planar_mapping::detail
