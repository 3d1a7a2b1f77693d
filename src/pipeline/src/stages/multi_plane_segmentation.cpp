// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/multi_plane.h"

#include <algorithm>

#include "builtin.h"
#include "noise_keys.h"

namespace planar_mapping {
namespace {

class MultiPlaneSegmentationStage : public Stage {
 public:
  static constexpr const char* kName = "multi_plane_segmentation";
  static constexpr const char* kSummary = "finds the planes of the frame (the paper, III-C)";
  static constexpr StageKind kKind = StageKind::Planes;

  void applyProfile(Profile profile) override {
    if (profile != Profile::Paper) return;
    params_.method = PlaneSearchMethod::MultiRansac;
    features_ = 1000;
    noise_.setSource(detail::NoiseKeys::Source::None);
  }
  void declare(ParameterTable& table) override {
    table.word("method", params_.method,
               {{"automatic", PlaneSearchMethod::Automatic},
                {"multi_ransac", PlaneSearchMethod::MultiRansac},
                {"sequential", PlaneSearchMethod::Sequential},
                {"organized", PlaneSearchMethod::Organized}},
               "how planes are looked for");
    table.integer("features", features_, Range::atLeast(0),
                  "planes come from this many points sampled evenly, and all points are then given "
                  "to them (Eq. 11); 0 = from all points");
    table.number("distance_threshold_m", distance_threshold_, Range::positive(),
                 "d_T, Eq. 11; auto = half the automatic resolution");
    table.integer("min_inliers", min_inliers_, Range::atLeast(3),
                  "smallest plane that counts; auto = a 300th of the points, at least 50");
    table.integer("max_planes", params_.max_planes, Range::atLeast(0), "0 = as many as there are");
    noise_.declareOptional(
        table, "the threshold follows the stereo noise, max(d_T, noise_factor * dz(z))");
    table.number("noise_factor", params_.noise_factor, Range::atLeast(0.0), "k of the noise model");
    table.number("patch_gap_m", params_.patch_gap, Range::atLeast(0.0),
                 "[ours] points of one plane farther apart are separate patches; 0 = from the "
                 "density");
    table.integer("number_of_models", params_.number_of_models, Range::atLeast(0),
                  "W of multi-RANSAC; 0 = by significance");
    table.integer("max_iterations", params_.max_iterations, Range::atLeast(0),
                  "of the random search; 0 = from the miss probability");
    table.number("miss_probability", params_.miss_probability, Range::above(0.0, 0.5),
                 "chance to miss a plane that is there");
    table.number("significance", params_.significance, Range::atLeast(0.0),
                 "[ours] standard deviations by which a plane must exceed clutter");
    table.number("max_normal_deviation_deg", params_.max_normal_deviation, Range::above(0.0, 90.0),
                 "[ours] largest angle between a plane and the surface at its points");
  }
  void configure(const RunSettings& settings) override {
    params_.seed = settings.seed;
    params_.threads = settings.threads;
    params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    constexpr std::size_t kSmallest = 50;
    constexpr std::size_t kShare = 300;
    if (!distance_threshold_) distance_threshold_ = 0.5 * detail::automaticResolution(scale);
    if (!min_inliers_) {
      min_inliers_ = static_cast<int>(std::max(kSmallest, scale.points / kShare));
    }
    noise_.adapt(scale);
    params_.noise = noise_.optionalNoise();
    params_.distance_threshold = *distance_threshold_;
    params_.min_inliers = *min_inliers_;
    params_.validate();
  }
  void process(Frame& frame) override {
    const PointsView points = viewOf(*frame.cloud);
    const bool from_features =
        features_ > 0 && frame.indices.size() > static_cast<std::size_t>(features_);
    frame.planes = from_features ? planesFromFeatures(points, frame.indices)
                                 : findPlanes(points, &frame.indices, params_).planes;
  }

 private:
  std::vector<PlaneSegment> planesFromFeatures(const PointsView& points,
                                               const Indices& indices) const;

  MultiPlaneParams params_;
  std::optional<double> distance_threshold_ = 0.05;
  std::optional<int> min_inliers_ = 100;
  int features_ = 0;
  detail::NoiseKeys noise_;
};

std::vector<PlaneSegment> MultiPlaneSegmentationStage::planesFromFeatures(
    const PointsView& points, const Indices& indices) const {
  Indices features;
  const auto count = static_cast<std::size_t>(features_);
  for (std::size_t i = 0; i < count; ++i) features.push_back(indices[i * indices.size() / count]);
  MultiPlaneParams params = params_;
  constexpr double kFewest = 8.0;  // a plane through fewer features could be chance
  const double share = static_cast<double>(count) / static_cast<double>(indices.size());
  params.min_inliers = static_cast<int>(std::max(kFewest, params_.min_inliers * share));
  const PlaneSet found = findPlanes(points, &features, params);
  std::vector<Plane> planes;
  for (const PlaneSegment& segment : found.planes) planes.push_back(segment.plane);
  if (planes.empty()) return {};

  const std::vector<std::int32_t> labels = clusterByPlane(points, planes, params_);
  std::vector<PlaneSegment> segments(planes.size());
  for (const int i : indices) {
    const std::int32_t label = labels[static_cast<std::size_t>(i)];
    if (label < 0) continue;
    PlaneSegment& segment = segments[static_cast<std::size_t>(label)];
    segment.inliers.push_back(i);
    segment.moments.add(points.point(static_cast<std::size_t>(i)));
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    // The paper keeps the parameters of the features; dense points only belong.
    segments[i].plane = planes[i];
    segments[i].covariance = found.planes[i].covariance;
    segments[i].rms = found.planes[i].rms;
    segments[i].tilt = found.planes[i].tilt;
  }
  segments.erase(std::remove_if(segments.begin(), segments.end(),
                                [this](const PlaneSegment& segment) {
                                  return static_cast<int>(segment.inliers.size()) <
                                         params_.min_inliers;
                                }),
                 segments.end());
  std::stable_sort(segments.begin(), segments.end(),
                   [](const PlaneSegment& a, const PlaneSegment& b) {
                     return a.inliers.size() > b.inliers.size();
                   });
  return segments;
}

}  // namespace

namespace detail {

void addMultiPlaneSegmentation(StageTable& table) {
  table.add<MultiPlaneSegmentationStage>();
}

}  // namespace detail
}  // namespace planar_mapping
