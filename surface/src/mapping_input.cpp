// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/mapping_input.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/pcl/parameter_setter.h"

namespace planar_mapping {
namespace {

constexpr double kMaxSpacing = 10.0;  // resolutions; beyond, each point has a cuboid of its own
constexpr char kLengths[] = "resolution and the other lengths";

/// Planes that stayed from the cloud before have inliers that do not lie on them.
void requireOwnPlanes(const PointsView& points, const std::vector<PlaneSegment>& planes,
                      double resolution) {
  constexpr double kMaxCells = 5.0;  // a plane that is searched for ends at half a cell
  constexpr double kMaxOfRange = 0.05;
  constexpr std::size_t kSample = 64;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const Indices& inliers = planes[k].inliers;
    std::size_t looked_at = 0, off = 0;
    for (std::size_t i = 0; i < inliers.size(); i += 1 + inliers.size() / kSample) {
      const auto index = static_cast<std::size_t>(inliers[i]);
      if (inliers[i] < 0 || index >= points.size || !points.isMeasured(index)) continue;
      const Vector3 p = points.point(index);
      ++looked_at;
      off += std::abs(planes[k].plane.signedDistance(p)) >
                     std::max(kMaxCells * resolution, kMaxOfRange * p.norm())
                 ? 1
                 : 0;
    }
    if (2 * off > looked_at)
      throw InputError("plane " + std::to_string(k) +
                       " is far from most of its inliers: set the planes of this cloud");
  }
}

[[noreturn]] void refuseFarther(const char* what, double reach, const char* of_what) {
  throw InputError(std::string("the ") + what + " farther from the origin than a map reaches, " +
                   std::to_string(static_cast<long>(reach)) +
                   " m at this resolution: take the same whole metres off all " + of_what);
}

/// Refuses a cloud without a point so near.
void requireWithin(const PointsView& points, const Indices* indices, double reach) {
  const std::size_t n = indices == nullptr ? points.size : indices->size();
  bool any = false;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = indices == nullptr ? k : static_cast<std::size_t>((*indices)[k]);
    if (!points.isMeasured(i)) continue;
    if (!(points.point(i).cwiseAbs().maxCoeff() > reach)) return;
    any = true;
  }
  if (any) refuseFarther("points are", reach, "coordinates, in double precision");
}

/// Points that are relative to their sensor, of the shape of a cloud that is not.
class SeenCloud {
 public:
  SeenCloud(const Vector3& origin, const PointsView& points)
      : xyz_(seenFrom(origin, points)), points_(points) {
    points_.data = xyz_.data();
    points_.stride = 3;
  }
  operator const PointsView&() const { return points_; }  // NOLINT: meant to be implicit

 private:
  std::vector<float> xyz_;
  PointsView points_;
};

}  // namespace

MappingInput MappingInput::seenFromOrigin() const {
  if (sensor_pose_ || camera_)
    throw InputError("a cloud with a sensor origin is in the coordinates of the world: it has no " +
                     std::string(sensor_pose_ ? "sensor pose" : "camera"));
  MappingInput input = *this;
  const Pose T_sensor_world(Eigen::Translation3d(-*sensor_origin_));
  for (PlaneSegment& segment : input.planes_) {
    segment.plane = orientedTowards(transformed(segment.plane, T_sensor_world), Vector3::Zero());
    segment.moments = segment.moments.transformed(T_sensor_world);
  }
  input.sensor_pose_ = T_sensor_world.inverse();
  input.sensor_origin_.reset();
  return input;
}

void MappingInput::setPlanes(const std::vector<pcl::PointIndices>& inliers,
                             const std::vector<pcl::ModelCoefficients>& planes) {
  if (inliers.size() != planes.size())
    throw InputError(std::to_string(planes.size()) + " planes come with " +
                     std::to_string(inliers.size()) + " sets of inliers");
  std::vector<PlaneSegment> segments(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const std::vector<float>& c = planes[i].values;
    if (c.size() != 4)
      throw InputError("plane " + std::to_string(i) + " has " + std::to_string(c.size()) +
                       " coefficients instead of 4");
    segments[i].plane = planeFromCoefficients(c[0], c[1], c[2], c[3]);
    segments[i].inliers = inliers[i].indices;
  }
  planes_ = std::move(segments);
}

