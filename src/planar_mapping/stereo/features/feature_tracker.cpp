// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/feature_tracker.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/features/feature_detection.h"
#include "planar_mapping/stereo/features/stereo_features.h"
#include "planar_mapping/stereo/features/track_memory.h"
#include "planar_mapping/stereo/opencv_threads.h"

namespace planar_mapping {
namespace {

using detail::DetectedFeatures;
using detail::Detection;
using detail::TrackMemory;

void requireSize(const io::Image& image, const PointsView& cloud) {
  const bool same = static_cast<int>(cloud.width) == image.width &&
                    static_cast<int>(cloud.height) == image.height &&
                    cloud.size == std::size_t{cloud.width} * cloud.height;
  if (same) return;
  throw InputError(
      "the image is " + detail::sizeText(image.width, image.height) + " pixels, its cloud " +
      detail::sizeText(static_cast<int>(cloud.width), static_cast<int>(cloud.height)) + " points");
}

KeyFeature featureOf(const detail::Track& track, const Detection& place) {
  KeyFeature feature;
  feature.track = track.number;
  feature.sightings = track.sightings;
  feature.column = place.column;
  feature.row = place.row;
  return feature;
}

}  // namespace

void FeatureTrackerParams::validate() const {
  requireInRange("detector", static_cast<int>(detector), 0,
                 static_cast<int>(FeatureDetector::Akaze));
  requireInRange("max_features", max_features, 8, 20000);
  requireInRange("detection_threshold", detection_threshold, 0.0, 1e6);
  requireInRange("epipolar_tolerance", epipolar_tolerance, 0.0, 100.0, "px");
  requirePositive("stereo_ratio", stereo_ratio);
  requireInRange("stereo_ratio", stereo_ratio, 0.0, 1.0);
  requireInRange("min_disparity", min_disparity, 0.0, 1000.0, "px");
  requirePositive("max_disparity_fraction", max_disparity_fraction);
  requireInRange("max_disparity_fraction", max_disparity_fraction, 0.0, 1.0);
  requireInRange("refine_window", refine_window, 5, 41, "px");
  if (refine_window % 2 == 0) throw ParameterError("refine_window", refine_window, "odd", "px");
  requireInRange("track_window", track_window, 5, 41, "px");
  if (track_window % 2 == 0) throw ParameterError("track_window", track_window, "odd", "px");
  requirePositive("max_refine_residual", max_refine_residual);
  requireInRange("max_refine_residual", max_refine_residual, 0.0, 2.0);
  requirePositive("track_ratio", track_ratio);
  requireInRange("track_ratio", track_ratio, 0.0, 1.0);
  requireInRange("remember_frames", remember_frames, 0, 1e6);
  requireInRange("max_remembered", max_remembered, 0, 1e5);
  requireInRange("threads", threads, 0, 4096);
}

/// Fewer features with a depth in the cloud are too few to lose those without: then the right image
/// is searched for features, too, which takes as long as the left one.
constexpr std::size_t kEnoughFeatures = 300;

struct FeatureTracker::Impl {
  explicit Impl(const FeatureTrackerParams& wanted) : params(wanted) { params.validate(); }

  std::vector<KeyFeature> trackStereo(const cv::Mat& left, const cv::Mat& right,
                                      const io::Calibration& calibration, const PointsView& cloud) {
    report = FeatureReport();
    const detail::OpenCvThreads threads(params.threads);
    detail::Stopwatch watch;
    const DetectedFeatures found = detectLeft(left);
    const PinholeCamera& camera = calibration.camera;
    const double infinity = camera.cx - calibration.cx_right;
    const double depth_of_one = camera.fx * *calibration.baseline;
    std::vector<float> disparity_of(found.size(), std::numeric_limits<float>::quiet_NaN());
    std::size_t known = 0;
    for (std::size_t i = 0; i < found.size() && cloud.size > 0; ++i) {
      const auto column = static_cast<std::size_t>(std::lround(found.places[i].column));
      const auto row = static_cast<std::size_t>(std::lround(found.places[i].row));
      if (column >= cloud.width || row >= cloud.height) continue;
      const float depth = cloud[row * cloud.width + column][2];
      disparity_of[i] = static_cast<float>(depth_of_one / depth + infinity);
      known += std::isfinite(disparity_of[i]) ? 1 : 0;
    }
    report.features_left = found.size();
    if (known < kEnoughFeatures) {
      // More on the right: what was chosen on the left must not miss its partner by a near choice.
      const DetectedFeatures others =
          detail::detectFeatures(right, params, params.max_features + params.max_features / 2);
      report.features_right = others.size();
      const std::vector<int> matches = matchPair(found, others, infinity, left.cols);
      for (std::size_t i = 0; i < matches.size(); ++i) {
        if (matches[i] < 0) continue;
        const Detection& other = others.places[static_cast<std::size_t>(matches[i])];
        disparity_of[i] = found.places[i].column - other.column;
        ++report.descriptor_matches;
      }
    }
    report.detect_ms = watch.lap();

    detail::Descriptors descriptors;
    std::vector<Detection> places;
    std::vector<float> disparities;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Detection& place = found.places[i];
      const float disparity = disparity_of[i];
      if (!std::isfinite(disparity)) continue;
      places.push_back(place);
      disparities.push_back(disparity);
      descriptors.add(found.descriptors, i);
    }
    report.stereo_ms = watch.lap();
    const std::vector<TrackMemory::Identity> identities =
        memory.identify(descriptors, params.track_ratio, params.threads);
    refinePlaces(left, identities, places);
    report.track_ms = watch.lap();

