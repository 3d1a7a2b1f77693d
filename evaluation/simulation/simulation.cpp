// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/simulation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping::evaluation {
namespace {

using Json = nlohmann::ordered_json;

Json listOf(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

const char* nameOf(Shape shape) {
  return shape == Shape::Box ? "box" : shape == Shape::Cylinder ? "cylinder" : "sphere";
}

Json objectJson(const SceneObject& object, const std::vector<int>& plane_of_face) {
  const Eigen::Quaterniond q(Matrix3(object.T_world_object.linear()));
  Json json = {{"name", object.name},
               {"shape", nameOf(object.shape)},
               {"center", listOf(object.T_world_object.translation())},
               {"size", listOf(object.size)},
               {"orientation", {q.x(), q.y(), q.z(), q.w()}},
               {"planes", Json::array()}};
  for (const int plane : plane_of_face)
    if (plane >= 0) json["planes"].push_back(plane);
  if (object.first_frame > 0) json["first_frame"] = object.first_frame;
  if (object.last_frame < std::numeric_limits<int>::max()) json["last_frame"] = object.last_frame;
  return json;
}

constexpr double kUsualFocalLength = 500.0 / 640.0;  ///< of the image width
constexpr double kShortestFrameTime = 0.1;           ///< seconds
/// Random streams of the images; those of the clouds are the frames' own numbers.
constexpr std::uint64_t kImageStreams = 1u << 20u;

}  // namespace

void SimulationParams::validate() const {
  SceneParams::validate();
  requireInRange("yaw", yaw, -1e3, 1e3, "rad");
  requireInRange("width", width, 8, 8192, "px");
  requireInRange("height", height, 8, 8192, "px");
  requireInRange("focal_length", focal_length, 0.0, 1e6, "px");
  requireInRange("plain_fraction", plain_fraction, 0.0, 1.0);
  requireInRange("image_noise", image_noise, 0.0, 100.0, "gray levels");
  requirePositive("right_exposure", right_exposure);
  requirePositive("speed", speed, "m/s");
  requireInRange("threads", threads, 0, 1024);
  sensor.validate();
  if (images && !colors) throw ParameterError("images cannot be rendered without colors");
}

PinholeCamera SimulationParams::camera() const {
  const double f = focal_length > 0.0 ? focal_length : kUsualFocalLength * width;
  return {f, f, 0.5 * (width - 1), 0.5 * (height - 1), width, height};
}

io::Calibration SimulationParams::calibration() const {
  io::Calibration calibration;
  calibration.camera = camera();
  calibration.baseline = sensor.baseline;
  calibration.cx_right = calibration.camera.cx;
  return calibration;
}

Simulation::Simulation(const SimulationParams& params) : params_(params) {
  params_.validate();
  scene_ = makeScene(params_);
  prepare();
}

Simulation::Simulation(const SimulationParams& params, const Scene& scene)
    : params_(params), scene_(scene) {
  params_.scene = sceneNames().front();
  params_.length = 0.0;
  params_.validate();
  params_.scene = scene.name;
  if (scene.path.empty()) throw InputError("the scene has no path to be seen from");
  prepare();
}

void Simulation::prepare() {
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

std::vector<io::StampedPose> Simulation::trajectory() const {
  std::vector<io::StampedPose> poses;
  for (std::size_t i = 0; i < size(); ++i) poses.push_back({timestamps_[i], scene_.path[i]});
  return poses;
}

int Simulation::planeOf(std::size_t object, int face) const {
  return planes_.plane_of_face.at(object).at(static_cast<std::size_t>(face));
}

SimulatedFrame Simulation::frame(std::size_t index) const {
  if (index >= size())
    throw InputError("frame " + std::to_string(index) + " of " + std::to_string(size()));
  SimulatedFrame frame;
  frame.index = index;
  frame.T_world_camera = scene_.path[index];
  frame.timestamp = timestamps_[index];
  RenderParams rendering;
  rendering.frame = static_cast<int>(index);
  rendering.plain_fraction = params_.plain_fraction;
  rendering.colors = params_.colors;
  rendering.threads = params_.threads;
  const PinholeCamera camera = params_.camera();
  frame.truth = render(scene_, camera, frame.T_world_camera, rendering);
  frame.labels.assign(frame.truth.size(), 0);
  for (std::size_t i = 0; i < frame.truth.size(); ++i)
    if (frame.truth.object[i] >= 0)
      frame.labels[i] = static_cast<std::uint32_t>(
          planeOf(static_cast<std::size_t>(frame.truth.object[i]), frame.truth.face[i]) + 1);
  if (params_.clouds) {
    Random random(params_.seed, index);
    frame.disparity = measureDisparity(frame.truth, params_.sensor, random);
    frame.xyz = pointsOf(frame.disparity, camera, params_.sensor.baseline);
  }
  if (!params_.images) return frame;
  ImageSensorParams sensor;
  sensor.color = params_.color_images;
  sensor.noise = params_.image_noise;
  Random seeds(params_.seed, kImageStreams + index);
  const auto nextSeed = [&seeds]() {
    const auto high = static_cast<std::uint64_t>(seeds.next());
    return high << 32u | seeds.next();
  };
  sensor.seed = nextSeed();
  frame.left = renderImage(scene_, frame.truth, frame.T_world_camera, rendering, sensor);
  if (params_.left_only) return frame;
  Pose T_world_right = frame.T_world_camera;
  sensor.exposure = params_.right_exposure;
  T_world_right.translation() += params_.sensor.baseline * frame.T_world_camera.linear().col(0);
  sensor.seed = nextSeed();
  frame.right = renderImage(scene_, render(scene_, camera, T_world_right, rendering), T_world_right,
                            rendering, sensor);
  return frame;
}

std::string Simulation::truthJson() const {
  const PinholeCamera camera = params_.camera();
  Json json = {{"scene", scene_.name},
               {"frames", scene_.path.size()},
               {"seed", params_.seed},
               {"yaw_rad", params_.yaw},
               {"camera_height_m", scene_.camera_height},
               {"camera",
                {{"width", camera.width},
                 {"height", camera.height},
                 {"fx", camera.fx},
                 {"fy", camera.fy},
                 {"cx", camera.cx},
                 {"cy", camera.cy},
                 {"baseline_m", params_.sensor.baseline},
                 {"noise_px", params_.sensor.noise_px}}},
               {"depth_gt_scale", kTruthDepthScale},
               {"objects", Json::array()},
               {"planes", Json::array()}};
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    json["objects"].push_back(objectJson(scene_.objects[i], planes_.plane_of_face[i]));
  for (const Plane& plane : planes_.planes) {
    const Vector3& n = plane.normal;
    json["planes"].push_back(
        {{"id", json["planes"].size()}, {"coefficients", {n.x(), n.y(), n.z(), plane.offset}}});
  }
  return json.dump(1) + "\n";
}

namespace {

namespace fs = std::filesystem;

constexpr double kLargestValue = 65534.0;  ///< of a 16-bit image; 65535 is no depth

std::string frameName(std::size_t index, const char* extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%06zu.%s", index, extension);
  return name;
}

void makeDirectory(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path))
    throw IoError(path, "cannot be made a directory" + (error ? ": " + error.message() : ""));
}

void writeCalibration(const Simulation& simulation, const std::string& directory,
                      io::Overwrite mode) {
  io::writeFileAtomically(directory + "/calib.yaml", io::toYaml(simulation.params().calibration()),
                          mode);
}

void writeCloud(const SimulatedFrame& frame, const std::string& directory, io::Overwrite mode) {
  io::CloudData cloud;
  cloud.width = static_cast<std::uint32_t>(frame.truth.camera.width);
  cloud.height = static_cast<std::uint32_t>(frame.truth.camera.height);
  cloud.xyz = frame.xyz;
  cloud.colors = frame.truth.colors;
  cloud.labels = frame.labels;
  cloud.T_world_sensor = frame.T_world_camera;
  io::writePcd(directory + "/clouds/" + frameName(frame.index, "pcd"), cloud, mode);
}

void writeImages(const SimulatedFrame& frame, const std::string& directory, io::Overwrite mode) {
  const std::string name = frameName(frame.index, "png");
  io::writeImage(directory + "/left/" + name, frame.left, mode);
  io::writeImage(directory + "/right/" + name, frame.right, mode);
  io::DepthImage truth;
  truth.width = static_cast<std::uint32_t>(frame.truth.camera.width);
  truth.height = static_cast<std::uint32_t>(frame.truth.camera.height);
  for (const float depth : frame.truth.depth) {
    const double value = std::round(static_cast<double>(depth) * kTruthDepthScale);
    truth.values.push_back(value <= kLargestValue ? static_cast<std::uint16_t>(value) : 0);
  }
  io::writeDepthPng(directory + "/depth_gt/" + name, truth, mode);
  for (std::size_t i = 0; i < frame.labels.size(); ++i)
    truth.values[i] = static_cast<std::uint16_t>(frame.labels[i]);
  io::writeDepthPng(directory + "/labels_gt/" + name, truth, mode);
}

}  // namespace

