// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/core/export.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping {

/// What became of one frame: a row of frames.csv.
struct FrameReport {
  std::size_t number = 0;
  std::string source;
  double timestamp = 0.0;
  double read_ms = 0.0;          ///< filled in by who reads the frame
  std::vector<double> stage_ms;  ///< in the order of the configuration
  double frame_ms = 0.0;         ///< cloud in memory to map updated
  std::size_t points_input = 0;
  std::size_t points_valid = 0;  ///< finite
  std::size_t points_ground = 0;
  std::size_t points_planar = 0;
  std::size_t points_non_planar = 0;
  std::size_t points_rejected = 0;  ///< valid, but removed or merged by a stage
  std::size_t features = 0;
  std::size_t matches = 0;
  std::size_t planes = 0;
  std::size_t planes_new = 0;
  std::size_t planes_matched = 0;
  std::size_t cuboids = 0;  ///< in the map, after the frame
  std::size_t map_bytes = 0;
};

/// The stages of a configuration and the map they build (the paper, Fig. 2).
/// One frame after the other, from one thread.
class PLANAR_MAPPING_EXPORT Pipeline {
 public:
  explicit Pipeline(Configuration configuration);

  /// Takes one frame through all stages; they change it in place.
  /// A frame without a single usable point changes nothing but gets a warning.
  /// \throws InputError, ParameterError; the map is then as the stage left it
  FrameReport process(Frame& frame);

  /// The same without putting the frame into the map: what stages remember of it comes back when
  /// an interrupted run continues with the map it has saved.
  FrameReport replay(Frame& frame);

  const PlanarMap& map() const { return map_; }
  /// Continues an earlier map, whose parameters stay.
  void continueFrom(PlanarMap map);
  /// With the values that `auto` took, once a frame has been processed.
  const Configuration& configuration() const { return configuration_; }

 private:
  FrameReport runStages(Frame& frame, bool insert);
  void findUsablePoints(Frame& frame) const;
  void adaptTo(const Frame& frame);
  FrameReport report(const Frame& frame) const;

  Configuration configuration_;
  PlanarMap map_;
  bool adapted_ = false;
  bool continued_ = false;
};

}  // namespace planar_mapping
