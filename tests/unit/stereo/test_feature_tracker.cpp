// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/feature_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "stereo_images.h"

namespace planar_mapping {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;

double median(std::vector<double> values) {
  EXPECT_FALSE(values.empty());
  if (values.empty()) return std::numeric_limits<double>::infinity();
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

constexpr std::array kDetectors = {FeatureDetector::Sift, FeatureDetector::Orb,
                                   FeatureDetector::Akaze};

FeatureTrackerParams paramsOf(FeatureDetector detector) {
  FeatureTrackerParams params;
  params.detector = detector;
  params.max_features = 200;
  return params;
}

std::vector<KeyFeature> track(FeatureTracker& tracker, const ImagePair& pair) {
  return tracker.track(pair.left, pair.right, pairCalibration(kWidth, kHeight));
}

bool operator==(const KeyFeature& a, const KeyFeature& b) {
  return a.track == b.track && a.sightings == b.sightings && a.column == b.column &&
         a.row == b.row && a.disparity == b.disparity && a.position == b.position;
}

/// An organized cloud of a plane at the depth, seen by the camera of pairCalibration().
std::vector<float> flatCloud(float depth) {
  const PinholeCamera camera = pairCalibration(kWidth, kHeight).camera;
  std::vector<float> xyz;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      xyz.push_back(static_cast<float>((column - camera.cx) / camera.fx) * depth);
      xyz.push_back(static_cast<float>((row - camera.cy) / camera.fy) * depth);
      xyz.push_back(depth);
    }
  }
  return xyz;
}

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), static_cast<std::uint32_t>(kWidth), static_cast<std::uint32_t>(kHeight), 3};
}

TEST(FeatureTracker, EveryDetectorFindsSubPixelDisparities) {
  const DisparityPlane plane{12.3, 0.0, 0.02};
  const ImagePair pair = pairOf(Pattern(1), plane, kWidth, kHeight);
  for (const FeatureDetector detector : kDetectors) {
    FeatureTracker tracker(paramsOf(detector));
    const std::vector<KeyFeature> features = track(tracker, pair);
    EXPECT_GT(features.size(), 60u) << static_cast<int>(detector);
    std::vector<double> errors;
    std::size_t wrong = 0;
    for (const KeyFeature& feature : features) {
      const double truth = plane.at(feature.column, feature.row);
      errors.push_back(std::abs(feature.disparity - truth));
      wrong += errors.back() > 1.0 ? 1 : 0;
      // Z = f B / d, and the point lies on the ray of its pixel.
      EXPECT_NEAR(feature.position.z(), 30.0 / feature.disparity, 1e-4);
      EXPECT_NEAR(feature.position.x() / feature.position.z(), (feature.column - 159.5) / 300.0,
                  1e-5);
    }
    EXPECT_LT(median(errors), 0.06) << static_cast<int>(detector);
    EXPECT_LE(wrong, features.size() / 50) << static_cast<int>(detector);
    const FeatureReport& report = tracker.report();
    EXPECT_EQ(report.stereo_matches, features.size());
    EXPECT_EQ(report.new_tracks, features.size());
    EXPECT_EQ(report.tracked, 0u);
    EXPECT_FALSE(report.swapped);
  }
}

