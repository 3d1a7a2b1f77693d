// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/ready_configuration.h"

#include <algorithm>

#include "planar_mapping/io/cloud_file.h"

namespace planar_mapping {
namespace {

ReadyConfiguration choosePair(const io::Sequence& sequence) {
  constexpr double kCarBaseline = 0.3;  // metres; wider pairs are mounted on cars
  const double baseline = *sequence.calibration()->baseline;
  if (baseline > kCarBaseline) return {"stereo_outdoor.yaml", {}, "baseline above 0.3 m"};
  return {"stereo_indoor.yaml", {}, "stereo_outdoor.yaml is for wide places"};
}

/// Do the files say where the sensor was? The first ones are enough to know.
bool haveViewpoints(const io::Sequence& sequence) {
  constexpr std::size_t kMaxFiles = 10;
  for (std::size_t i = 0; i < std::min(kMaxFiles, sequence.size()); ++i) {
    const Pose pose = io::readCloudFileInfo(sequence.path(i)).T_world_sensor;
    if (pose.matrix() != Pose::Identity().matrix()) return true;
  }
  return false;
}

ReadyConfiguration chooseClouds(const io::Sequence& sequence) {
  const bool has_poses =
      sequence.poseSource() != io::PoseSource::Viewpoint || haveViewpoints(sequence);
  if (sequence.size() == 1)
    return {"single_pcd.yaml",
            {},
            has_poses ? "" : "no poses are given: the sensor is taken to be at the origin"};
  ReadyConfiguration ready = {"pcd_sequence.yaml", {}, ""};
  if (!has_poses) {
    ready.assignments.emplace_back("motion_estimation.enabled=true");
    ready.why = "without poses their motion is estimated; --poses FILE gives them";
  }
  return ready;
}

}  // namespace

ReadyConfiguration readyConfigurationFor(const io::Sequence& sequence) {
  if (sequence.kind() == io::SequenceKind::Stereo) return choosePair(sequence);
  if (sequence.kind() == io::SequenceKind::Clouds) return chooseClouds(sequence);
  return {"rgbd_indoor.yaml", {}, ""};
}

}  // namespace planar_mapping
