// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "machine_facts.h"

#include <pcl/pcl_config.h>

#include <fstream>
#include <thread>

#include "planar_mapping/evaluation/octree_grid.h"

namespace planar_mapping::tools {
namespace {

std::string processorName() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(": ");
    if (line.compare(0, 10, "model name") == 0 && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown";
}

std::string compilerName() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

}  // namespace

std::vector<std::pair<std::string, std::string>> machineFacts() {
  return {{"version", "planar_mapping " PLANAR_MAPPING_VERSION},
          {"compiler", compilerName()},
          {"processor", processorName()},
          {"cores", std::to_string(std::thread::hardware_concurrency())},
          {"octomap", evaluation::OctreeGrid::isAvailable() ? PLANAR_MAPPING_OCTOMAP_VERSION
                                                            : "not built in: OG is left out"},
          {"pcl", PCL_VERSION_PRETTY},
          {"vtk", PLANAR_MAPPING_VTK_VERSION}};
}

}  // namespace planar_mapping::tools
