// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <iostream>

#include "machine_load.h"
#include "planar_mapping/visualization/snapshot.h"
#include "scenes.h"

namespace planar_mapping {
namespace {

TEST(SnapshotSpeed, DrawsTwentyThousandCuboids) {
  const SceneContent content = testing::field(20000);
  // Processor time of all threads: what it takes on a machine that does nothing else.
  double fastest = 1e9;
  for (int run = 0; run < 3; ++run) {
    const std::clock_t start = std::clock();
    renderSnapshot(content, ViewOptions());
    fastest = std::min(fastest, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::cout << "20,000 cuboids at 1280 x 720: " << fastest << " s of processor time\n";
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  if (machineIsBusy()) GTEST_SKIP() << "this machine is too busy to judge times";
  EXPECT_LT(fastest, 1.5);
#endif
}

TEST(SnapshotSpeed, CopesWithTwoHundredThousand) {
  ViewOptions options;
  options.width = 640;
  options.height = 480;
  EXPECT_FALSE(isBlank(renderSnapshot(testing::field(200000), options)));
}

}  // namespace
}  // namespace planar_mapping
