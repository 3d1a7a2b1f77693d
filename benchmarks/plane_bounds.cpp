// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What noise leaves to any search for planes, beside what ours finds: the bounds of
// docs/results.md.
//   plane_bounds     prints Markdown
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "labelled_clouds.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "evaluation/plane_bounds.h"
#include "evaluation/plane_quality.h"

namespace {

using namespace planar_mapping;
using evaluation::assignToKnownPlanes;
using evaluation::CoplanarParams;
using evaluation::DisparityNoise;
using evaluation::joinCoplanar;
using evaluation::judgePlanes;
using evaluation::KnownPlanesParams;
using evaluation::NormalError;
using evaluation::normalError;
using evaluation::PlaneQuality;
using evaluation::PlaneTruth;
using evaluation::splitFaces;
using evaluation::truthOf;
using evaluation::truthOfLabels;
using test::LabelledCloud;

constexpr double kDegree = M_PI / 180.0;

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

/// Whether a segment holds 80 % of a plane and lies within a degree of it.
bool isFound(const PlaneTruth& truth, std::size_t plane, std::size_t size,
             const std::vector<PlaneSegment>& found) {
  for (const PlaneSegment& segment : found) {
    std::size_t shared = 0;
    for (const int i : segment.inliers) {
      shared += truth.labels[static_cast<std::size_t>(i)] == static_cast<int>(plane) ? 1 : 0;
    }
    if (10 * shared <= 8 * size) continue;
    const double cosine = std::fabs(segment.plane.normal.dot(truth.planes[plane].normal));
    return cosine > std::cos(kDegree);
  }
  return false;
}

/// How many faces of room frames can be known to a degree.
void boundNormals() {
  constexpr double kFocalBaseline = 525.0 * 0.075;
  DisparityNoise noise;  // of furnishedRoom()
  noise.white = 1.0 / 8.0 / std::sqrt(12.0);
  noise.smooth = 0.05;
  noise.smooth_side = 5;
  std::printf(
      "\n### Normals of room frames within a degree\n\n| seed | faces | expected of all points "
      "| of all points | ours, with 80 %% of them | doubtful: points (chance) |\n"
      "|---|---|---|---|---|---|\n");
  for (std::uint64_t seed = 100; seed < 109; ++seed) {
    const LabelledCloud cloud = test::roomFrame(seed);
    const PlaneTruth& truth = cloud.truth;
    const std::vector<PlaneSegment> found = ours(cloud.view(), 1000);
    const PlaneTruth fitted = truthOfLabels(cloud.view(), truth.labels);
    std::vector<Indices> faces(truth.planes.size());
    for (std::size_t i = 0; i < truth.labels.size(); ++i) {
      if (truth.labels[i] >= 0)
        faces[static_cast<std::size_t>(truth.labels[i])].push_back(static_cast<int>(i));
    }
    double expected = 0.0;
    int of_all = 0;
    int of_ours = 0;
    std::string doubtful;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      const Plane& plane = truth.planes[f];
      const NormalError error = normalError(cloud.view(), faces[f], plane, kFocalBaseline, noise);
      const double chance = error.chanceWithin(kDegree);
      expected += chance;
      of_all += std::fabs(fitted.planes[f].normal.dot(plane.normal)) > std::cos(kDegree) ? 1 : 0;
      of_ours += isFound(truth, f, faces[f].size(), found) ? 1 : 0;
      if (chance > 0.9) continue;
      char text[48];
      std::snprintf(text, sizeof(text), "%s%zu (%.2f)", doubtful.empty() ? "" : ", ",
                    faces[f].size(), chance);
      doubtful += text;
    }
    std::printf("| %d | %zu | %.1f | %d | %d | %s |\n", static_cast<int>(seed), faces.size(),
                expected, of_all, of_ours, doubtful.c_str());
    std::fflush(stdout);
  }
}

}  // namespace

int main() {
  boundLabels("spiral_stairs_noisy", 0.02);
  boundNormals();
  return 0;
}
