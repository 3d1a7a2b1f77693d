// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/run_advice.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/pipeline/advice/leaning_floor.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/pipeline/rounded.h"

namespace planar_mapping::detail {
namespace {

/// One sentence for all of them; run.log and frames.csv tell of each.
std::optional<std::string> skippedFrames(const Pipeline& pipeline, const RunStatistics& statistics,
                                         const FrameSource& source) {
  const std::size_t skipped = statistics.frames() - statistics.usedFrames();
  if (skipped == 0) return std::nullopt;
  const FrameReport& first = statistics.firstSkipped();
  const bool many = 3 * skipped >= statistics.frames();
  // Nothing of this helps frames that could not be read.
  const bool is_own =
      pipeline.map().params().frame == MapFrame::Start && statistics.hasSkippedPoints();
  constexpr std::size_t kMinEnd = 10;  // frames; fewer are no other recording
  const std::vector<FrameReport> end = statistics.skippedEnd();
  const bool breaks =
      is_own && source.size() && end.size() >= kMinEnd && statistics.usedFrames() > 1;
  const std::string start = breaks ? std::to_string(end.front().number) : "";
  return std::to_string(skipped) + " of " + std::to_string(statistics.frames()) +
         " frames left out (see frames.csv), the first: frame " + std::to_string(first.number) +
         ", " + first.skip_reason +
         (many && is_own ? "; frames closer together, of which neighbours see mostly the same, or "
                           "given poses help; the others may be too few for a map"
                         : "") +
         (many && is_own && source.kind() == io::SequenceKind::Rgbd &&
                  statistics.mayBeUnregistered() &&
                  !hasStageWith(pipeline.configuration(), StageKind::Features, "registered",
                                "false")
              ? ", and key_features.registered=false where the colour image of a depth camera "
                "is not registered to the depth image"
              : "") +
         (breaks ? "; none of the last " + std::to_string(end.size()) +
                       " has a place: if the recording breaks at frame " + start + ", --frames " +
                       start +
                       ": maps what follows by itself, or a little later if that shows too little"
                 : "");
}

/// What is upwards may be known from the first frame only. Where ground was removed it was level
/// and is not in the map.
std::optional<std::string> tilt(const PlanarMap& map, const RunStatistics& statistics,
                                const FrameSource& source, bool is_camera) {
  if (statistics.hasGroundInMostFrames()) return std::nullopt;
  constexpr double kUsualSlope = 10.0 * kRadiansPerDegree;  // of what lies along a street
  const bool is_own = map.params().frame == MapFrame::Start;
  const std::optional<LeaningFloor> floor = leaningFloor(map, is_camera);
  using Kind = LeaningFloor::Kind;
  if (!floor || (floor->kind == Kind::Leans && !is_own && floor->tilt < kUsualSlope))
    return std::nullopt;
  const std::string axis = rounded(floor->up, 2);
  if (floor->kind == Kind::OtherAxis)
    return "no plane is level, and nearly all (" + rounded(floor->area, 0) +
           " m2) face along another axis: if they are floors, set `up` of the stages to " + axis +
           " or its opposite";
  if (floor->kind == Kind::LevelWithoutTurn) {
    return "what looks like a floor (" + rounded(floor->area, 0) +
           " m2) is level for the sensor, but its pose, which turns and does not move it, "
           "stands it up: if the sensor stood level, set `up` of the stages to " +
           axis;
  }
  const std::string what = "what looks like a floor (" + rounded(floor->area, 0) +
                           " m2) leans by " + rounded(floor->tilt / kRadiansPerDegree, 0) +
                           " degrees: ";
  if (is_own)
    return what +
           "the sensor did not start level, and the first frame does not show how it was held; "
           "give poses, or begin with a frame that sees floor and walls (--frames)";
  const auto& trajectory = map.trajectory();
  const bool has_poses = source.poseSource() == io::PoseSource::File ||
                         std::any_of(trajectory.begin(), trajectory.end(), [](const auto& one) {
                           return one.second.matrix() != Pose::Identity().matrix();
                         });
  return what + (has_poses ? "the world of the given poses may not be level; set `up` of the stages"
                           : "if it is one, no pose says how the sensor was held; set `up` of the "
                             "stages to " +
                                 axis);
}

}  // namespace

std::vector<std::string> FrameWatch::adviceOn(const Frame& frame, const PlanarMap& map) {
  std::vector<std::string> advice;
  const PointsView points = pointsOf(*frame.cloud);
  if (!is_camera_) is_camera_ = frame.camera || isCameraView(points, &frame.indices);
  if (robot_.isSeenIn(points, frame.indices, frame.T_world_sensor))
    advice.push_back(frame.source + ": " + RobotWatch::kAdvice);
  if (frame.camera && !frame.baseline && depths_.isBentIn(points, frame.is_only))
    advice.push_back(frame.source + ": " + DepthWatch::kAdvice);
  if (auto text = apart(frame, points)) advice.push_back(std::move(*text));
  // The noise of depth cameras is as large as what is wrong with their poses.
  const bool is_given_for_scan =
      frame.given_pose && !frame.pose_assumed && !frame.without_sensor && !frame.camera &&
      frame.given_pose->matrix().isApprox(frame.T_world_sensor.matrix(), 1e-12);
  if (!is_given_for_scan) return advice;
  const std::optional<double> misfit =
      poses_.misfit(points, frame.planes, frame.T_world_sensor, map.params().approximation);
  if (misfit) {
    advice.push_back("frame " + std::to_string(frame.number) + " " + frame.source +
                     ": its given pose does not fit the cloud before: walls seen in both are " +
                     rounded(*misfit, 2) +
                     " m apart, and what stands there may be erased; check the poses, or have "
                     "them found (motion_estimation)");
  }
  return advice;
}

/// Whether two frames in a row stand too far apart to have seen a thing in common.
std::optional<std::string> FrameWatch::apart(const Frame& frame, const PointsView& points) {
  if (is_apart_ || !frame.given_pose || frame.pose_assumed || frame.without_sensor)
    return std::nullopt;
  double squared = 0.0;
  for (const int i : frame.indices)
    squared = std::max(squared, points.point(static_cast<std::size_t>(i)).squaredNorm());
  const double reach = std::sqrt(squared);
  const Vector3 place = frame.given_pose->translation();
  const double step = last_place_ ? (place - *last_place_).norm() : 0.0;
  const double both = last_reach_ + reach;
  const bool is_seen = std::min(last_reach_, reach) > 0.0;
  last_place_ = place;
  last_reach_ = reach;
  if (!is_seen || !(step > both)) return std::nullopt;
  is_apart_ = true;
  return "frame " + std::to_string(frame.number) + " " + frame.source + ": its given pose is " +
         rounded(step, 1) + " m from that of the frame before, and the points of both reach " +
         rounded(both, 1) + " m together: nothing can be seen in both; are the poses in metres?";
}

std::vector<std::string> adviceOn(const Pipeline& pipeline, const RunStatistics& statistics,
                                  const FrameSource& source, bool is_camera) {
  std::vector<std::string> advice;
  const auto add = [&advice](std::optional<std::string> text) {
    if (text) advice.push_back(std::move(*text));
  };
  add(skippedFrames(pipeline, statistics, source));
  const PlanarMap& map = pipeline.map();
  if (const std::size_t beyond = statistics.pointsBeyond(); beyond > 0)
    advice.push_back(
        std::to_string(beyond) +
        " points were dropped: the map reaches 2^20 cells from its origin along each axis");
  constexpr double kNearlyAll = 0.9;
  const double removed = statistics.removedFraction();
  const std::string why =
      rounded(100.0 * removed, 1) +
      " % of the points were removed before: look at the stages that do that (pass_through.max_m, "
      "voxel_grid, outlier filters, ground_removal)";
  if (map.cuboids().empty()) {
    advice.push_back("the map holds no cuboid: " +
                     (removed < kNearlyAll
                          ? "no cell got enough points; look at the stages before the last and at "
                            "min_points_per_cell"
                          : why));
  } else if (map.planes().empty()) {
    advice.push_back("no plane was found: the map holds non-planar cuboids only; " +
                     (removed < kNearlyAll ? "look at min_inliers and distance_threshold_m" : why));
  }
  add(tilt(map, statistics, source, is_camera));
  return advice;
}

}  // namespace planar_mapping::detail
