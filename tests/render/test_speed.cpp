// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <iostream>

#include "planar_mapping/viewer/window/snapshot.h"
#include "scenes.h"

namespace planar_mapping {
namespace {

/// Processor time of all threads for one picture of so many cuboids.
double secondsFor(const SceneContent& content) {
  const std::clock_t start = std::clock();
  renderSnapshot(content, ViewOptions());
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// How long a picture takes differs four times between machines; benchmark_snapshot measures it.
// What a test can hold on every machine is how the time grows.
TEST(SnapshotSpeed, GrowsNoFasterThanTheCuboids) {
  const SceneContent few = testing::field(5000);
  const SceneContent many = testing::field(20000);
  double seconds_for_few = 1e9;
  double seconds_for_many = 1e9;
  for (int run = 0; run < 3; ++run) {
    seconds_for_few = std::min(seconds_for_few, secondsFor(few));
    seconds_for_many = std::min(seconds_for_many, secondsFor(many));
  }
  std::cout << "1280 x 720, processor time: 5,000 cuboids " << seconds_for_few << " s, 20,000 "
            << seconds_for_many << " s\n";
  // Four times the cuboids; a cost of each pair would make it sixteen.
  EXPECT_LT(seconds_for_many, 6.0 * seconds_for_few);
}

TEST(SnapshotSpeed, CopesWithTwoHundredThousand) {
  ViewOptions options;
  options.width = 640;
  options.height = 480;
  EXPECT_FALSE(isBlank(renderSnapshot(testing::field(200000), options)));
}

}  // namespace
}  // namespace planar_mapping
