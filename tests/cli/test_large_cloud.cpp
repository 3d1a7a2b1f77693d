// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli_fixture.h"

namespace planar_mapping {
namespace {

using LargeCloud = CliTest;

TEST_F(LargeCloud, TenMillionPointsTakeTimeAndMemoryInProportion) {
  constexpr std::size_t kPoints = 10000000;
  const ProgramResult small = runOn(write("small.pcd", binaryPcd(roomPoints(kPoints / 5))));
  ASSERT_EQ(0, small.exit_code) << small.err;
  const ProgramResult large =
      runOn(write("large.pcd", binaryPcd(roomPoints(kPoints))), {"--force"});
  ASSERT_EQ(0, large.exit_code) << large.err;
  const double cloud_kilobytes = static_cast<double>(kPoints) * sizeof(float) * 4 / 1024;
  const double ratio = static_cast<double>(large.peak_kilobytes) / cloud_kilobytes;
  std::cout << "10 million points: " << large.seconds << " s (" << large.processor_seconds
            << " s of processor time; 2 million: " << small.processor_seconds << " s), peak memory "
            << ratio << " times the cloud of 16 bytes a point\n";
#ifndef PLANAR_MAPPING_SANITIZED
  EXPECT_LE(ratio, 3.0);
  // Five times the points. Seconds differ between machines, their growth does not.
  EXPECT_LE(large.processor_seconds, 7.5 * small.processor_seconds);
#endif
}

}  // namespace
}  // namespace planar_mapping