TEST(FeatureTracker, FeaturesKeepTheirNumberOverFrames) {
  const DisparityPlane plane{15.0, 0.0, 0.0};
  const Pattern pattern(2);
  for (const FeatureDetector detector : kDetectors) {
    FeatureTracker tracker(paramsOf(detector));
    std::map<std::int64_t, KeyFeature> before;
    std::set<std::int64_t> ever;
    for (int frame = 0; frame < 3; ++frame) {
      const double shift = 7.3 * frame;  // pixels the scene moves to the left
      const std::vector<KeyFeature> features =
          track(tracker, pairOf(pattern, plane, kWidth, kHeight, shift, 0.0));
      std::set<std::int64_t> numbers;
      std::vector<double> errors;
      std::size_t wrong = 0;
      for (const KeyFeature& feature : features) {
        EXPECT_TRUE(numbers.insert(feature.track).second) << "a number twice in a frame";
        const auto known = before.find(feature.track);
        if (known == before.end()) {
          EXPECT_EQ(feature.sightings == 1, ever.count(feature.track) == 0);
          continue;
        }
        EXPECT_EQ(feature.sightings, known->second.sightings + 1);
        const double error = std::hypot(feature.column - (known->second.column - 7.3),
                                        feature.row - known->second.row);
        errors.push_back(error);
        wrong += error > 4.0 ? 1 : 0;  // another place, not the same one seen less exactly
      }
      if (frame > 0) {
        EXPECT_GT(errors.size(), features.size() / 2) << static_cast<int>(detector);
        EXPECT_LT(median(errors), 0.08) << static_cast<int>(detector);
        EXPECT_LE(wrong, errors.size() / 50) << static_cast<int>(detector);
        EXPECT_EQ(tracker.report().tracked, errors.size());
      }
      before.clear();
      for (const KeyFeature& feature : features) before[feature.track] = feature;
      ever.insert(numbers.begin(), numbers.end());
    }
  }
}

TEST(FeatureTracker, LostFeaturesAreFoundAgainUnderTheirNumber) {
  const DisparityPlane plane{15.0, 0.0, 0.0};
  const ImagePair here = pairOf(Pattern(3), plane, kWidth, kHeight);
  const ImagePair elsewhere = pairOf(Pattern(4), plane, kWidth, kHeight);
  const ImagePair dark{uniform(kWidth, kHeight, 0.0), uniform(kWidth, kHeight, 0.0)};
  for (const ImagePair* gap : {&dark, &elsewhere}) {
    FeatureTracker tracker(paramsOf(FeatureDetector::Automatic));
    std::set<std::int64_t> numbers;
    for (const KeyFeature& feature : track(tracker, here)) numbers.insert(feature.track);
    track(tracker, *gap);
    const std::vector<KeyFeature> back = track(tracker, here);
    std::size_t known = 0;
    for (const KeyFeature& feature : back) known += numbers.count(feature.track);
    EXPECT_GT(known, numbers.size() * 7 / 10);
    EXPECT_GT(tracker.report().reseen, numbers.size() * 7 / 10);
  }
}

TEST(FeatureTracker, ForgetsAfterTheGivenTimeAndNumber) {
  const DisparityPlane plane{15.0, 0.0, 0.0};
  const ImagePair here = pairOf(Pattern(5), plane, kWidth, kHeight);
  const ImagePair dark{uniform(kWidth, kHeight, 0.0), uniform(kWidth, kHeight, 0.0)};
  FeatureTrackerParams params = paramsOf(FeatureDetector::Orb);
  params.remember_frames = 2;
  FeatureTracker patient(params);
  track(patient, here);
  for (int i = 0; i < 3; ++i) track(patient, dark);
  track(patient, here);
  EXPECT_EQ(patient.report().reseen, 0u);

  params.remember_frames = 50;
  params.max_remembered = 10;
  FeatureTracker narrow(params);
  track(narrow, here);
  track(narrow, dark);
  track(narrow, here);
  EXPECT_LE(narrow.report().reseen, 10u);
  EXPECT_GT(narrow.report().reseen, 0u);
}

TEST(FeatureTracker, NumbersGoOnAfterAReset) {
  const ImagePair pair = pairOf(Pattern(6), {15.0, 0.0, 0.0}, kWidth, kHeight);
  FeatureTracker tracker(paramsOf(FeatureDetector::Orb));
  std::int64_t largest = -1;
  for (const KeyFeature& feature : track(tracker, pair)) largest = std::max(largest, feature.track);
  ASSERT_GE(largest, 0);
  tracker.reset();
  for (const KeyFeature& feature : track(tracker, pair)) EXPECT_GT(feature.track, largest);
  EXPECT_EQ(tracker.report().tracked + tracker.report().reseen, 0u);
}

