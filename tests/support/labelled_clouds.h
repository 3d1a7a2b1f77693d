// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/metrics/plane_quality.h"
#include "evaluation/simulation/simulation.h"
#include "furnished_room.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "real_data.h"

namespace planar_mapping::test {

/// A cloud seen from the origin whose planes are known.
struct LabelledCloud {
  std::string name;
  std::vector<float> xyz;
  std::uint32_t width = 0;
  std::uint32_t height = 0;  ///< 1 = not organized
  evaluation::PlaneTruth truth;

  PointsView view() const { return PointsView(xyz.data(), width, height, 3); }
  std::size_t finite() const {
    std::size_t number = 0;
    for (std::size_t i = 0; i < view().size; ++i) number += view().isMeasured(i) ? 1 : 0;
    return number;
  }
};

inline LabelledCloud labelled(std::string name, std::vector<float> xyz, std::uint32_t width,
                              std::uint32_t height, const std::vector<int>& labels,
                              int min_points = 3) {
  LabelledCloud cloud{std::move(name), std::move(xyz), width, height, {}};
  cloud.truth = evaluation::truthOfLabels(cloud.view(), labels, min_points);
  return cloud;
}

/// labelled_icl_frame: label 0 is not labelled.
inline LabelledCloud readIclFrame() {
  const std::string set = realData("labelled_icl_frame") + "/";
  const io::Calibration calibration = io::readCalibration(set + "calib.yaml");
  io::CloudData data;
  io::DepthProjector(calibration.camera, *calibration.depth_scale)
      .project(io::readDepthPng(set + "depth/000000.png"), data);
  const io::Image image = io::readImage(set + "plane_labels/000000.png");
  std::vector<int> labels(data.size());
  for (std::size_t i = 0; i < labels.size(); ++i)
    labels[i] = image.pixels[i] > 0 ? image.pixels[i] : evaluation::kNotJudged;
  return labelled("icl_frame", std::move(data.xyz), data.width, data.height, labels);
}

/// labelled_synpeb: intensities of 10 and more are planes, the others none.
inline LabelledCloud readSynpeb(const std::string& name) {
  io::CloudData data = io::readCloudFile(realData("labelled_synpeb/" + name + ".pcd"));
  std::vector<int> labels(data.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const int label = static_cast<int>(std::lround(data.intensities[i]));
    labels[i] = label >= 10 ? label : evaluation::kOnNoPlane;
  }
  return labelled(name, std::move(data.xyz), data.width, data.height, labels);
}

/// labelled_mosd_tabletop: the labels of objects join several faces, so that only the table (1 to
/// 9) is judged.
inline LabelledCloud readTabletop(const std::string& name) {
  io::CloudData data = io::readCloudFile(realData("labelled_mosd_tabletop/" + name + ".pcd"));
  std::vector<int> labels(data.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto label = static_cast<int>(data.labels[i]);
    labels[i] = label >= 1 && label <= 9 ? 1 : evaluation::kNotJudged;
  }
  return labelled("mosd_" + name, std::move(data.xyz), data.width, data.height, labels);
}

/// A frame of furnishedRoom(); faces of less than a thousand pixels are not planes that must be
/// found, but no clutter either.
inline LabelledCloud roomFrame(std::uint64_t seed) {
  RoomFrame frame = furnishedRoom(seed);
  LabelledCloud cloud{
      "room_frame_" + std::to_string(seed), std::move(frame.xyz), frame.width, frame.height, {}};
  cloud.truth = evaluation::truthOf(cloud.view(), frame.labels, frame.planes, 1000);
  return cloud;
}

/// A frame of a simulated stereo scene, as it is measured.
inline LabelledCloud simulatedFrame(const evaluation::Simulation& simulation, std::size_t index,
                                    int min_points) {
  evaluation::SimulatedFrame frame = simulation.frame(index);
  std::vector<int> labels(frame.labels.size());
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = static_cast<int>(frame.labels[i]) - 1;
  std::vector<Plane> planes;
  const Pose T_camera_world = frame.T_world_camera.inverse();
  for (const Plane& plane : simulation.planes())
    planes.push_back(transformed(plane, T_camera_world));
  LabelledCloud cloud{simulation.params().scene + "_" + std::to_string(index),
                      std::move(frame.xyz),
                      static_cast<std::uint32_t>(simulation.params().width),
                      static_cast<std::uint32_t>(simulation.params().height),
                      {}};
  cloud.truth = evaluation::truthOf(cloud.view(), labels, planes, min_points);
  return cloud;
}

}  // namespace planar_mapping::test
