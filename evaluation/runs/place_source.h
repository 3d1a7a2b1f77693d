// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "evaluation/metrics/map_metrics.h"
#include "evaluation/metrics/surface_truth.h"
#include "evaluation/simulation/simulation.h"
#include "planar_mapping/ground/up.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::tools {

/// The stages that prepare a frame for any method: those before the first that finds planes,
/// decides on points or makes a map. The others are taken out.
void keepPreparingStages(Configuration& configuration);
/// The others alone.
void keepMappingStages(Configuration& configuration);

/// A frame as every method gets it: taken through the configuration's stages up to those that find
/// planes, without the points that are held back.
struct PreparedFrame {
  Frame frame;
  std::vector<Vector3> obstacles;  ///< of frame.indices, world frame
  std::vector<Vector3> ground;     ///< of frame.ground, world frame
};

/// A stretch of frames that is mapped anew.
struct Place {
  std::size_t number = 0;
  std::vector<PreparedFrame> frames;
  Pose T_world_given = Pose::Identity();  ///< world of given poses in that of the frames
  std::optional<ImagesUp> mean_up;        ///< FrameSource::meanUp() of the input
  /// Where the motion was found although poses are given: how far the frames are from those,
  /// metres. The given ones are aligned at the first frame.
  std::vector<double> position_errors;
  /// Rays to the points to look for in the maps, as measured, from given poses, world frame.
  std::vector<evaluation::MeasuredRay> rays;
  /// Where those points truly are: what their pixels hit. As measured where there is no truth.
  std::vector<Vector3> checked;
  /// Null where the input has no true surface; the points were then held back from every method.
  std::shared_ptr<const evaluation::SurfaceTruth> truth;
};

/// How an input is cut into places.
struct PlaceOptions {
  std::size_t places = 10;
  std::size_t frames_per_place = 10;  ///< 0 = all frames as one place
  /// Every so many-th obstacle point is kept for checking the maps.
  std::size_t check_step = 10;
};

/// Places of one input. next() may be called from several threads; the places come in order.
class PlaceSource {
 public:
  virtual ~PlaceSource() = default;
  virtual std::size_t size() const = 0;
  /// The next place, or null at the end. \throws InputError, IoError
  virtual std::unique_ptr<Place> next() = 0;
};

/// Reads a configuration with some assignments on top, of one profile.
using ConfigurationLoader = std::function<Configuration()>;

/// Places along the path of a simulated scene, seen by a stereo camera with noise.
std::unique_ptr<PlaceSource> simulatedPlaces(const evaluation::SimulationParams& params,
                                             const PlaceOptions& options, ConfigurationLoader load);
/// Places of the input that the configuration names.
std::unique_ptr<PlaceSource> recordedPlaces(const PlaceOptions& options, ConfigurationLoader load);

}  // namespace planar_mapping::tools