TEST(FeatureTracker, BlackAndUniformImagesHaveNoFeatures) {
  for (const FeatureDetector detector : kDetectors) {
    for (const double value : {0.0, 200.0}) {
      FeatureTracker tracker(paramsOf(detector));
      EXPECT_TRUE(track(tracker, {uniform(kWidth, kHeight, value), uniform(kWidth, kHeight, value)})
                      .empty());
      EXPECT_FALSE(tracker.report().swapped);
    }
  }
}

TEST(FeatureTracker, ThreadsAndRepetitionDoNotChangeTheResult) {
  const Pattern pattern(8);
  const ImagePair pairs[] = {pairOf(pattern, {15.0, 0.0, 0.01}, kWidth, kHeight),
                             pairOf(pattern, {15.0, 0.0, 0.01}, kWidth, kHeight, 5.0)};
  for (const FeatureDetector detector : {FeatureDetector::Automatic, FeatureDetector::Sift}) {
    std::vector<std::vector<KeyFeature>> results;
    struct Way {
      int threads;
      int begun;  // -1 nothing, 0 the left image, 1 another, which must not be taken
    };
    for (const Way way : {Way{1, 0}, Way{1, 0}, Way{3, -1}, Way{3, 0}, Way{3, 1}, Way{1, 1}}) {
      FeatureTrackerParams params = paramsOf(detector);
      params.threads = way.threads;
      FeatureTracker tracker(params);
      std::vector<KeyFeature> all;
      for (const ImagePair& pair : pairs) {
        if (way.begun >= 0) tracker.begin(way.begun == 0 ? pair.left : pairs[1].right);
        const auto features = track(tracker, pair);
        all.insert(all.end(), features.begin(), features.end());
      }
      results.push_back(all);
    }
    for (std::size_t i = 1; i < results.size(); ++i) {
      ASSERT_EQ(results[i].size(), results[0].size());
      for (std::size_t k = 0; k < results[0].size(); ++k)
        ASSERT_TRUE(results[i][k] == results[0][k]) << static_cast<int>(detector) << " " << k;
    }
  }
}

TEST(FeatureTracker, TheCloudHelpsWhereTheRightImageWasNotDetected) {
  const DisparityPlane plane{15.0, 0.0, 0.0};
  const ImagePair pair = pairOf(Pattern(10), plane, kWidth, kHeight);
  const std::vector<float> cloud = flatCloud(30.0f / 14.0f);  // a pixel off
  FeatureTracker alone(paramsOf(FeatureDetector::Orb));
  FeatureTracker helped(paramsOf(FeatureDetector::Orb));
  const std::size_t few = track(alone, pair).size();
  const std::vector<KeyFeature> many =
      helped.track(pair.left, pair.right, pairCalibration(kWidth, kHeight), viewOf(cloud));
  EXPECT_GT(many.size(), few);
  std::vector<double> errors;
  for (const KeyFeature& feature : many) errors.push_back(std::abs(feature.disparity - 15.0));
  EXPECT_LT(median(errors), 0.06);
}

TEST(FeatureTracker, DepthImagesGiveThePositionOfFeatures) {
  const io::Image image = pairOf(Pattern(11), {}, kWidth, kHeight).left;
  const std::vector<float> cloud = flatCloud(2.5f);
  FeatureTracker tracker(paramsOf(FeatureDetector::Automatic));
  const std::vector<KeyFeature> features = tracker.track(image, viewOf(cloud));
  EXPECT_GT(features.size(), 60u);
  for (const KeyFeature& feature : features) {
    EXPECT_NEAR(feature.position.z(), 2.5, 1e-6);
    EXPECT_NEAR(feature.position.x(), (feature.column - 159.5) / 300.0 * 2.5, 1e-5);
    EXPECT_NEAR(feature.position.y(), (feature.row - 119.5) / 300.0 * 2.5, 1e-5);
    EXPECT_TRUE(std::isnan(feature.disparity));
  }
}