void writeSequence(const Simulation& simulation, const std::string& directory, bool overwrite,
                   const std::function<void(std::size_t)>& progress) {
  const io::Overwrite mode = overwrite ? io::Overwrite::Allow : io::Overwrite::Refuse;
  const bool images = simulation.params().images;
  const bool clouds = simulation.params().clouds;
  const std::string cloud_folder = images ? directory + "/measured" : directory;
  if (images && simulation.planes().size() >= static_cast<std::size_t>(kLargestValue))
    throw InputError("labels of more than 65534 planes do not fit an image");
  makeDirectory(directory);
  if (clouds) makeDirectory(cloud_folder + "/clouds");
  if (images)
    for (const char* name : {"/left", "/right", "/depth_gt", "/labels_gt"})
      makeDirectory(directory + name);
  writeCalibration(simulation, directory, mode);
  if (images && clouds) writeCalibration(simulation, cloud_folder, mode);
  io::writeFileAtomically(directory + "/scene.json", simulation.truthJson(), mode);

  for (std::size_t i = 0; i < simulation.size(); ++i) {
    const SimulatedFrame frame = simulation.frame(i);
    if (clouds) writeCloud(frame, cloud_folder, mode);
    if (images) writeImages(frame, directory, mode);
    if (progress) progress(i + 1);
  }
  const std::vector<io::StampedPose> poses = simulation.trajectory();
  io::writeTumPoses(directory + "/poses.txt", poses, mode);
  if (images && clouds) io::writeTumPoses(cloud_folder + "/poses.txt", poses, mode);
}

}  // namespace planar_mapping::evaluation
