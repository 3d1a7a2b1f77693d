// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/simulated_features.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kSmallestIncidence = 0.1;  ///< cosine below which nothing is recognised
constexpr double kSmallestDisparity = 1.0;  ///< pixels
constexpr double kSameDepth = 0.01;         ///< of the depth: the landmark is what the pixel shows
constexpr int kTriesPerLandmark = 8;
constexpr std::uint64_t kFeatureStreams = 1u << 21u;

std::size_t pixelAt(const PinholeCamera& camera, double column, double row) {
  return static_cast<std::size_t>(std::lround(row)) * static_cast<std::size_t>(camera.width) +
         static_cast<std::size_t>(std::lround(column));
}

}  // namespace

/// A landmark as a frame shows it, without error.
struct SimulatedFeatures::Sight {
  std::int64_t identity;
  double column, row, disparity;
};

void SimulatedFeatureParams::validate() const {
  requireInRange("per_frame", per_frame, 1, 100000);
  requireInRange("noise_px", noise_px, 0.0, 100.0, "px");
  requireInRange("miss_fraction", miss_fraction, 0.0, 1.0);
}

SimulatedFeatures::SimulatedFeatures(const Simulation& simulation,
                                     const SimulatedFeatureParams& params)
    : simulation_(simulation), params_(params) {
  params_.validate();
}

std::vector<SimulatedFeatures::Sight> SimulatedFeatures::landmarksInView(
    const SimulatedFrame& frame) const {
  const Rendering& truth = frame.truth;
  const PinholeCamera& camera = truth.camera;
  const double baseline = simulation_.params().sensor.baseline;
  const Pose T_camera_world = frame.T_world_camera.inverse();
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const Vector3 p = T_camera_world * landmarks_[i].position;
    if (p.z() <= 0.0) continue;
    const Vector2 place = camera.project(p);
    const double column = place.x();
    const double row = place.y();
    const double disparity = baseline * camera.fx / p.z();
    // In both images, and what their pixel shows.
    if (!(column >= disparity && column <= camera.width - 1 && row >= 0.0 &&
          row <= camera.height - 1 && disparity >= kSmallestDisparity))
      continue;
    const std::size_t pixel = pixelAt(camera, column, row);
    if (truth.object[pixel] != landmarks_[i].object ||
        std::abs(static_cast<double>(truth.depth[pixel]) - p.z()) > kSameDepth * p.z())
      continue;
    sights.push_back({static_cast<std::int64_t>(i), column, row, disparity});
  }
  return sights;
}

void SimulatedFeatures::findNewLandmarks(const SimulatedFrame& frame, std::size_t count,
                                         Random& random) {
  const Rendering& truth = frame.truth;
  const PinholeCamera& camera = truth.camera;
  std::size_t found = 0;
  for (std::size_t tries = 0; tries < kTriesPerLandmark * count && found < count; ++tries) {
    const auto pixel =
        static_cast<std::size_t>(random.below(static_cast<std::uint32_t>(truth.size())));
    if (truth.object[pixel] < 0 ||
        static_cast<double>(truth.incidence[pixel]) < kSmallestIncidence ||
        truth.texture[pixel] <= 0.0f)
      continue;
    const auto width = static_cast<std::size_t>(camera.width);
    const Vector3 ray =
        camera.rayOf(static_cast<double>(pixel % width), static_cast<double>(pixel / width));
    const auto depth = static_cast<double>(truth.depth[pixel]);
    const Vector3 position = frame.T_world_camera * (depth * ray);
    landmarks_.push_back({position, truth.object[pixel], 0});
    ++found;
  }
}

std::vector<KeyFeature> SimulatedFeatures::next(const SimulatedFrame& frame) {
  if (frame.truth.size() == 0) throw InputError("features need the truth of the frame");
  if (static_cast<std::int64_t>(frame.index) < next_frame_)
    throw InputError("features are made in the order of the frames");
  next_frame_ = static_cast<std::int64_t>(frame.index) + 1;
  Random random(params_.seed, kFeatureStreams + frame.index);
  const PinholeCamera& camera = frame.truth.camera;
  const double baseline = simulation_.params().sensor.baseline;

  const std::size_t known = landmarksInView(frame).size();
  const auto wanted = static_cast<std::size_t>(params_.per_frame);
  if (known < wanted) findNewLandmarks(frame, wanted - known, random);
  std::vector<KeyFeature> features;
  for (const Sight& sight : landmarksInView(frame)) {
    // Drawn for every one alike: what happens to one does not change the others.
    const bool missed = random.uniform() < params_.miss_fraction;
    for (int unused = 0; unused < 3; ++unused) random.uniform();  // docs/results.md has them
    const double noise[3] = {random.normal(), random.normal(), random.normal()};
    if (missed) continue;
    const double column = sight.column + params_.noise_px * noise[0];
    const double row = sight.row + params_.noise_px * noise[1];
    const double disparity =
        std::max(sight.disparity + params_.noise_px * noise[2], 0.5 * kSmallestDisparity);
    const double depth = baseline * camera.fx / disparity;
    KeyFeature feature;
    feature.track = sight.identity;
    feature.column = static_cast<float>(column);
    feature.row = static_cast<float>(row);
    feature.disparity = static_cast<float>(disparity);
    feature.position = depth * camera.rayOf(column, row);
    feature.sightings = ++landmarks_[static_cast<std::size_t>(sight.identity)].sightings;
    features.push_back(feature);
  }
  return features;
}

}  // namespace planar_mapping::evaluation
