// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "place_source.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::tools {

/// A map made of a place, and what it took.
struct PlanarRun {
  PlanarMap map;
  double time_ms = 0.0;  ///< planes, beliefs, insertion of all frames, and the list of cuboids
};

/// Points that make a cell, as the map stage of the configuration says.
int minPointsPerCell(const Configuration& configuration);

/// Makes maps of one place with many configurations. Planes are found once for all configurations
/// whose stages for them are alike.
class PlanarRuns {
 public:
  /// \p place must outlive this object.
  explicit PlanarRuns(const Place& place) : place_(place) {}
  PlanarRun make(Configuration configuration);

 private:
  struct Planes {
    std::vector<std::vector<PlaneSegment>> of_frames;
    double time_ms = 0.0;
  };

  const Place& place_;
  std::map<std::string, Planes> planes_;  ///< by the text of the stages that found them
};

}  // namespace planar_mapping::tools