    const std::vector<float> right_columns =
        detail::refineAlongRows(left, right, places, disparities, params.refine_window,
                                static_cast<float>(params.max_refine_residual), params.threads);
    std::vector<KeyFeature> features;
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double disparity = double{places[i].column} - double{right_columns[i]};
      const double from_infinity = disparity - infinity;
      if (!(from_infinity >= std::max(params.min_disparity, 1e-3))) continue;  // NaN is out
      KeyFeature feature = featureOf(identities[i].track, places[i]);
      feature.disparity = static_cast<float>(disparity);
      const double depth = depth_of_one / from_infinity;
      feature.position = depth * camera.rayOf(double{feature.column}, double{feature.row});
      features.push_back(feature);
      used.push_back(i);
    }
    report.stereo_ms += watch.lap();
    remember(left, features, identities, used, descriptors);
    report.track_ms += watch.lap();
    return features;
  }

  std::vector<KeyFeature> trackWithCloud(const cv::Mat& image, const PointsView& cloud) {
    report = FeatureReport();
    const detail::OpenCvThreads threads(params.threads);
    detail::Stopwatch watch;
    const DetectedFeatures found = detail::detectFeatures(image, params, params.max_features);
    report.features_left = found.size();
    report.detect_ms = watch.lap();
    const std::vector<TrackMemory::Identity> identities =
        memory.identify(found.descriptors, params.track_ratio, params.threads);
    std::vector<Detection> places = found.places;
    refinePlaces(image, identities, places);
    std::vector<KeyFeature> features;
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const std::optional<Vector3> point = detail::pointAt(cloud, places[i].column, places[i].row);
      if (!point) continue;
      KeyFeature feature = featureOf(identities[i].track, places[i]);
      feature.position = *point;
      features.push_back(feature);
      used.push_back(i);
    }
    remember(image, features, identities, used, found.descriptors);
    report.track_ms = watch.lap();
    return features;
  }

  DetectedFeatures detectLeft(const cv::Mat& gray) {
    if (begun.valid()) {
      DetectedFeatures found = begun.get();
      const cv::Mat was = detail::matOf(begun_in);
      if (was.size() == gray.size() && std::equal(gray.datastart, gray.dataend, was.datastart)) {
        return found;
      }
    }
    return detail::detectFeatures(gray, params, params.max_features);
  }

  std::vector<int> matchPair(const DetectedFeatures& left, const DetectedFeatures& right,
                             double infinity, int width) {
    detail::RowSearch search;
    search.epipolar_tolerance = params.epipolar_tolerance;
    search.ratio = params.stereo_ratio;
    // Behind infinity nothing can be: what matches there better than in front tells of a mistake.
    const double reach = params.max_disparity_fraction * width;
    search.low = infinity - reach;
    search.high = infinity + reach;
    std::vector<int> matches = detail::matchAlongRows(left, right, search);
    constexpr double kSlack = 2.0;  // pixels: a far point that is not exact is no mistake
    std::size_t behind = 0;
    std::size_t found = 0;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (matches[i] < 0) continue;
      const Detection& other = right.places[static_cast<std::size_t>(matches[i])];
      const double disparity = double{left.places[i].column} - other.column - infinity;
      ++(disparity < -kSlack ? behind : found);
    }
    report.negative_disparities = behind;
    constexpr std::size_t kFewest = 20;
    report.swapped = behind >= kFewest && behind > 2 * found;
    search.low = infinity;
    return detail::matchAlongRows(left, right, search);
  }

  /// Detections of one corner in two images differ by a good part of a pixel; gray values agree
  /// better. Only for tracks of the last frame, whose image is at hand.
  void refinePlaces(const cv::Mat& image, const std::vector<TrackMemory::Identity>& identities,
                    std::vector<Detection>& places) const {
    if (!params.refine_tracks || last_image.empty() || last_image.size() != image.size()) return;
    constexpr std::size_t kPlacesPerChunk = 64;
    constexpr float kReach = 1.5f;
    const std::size_t chunks = (places.size() + kPlacesPerChunk - 1) / kPlacesPerChunk;
    parallelFor(chunks, params.threads, [&](std::size_t chunk) {
      const std::size_t last = std::min((chunk + 1) * kPlacesPerChunk, places.size());
      for (std::size_t i = chunk * kPlacesPerChunk; i < last; ++i) {
        const TrackMemory::Identity& identity = identities[i];
        if (identity.origin != TrackMemory::Origin::LastFrame) continue;
        const detail::Patch patch(last_image, {identity.track.column, identity.track.row},
                                  params.track_window);
        const auto found = patch.find(image, {places[i].column, places[i].row}, kReach,
                                      static_cast<float>(params.max_refine_residual));
        if (!found) continue;
        places[i].column = found->x;
        places[i].row = found->y;
      }
    });
  }

  /// Reports what was seen, too.
  /// \param rows  of the features among identities and descriptors
  void remember(const cv::Mat& image, const std::vector<KeyFeature>& features,
                const std::vector<TrackMemory::Identity>& identities,
                const std::vector<std::size_t>& rows, const detail::Descriptors& descriptors) {
    report.stereo_matches = features.size();
    detail::TrackSet seen;
    for (std::size_t k = 0; k < features.size(); ++k) {
      detail::Track track;
      track.number = features[k].track;
      track.sightings = features[k].sightings;
      track.column = features[k].column;
      track.row = features[k].row;
      seen.add(track, descriptors, rows[k]);
      switch (identities[rows[k]].origin) {
        case TrackMemory::Origin::New:
          ++report.new_tracks;
          break;
        case TrackMemory::Origin::LastFrame:
          ++report.tracked;
          break;
        case TrackMemory::Origin::Lost:
          ++report.reseen;
          break;
      }
    }
    memory.store(std::move(seen), params.remember_frames, params.max_remembered);
    image.copyTo(last_image);
  }

  FeatureTrackerParams params;
  FeatureReport report;
  TrackMemory memory;
  cv::Mat last_image;
  /// Features that are being looked for, and where.
  io::Image begun_in;
  std::future<DetectedFeatures> begun;
};
FeatureTracker::FeatureTracker(const FeatureTrackerParams& params)
    : impl_(std::make_unique<Impl>(params)) {}
