// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/evaluation/simulation.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping::evaluation {
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
  io::Calibration calibration;
  calibration.camera = simulation.params().camera();
  calibration.baseline = simulation.params().sensor.baseline;
  calibration.cx_right = calibration.camera.cx;
  io::writeFileAtomically(directory + "/calib.yaml", io::toYaml(calibration), mode);
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

  std::vector<io::StampedPose> poses;
  for (std::size_t i = 0; i < simulation.size(); ++i) {
    const SimulatedFrame frame = simulation.frame(i);
    if (clouds) writeCloud(frame, cloud_folder, mode);
    if (images) writeImages(frame, directory, mode);
    poses.push_back({frame.timestamp, frame.T_world_camera});
    if (progress) progress(i + 1);
  }
  io::writeTumPoses(directory + "/poses.txt", poses, mode);
  if (images && clouds) io::writeTumPoses(cloud_folder + "/poses.txt", poses, mode);
}

}  // namespace planar_mapping::evaluation
