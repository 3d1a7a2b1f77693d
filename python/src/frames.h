// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/planes/multi_plane.h"
#include "planar_mapping/surface/mapping_input.h"

// Frames into a map, as segment(), approximate(), insert() and insert_depth() have them in common.
namespace planar_mapping::python {

/// The planes of a cloud: what segment() returns.
struct Segmentation {
  std::vector<PlaneSegment> planes;
  std::vector<pybind11::ssize_t> shape;  ///< of the cloud: (N) or (H, W)
  std::size_t points = 0;
};

/// What a word stands for.
/// \throws InputError that lists the words there are
template <typename T>
T wordOf(const std::string& name, const std::string& word, const std::map<std::string, T>& words) {
  const auto found = words.find(word);
  if (found != words.end()) return found->second;
  std::string list;
  for (const auto& entry : words) list += (list.empty() ? "" : ", ") + entry.first;
  throw InputError(name + " is '" + word + "', but must be one of " + list);
}

/// \throws InputError if the word is none of compact and paper
Profile profileOf(const std::string& word);

/// A frame for a map: its cloud, and its planes or how they are found.
struct FrameInput : MappingInput {
  explicit FrameInput(const PlanarMapParams& params = {}) : MappingInput(params) {}

  PointsView points;
  double max_depth = 0.0;  ///< points with a larger z are measured, but not mapped; 0 = no limit
  Pose T_world_sensor = Pose::Identity();
  bool find_planes = false;
  MultiPlaneParams search;

  /// The parameters of a map that begins with this frame.
  PlanarMapParams paramsOfMap() const { return paramsFor(points, nullptr, T_world_sensor); }
  /// Keywords of Python: planes (null = they are looked for), distance_threshold (absent = half the
  /// resolution) and min_inliers (absent = by the points).
  void setPlaneSearch(const Segmentation* planes, std::optional<double> distance_threshold,
                      std::optional<int> min_inliers, double resolution);
  /// Touches no Python object.
  FrameUpdate insertInto(PlanarMap& map);
};

}  // namespace planar_mapping::python