FeatureTracker::~FeatureTracker() = default;
FeatureTracker::FeatureTracker(FeatureTracker&& other) noexcept = default;
FeatureTracker& FeatureTracker::operator=(FeatureTracker&& other) noexcept = default;

const FeatureTrackerParams& FeatureTracker::params() const {
  return impl_->params;
}

const FeatureReport& FeatureTracker::report() const {
  return impl_->report;
}

void FeatureTracker::begin(const io::Image& left) {
  Impl& impl = *impl_;
  if (impl.begun.valid()) impl.begun.wait();
  if (resolveThreads(impl.params.threads) < 2 || left.empty()) return;
  io::requireSound(left, "left");
  impl.begun_in = io::toGray(left);
  impl.begun = std::async(std::launch::async | std::launch::deferred, [&impl]() {
    return detail::detectFeatures(detail::matOf(impl.begun_in), impl.params,
                                  impl.params.max_features);
  });
}

std::vector<KeyFeature> FeatureTracker::track(const io::Image& left, const io::Image& right,
                                              const io::Calibration& calibration,
                                              const PointsView& cloud) {
  detail::requirePair(left, right);
  detail::requireStereo(calibration, left.width, left.height);
  if (cloud.size > 0) requireSize(left, cloud);
  const io::Image gray_left = io::toGray(left);
  const io::Image gray_right = io::toGray(right);
  return impl_->trackStereo(detail::matOf(gray_left), detail::matOf(gray_right), calibration,
                            cloud);
}

std::vector<KeyFeature> FeatureTracker::track(const io::Image& image, const PointsView& cloud) {
  io::requireSound(image, "colour");
  requireSize(image, cloud);
  const io::Image gray = io::toGray(image);
  return impl_->trackWithCloud(detail::matOf(gray), cloud);
}

void FeatureTracker::reset() {
  impl_->memory.clear();
  impl_->last_image.release();
}

}  // namespace planar_mapping
