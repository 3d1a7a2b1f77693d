// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/detail/colour_registration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "boxes_seen.h"

namespace planar_mapping::detail {
namespace {

using test::Boxes;
constexpr int kWidth = Boxes::kWidth;
constexpr int kHeight = Boxes::kHeight;

ColourRegistration::State stateOf(double scale, double shift, double noise) {
  ColourRegistration registration;
  for (unsigned seed = 31; seed < 41; ++seed) {
    Boxes boxes(seed);
    const std::vector<float> xyz = boxes.cloud();
    registration.look(boxes.image(scale, shift, noise), PointsView(xyz.data(), kWidth, kHeight, 3));
  }
  return registration.state();
}

TEST(ColourRegistration, IsSeenByEdges) {
  EXPECT_EQ(stateOf(1.0, 0.0, 2.0), ColourRegistration::State::Registered);
  EXPECT_EQ(stateOf(1.0, 1.0, 2.0), ColourRegistration::State::Registered);
  EXPECT_EQ(stateOf(0.9, -3.0, 2.0), ColourRegistration::State::Apart);
  EXPECT_EQ(stateOf(1.4, 4.0, 2.0), ColourRegistration::State::Apart);
  EXPECT_EQ(stateOf(1.0, 8.0, 12.0), ColourRegistration::State::Apart);
}

TEST(ColourRegistration, AlignsTheImageToAFewPixels) {
  ColourRegistration registration;
  Boxes boxes(31);
  const std::vector<float> xyz = boxes.cloud();
  const io::Image image = boxes.image(0.9, -3.0, 2.0);
  registration.look(image, PointsView(xyz.data(), kWidth, kHeight, 3));
  for (unsigned seed = 32; seed < 41 && registration.state() != ColourRegistration::State::Apart;
       ++seed) {
    Boxes others(seed);
    const std::vector<float> other_xyz = others.cloud();
    registration.look(others.image(0.9, -3.0, 2.0),
                      PointsView(other_xyz.data(), kWidth, kHeight, 3));
  }
  ASSERT_EQ(registration.state(), ColourRegistration::State::Apart);
  const io::Image wanted = boxes.image(1.0, 0.0, 0.0);
  const auto difference = [&](const io::Image& one) {
    double sum = 0.0;
    for (std::size_t i = 0; i < one.pixels.size(); ++i)
      sum += std::abs(one.pixels[i] - wanted.pixels[i]);
    return sum / static_cast<double>(one.pixels.size());
  };
  EXPECT_LT(difference(registration.aligned(image)), 0.4 * difference(image));
}

TEST(ColourRegistration, ImagesThatShowNothingAreNotJudged) {
  EXPECT_EQ(stateOf(50.0, 0.0, 0.0), ColourRegistration::State::Unknown);  // even
  EXPECT_EQ(stateOf(50.0, 0.0, 5.0), ColourRegistration::State::Unknown);  // noise
  ColourRegistration registration;
  const std::vector<float> wall(3 * kWidth * kHeight, 2.0f);
  for (unsigned seed = 31; seed < 41; ++seed)
    registration.look(Boxes(seed).image(1.0, 0.0, 2.0),
                      PointsView(wall.data(), kWidth, kHeight, 3));
  EXPECT_EQ(registration.state(), ColourRegistration::State::Unknown);
  EXPECT_FALSE(registration.isDoubtful());  // a wall has no edges
  // Another scene than that of the depth.
  for (unsigned seed = 31; seed < 41; ++seed) {
    const std::vector<float> xyz = Boxes(seed + 100).cloud();
    registration.look(Boxes(seed).image(1.0, 0.0, 2.0), PointsView(xyz.data(), kWidth, kHeight, 3));
  }
  EXPECT_NE(registration.state(), ColourRegistration::State::Registered);
  EXPECT_TRUE(registration.isDoubtful());
}

}  // namespace
}  // namespace planar_mapping::detail