void MappingInput::setNoiseModel(const std::optional<StereoNoise>& noise) {
  if (noise) noise->validate();
  noise_ = noise;
}

PlanarMapParams MappingInput::paramsFor(const PointsView& points, const Indices* indices,
                                        const Pose& T_world_sensor) const {
  if (sensor_origin_) {
    const MappingInput input = seenFromOrigin();
    return input.paramsFor(SeenCloud(*sensor_origin_, points), indices, *input.sensor_pose_);
  }
  CloudScale scale = scaleOf(points, usablePoints(points), T_world_sensor);
  const bool has_pose = sensor_pose_ || T_world_sensor.matrix() != Pose::Identity().matrix();
  scale.has_sensor = has_pose || !params_.unknown_space || !isMerged(points, indices);
  PlanarMapParams params = params_;
  if (finds_resolution_) {
    requireMetres(points, indices, kMaxSpacing * params.approximation.resolution, kLengths);
    params.setResolution(automaticResolution(scale));
    requireWithin(points, indices, PlanarMap::kReach * params.approximation.resolution);
  }
  if (finds_up_ && !has_pose) params.approximation.up = scale.up;
  return params.resolvedFor(scale);
}

FrameUpdate MappingInput::insertInto(PlanarMap& map, const PointsView& points,
                                     const Indices* indices, const Pose& T_world_sensor,
                                     std::uint64_t stamp_us) const {
  if (sensor_origin_) {
    const MappingInput input = seenFromOrigin();
    return input.insertInto(map, SeenCloud(*sensor_origin_, points), indices, *input.sensor_pose_,
                            stamp_us);
  }
  const double resolution = map.params().approximation.resolution;
  const double reach = PlanarMap::kReach * resolution;
  if (T_world_sensor.translation().cwiseAbs().maxCoeff() > reach)
    refuseFarther("sensor is", reach, "poses");
  if (map.frames() == 0) {
    requireWithin(points, indices, reach);
    requireMetres(points, indices, kMaxSpacing * resolution, kLengths);
  }
  if (!noise_) requireOwnPlanes(points, planes_, resolution);
  FrameObservation frame;
  frame.T_world_sensor = T_world_sensor;
  frame.timestamp = timestamp_.value_or(1e-6 * static_cast<double>(stamp_us));
  frame.points = points;
  const Indices usable = indices == nullptr ? usablePoints(points) : Indices();
  frame.indices = indices == nullptr ? &usable : indices;
  frame.ground = &ground_;
  frame.planes = &planes_;
  if (!probabilities_.empty()) frame.probability = &probabilities_;
  if (!assumed_.empty()) frame.assumed = &assumed_;
  frame.camera = camera_;
  frame.noise = noise_;
  FrameUpdate update = map.insert(frame);
  if (indices == nullptr) update.dropped_points += points.size - usable.size();
  return update;
}

void MappingInput::setParams(const PlanarMapParams& params) {
  params.validate();
  params_ = params;
  finds_resolution_ = finds_up_ = false;
}

void MappingInput::setResolution(double metres) {
  PlanarMapParams changed = params_;
  changed.setResolution(metres);
  changed.validate();
  params_ = changed;
  finds_resolution_ = false;
}

void MappingInput::setUpDirection(const Vector3& up) {
  PlanarMapParams changed = params_;
  changed.approximation.up = up;
  changed.validate();
  params_ = changed;
  finds_up_ = false;
}

PLANAR_MAPPING_SETTER(MappingInput, setProfile, Profile, approximation.profile)
PLANAR_MAPPING_SETTER(MappingInput, setThickness, double, approximation.thickness)
PLANAR_MAPPING_SETTER(MappingInput, setMinPointsPerCell, int, approximation.min_points_per_cell)
PLANAR_MAPPING_SETTER(MappingInput, setHoleSize, double, approximation.hole_size)
PLANAR_MAPPING_SETTER(MappingInput, setAbsorption, double, approximation.absorption)
PLANAR_MAPPING_SETTER(MappingInput, setMaxRange, double, max_range)
PLANAR_MAPPING_SETTER(MappingInput, setMinProbability, double, min_probability)
PLANAR_MAPPING_SETTER(MappingInput, setNumberOfThreads, int, approximation.threads)

}  // namespace planar_mapping
