// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "builtin.h"
#include "keys/image_keys.h"
#include "planar_mapping/core/base/detail/state_archive.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/stereo/detail/colour_registration.h"

namespace planar_mapping {
namespace {

using Source = detail::FeatureKeys::Source;

/// Whether the image has the size of the cloud, pixel by pixel.
bool showsTheCloud(const Frame& frame) {
  return !frame.images.left.empty() && !frame.cloud->empty() &&
         static_cast<int>(frame.cloud->width) == frame.images.left.width &&
         static_cast<int>(frame.cloud->height) == frame.images.left.height;
}

/// Brings the image of a frame to its depth: features of an image that is not registered to it get
/// the depth of something else.
/// \return whether it was found now that images lie elsewhere: earlier features are of no use
bool alignColour(detail::FeatureKeys::Registered registered,
                 detail::ColourRegistration& registration, Frame& frame) {
  using Registered = detail::FeatureKeys::Registered;
  using State = detail::ColourRegistration::State;
  if (registered == Registered::Yes || frame.images.left.empty()) return false;
  if (registered == Registered::No) {
    frame.images.left = io::Image();
    return false;
  }
  if (registration.state() == State::Unknown && showsTheCloud(frame)) {
    registration.look(frame.images.left, pointsOf(*frame.cloud));
    if (registration.state() == State::Apart) {
      frame.images_changed = true;
      frame.warnings.push_back(
          "frame " + std::to_string(frame.number) + " " + frame.source +
          ": the colour images are not registered to the depth images: things in them are " +
          registration.describe() +
          ", which is made good from here on, right to a few pixels; better register them, and see "
          "that calib.yaml is the depth camera's; "
          "key_features.registered=false leaves them out, true takes them as they are");
    }
  }
  frame.image_doubtful = registration.isDoubtful();
  frame.statistics.push_back(
      {"colour_registered", registration.state() == State::Registered ? 1.0 : 0.0});
  if (registration.state() == State::Apart)
    frame.images.left = registration.aligned(frame.images.left);
  return frame.images_changed;
}

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
    if (!pair && alignColour(keys_.registered, registration_, frame)) tracker_.reset();
    const bool depth = showsTheCloud(frame);
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
    if (report.swapped) {
      frame.skip_reason = "left and right images seem to be exchanged: " +
                          std::to_string(report.negative_disparities) +
                          " features have a negative disparity";
    }
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

  detail::FeatureKeys keys_;
  FeatureTracker tracker_;
  CloudFeatureSampler sampler_;
  detail::ColourRegistration registration_;
  bool ignores_poses_ = false;
};
}  // namespace

void detail::addKeyFeatures(StageTable& table) {
  table.add<KeyFeaturesStage>();
}

}  // namespace planar_mapping
