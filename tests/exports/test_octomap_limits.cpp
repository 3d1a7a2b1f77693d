// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Octrees that would not fit the memory meant for them.
#include "export_scene.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

TEST(OctoMapFile, TooSmallCellsAreRefusedAndLargerOnesAdvised) {
  io::ExportedMap map = test::manyExported(500);
  for (const double cell : {0.01, 1e-5}) {  // too many, too far from the origin
    map.options.cell = cell;
    try {
      io::writeOctree(map, "m.bt");
      FAIL();
    } catch (const ParameterError& error) {
      EXPECT_NE(std::string(error.what()).find("larger"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace planar_mapping
