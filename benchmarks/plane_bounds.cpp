// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What noise leaves to any search for planes, beside what ours finds: the bounds of
// docs/results.md.
//   plane_bounds     prints Markdown
#include <cstdio>
#include <string>
#include <vector>

#include "evaluation/plane_bounds.h"
#include "evaluation/plane_quality.h"
#include "labelled_clouds.h"
#include "planar_mapping/core/planes/multi_plane.h"

namespace {

using namespace planar_mapping;
using evaluation::assignToKnownPlanes;
using evaluation::CoplanarParams;
using evaluation::joinCoplanar;
using evaluation::judgePlanes;
using evaluation::KnownPlanesParams;
using evaluation::PlaneQuality;
using evaluation::PlaneTruth;
using evaluation::splitFaces;
using evaluation::truthOf;
using evaluation::truthOfLabels;
using test::LabelledCloud;

std::vector<PlaneSegment> ours(const PointsView& points, int min_points) {
  MultiPlaneParams params;
  params.min_inliers = min_points;
  return findPlanes(points, nullptr, params).planes;
}

void printRow(const char* who, const LabelledCloud& cloud, int min_points,
              const std::vector<PlaneSegment>& found) {
  const PlaneQuality labels = judgePlanes(cloud.truth, found);
  const PlaneTruth large =
      truthOf(cloud.view(), cloud.truth.labels, cloud.truth.planes, min_points);
  const PlaneQuality faces = judgePlanes(splitFaces(cloud.view(), large, min_points),
                                         splitFaces(cloud.view(), found, min_points));
  const CoplanarParams coplanar;
  const PlaneQuality joined = judgePlanes(joinCoplanar(cloud.view(), large, coplanar),
                                          joinCoplanar(cloud.view(), found, coplanar));
  std::printf("| %s | %d / %d | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f |\n", who, labels.correct,
              labels.true_planes, labels.recall(), labels.precision(), faces.recall(),
              faces.precision(), joined.recall(), joined.precision());
  std::fflush(stdout);
}

/// Labels in white noise along the rays, by methods that know planes and noise.
void boundLabels(const char* name, double range_noise) {
  constexpr int kMinPoints = 100;
  if (test::isMissing("labelled_synpeb")) return;
  const LabelledCloud cloud = test::readSynpeb(name);
  std::printf("\n### %s\n\n", name);
  std::printf(
      "| planes of | found / labels | recall | precision | faces: recall | precision "
      "| joined: recall | precision |\n|---|---|---|---|---|---|---|---|\n");
  printRow("planar_mapping, defaults", cloud, kMinPoints, ours(cloud.view(), kMinPoints));
  KnownPlanesParams params;
  params.range_noise = range_noise;
  params.min_points = kMinPoints;
  printRow("the labels", cloud, kMinPoints,
           assignToKnownPlanes(cloud.view(), cloud.truth.planes, params));
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    // Fitted to other noise and applied to this one; labels choose the points in both.
    const std::vector<float> other =
        measuredAgain(cloud.view(), cloud.truth, range_noise, 2 * seed);
    const LabelledCloud again{cloud.name,
                              measuredAgain(cloud.view(), cloud.truth, range_noise, 2 * seed + 1),
                              cloud.width, cloud.height, cloud.truth};
    const PointsView view(other.data(), cloud.width, cloud.height, 3);
    const PlaneTruth fitted = truthOfLabels(view, cloud.truth.labels);
    const std::string draw = ", draw " + std::to_string(seed);
    printRow(("planar_mapping, defaults" + draw).c_str(), again, kMinPoints,
             ours(again.view(), kMinPoints));
    printRow(("the labels in other noise" + draw).c_str(), again, kMinPoints,
             assignToKnownPlanes(again.view(), fitted.planes, params));
  }
}

}  // namespace

int main() {
  boundLabels("spiral_stairs_noisy", 0.02);
  return 0;
}
