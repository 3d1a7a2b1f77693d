// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "planar_mapping/stereo/features/feature_detection.h"

namespace planar_mapping::detail {
namespace {

struct Blob {
  double column, row, sigma, height;
};

/// Gaussian blobs on gray.
cv::Mat imageOf(const std::vector<Blob>& blobs, int width, int height) {
  cv::Mat image(height, width, CV_8U);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      double value = 100.0;
      for (const Blob& blob : blobs) {
        const double square = std::pow(column - blob.column, 2) + std::pow(row - blob.row, 2);
        value += blob.height * std::exp(-square / (2.0 * blob.sigma * blob.sigma));
      }
      image.at<std::uint8_t>(row, column) = cv::saturate_cast<std::uint8_t>(value);
    }
  }
  return image;
}

/// A cluster of blobs of random places and heights about the middle of an image of 320 x 240.
std::vector<Blob> cluster() {
  std::mt19937 random(71);
  std::uniform_real_distribution<double> place(-45.0, 45.0);
  std::uniform_real_distribution<double> height(-60.0, 90.0);
  std::vector<Blob> blobs;
  for (int i = 0; i < 40; ++i)
    blobs.push_back({160.0 + place(random), 120.0 + place(random), 3.0, height(random)});
  return blobs;
}

std::vector<Blob> turned(std::vector<Blob> blobs, double angle) {
  for (Blob& blob : blobs) {
    const double x = blob.column - 160.0;
    const double y = blob.row - 120.0;
    blob.column = 160.0 + std::cos(angle) * x - std::sin(angle) * y;
    blob.row = 120.0 + std::sin(angle) * x + std::cos(angle) * y;
  }
  return blobs;
}

TEST(Surf, FindsBlobsOfAnySizeWhereTheyAre) {
  for (const double sigma : {2.5, 4.0, 6.0, 9.0}) {
    for (const double height : {80.0, -80.0}) {
      const Blob blob{160.3, 118.6, sigma, height};
      const DetectedFeatures found = detectSurf(imageOf({blob}, 320, 240), 50, 10.0);
      ASSERT_GE(found.size(), 1u) << sigma;
      double nearest = 1e9;
      for (const Detection& place : found.places)
        nearest = std::min(nearest, std::hypot(place.column - blob.column, place.row - blob.row));
      EXPECT_LT(nearest, 0.15 * sigma) << sigma << " " << height;
    }
  }
}

TEST(Surf, DescriptorsTurnWithTheImage) {
  const DetectedFeatures before = detectSurf(imageOf(cluster(), 320, 240), 100, 10.0);
  ASSERT_GE(before.size(), 10u);
  for (const double angle : {0.4, 1.57, -2.2}) {
    const DetectedFeatures after =
        detectSurf(imageOf(turned(cluster(), angle), 320, 240), 100, 10.0);
    std::size_t matched = 0;
    std::size_t right = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      std::vector<std::int32_t> distances(after.size());
      before.descriptors.distances(i, after.descriptors, distances.data());
      const auto best = std::min_element(distances.begin(), distances.end());
      const Detection& found = after.places[static_cast<std::size_t>(best - distances.begin())];
      const std::int32_t least = *best;
      *best = std::numeric_limits<std::int32_t>::max();
      if (!isDistinct(least, *std::min_element(distances.begin(), distances.end()), 0.8, false))
        continue;
      ++matched;
      const Detection& place = before.places[i];
      const Blob there = turned({{place.column, place.row, 1.0, 0.0}}, angle).front();
      if (std::hypot(found.column - there.column, found.row - there.row) < 1.0) ++right;
    }
    EXPECT_GE(matched, before.size() / 2) << angle;
    EXPECT_GE(right, matched * 8 / 10) << angle << ": " << matched;
  }
}

TEST(Surf, SmallEvenAndFewestImagesAreNoTrouble) {
  EXPECT_EQ(detectSurf(cv::Mat(63, 200, CV_8U, cv::Scalar(90)), 100, 10.0).size(), 0u);
  EXPECT_EQ(detectSurf(cv::Mat(240, 320, CV_8U, cv::Scalar(90)), 100, 10.0).size(), 0u);
  const cv::Mat image = imageOf(cluster(), 320, 240);
  EXPECT_EQ(detectSurf(image, 5, 10.0).size(), 5u);
  for (int side = 64; side < 104; ++side) {
    const DetectedFeatures found =
        detectSurf(image(cv::Rect(120, 80, side, side)).clone(), 100, 0.0);
    for (const Detection& place : found.places) {
      EXPECT_GT(std::min(place.column, place.row), 0.0f) << side;
      EXPECT_LT(std::max(place.column, place.row), static_cast<float>(side)) << side;
    }
    EXPECT_TRUE(side < 80 || !found.places.empty()) << side;
  }
}

}  // namespace
}  // namespace planar_mapping::detail
