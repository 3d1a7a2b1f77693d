// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli_fixture.h"
#include "machine_load.h"

namespace planar_mapping {
namespace {

using LargeCloud = CliTest;

TEST_F(LargeCloud, TenMillionPointsInBoundedTimeAndMemory) {
  constexpr std::size_t kPoints = 10000000;
  const std::string cloud = write("large.pcd", binaryPcd(roomPoints(kPoints)));
  const ProgramResult result = runOn(cloud);
  ASSERT_EQ(0, result.exit_code) << result.err;
  const double cloud_kilobytes = static_cast<double>(kPoints) * sizeof(float) * 4 / 1024;
  const double ratio = static_cast<double>(result.peak_kilobytes) / cloud_kilobytes;
  std::cout << "10 million points: " << result.seconds << " s, peak memory " << ratio
            << " times the cloud of 16 bytes a point\n";
#ifndef PLANAR_MAPPING_SANITIZED
  EXPECT_LE(ratio, 3.0);
  if (machineIsBusy()) GTEST_SKIP() << "this machine is too busy to judge times";
  EXPECT_LE(result.seconds, 10.0);
#endif
}

}  // namespace
}  // namespace planar_mapping
