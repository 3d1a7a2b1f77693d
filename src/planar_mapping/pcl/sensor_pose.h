// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>

#include <optional>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// Pose of the sensor in the world as a cloud carries it: its sensor_origin_ and
/// sensor_orientation_, which PCL reads from the VIEWPOINT of a PCD file. Maps the coordinates of
/// the points, which are in the sensor's frame, to the world. Identity for a cloud without one.
///
/// This is the pose that `planar_map run` takes from the same file. PCL keeps it as floats, the
/// command as doubles: pass the pose to setSensorPose() where more than seven digits matter.
/// \return the orientation normalised, metres
/// \throws InputError if the pose is not finite or the quaternion has length 0
template <typename PointT>
Pose sensorPoseOf(const pcl::PointCloud<PointT>& cloud) {
  const Vector3 origin = cloud.sensor_origin_.template head<3>().template cast<double>();
  const Eigen::Quaterniond orientation = cloud.sensor_orientation_.template cast<double>();
  if (!origin.allFinite() || !orientation.coeffs().allFinite() || !(orientation.norm() > 0.0))
    throw InputError("the cloud's sensor_origin_ and sensor_orientation_ are no pose");
  Pose pose = Pose::Identity();
  pose.linear() = orientation.normalized().toRotationMatrix();
  pose.translation() = origin;
  return pose;
}

/// The pose that was given, else the cloud's own: the rule of every class with a setSensorPose().
/// \throws InputError as sensorPoseOf(cloud), or if the given pose is no rigid motion
template <typename PointT>
Pose sensorPoseOf(const pcl::PointCloud<PointT>& cloud, const std::optional<Pose>& given) {
  if (!given) return sensorPoseOf(cloud);
  requireRigid("the pose of the sensor", *given);
  return *given;
}

}  // namespace planar_mapping
