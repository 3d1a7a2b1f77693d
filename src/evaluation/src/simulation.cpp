// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/simulation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "planar_mapping/core/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/pose_file.h"
#include "scene_json.h"

namespace planar_mapping {
namespace evaluation {
namespace {

namespace fs = std::filesystem;

constexpr double kUsualFocalLength = 500.0 / 640.0;  ///< of the image width
constexpr double kShortestFrameTime = 0.1;           ///< seconds

std::string frameName(std::size_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "%06zu.pcd", index);
  return name;
}

void makeDirectory(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path))
    throw IoError(path, "cannot be made a directory" + (error ? ": " + error.message() : ""));
}

}  // namespace

void SimulationParams::validate() const {
  const std::vector<std::string>& names = sceneNames();
  if (std::find(names.begin(), names.end(), scene) == names.end()) makeScene(scene, 1);
  requireInRange("frames", frames, 1, 100000);
  requireInRange("yaw", yaw, -1e3, 1e3, "rad");
  requireInRange("width", width, 8, 8192, "px");
  requireInRange("height", height, 8, 8192, "px");
  requireInRange("focal_length", focal_length, 0.0, 1e6, "px");
  requirePositive("speed", speed, "m/s");
  sensor.validate();
}

PinholeCamera SimulationParams::camera() const {
  PinholeCamera camera;
  camera.fx = camera.fy = focal_length > 0.0 ? focal_length : kUsualFocalLength * width;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.width = width;
  camera.height = height;
  return camera;
}

Simulation::Simulation(const SimulationParams& params) : params_(params) {
  params_.validate();
  scene_ = makeScene(params_.scene, params_.frames);
  scene_.rotate(params_.yaw);
  planes_ = planesOf(scene_);
  double time = 0.0;
  for (std::size_t i = 0; i < scene_.path.size(); ++i) {
    if (i > 0) {
      const double distance =
          (scene_.path[i].translation() - scene_.path[i - 1].translation()).norm();
      time += std::max(kShortestFrameTime, distance / params_.speed);
    }
    timestamps_.push_back(time);
  }
}

SimulatedFrame Simulation::frame(std::size_t index) const {
  if (index >= size())
    throw InputError("frame " + std::to_string(index) + " of " + std::to_string(size()));
  SimulatedFrame frame;
  frame.T_world_camera = scene_.path[index];
  frame.timestamp = timestamps_[index];
  frame.truth = render(scene_, params_.camera(), frame.T_world_camera);
  Random random(params_.seed, index);
  frame.disparity = measureDisparity(frame.truth, params_.sensor, random);
  frame.xyz = pointsOf(frame.disparity, frame.truth.camera, params_.sensor.baseline);
  frame.labels.assign(frame.truth.size(), 0);
  for (std::size_t i = 0; i < frame.truth.size(); ++i) {
    if (frame.truth.object[i] < 0) continue;
    const auto object = static_cast<std::size_t>(frame.truth.object[i]);
    frame.labels[i] =
        static_cast<std::uint32_t>(planes_.plane_of_face[object][frame.truth.face[i]] + 1);
  }
  return frame;
}

std::string Simulation::truthJson() const {
  return sceneJson(params_, scene_, planes_);
}

void writeSequence(const Simulation& simulation, const std::string& directory, bool overwrite,
                   const std::function<void(std::size_t)>& progress) {
  const io::Overwrite mode = overwrite ? io::Overwrite::Allow : io::Overwrite::Refuse;
  const std::string clouds = directory + "/clouds";
  makeDirectory(clouds);
  io::Calibration calibration;
  calibration.camera = simulation.params().camera();
  calibration.baseline = simulation.params().sensor.baseline;
  calibration.cx_right = calibration.camera.cx;
  io::writeFileAtomically(directory + "/calib.yaml", io::toYaml(calibration), mode);
  io::writeFileAtomically(directory + "/scene.json", simulation.truthJson(), mode);

  std::vector<io::StampedPose> poses;
  for (std::size_t i = 0; i < simulation.size(); ++i) {
    SimulatedFrame frame = simulation.frame(i);
    io::CloudData cloud;
    cloud.width = static_cast<std::uint32_t>(frame.truth.camera.width);
    cloud.height = static_cast<std::uint32_t>(frame.truth.camera.height);
    cloud.xyz = std::move(frame.xyz);
    cloud.colors = std::move(frame.truth.colors);
    cloud.labels = std::move(frame.labels);
    cloud.T_world_sensor = frame.T_world_camera;
    io::writePcd(clouds + "/" + frameName(i), cloud, io::PcdEncoding::Binary, mode);
    poses.push_back({frame.timestamp, frame.T_world_camera});
    if (progress) progress(i + 1);
  }
  io::writeTumPoses(directory + "/poses.txt", poses, mode);
}

}  // namespace evaluation
}  // namespace planar_mapping
