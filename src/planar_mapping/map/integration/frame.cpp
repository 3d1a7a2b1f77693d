// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/integration/frame.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

/// How far a rotation may be from orthonormal: float poses of other libraries pass.
constexpr double kRotationTolerance = 1e-3;
/// Metres; points beyond are in nobody's world, and their squares would soon overflow a float.
constexpr double kMaxCoordinate = 1e9;

/// NaN is no belief either.
PLANAR_MAPPING_MULTIVERSION
bool areBeliefs(const float* beliefs, std::size_t n) {
  unsigned outside = 0;
  for (std::size_t i = 0; i < n; ++i) {
    outside |= (beliefs[i] >= 0.0f) & (beliefs[i] <= 1.0f) ? 0u : 1u;
  }
  return outside == 0;
}

/// Positions whose byte is 1, not 0.
Indices positionsOf(const std::vector<std::uint8_t>& bytes) {
  Indices positions;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] != 0) positions.push_back(static_cast<int>(i));
  }
  return positions;
}

/// Gives the bytes of points a value.
void setBytes(const Indices& indices, std::uint8_t value, std::vector<std::uint8_t>& bytes) {
  for (const int i : indices) bytes[static_cast<std::size_t>(i)] = value;
}

/// Those whose byte is 1; none if that is all of them.
std::optional<Indices> filtered(const Indices& indices, const std::vector<std::uint8_t>& bytes) {
  Indices kept;
  std::copy_if(indices.begin(), indices.end(), std::back_inserter(kept),
               [&](int i) { return bytes[static_cast<std::size_t>(i)] != 0; });
  if (kept.size() == indices.size()) return std::nullopt;
  return kept;
}

void requireIndices(const Indices& indices, std::size_t size, const char* what) {
  std::uint32_t largest = 0;  // negative indices are larger than all others
  for (const int i : indices) largest = std::max(largest, static_cast<std::uint32_t>(i));
  if (!indices.empty() && (largest > INT32_MAX || largest >= size)) {
    throw InputError(std::string(what) + ": index " + std::to_string(static_cast<int>(largest)) +
                     " is outside the cloud of " + std::to_string(size) + " points");
  }
}

void requireCamera(const PinholeCamera& camera, const PointsView& points) {
  constexpr int kMaxImageSide = 1 << 14;
  const bool is_finite = std::isfinite(camera.fx) && std::isfinite(camera.fy) &&
                         std::isfinite(camera.cx) && std::isfinite(camera.cy);
  if (!is_finite || !(camera.fx > 0.0) || !(camera.fy > 0.0)) {
    throw InputError("the camera of the frame has a focal length that is not positive");
  }
  const bool has_size = camera.width > 0 && camera.height > 0;
  if (points.isOrganized()) {
    if (has_size && (static_cast<std::uint32_t>(camera.width) != points.width ||
                     static_cast<std::uint32_t>(camera.height) != points.height)) {
      throw InputError("the camera of the frame has another size than its organized cloud");
    }
  } else if (!has_size || camera.width > kMaxImageSide || camera.height > kMaxImageSide) {
    throw InputError("the camera of the frame has no usable image size");
  }
}

PlaneMoments momentsOf(const PointsView& points, const Indices& inliers) {
  PlaneMoments moments;
  for (const int i : inliers) {
    const Vector3 p = points.point(static_cast<std::size_t>(i));
    if (p.cwiseAbs().maxCoeff() < kMaxCoordinate) moments.add(p);  // false for NaN
  }
  return moments;
}

/// A plane of its inliers passes them within their spread. Sums over coordinates beyond all reason
/// cancel to anything: those are not judged.
void requireNearInliers(const Plane& plane, const PlaneMoments& inliers) {
  constexpr double kNoise = 1.0;  // metres: more than a far sensor has
  if (!(inliers.weight() > 0.0)) return;
  const double spread = std::sqrt(inliers.scatter().trace() / inliers.weight());
  const double rounding = 1e-3 * inliers.mean().norm();
  if (std::abs(plane.signedDistance(inliers.mean())) > spread + kNoise + rounding)
    throw InputError("a plane of the frame is farther from its inliers than they spread");
}

void requireAssumed(const FrameObservation& observation) {
  const AssumedPoints& assumed = *observation.assumed;
  const std::size_t planes = observation.planes == nullptr ? 0 : observation.planes->size();
  if (assumed.of_plane.size() > planes)
    throw InputError("points are assumed for more planes than the frame has");
  requireInRange("assumed probability", assumed.probability, 0.0, 1.0);
  for (const Indices& indices : assumed.of_plane)
    requireIndices(indices, assumed.xyz.size() / 3, "assumed points");
}

}  // namespace

void requirePose(const Pose& pose) {
  requireRigid("the pose", pose);
  if (!(pose.translation().cwiseAbs().maxCoeff() < kFarthestPose)) {
    throw InputError("the pose is farther from the origin than 1e14 m");
  }
}

