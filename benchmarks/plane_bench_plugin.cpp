// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "plane_bench_plugin.h"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "planar_mapping/base/error.h"
#include "planar_mapping/planes/multi_plane.h"

namespace {

using planar_mapping::PlaneSearchMethod;

struct Entry {
  const char* name;
  PlaneSearchMethod method;
};

constexpr Entry kEntries[] = {
    {"pm_auto", PlaneSearchMethod::Automatic},
    {"pm_organized", PlaneSearchMethod::Organized},
    {"pm_sequential", PlaneSearchMethod::Sequential},
    {"pm_multi_ransac", PlaneSearchMethod::MultiRansac},
};

}  // namespace

int pb_count(void) {
  return static_cast<int>(std::size(kEntries));
}

const char* pb_name(int i) {
  return kEntries[i].name;
}

int pb_run(int i, const pb_input* in, pb_output* out) {
  if (kEntries[i].method == PlaneSearchMethod::Organized && in->height < 2) return 1;
  planar_mapping::MultiPlaneParams params;
  params.method = kEntries[i].method;
  params.distance_threshold = in->dist;
  params.min_inliers = in->min_inliers;
  const planar_mapping::PointsView points(in->xyz, static_cast<std::uint32_t>(in->width),
                                          static_cast<std::uint32_t>(in->height), 3);
  planar_mapping::PlaneSet found;
  const auto start = std::chrono::steady_clock::now();
  try {
    found = planar_mapping::findPlanes(points, nullptr, params);
  } catch (const planar_mapping::Error&) {
    return 2;
  }
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
  out->ms_pre = 0.0;
  out->ms_seg = taken.count();
  std::fill(out->labels, out->labels + in->n, -1);
  out->n_planes = std::min(static_cast<int>(found.planes.size()), out->max_planes);
  for (int k = 0; k < out->n_planes; ++k) {
    const planar_mapping::PlaneSegment& segment = found.planes[static_cast<std::size_t>(k)];
    for (const int point : segment.inliers) out->labels[point] = k;
    for (int j = 0; j < 3; ++j) out->planes[4 * k + j] = segment.plane.normal[j];
    out->planes[4 * k + 3] = segment.plane.offset;
  }
  return 0;
}
