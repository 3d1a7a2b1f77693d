// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A pose file, as TUM or KITTI write it.
#include <cmath>

#include "fuzz.h"
#include "planar_mapping/io/pose_file.h"

using namespace planar_mapping;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = fuzz::write("poses.txt", fuzz::Input(data, size).rest());
  fuzz::succeeds([&] { io::readTumPoses(path); });
  std::vector<io::StampedPose> poses;
  if (!fuzz::succeeds([&] { poses = io::readTrajectory(path).poses; })) return 0;
  for (const io::StampedPose& pose : poses) {
    const Matrix3 rotation = pose.pose.linear();
    fuzz::require(std::isfinite(pose.timestamp) && pose.pose.matrix().allFinite(), "finite poses");
    fuzz::require((rotation * rotation.transpose()).isIdentity(0.01), "rotations");
  }
  const auto again = io::readTrajectory(fuzz::write("again.txt", io::toTum(poses))).poses;
  fuzz::require(again.size() == poses.size(), "poses that are written can be read");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    fuzz::require(again[i].timestamp == poses[i].timestamp &&
                      again[i].pose.translation() == poses[i].pose.translation() &&
                      again[i].pose.linear().isApprox(poses[i].pose.linear(), 1e-9),
                  "poses that are written are read as the same");
  }
  return 0;
}