double Frame::pointsToBeSeen(const PlanarMapParams& params, const Vector3& world,
                             double facing) const {
  const auto image = std::find_if(images.begin(), images.end(), [&](const DepthImage& i) {
    return images.size() == 1 || i.isResponsible(i.toCamera(world));
  });
  if (image == images.end() || !(facing > 0.0)) return 0.0;
  const double side = params.approximation.resolution;
  const Vector3 centre = image->toCamera(world);
  const double depth = centre.z();
  if (!(depth > 0.0)) return 0.0;
  double pixels = image->pixelsOf(side, depth);  // face to face
  // Between the rings of a scan nothing is measured.
  if (image->isOfScan()) pixels *= image->coverOf(centre, Vector3::Constant(2.0 * side)).measured;
  if (!(pixels > 0.0)) return 0.0;
  // Of the points of a full cell noise carries 0.4 standard deviations across each face, and the
  // depth error is two of them. Up to half a cell away they are no error.
  constexpr double kCarried = 0.2;
  constexpr double kHarmless = 0.5;
  const double error = observation->noise ? observation->noise->depthError(depth) : 0.0;
  const double rim =
      params.rim_pixels / std::sqrt(pixels) + kCarried * std::max(0.0, error / side - kHarmless);
  return std::min(params.min_cell_fraction, rim) * facing * pixels;
}

Frame makeFrame(const FrameObservation& observation) {
  const PointsView& points = observation.points;
  const std::size_t n = points.size;
  requirePose(observation.T_world_sensor);
  if (!std::isfinite(observation.timestamp)) {
    throw InputError("the time stamp of the frame is not finite");
  }
  if (n > 0 && (points.data == nullptr || points.stride < 3)) {
    throw InputError("the cloud of the frame has no data or a stride below 3");
  }
  if (n > 0 && static_cast<std::uint64_t>(points.width) * points.height != n) {
    throw InputError("the cloud of the frame has " + std::to_string(n) + " points, not " +
                     std::to_string(points.width) + " x " + std::to_string(points.height));
  }
  if (observation.noise) observation.noise->validate();
  if (observation.camera && n > 0) requireCamera(*observation.camera, points);
  if (observation.indices != nullptr) requireIndices(*observation.indices, n, "indices");
  if (observation.ground != nullptr) requireIndices(*observation.ground, n, "ground");
  if (observation.probability != nullptr) {
    if (observation.probability->size() != n) {
      throw InputError("the cloud of " + std::to_string(n) + " points comes with " +
                       std::to_string(observation.probability->size()) + " beliefs");
    }
    if (!areBeliefs(observation.probability->data(), n)) {
      throw InputError("a belief is outside [0, 1]");
    }
  }

  if (observation.assumed != nullptr) requireAssumed(observation);

  Frame frame;
  frame.observation = &observation;
  frame.orientation = Quaternion(Matrix3(observation.T_world_sensor.linear())).normalized();
  frame.rotation = frame.orientation.toRotationMatrix();
  frame.sensor = observation.T_world_sensor.translation();
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.linear() = frame.rotation;
  T_world_sensor.translation() = frame.sensor;

  if (observation.indices != nullptr || observation.ground != nullptr) {
    frame.use.assign(n, observation.indices == nullptr ? 1 : 0);
    if (observation.indices != nullptr) {
      setBytes(*observation.indices, 1, frame.use);
    }
    if (observation.ground != nullptr) {
      setBytes(*observation.ground, 0, frame.use);
    }
  }

  // Points that no plane claims are non-planar.
  std::vector<std::uint8_t> unclaimed = frame.use;
  if (unclaimed.empty()) unclaimed.assign(n, 1);
  if (observation.planes != nullptr) {
    for (const PlaneSegment& segment : *observation.planes) {
      requireIndices(segment.inliers, n, "inliers of a plane");
      const Plane& plane = segment.plane;
      if (!plane.normal.allFinite() || !std::isfinite(plane.offset) ||
          !(std::abs(plane.normal.norm() - 1.0) < kRotationTolerance)) {
        throw InputError("a plane of the frame is not finite or has no unit normal");
      }
      const PlaneMoments& m = segment.moments;
      constexpr double kMaxScatter = 1e30;
      if (!std::isfinite(m.weight()) || !m.mean().allFinite() ||
          !(m.scatter().cwiseAbs().maxCoeff() < kMaxScatter)) {
        throw InputError("the moments of a plane of the frame are not finite or too large");
      }
    }
    for (const PlaneSegment& segment : *observation.planes) {
      frame.inliers.push_back(frame.use.empty() ? std::nullopt
                                                : filtered(segment.inliers, unclaimed));
      setBytes(segment.inliers, 0, unclaimed);
      const Indices& inliers = frame.inliersOf(frame.planes.size());
      frame.planes.push_back(
          orientedTowards(transformed(segment.plane, T_world_sensor), frame.sensor));
      frame.moments.push_back(
          (segment.moments.weight() >= 3.0 ? segment.moments : momentsOf(points, inliers))
              .transformed(T_world_sensor));
      requireNearInliers(frame.planes.back(), frame.moments.back());
    }
  }
  frame.non_planar = positionsOf(unclaimed);
  return frame;
}

}  // namespace planar_mapping::detail