TEST(FeatureTracker, FeaturesInHolesAreLeftOutAndEdgesBelongToTheFront) {
  const io::Image image = pairOf(Pattern(12), {}, kWidth, kHeight).left;
  std::vector<float> cloud = flatCloud(2.0f);
  const std::vector<float> front = flatCloud(1.0f);
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const std::size_t i =
          3 * (static_cast<std::size_t>(row) * kWidth + static_cast<std::size_t>(column));
      for (std::size_t k = i; k < i + 3; ++k) {
        if (column < kWidth / 3) cloud[k] = std::numeric_limits<float>::quiet_NaN();
        if (column >= 2 * kWidth / 3) cloud[k] = front[k];
      }
    }
  }
  FeatureTracker tracker(paramsOf(FeatureDetector::Orb));
  const std::vector<KeyFeature> features = tracker.track(image, viewOf(cloud));
  EXPECT_GT(features.size(), 30u);
  for (const KeyFeature& feature : features) {
    EXPECT_GT(feature.column, kWidth / 3 - 2.0);
    const double z = feature.position.z();
    EXPECT_TRUE(std::abs(z - 1.0) < 1e-6 || std::abs(z - 2.0) < 1e-6) << z;
    if (feature.column > 2 * kWidth / 3 - 1) {
      EXPECT_NEAR(z, 1.0, 1e-6);
    }
  }
}

TEST(FeatureTracker, RefusesWhatDoesNotFit) {
  FeatureTracker tracker(paramsOf(FeatureDetector::Orb));
  const io::Image image = uniform(kWidth, kHeight, 9.0);
  io::Calibration calibration = pairCalibration(kWidth, kHeight);
  EXPECT_THROW(tracker.track(image, uniform(kWidth, kHeight - 1, 9.0), calibration), InputError);
  EXPECT_THROW(tracker.track(image, io::Image(), calibration), InputError);
  calibration.camera.width = 7;
  EXPECT_THROW(tracker.track(image, image, calibration), InputError);
  calibration = pairCalibration(kWidth, kHeight);
  calibration.baseline.reset();
  EXPECT_THROW(tracker.track(image, image, calibration), InputError);
  const std::vector<float> small(30, 1.0f);
  EXPECT_THROW(tracker.track(image, PointsView(small.data(), 5, 2, 3)), InputError);
  EXPECT_THROW(tracker.track(image, image, pairCalibration(kWidth, kHeight),
                             PointsView(small.data(), 5, 2, 3)),
               InputError);
}

TEST(FeatureTracker, TinyImagesAreNoProblem) {
  for (const FeatureDetector detector : kDetectors) {
    FeatureTracker tracker(paramsOf(detector));
    const ImagePair pair = pairOf(Pattern(13), {2.0, 0.0, 0.0}, 20, 16);
    EXPECT_NO_THROW(tracker.track(pair.left, pair.right, pairCalibration(20, 16)));
  }
}

TEST(FeatureTracker, RefusesParametersOutOfRange) {
  const auto refused = [](auto&& change) {
    FeatureTrackerParams params;
    change(params);
    EXPECT_THROW(FeatureTracker{params}, ParameterError);
  };
  refused([](auto& p) { p.detector = static_cast<FeatureDetector>(77); });
  refused([](auto& p) { p.max_features = 0; });
  refused([](auto& p) { p.track_ratio = 0.0; });
  refused([](auto& p) { p.stereo_ratio = 1.5; });
  refused([](auto& p) { p.epipolar_tolerance = test::kNan; });
  refused([](auto& p) { p.refine_window = 8; });
  refused([](auto& p) { p.track_window = 43; });
  refused([](auto& p) { p.max_refine_residual = 0.0; });
  refused([](auto& p) { p.remember_frames = -1; });
  refused([](auto& p) { p.max_remembered = -1; });
  refused([](auto& p) { p.min_disparity = -1.0; });
  refused([](auto& p) { p.max_disparity_fraction = 2.0; });
  refused([](auto& p) { p.detection_threshold = -1.0; });
  refused([](auto& p) { p.threads = -1; });
}

}  // namespace
}  // namespace planar_mapping
