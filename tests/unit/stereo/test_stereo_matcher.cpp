// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/matching/stereo_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "stereo_images.h"

namespace planar_mapping {
namespace {

constexpr int kImageWidth = 256;
constexpr int kImageHeight = 160;

struct Errors {
  double density = 0.0;  ///< over the pixels whose partner is inside the right image
  double rms = 0.0;
  double mean = 0.0;
  double bad = 0.0;  ///< fraction beyond 1 px
};

Errors errorsOf(const DisparityImage& disparity, const DisparityPlane& truth) {
  Errors errors;
  int all = 0;
  int found = 0;
  double squares = 0.0;
  for (int row = 0; row < disparity.height; ++row) {
    for (int column = 0; column < disparity.width; ++column) {
      const double wanted = truth.at(column, row);
      constexpr double kMargin = 10.0;  // windows at the border are cut off
      if (column - wanted < kMargin || column - wanted > disparity.width - kMargin) continue;
      ++all;
      const double value = disparity.at(column, row);
      if (std::isnan(value)) continue;
      ++found;
      const double error = value - wanted;
      squares += error * error;
      errors.mean += error;
      errors.bad += std::abs(error) > 1.0 ? 1.0 : 0.0;
    }
  }
  errors.density = static_cast<double>(found) / all;
  errors.rms = std::sqrt(squares / found);
  errors.mean /= found;
  errors.bad /= found;
  return errors;
}

DisparityImage match(const ImagePair& pair, const StereoMatcherParams& params = {},
                     StereoReport* report = nullptr) {
  return StereoMatcher(params).match(pair.left, pair.right,
                                     pairCalibration(pair.left.width, pair.left.height), report);
}

TEST(StereoMatcher, FindsSubPixelDisparities) {
  const Pattern pattern;
  for (const double d : {3.0, 12.3, 20.5, 31.75, 60.2}) {
    const DisparityPlane plane{d, 0.0, 0.0};
    StereoReport report;
    const Errors errors =
        errorsOf(match(pairOf(pattern, plane, kImageWidth, kImageHeight), {}, &report), plane);
    EXPECT_GT(errors.density, 0.95) << d;
    EXPECT_LT(errors.rms, 0.12) << d;
    EXPECT_LT(std::abs(errors.mean), 0.06) << d;
    EXPECT_LE(report.min_disparity, d);
    EXPECT_GT(report.min_disparity + report.disparities, d);
    EXPECT_FALSE(report.swapped);
  }
}

TEST(StereoMatcher, FollowsASlantedPlane) {
  const DisparityPlane plane{10.0, 0.03, 0.08};
  const Errors errors =
      errorsOf(match(pairOf(Pattern(2), plane, kImageWidth, kImageHeight)), plane);
  EXPECT_GT(errors.density, 0.9);
  EXPECT_LT(errors.rms, 0.15);
  EXPECT_LT(errors.bad, 0.005);
}

TEST(StereoMatcher, TheSubPixelPassTakesAwayThePullToWholeDisparities) {
  const Pattern pattern(5);
  // Over a plane that runs through all fractions of a pixel.
  const DisparityPlane plane{8.0, 0.0, 0.05};
  const ImagePair pair = pairOf(pattern, plane, kImageWidth, kImageHeight);
  StereoMatcherParams params;
  const double refined = errorsOf(match(pair, params), plane).rms;
  params.refine = false;
  const double plain = errorsOf(match(pair, params), plane).rms;
  EXPECT_LT(refined, 0.75 * plain);
}

TEST(StereoMatcher, PixelsWhosePartnerIsOutsideHaveNone) {
  const DisparityPlane plane{40.0, 0.0, 0.0};
  const DisparityImage disparity = match(pairOf(Pattern(3), plane, kImageWidth, kImageHeight));
  int wrong = 0;
  for (int row = 0; row < kImageHeight; ++row) {
    for (int column = 0; column < kImageWidth; ++column) {
      const float value = disparity.at(column, row);
      if (!std::isnan(value) && column - value < -1.0f) ++wrong;
    }
  }
  EXPECT_EQ(wrong, 0);
  // And those right of them have one, although the search goes to larger disparities.
  int found = 0;
  for (int row = 10; row < kImageHeight - 10; ++row)
    found += std::isnan(disparity.at(50, row)) ? 0 : 1;
  EXPECT_GT(found, (kImageHeight - 20) * 9 / 10);
}

TEST(StereoMatcher, PrincipalPointsThatDifferShiftTheDisparityOfInfinity) {
  // d + cx_right - cx = 6: a point at Z = 5 m, though its disparity is negative.
  const DisparityPlane plane{-14.0, 0.0, 0.0};
  const ImagePair pair = pairOf(Pattern(4), plane, kImageWidth, kImageHeight);
  io::Calibration calibration = pairCalibration(kImageWidth, kImageHeight);
  calibration.cx_right = calibration.camera.cx + 20.0;
  StereoReport report;
  const DisparityImage disparity =
      StereoMatcher().match(pair.left, pair.right, calibration, &report);
  EXPECT_GE(report.min_disparity, -20);
  EXPECT_LT(errorsOf(disparity, plane).rms, 0.1);
  std::vector<float> xyz;
  triangulate(disparity, calibration, xyz);
  const std::size_t center =
      static_cast<std::size_t>(kImageHeight / 2) * kImageWidth + kImageWidth / 2;
  EXPECT_NEAR(xyz[3 * center + 2], 5.0, 0.1);
}

TEST(StereoMatcher, BlackAndUniformImagesHaveNoDisparity) {
  for (const double value : {0.0, 128.0, 255.0}) {
    const ImagePair pair{uniform(kImageWidth, kImageHeight, value),
                         uniform(kImageWidth, kImageHeight, value)};
    StereoReport report;
    const DisparityImage disparity = match(pair, {}, &report);
    EXPECT_LT(report.density, 0.02) << value;
    EXPECT_EQ(disparity.values.size(), static_cast<std::size_t>(kImageWidth * kImageHeight));
    EXPECT_DOUBLE_EQ(report.brightness, value);
    EXPECT_DOUBLE_EQ(report.contrast, 0.0);
    EXPECT_FALSE(report.swapped);
  }
}

TEST(StereoMatcher, ExposuresOfTheCamerasMayDiffer) {
  const DisparityPlane plane{12.0, 0.0, 0.06};
  const ImagePair alike = pairOf(Pattern(15), plane, kImageWidth, kImageHeight);
  for (const auto& [gain, offset] : {std::pair(0.7, 0.0), std::pair(0.35, 20.0)}) {
    ImagePair pair = alike;
    for (std::uint8_t& value : pair.right.pixels)
      value = static_cast<std::uint8_t>(std::lround(gain * value + offset));
    StereoReport report;
    const Errors errors = errorsOf(match(pair, {}, &report), plane);
    EXPECT_GT(errors.density, 0.9) << gain;
    EXPECT_LT(errors.bad, 0.01) << gain;
    EXPECT_LE(report.disparities, 48) << gain;  // of 9 to 28 px that are there
  }
}

TEST(StereoMatcher, NoiseOnAPlainSurfaceIsNoTexture) {
  const DisparityPlane plane{20.0, 0.0, 0.0};
  ImagePair pair = pairOf(Pattern(14), plane, kImageWidth, kImageHeight);
  std::uint32_t random = 1;
  for (io::Image* image : {&pair.left, &pair.right}) {
    for (int row = 0; row < kImageHeight; ++row) {
      for (int column = kImageWidth / 2; column < kImageWidth; ++column) {
        random = random * 1664525u + 1013904223u;
        image->pixels[static_cast<std::size_t>(row * kImageWidth + column)] =
            static_cast<std::uint8_t>(200 + (random >> 24u) % 7);
      }
    }
  }
  const DisparityImage disparity = match(pair);
  int found = 0;
  for (int row = 0; row < kImageHeight; ++row) {
    for (int column = kImageWidth / 2 + 24; column < kImageWidth; ++column)
      found += std::isnan(disparity.at(column, row)) ? 0 : 1;
  }
  EXPECT_LT(found, kImageHeight * (kImageWidth / 2 - 24) / 50);
  EXPECT_NEAR(disparity.at(80, kImageHeight / 2), 20.0, 0.2);
}

/// A table of one colour in soft light, seen by cameras whose images were resampled: their noise is
/// smooth, too, and among many disparities some agree by chance.
TEST(StereoMatcher, SmoothShadingWithSmoothNoiseIsNoTexture) {
  constexpr int kColumns = 640;
  constexpr int kRows = 240;
  constexpr double kShift = 150.0;
  const Pattern pattern(14);
  std::uint32_t random = 1;
  const auto image = [&](double shift) {
    std::vector<double> noise(static_cast<std::size_t>(kColumns * kRows));
    for (double& value : noise) {
      random = random * 1664525u + 1013904223u;
      value = (random >> 8u) / 16777216.0 - 0.5;
    }
    return paint(kColumns, kRows, [&](int column, int row) {
      if (column + shift < kColumns / 2) return pattern(column + shift, row);
      double sum = 0.0;
      for (int y = std::max(row - 1, 0); y <= std::min(row + 1, kRows - 1); ++y)
        for (int x = std::max(column - 1, 0); x <= std::min(column + 1, kColumns - 1); ++x)
          sum += noise[static_cast<std::size_t>(y * kColumns + x)];
      return 190.0 + 0.03 * (column + shift) + 0.02 * row + 0.8 * sum;
    });
  };
  const ImagePair pair{image(0.0), image(kShift)};
  const DisparityImage disparity = match(pair);
  int found = 0;
  for (int row = 0; row < kRows; ++row)
    for (int column = kColumns / 2 + 24; column < kColumns; ++column)
      found += std::isnan(disparity.at(column, row)) ? 0 : 1;
  EXPECT_LT(found, kRows * (kColumns / 2 - 24) / 1000);
  EXPECT_NEAR(disparity.at(kColumns / 2 - 60, kRows / 2), kShift, 0.2);
}

TEST(StereoMatcher, APlainSurfaceIsAHole) {
  const DisparityPlane plane{20.0, 0.0, 0.0};
  ImagePair pair = pairOf(Pattern(14), plane, kImageWidth, kImageHeight);
  for (io::Image* image : {&pair.left, &pair.right}) {
    for (int row = 0; row < kImageHeight; ++row)
      std::fill_n(image->pixels.begin() + row * kImageWidth + kImageWidth / 2, kImageWidth / 2,
                  std::uint8_t{255});
  }
  const DisparityImage disparity = match(pair);
  EXPECT_TRUE(std::isnan(disparity.at(kImageWidth - 30, kImageHeight / 2)));
  EXPECT_NEAR(disparity.at(80, kImageHeight / 2), 20.0, 0.2);
}

TEST(StereoMatcher, UnrelatedImagesAreMostlyHoles) {
  const ImagePair pair{pairOf(Pattern(7), {}, kImageWidth, kImageHeight).left,
                       pairOf(Pattern(8), {}, kImageWidth, kImageHeight).left};
  StereoReport report;
  match(pair, {}, &report);
  EXPECT_LT(report.density, 0.6);
  EXPECT_FALSE(report.swapped);
}

TEST(StereoMatcher, ThreadsDoNotChangeTheResult) {
  const ImagePair pair = pairOf(Pattern(9), {14.0, 0.02, 0.05}, kImageWidth, kImageHeight);
  StereoMatcherParams params;
  for (const SmoothnessPaths paths :
       {SmoothnessPaths::Three, SmoothnessPaths::Five, SmoothnessPaths::Eight}) {
    params.paths = paths;
    params.threads = 1;
    const DisparityImage one = match(pair, params);
    for (const int threads : {2, 3, 0}) {
      params.threads = threads;
      const DisparityImage many = match(pair, params);
      ASSERT_EQ(one.values.size(), many.values.size());
      EXPECT_EQ(std::memcmp(one.values.data(), many.values.data(), 4 * one.values.size()), 0)
          << threads;
    }
  }
}

TEST(StereoMatcher, GrayAndColorGiveTheSame) {
  const ImagePair gray = pairOf(Pattern(10), {14.0, 0.0, 0.0}, 96, 64);
  const auto colored = [](const io::Image& image) {
    io::Image color = image;
    color.channels = 3;
    color.pixels.clear();
    for (const std::uint8_t value : image.pixels) color.pixels.insert(color.pixels.end(), 3, value);
    return color;
  };
  const DisparityImage a = match(gray);
  const DisparityImage b = match({colored(gray.left), colored(gray.right)});
  EXPECT_EQ(std::memcmp(a.values.data(), b.values.data(), 4 * a.values.size()), 0);
}

TEST(StereoMatcher, AGivenRangeIsKept) {
  const DisparityPlane plane{20.0, 0.0, 0.0};
  StereoMatcherParams params;
  params.min_disparity = 4;
  params.disparities = 40;  // OpenCV wants whole sixteens
  StereoReport report;
  const Errors errors = errorsOf(
      match(pairOf(Pattern(11), plane, kImageWidth, kImageHeight), params, &report), plane);
  EXPECT_EQ(report.min_disparity, 4);
  EXPECT_EQ(report.disparities, 48);
  EXPECT_LT(errors.rms, 0.08);
}

TEST(StereoMatcher, TheSameRegionIsTooSmallOnlyNearBy) {
  const double baseline = *pairCalibration(kImageWidth, kImageHeight).baseline;
  for (const double d : {8.0, 60.0}) {
    const ImagePair pair =
        pairOf(Pattern(3), DisparityPlane{d, 0.0, 0.0}, kImageWidth, kImageHeight);
    const DisparityImage all = match(pair);
    const double side = std::sqrt(all.density() * kImageWidth * kImageHeight) * baseline / d;
    StereoMatcherParams params;
    params.speckle_side = 0.9 * side;
    EXPECT_GT(match(pair, params).density(), 0.95 * all.density()) << d;
    params.speckle_side = 1.1 * side;
    EXPECT_EQ(match(pair, params).density(), 0.0) << d;
  }
}

TEST(StereoMatcher, RefusesImagesThatAreNoPair) {
  const StereoMatcher matcher;
  const io::Calibration calibration = pairCalibration(64, 48);
  const io::Image image = uniform(64, 48, 100.0);
  EXPECT_THROW(matcher.match(image, uniform(64, 47, 100.0), calibration), InputError);
  EXPECT_THROW(matcher.match(image, io::Image(), calibration), InputError);
  EXPECT_THROW(matcher.match(io::Image(), image, calibration), InputError);
  EXPECT_THROW(matcher.match(uniform(8, 8, 0.0), uniform(8, 8, 0.0), calibration), InputError);
  io::Image short_of_pixels = image;
  short_of_pixels.pixels.pop_back();
  EXPECT_THROW(matcher.match(short_of_pixels, image, calibration), InputError);
  try {
    matcher.match(image, uniform(32, 48, 100.0), calibration);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "the left image is 64 x 48 pixels, the right one 32 x 48");
  }
}

TEST(StereoMatcher, TheSmallestImagesWork) {
  const ImagePair pair = pairOf(Pattern(13), {3.0, 0.0, 0.0}, 16, 16);
  EXPECT_EQ(match(pair).values.size(), 256u);
}

TEST(StereoMatcher, RefusesParametersOutOfRange) {
  const auto refused = [](auto&& change) {
    StereoMatcherParams params;
    change(params);
    EXPECT_THROW(StereoMatcher{params}, ParameterError);
  };
  refused([](auto& p) { p.paths = static_cast<SmoothnessPaths>(77); });
  refused([](auto& p) { p.block_size = 4; });
  refused([](auto& p) { p.block_size = 0; });
  refused([](auto& p) { p.refine_window = 8; });
  refused([](auto& p) { p.texture_window = 8; });
  refused([](auto& p) { p.min_texture = -1.0; });
  refused([](auto& p) { p.disparities = 0; });
  refused([](auto& p) { p.min_disparity = -5000; });
  refused([](auto& p) { p.max_disparity_fraction = test::kNan; });
  refused([](auto& p) { p.max_disparity_fraction = 0.0; });
  refused([](auto& p) { p.near_distance = -1.0; });
  refused([](auto& p) { p.smoothness_large = p.smoothness_small - 1.0; });
  refused([](auto& p) { p.speckle_range = 0.0; });
  refused([](auto& p) { p.speckle_side = -0.1; });
  refused([](auto& p) { p.uniqueness_percent = 101.0; });
  refused([](auto& p) { p.prefilter_cap = 64; });
  refused([](auto& p) { p.threads = -1; });
}

TEST(StereoMatcher, MatchersOfDifferentThreadsWorkAtTheSameTime) {
  const ImagePair pair = pairOf(Pattern(2), {20.0, 0.0, 0.0}, kImageWidth, kImageHeight);
  StereoMatcherParams one;
  one.threads = 1;
  StereoMatcherParams all;
  all.threads = 0;
  const DisparityImage alone = match(pair, one);
  const auto matchOften = [&pair, &alone](const StereoMatcherParams& params) {
    for (int i = 0; i < 60; ++i) {
      const DisparityImage found = match(pair, params);
      ASSERT_EQ(0, std::memcmp(alone.values.data(), found.values.data(),
                               alone.values.size() * sizeof(alone.values[0])));
    }
  };
  std::thread other(matchOften, one);
  matchOften(all);
  other.join();
}

}  // namespace
}  // namespace planar_mapping
