// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "organized_segments.h"

#include <algorithm>
#include <cmath>

#include "plane_patches.h"

namespace planar_mapping::detail {
namespace {

// Row by row, so that every list is ascending.
void listInliers(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                 const std::vector<int*>& lists) {
  std::vector<int*> end = lists;
  for (int row = 0; row < cloud.height; ++row) {
    const std::size_t first_tile = static_cast<std::size_t>(row / kTileSide) * cloud.columns;
    for (int column = 0; column < cloud.width; column += kQuarterSide) {
      const std::int16_t* four = labels.data() + (first_tile + column / kTileSide) * kTileArea +
                                 pixelInTile(row % kTileSide, column % kTileSide);
      const int index = row * cloud.width + column;
      const std::int16_t label = four[0];
      if (label == four[1] && label == four[2] && label == four[3]) {
        if (label < 0) continue;
        int*& list = end[static_cast<std::size_t>(label)];
        for (int i = 0; i < kQuarterSide; ++i) list[i] = index + i;
        list += kQuarterSide;
        continue;
      }
      for (int i = 0; i < kQuarterSide; ++i) {
        if (four[i] >= 0) *end[static_cast<std::size_t>(four[i])]++ = index + i;
      }
    }
  }
}

}  // namespace

void writeSegments(const PointsView& points, const TiledCloud& cloud,
                   const std::vector<PlaneCandidate>& planes, const PixelAssigner& pixels,
                   const MultiPlaneParams& params, const Vector3& sensor, PlaneSet& set) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (planes[i].valid) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].sums[kN] > planes[b].sums[kN];
  });
  set.planes.resize(order.size());
  std::vector<int*> lists(planes.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const PlaneCandidate& plane = planes[order[i]];
    PlaneSegment& segment = set.planes[i];
    Matrix3 outer;
    outer << plane.sums[kXX], plane.sums[kXY], plane.sums[kXZ], plane.sums[kXY], plane.sums[kYY],
        plane.sums[kYZ], plane.sums[kXZ], plane.sums[kYZ], plane.sums[kZZ];
    const Vector3 sum(plane.sums[kX], plane.sums[kY], plane.sums[kZ]);
    segment.moments = PlaneMoments::fromSums(plane.sums[kN], sum, outer, Vector3::Zero());
    Pose shift = Pose::Identity();
    shift.translation() = cloud.origin;
    segment.moments = segment.moments.transformed(shift);
    const PlaneMoments::Fit fit = segment.moments.fit();
    const Vector3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
    segment.plane = orientedTowards({normal, plane.offset - normal.dot(cloud.origin)}, sensor);
    segment.rms = std::sqrt(plane.meanSquare(plane.sums));
    segment.tilt = normalizedTilt(segment.plane);
    segment.covariance = segment.moments.planeCovariance(fit);
    segment.inliers.resize(static_cast<std::size_t>(plane.sums[kN]));
    lists[order[i]] = segment.inliers.data();
  }
  listInliers(cloud, pixels.labels(), lists);
  if (params.patch_gap > 0.0) {
    for (PlaneSegment& segment : set.planes) findPatches(points, params.patch_gap, segment);
  }
}

}  // namespace planar_mapping::detail
