// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "evaluation/simulation/image_renderer.h"
#include "evaluation/simulation/ray_caster.h"
#include "evaluation/simulation/scene.h"
#include "evaluation/simulation/stereo_sensor.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping::evaluation {

/// The scene and how it is seen; `seed` is of the noise, too.
struct PLANAR_MAPPING_EXPORT SimulationParams : SceneParams {
  double yaw = 0.0;             ///< of the whole world about z, radians
  int width = 640;              ///< pixels, [8, 8192]
  int height = 480;             ///< pixels, [8, 8192]
  double focal_length = 0.0;    ///< pixels; 0 = 500 for a width of 640, in proportion
  double plain_fraction = 0.0;  ///< of all surface, in patches: nothing to match, in [0, 1]
  bool clouds = true;           ///< measure disparities and points
  bool images = false;          ///< render the left and the right image
  bool left_only = false;       ///< and no right one
  bool color_images = false;    ///< RGB instead of gray
  double image_noise = 1.5;     ///< standard deviation, gray levels of 255
  double right_exposure = 1.0;  ///< of the right camera, where the left one has 1; > 0
  bool colors = true;           ///< of the truth; images need them, clouds can do without
  StereoSensorParams sensor;
  double speed = 0.4;  ///< of the camera, m/s; makes the time stamps
  int threads = 1;     ///< 0 = all cores; changes nothing but the time

  /// \throws ParameterError; InputError for an unknown scene
  void validate() const;
  PinholeCamera camera() const;
  io::Calibration calibration() const;
};

/// One simulated frame: what is measured, and the truth about each pixel of the left image.
struct SimulatedFrame {
  std::size_t index = 0;
  Pose T_world_camera = Pose::Identity();
  double timestamp = 0.0;
  Rendering truth;
  std::vector<float> disparity;       ///< measured, 0 = none
  std::vector<float> xyz;             ///< measured, camera frame, NaN = none
  std::vector<std::uint32_t> labels;  ///< 1 + index into planes(), 0 = curved or nothing
  io::Image left;                     ///< rectified pair; empty unless asked for
  io::Image right;
};

/// A scene seen frame by frame. Frames do not depend on each other or on the order of asking.
class PLANAR_MAPPING_EXPORT Simulation {
 public:
  /// \throws ParameterError; InputError for an unknown scene
  explicit Simulation(const SimulationParams& params);
  /// A scene of the caller's own instead of a named one; what \p params say about the scene and its
  /// path is not used, but for the yaw. \throws InputError for a scene without a path
  Simulation(const SimulationParams& params, const Scene& scene);

  const SimulationParams& params() const { return params_; }
  const Scene& scene() const { return scene_; }
  const std::vector<Plane>& planes() const { return planes_.planes; }
  std::size_t size() const { return scene_.path.size(); }
  std::vector<io::StampedPose> trajectory() const;  ///< T_world_camera
  /// \throws InputError if there is no such frame
  SimulatedFrame frame(std::size_t index) const;
  /// Index into planes() of a face of an object of the scene, -1 where curved.
  int planeOf(std::size_t object, int face) const;

  /// The truth as JSON: camera, objects (centre, full lengths, quaternion xyzw, planes), planes.
  std::string truthJson() const;

 private:
  void prepare();

  SimulationParams params_;
  Scene scene_;
  ScenePlanes planes_;
  std::vector<double> timestamps_;
};

/// Truth of the depth image of a written sequence: metres = value / kTruthDepthScale.
constexpr double kTruthDepthScale = 1000.0;

/// Writes a sequence folder: calib.yaml, poses.txt, scene.json, and
/// - with clouds: clouds/NNNNNN.pcd (organized, camera frame, VIEWPOINT = pose, with rgb and
/// label);
/// - with images: left/NNNNNN.png and right/NNNNNN.png, and the truth of the left image's pixels:
///   depth_gt/NNNNNN.png (16 bits, see kTruthDepthScale, 0 = none or beyond 65.534 m) and
///   labels_gt/NNNNNN.png (16 bits, as SimulatedFrame::labels).
/// With both, the clouds are a sequence folder of their own, measured/, so that it is clear what
/// either folder is read as. The directory is made if it is missing.
/// \param progress  called after each frame with the number done; may be empty
/// \throws IoError if something exists already and \p overwrite is false, or cannot be written
PLANAR_MAPPING_EXPORT void writeSequence(const Simulation& simulation, const std::string& directory,
                                         bool overwrite,
                                         const std::function<void(std::size_t)>& progress = {});

}  // namespace planar_mapping::evaluation
