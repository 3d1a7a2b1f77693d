// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Wrong matches and flying pixels in docs/results.md: map_experiments outliers
#include <cstdio>

#include "occupancy_experiment.h"

namespace {

using namespace planar_mapping;

void printOutliers() {
  std::printf("%-6s %-6s %-14s %8s %8s %8s %8s\n", "wrong", "miss", "update", "wrong", "occupied",
              "error%", "complete");
  for (const double wrong : {0.0, 0.05, 0.10, 0.20}) {
    for (const double miss : {1.0, 0.7}) {
      for (const test::Variant& variant : test::variants()) {
        const test::OutlierResult r = test::runOutliers(wrong, miss, variant);
        std::printf("%-6.2f %-6.1f %-14s %8zu %8zu %8.2f %8.3f\n", wrong, miss, variant.name,
                    r.wrong, r.occupied,
                    100.0 * static_cast<double>(r.wrong) / static_cast<double>(r.occupied),
                    r.completeness);
      }
    }
  }
}

}  // namespace

int main() {
  printOutliers();
  return 0;
}
