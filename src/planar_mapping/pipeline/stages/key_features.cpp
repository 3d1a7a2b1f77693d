// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/stages/builtin.h"
#include "planar_mapping/stereo/features/cloud_features.h"
#include "planar_mapping/stereo/features/feature_tracker.h"

namespace planar_mapping {
namespace {

enum class Source : std::uint8_t { Auto, Image, Cloud };

/// Whether the image has the size of the cloud, pixel by pixel.
bool showsTheCloud(const Frame& frame) {
  return !frame.images.left.empty() && !frame.cloud->empty() &&
         static_cast<int>(frame.cloud->width) == frame.images.left.width &&
         static_cast<int>(frame.cloud->height) == frame.images.left.height;
}

class KeyFeaturesStage : public Stage {
 public:
  static constexpr const char* kName = "key_features";
  static constexpr const char* kSummary =
      "finds key features and follows them over frames (the paper, III-B)";
  static constexpr StageKind kKind = StageKind::Features;

  void declare(ParameterTable& table) override {
    table.word("source", source_,
               {{"auto", Source::Auto}, {"image", Source::Image}, {"cloud", Source::Cloud}},
               "[ours] where features come from; auto = the image, where there is one of the same "
               "size as the cloud, else the cloud");
    table.word("detector", tracker_params_.detector,
               {{"auto", FeatureDetector::Automatic},
                {"sift", FeatureDetector::Sift},
                {"orb", FeatureDetector::Orb},
                {"akaze", FeatureDetector::Akaze}},
               "of images; auto = ORB (the paper has SURF)");
    table.integer("max_features", tracker_params_.max_features, Range::between(8, 20000),
                  "of one image, spread evenly over it");
    table.number("detection_threshold", tracker_params_.detection_threshold, Range::atLeast(0.0),
                 "weakest response, in the detector's unit; 0 = its usual one");
    table.number("epipolar_tolerance_px", tracker_params_.epipolar_tolerance,
                 Range::between(0.0, 100.0),
                 "[ours] rows of left and right feature may differ by so much");
    table.number("stereo_ratio", tracker_params_.stereo_ratio, Range::above(0.0, 1.0),
                 "[ours] best over second-best descriptor distance along the row, at most");
    table.number("track_ratio", tracker_params_.track_ratio, Range::above(0.0, 1.0),
                 "[ours] best over second-best descriptor distance between frames, at most");
    table.number("min_disparity_px", tracker_params_.min_disparity, Range::between(0.0, 1000.0),
                 "[ours] features of smaller disparity are too far to be of use");
    table.number("max_disparity_fraction", tracker_params_.max_disparity_fraction,
                 Range::above(0.0, 1.0), "[ours] largest disparity, in image widths");
    table.integer("refine_window_px", tracker_params_.refine_window, Range::between(5, 41),
                  "[ours] side of the window of the sub-pixel disparity, odd");
    table.integer("track_window_px", tracker_params_.track_window, Range::between(5, 41),
                  "[ours] side of the window of the place in a new image, odd");
    table.number("max_refine_residual", tracker_params_.max_refine_residual, Range::above(0.0, 2.0),
                 "[ours] gray values in a window may differ by this fraction of their deviation");
    table.flag("refine_tracks", tracker_params_.refine_tracks,
               "[ours] places in a new image follow from gray values of the one before");
    table.integer("remember_frames", tracker_params_.remember_frames, Range::between(0, 1000000),
                  "[ours] a feature lost for so many frames keeps its identity when seen again");
    table.integer("max_remembered", tracker_params_.max_remembered, Range::between(0, 100000),
                  "[ours] lost features kept, the latest");
    table.number("cell_m", sampler_params_.cell, Range::between(1e-6, 1e6),
                 "[ours] features of clouds: one in each cell of this side");
    table.integer("cell_points", sampler_params_.min_points, Range::atLeast(1),
                  "[ours] features of clouds: points in such a cell");
    table.integer("max_cells", sampler_params_.max_features, Range::between(1, 1000000),
                  "[ours] features of clouds: at most");
    table.basic({"source", "detector", "max_features"});
  }
  void configure(const RunSettings& settings) override {
    tracker_params_.threads = settings.threads;
    sampler_params_.remember_frames = tracker_params_.remember_frames;
    tracker_ = FeatureTracker(tracker_params_);
    sampler_ = CloudFeatureSampler(sampler_params_);
    ignores_poses_ = settings.ignores_poses;
  }
  void begin(const Frame& frame) override {
    if (source_ != Source::Cloud && !frame.images.right.empty()) tracker_.begin(frame.images.left);
  }
  void process(Frame& frame) override {
    const bool pair = !frame.images.right.empty() && frame.images.calibration;
    const bool depth = showsTheCloud(frame);
    if (source_ == Source::Image && !pair && !depth)
      throw InputError(
          "key_features: source is 'image', but the input has none of the size of the "
          "cloud");
    if (source_ != Source::Cloud && (pair || depth)) {
      trackImages(frame, pair);
    } else {
      sampleCloud(frame);
    }
  }

 private:
  void trackImages(Frame& frame, bool pair) {
    const FrameImages& images = frame.images;
    const PointsView cloud = showsTheCloud(frame) ? pointsOf(*frame.cloud) : PointsView();
    frame.key_features = pair
                             ? tracker_.track(images.left, images.right, *images.calibration, cloud)
                             : tracker_.track(images.left, cloud);
    const FeatureReport& report = tracker_.report();
    const auto add = [&frame](const char* name, double value) {
      frame.statistics.push_back({name, value});
    };
    add("features_left", static_cast<double>(report.features_left));
    add("features_right", static_cast<double>(report.features_right));
    add("descriptor_matches", static_cast<double>(report.descriptor_matches));
    add("stereo_matches", static_cast<double>(report.stereo_matches));
    add("tracked", static_cast<double>(report.tracked));
    add("reseen", static_cast<double>(report.reseen));
    add("new_tracks", static_cast<double>(report.new_tracks));
    add("key_features.detect_ms", report.detect_ms);
    add("key_features.stereo_ms", report.stereo_ms);
    add("key_features.track_ms", report.track_ms);
    if (report.swapped)
      frame.skip_reason = "left and right images seem to be exchanged: " +
                          std::to_string(report.negative_disparities) +
                          " features have a negative disparity";
  }

  void sampleCloud(Frame& frame) {
    frame.key_features = sampler_.sample(pointsOf(*frame.cloud), nullptr,
                                         ignores_poses_ ? std::nullopt : frame.given_pose);
    std::size_t reseen = 0;
    for (const KeyFeature& feature : frame.key_features) reseen += feature.sightings > 1 ? 1 : 0;
    frame.statistics.push_back({"tracked", static_cast<double>(reseen)});
    frame.statistics.push_back(
        {"new_tracks", static_cast<double>(frame.key_features.size() - reseen)});
  }

  Source source_ = Source::Auto;
  FeatureTrackerParams tracker_params_;
  CloudFeatureParams sampler_params_;
  FeatureTracker tracker_;
  CloudFeatureSampler sampler_;
  bool ignores_poses_ = false;
};
}  // namespace

void detail::addKeyFeatures(StageTable& table) {
  table.add<KeyFeaturesStage>();
}

}  // namespace planar_mapping
