// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Memory of a map that the whole pipeline makes of simulated stereo clouds with their noise. The
// corridor of 100 m takes minutes; here are ten.
#include <gtest/gtest.h>

#include <string>

#include "pipeline_frames.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace planar_mapping {
namespace {

TEST(MapMemory, OfTenMetresOfANoisyCorridorIsAFifthOfOctoMaps) {
  Pipeline pipeline(test::readyConfiguration("pcd_sequence.yaml",
                                             {"planar_cuboid_approximation.unknown_space=false"}));
  test::SimulatedCorridor corridor;
  corridor.length = 10.0;
  corridor.frames = 60;
  const evaluation::Simulation simulation(corridor.params());
  for (std::size_t i = 0; i < simulation.size(); ++i) {
    Frame frame = test::simulatedFrame(simulation, i);
    ASSERT_EQ(pipeline.process(frame).skip_reason, "");
  }
  const PlanarMap& map = pipeline.map();
  ASSERT_GT(map.cuboidCount(), 40u);
  EXPECT_LT(map.memoryBytes(), 100000u);
  // OctoMap's .ot of the first five frames alone has 78 kB.
  EXPECT_LT(map.serialize().size(), 78000u / 5u);
}

}  // namespace
}  // namespace planar_mapping
