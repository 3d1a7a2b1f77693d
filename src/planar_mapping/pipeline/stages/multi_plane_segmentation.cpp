// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "planar_mapping/pipeline/noise_keys.h"
#include "planar_mapping/pipeline/stages/builtin.h"

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
    params_.source = PlaneSource::Features;
    params_.features.refine = false;
    assumed_probability_ = 0.0;
    noise_.setSource(detail::NoiseKeys::Source::None);
  }
  void declare(ParameterTable& table) override {
    table.word("method", params_.method,
               {{"automatic", PlaneSearchMethod::Automatic},
                {"multi_ransac", PlaneSearchMethod::MultiRansac},
                {"sequential", PlaneSearchMethod::Sequential},
                {"organized", PlaneSearchMethod::Organized},
                {"disparity", PlaneSearchMethod::Disparity}},
               "how planes are looked for");
    table.word("source", params_.source,
               {{"dense", PlaneSource::Dense},
                {"features", PlaneSource::Features},
                {"auto", PlaneSource::Auto}},
               "what planes are found in: the dense points, the key features, whose planes the "
               "dense points are then given to (Eq. 11), or auto = the key features and then the "
               "dense points on none of their planes");
    table.integer("features", params_.features.samples, Range::atLeast(8),
                  "points sampled evenly from the cloud in place of key features, where a frame "
                  "has none");
    table.integer("min_features", params_.features.min_features, Range::atLeast(3),
                  "[ours] key features on a plane, fewer could be chance");
    table.flag("refine", params_.features.refine,
               "[ours] planes of key features keep only points that are a surface and are refitted "
               "to them; without, dense points only belong, as in the paper");
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
    table.number("assumed_probability", assumed_probability_, Range::between(0.0, 1.0),
                 "[ours] belief in a plane where a stereo camera measures nothing between its "
                 "points, as the image is even: a white wall; 0 = none");
    table.basic({"source", "distance_threshold_m", "min_inliers", "noise", "noise_factor"});
  }
  void configure(const RunSettings& settings) override {
    params_.seed = settings.seed;
    params_.threads = settings.threads;
    params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    if (!distance_threshold_) distance_threshold_ = automaticThreshold(scale);
    if (!min_inliers_) min_inliers_ = automaticSmallestPlane(scale);
    up_ = scale.up;
    noise_.adapt(scale);
    params_.noise = noise_.optionalNoise();
    params_.distance_threshold = *distance_threshold_;
    params_.min_inliers = *min_inliers_;
    params_.validate();
  }
  bool usesKeyFeatures(const Frame&) const override { return params_.source != PlaneSource::Dense; }
  void process(Frame& frame) override {
    const bool assumes = assumed_probability_ > 0.0 && !frame.even.empty() && frame.camera;
    if (assumes) takeOutCarried(frame);
    segmentation_.setParams(params_);
    segmentation_.setInputCloud(frame.cloud);
    segmentation_.setIndices(detail::sharedIndices(frame.indices));
    segmentation_.setInputFeatures(frame.key_features);
    segmentation_.segment();
    segmentation_.setInputCloud(nullptr);
    frame.planes = segmentation_.takePlanes();
    if (assumes) {
      frame.assumed = assumePoints(
          pointsOf(*frame.cloud), frame.indices, frame.ground, *frame.camera, frame.even,
          frame.T_world_sensor.linear().transpose() * up_, params_, frame.planes);
      frame.assumed.probability = assumed_probability_;
      frame.statistics.push_back(
          {"assumed_points", static_cast<double>(frame.assumed.xyz.size() / 3)});
    }
    if (params_.source == PlaneSource::Dense) return;
    const auto number = static_cast<double>(frame.planes.size());
    const auto dense =
        static_cast<double>(segmentation_.getDiagnostics().features.planes_of_dense_points);
    frame.statistics.push_back({"planes_from_features", number - dense});
    frame.statistics.push_back({"planes_from_dense", dense});
  }

 private:
  /// What matching carried into even parts of the image makes no cell and clears no space.
  static void takeOutCarried(Frame& frame) {
    const Indices carried = carriedPoints(pointsOf(*frame.cloud), *frame.camera, frame.even);
    if (carried.empty()) return;
    frame.cloud = pcl::make_shared<FrameCloud>(*frame.cloud);
    frame.cloud->is_dense = false;
    for (const int i : carried) {
      pcl::PointXYZ& point = (*frame.cloud)[static_cast<std::size_t>(i)];
      point.x = point.y = point.z = std::numeric_limits<float>::quiet_NaN();
    }
    for (Indices* points : {&frame.indices, &frame.ground}) {
      Indices left;
      std::set_difference(points->begin(), points->end(), carried.begin(), carried.end(),
                          std::back_inserter(left));
      *points = std::move(left);
    }
  }

  MultiPlaneParams params_;
  double assumed_probability_ = 0.6;
  std::optional<double> distance_threshold_ = 0.05;
  std::optional<int> min_inliers_ = 100;
  Vector3 up_ = Vector3::UnitZ();
  detail::NoiseKeys noise_;
  MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation_;
};

}  // namespace

void detail::addMultiPlaneSegmentation(StageTable& table) {
  table.add<MultiPlaneSegmentationStage>();
}

}  // namespace planar_mapping
