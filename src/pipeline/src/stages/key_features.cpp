// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "builtin.h"
#include "colour_alignment.h"
#include "keys/feature_keys.h"
#include "planar_mapping/core/base/detail/state_archive.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

using Source = detail::FeatureKeys::Source;

class KeyFeaturesStage : public Stage {
 public:
  static constexpr const char* kName = "key_features";
  static constexpr const char* kSummary =
      "finds key features and follows them over frames (the paper, III-B)";
  static constexpr StageKind kKind = StageKind::Features;

  void declare(ParameterTable& table) override { keys_.declare(table); }
  void configure(const RunSettings& settings) override {
    keys_.configure(settings.threads);
    tracker_ = FeatureTracker(keys_.tracker);
    sampler_ = CloudFeatureSampler(keys_.sampler);
    ignores_poses_ = settings.ignores_poses;
  }
  void begin(const Frame& frame) override {
    if (keys_.source != Source::Cloud && !frame.images.right.empty())
      tracker_.begin(frame.images.left);
  }
  void process(Frame& frame) override {
    const bool pair = !frame.images.right.empty() && frame.images.calibration;
    if (!pair && detail::alignColour(keys_.registered, registration_, frame)) tracker_.reset();
    const bool depth = detail::showsTheCloud(frame);
    if (keys_.source == Source::Image && !pair && !depth) {
      throw InputError(
          "key_features: source is 'image', but the input has none of the size of the "
          "cloud");
    }
    if (keys_.source != Source::Cloud && (pair || depth)) {
      trackImages(frame, pair);
    } else {
      sampleCloud(frame);
    }
  }
  std::string saveState() const override {
    detail::StateWriter writer;
    writer(tracker_.saveState(), sampler_, registration_);
    return writer.take();
  }
  void loadState(const std::string& bytes) override {
    detail::StateReader reader(bytes);
    std::string tracker;
    reader(tracker, sampler_, registration_);
    reader.finish();
    tracker_.loadState(tracker);
  }

 private:
  void trackImages(Frame& frame, bool pair);
  void sampleCloud(Frame& frame);

  detail::FeatureKeys keys_;
  FeatureTracker tracker_;
  CloudFeatureSampler sampler_;
  detail::ColourRegistration registration_;
  bool ignores_poses_ = false;
};

void KeyFeaturesStage::trackImages(Frame& frame, bool pair) {
  const FrameImages& images = frame.images;
  const PointsView cloud = detail::showsTheCloud(frame) ? viewOf(*frame.cloud) : PointsView();
  frame.key_features = pair ? tracker_.track(images.left, images.right, *images.calibration, cloud)
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
  if (report.swapped) {
    frame.skip_reason = "left and right images seem to be exchanged: " +
                        std::to_string(report.negative_disparities) +
                        " features have a negative disparity";
  }
}

void KeyFeaturesStage::sampleCloud(Frame& frame) {
  frame.key_features = sampler_.sample(viewOf(*frame.cloud), nullptr,
                                       ignores_poses_ ? std::nullopt : frame.given_pose);
  std::size_t reseen = 0;
  for (const KeyFeature& feature : frame.key_features) reseen += feature.sightings > 1 ? 1 : 0;
  frame.statistics.push_back({"tracked", static_cast<double>(reseen)});
  frame.statistics.push_back(
      {"new_tracks", static_cast<double>(frame.key_features.size() - reseen)});
}

}  // namespace

void detail::addKeyFeatures(StageTable& table) {
  table.add<KeyFeaturesStage>();
}

}  // namespace planar_mapping
