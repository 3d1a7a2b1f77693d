// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "planar_mapping/core/export.h"
#include "planar_mapping/core/random.h"
#include "planar_mapping/evaluation/ray_caster.h"
#include "planar_mapping/evaluation/scene.h"
#include "planar_mapping/evaluation/stereo_sensor.h"

namespace planar_mapping {
namespace evaluation {

struct PLANAR_MAPPING_EXPORT SimulationParams {
  std::string scene = "room";
  int frames = 12;            ///< >= 1
  double yaw = 0.0;           ///< of the whole world about z, radians
  int width = 640;            ///< pixels, [8, 8192]
  int height = 480;           ///< pixels, [8, 8192]
  double focal_length = 0.0;  ///< pixels; 0 = 500 for a width of 640, in proportion
  StereoSensorParams sensor;
  std::uint64_t seed = Random::kDefaultSeed;
  double speed = 0.4;  ///< of the camera, m/s; makes the time stamps

  /// \throws ParameterError; InputError for an unknown scene
  void validate() const;
  PinholeCamera camera() const;
};

/// One simulated frame: the measured cloud and the truth about each of its pixels.
struct SimulatedFrame {
  Pose T_world_camera = Pose::Identity();
  double timestamp = 0.0;
  Rendering truth;
  std::vector<float> disparity;       ///< measured, 0 = none
  std::vector<float> xyz;             ///< measured, camera frame, NaN = none
  std::vector<std::uint32_t> labels;  ///< 1 + index into planes(), 0 = curved or nothing
};

/// A scene seen frame by frame. Frames do not depend on each other or on the order of asking.
class PLANAR_MAPPING_EXPORT Simulation {
 public:
  explicit Simulation(const SimulationParams& params);

  const SimulationParams& params() const { return params_; }
  const Scene& scene() const { return scene_; }
  const std::vector<Plane>& planes() const { return planes_.planes; }
  std::size_t size() const { return scene_.path.size(); }
  /// \throws InputError if there is no such frame
  SimulatedFrame frame(std::size_t index) const;

  /// The truth as JSON: camera, objects (centre, full lengths, quaternion xyzw, planes), planes.
  std::string truthJson() const;

 private:
  SimulationParams params_;
  Scene scene_;
  ScenePlanes planes_;
  std::vector<double> timestamps_;
};

/// Writes a sequence folder: clouds/NNNNNN.pcd (organized, camera frame, VIEWPOINT = pose, with
/// rgb and label), poses.txt, calib.yaml, scene.json. The directory is made if it is missing.
/// \param progress  called after each frame with the number done; may be empty
/// \throws IoError if something exists already and \p overwrite is false, or cannot be written
PLANAR_MAPPING_EXPORT void writeSequence(const Simulation& simulation, const std::string& directory,
                                         bool overwrite,
                                         const std::function<void(std::size_t)>& progress = {});

}  // namespace evaluation
}  // namespace planar_mapping
