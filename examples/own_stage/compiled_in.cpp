// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A stage compiled into a program of your own: own_stage CLOUD.pcd DIR
#include <iostream>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/runner.h"
#include "range_limit.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: own_stage CLOUD.pcd DIR\n";
    return 2;
  }
  try {
    planar_mapping::StageTable table;
    planar_mapping::registerBuiltinStages(table);
    table.add<RangeLimit>();
    auto configuration = planar_mapping::parseConfiguration(
        "version: 1\n"
        "stages:\n"
        "  - stage: range_limit\n"
        "    max_range_m: 3.0\n"
        "  - stage: multi_plane_segmentation\n"
        "  - stage: planar_cuboid_approximation\n",
        "built in", table);
    configuration.inputs = {argv[1]};
    planar_mapping::RunOptions options;
    options.output = argv[2];
    std::cout << planar_mapping::runPipeline(std::move(configuration), options).metrics_json;
    return 0;
  } catch (const planar_mapping::Error& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
