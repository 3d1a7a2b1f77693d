// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_builder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/atlas/keyframe_maker.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {
namespace {

/// Views that differ by less show the same place from the same side.
constexpr double kKeyframeStep = 0.25;                      // metres
constexpr double kKeyframeTurn = 15.0 * kRadiansPerDegree;  // radians
/// What a motion's covariance does not say: time stamps, calibration.
constexpr double kLeastShift = 0.001;  // metres, a step
constexpr double kLeastTurn = 0.0003;  // radians, a step
/// Of given poses: slip and bias, as odometers have them.
constexpr double kDrift = 0.02;                         // of the way, and of a turn about its axis
constexpr double kTurnDrift = 0.3 * kRadiansPerDegree;  // radians a metre
// So far such an error goes on in one direction; beyond that variances add up.
constexpr double kSteadyWay = 10.0;         // metres
constexpr double kSteadyTurn = 2.0 * M_PI;  // radians

Matrix6 covarianceOf(const Pose& step, bool is_given) {
  Vector6 variance;
  variance << Vector3::Constant(kLeastShift * kLeastShift),
      Vector3::Constant(kLeastTurn * kLeastTurn);
  Matrix6 covariance = variance.asDiagonal();
  if (!is_given) return covariance;
  const double way = kSteadyWay * step.translation().norm();
  variance << Vector3::Constant(kDrift * kDrift * way),
      Vector3::Constant(kTurnDrift * kTurnDrift * way);
  covariance.diagonal() += variance;
  const Eigen::AngleAxisd turn(step.linear());
  covariance.bottomRightCorner<3, 3>() +=
      kDrift * kDrift * kSteadyTurn * turn.angle() * turn.axis() * turn.axis().transpose();
  return covariance;
}

}  // namespace

void SubmapParams::validate() const {
  if (frames < 1) throw ParameterError("SubmapParams: frames must be at least 1");
  if (!(path > 0.0)) throw ParameterError("SubmapParams: path must be above 0");
}

AtlasBuilder::AtlasBuilder(const SubmapParams& params, const PlanarMapParams& map,
                           AtlasSession session, AtlasData known)
    : params_(params), map_params_(map), data_(std::move(known)) {
  params_.validate();
  requireFits(data_, map_params_);
  session.id = detail::nextId(data_.sessions);
  session_ = session.id;
  data_.sessions.push_back(std::move(session));
  for (const Keyframe& key : data_.keyframes) places_.add(key);
  stored_ = earlier_ = data_.submaps.size();
}

PlanarMap& AtlasBuilder::mapForNext(std::size_t track) {
  const bool is_full = open_ && (open_->frames() >= static_cast<std::size_t>(params_.frames) ||
                                 path_ >= params_.path || (is_closed_ && open_->frames() > 0));
  if (!open_ || is_full || track != open_track_) begin(track);
  is_joined_ = false;
  return *open_;
}

/// The next submap lies where the last one of its track does: what moved that moved all after it.
void AtlasBuilder::begin(std::size_t track) {
  Submap next;
  next.id = detail::nextId(data_.submaps);
  next.session = session_;
  next.component = next.id;
  if (open_) {
    closed_bytes_ += open_->memoryBytes();
    const Submap& last = data_.submaps.back();
    joined_.set(static_cast<std::int32_t>(last.id), last.map, last.T_world_submap);
  }
  const auto [known, is_new] = tracks_.try_emplace(track);
  if (!is_new) {
    const Submap& last = detail::rowOf(data_.submaps, known->second.submap);
    next.component = last.component;
    next.T_world_submap = last.T_world_submap;
    Link link;
    link.id = detail::nextId(data_.links);
    link.kind = LinkKind::Neighbour;
    link.from_submap = last.id;
    link.to_submap = next.id;
    data_.links.push_back(link);  // its covariance takes the step into the submap
  }
  is_entering_ = !is_new;
  known->second.submap = next.id;
  open_track_ = track;
  open_ = std::make_shared<PlanarMap>(map_params_);
  next.map = open_;
  data_.submaps.push_back(std::move(next));
  last_keyframe_.reset();
  is_closed_ = false;
  path_ = 0.0;
}

AtlasBuilder::Update AtlasBuilder::add(const Seen& seen) {
  Update update;
  Track& track = tracks_.at(open_track_);
  if (track.last_frame) {
    const Pose step = seen.T_track_sensor.inverse() * *track.last_frame;
    path_ += step.translation().norm();
    track.drift = turnedCovariance(step, track.drift);
    track.drift += covarianceOf(step, !seen.drift);
    if (seen.drift) track.drift += *seen.drift;
  }
  if (is_entering_) {
    data_.links.back().covariance = turnedCovariance(seen.T_track_sensor, track.drift);
    track.drift.setZero();
    is_entering_ = false;
  }
  track.last_frame = seen.T_track_sensor;
  if (seen.joined) {
    linkTrack(*seen.joined);
    update.moved = solvePoseGraph(data_).moved;
  }
  if (seen.gray == nullptr && seen.cloud.size == 0) return update;
  if (last_keyframe_) {
    const Pose since = last_keyframe_->inverse() * seen.T_track_sensor;
    if (since.translation().norm() < kKeyframeStep && rotationAngle(since.linear()) < kKeyframeTurn)
      return update;
  }
  last_keyframe_ = seen.T_track_sensor;
  update.links = findLoops(seen);
  if (update.links.empty()) return update;
  for (Link& link : update.links) {
    link.id = detail::nextId(data_.links);
    data_.links.push_back(link);
  }
  for (const std::int64_t moved : solvePoseGraph(data_).moved)
    if (std::find(update.moved.begin(), update.moved.end(), moved) == update.moved.end())
      update.moved.push_back(moved);
  const auto found = static_cast<std::ptrdiff_t>(update.links.size());
  update.links.assign(data_.links.end() - found, data_.links.end());
  is_joined_ = is_joined_ && update.moved.empty();
  return update;
}

/// Of a frame that is remembered from now on, by its image or else by its cloud.
std::vector<Link> AtlasBuilder::findLoops(const Seen& seen) {
  const std::int64_t submap = data_.submaps.back().id;
  std::vector<std::int64_t> neighbours;
  for (const Link& link : data_.links)
    if (link.kind == LinkKind::Neighbour && link.to_submap == submap)
      neighbours.push_back(link.from_submap);
  Keyframe key = seen.gray != nullptr ? makeKeyframe(*seen.gray, seen.cloud, seen.camera)
                                      : makeKeyframe(seen.cloud, seen.is_scan);
  if (seen.gray == nullptr && key.points.empty()) return {};
  key.id = detail::nextId(data_.keyframes);
  key.submap = submap;
  key.frame = seen.frame;
  key.source = seen.source;
  key.timestamp = seen.timestamp;
  key.T_submap_keyframe = seen.T_track_sensor;
  std::vector<Link> links = places_.links(key, data_, neighbours);
  places_.add(key);
  data_.keyframes.push_back(std::move(key));
  return links;
}

/// Of the last submap of that track to the open one.
void AtlasBuilder::linkTrack(const JoinedSubmap& joined) {
  const auto other = tracks_.find(joined.submap);
  if (other == tracks_.end()) return;  // none of its frames is in a map
  Link link;
  link.id = detail::nextId(data_.links);
  link.kind = LinkKind::Neighbour;
  link.from_submap = other->second.submap;
  link.to_submap = data_.submaps.back().id;
  link.T_to_from = joined.T_other_submap;
  link.covariance = joined.covariance;
  data_.links.push_back(link);
  tracks_.erase(other);
}

void AtlasBuilder::finish() {
  is_over_ = true;
  is_joined_ = false;
}

const PlanarMap& AtlasBuilder::map() {
  updateJoined();
  return joined_.map();
}

void AtlasBuilder::updateJoined() {
  if (is_joined_ || !open_) return;
  const std::int64_t component = data_.submaps[earlier_].component;
  for (const Submap& submap : data_.submaps) {
    const auto id = static_cast<std::int32_t>(submap.id);
    if (submap.component != component) {
      if (joined_.contains(id)) joined_.remove(id);
    } else if (submap.map == open_) {
      joined_.set(id, std::make_shared<const PlanarMap>(*open_), submap.T_world_submap);
    } else if (joined_.contains(id) &&
               (!is_over_ || joined_.pose(id).matrix() == submap.T_world_submap.matrix())) {
      joined_.move(id, submap.T_world_submap);
    } else {
      joined_.set(id, submap.map, submap.T_world_submap);
    }
  }
  is_joined_ = true;
}

bool AtlasBuilder::store(const Write& write, std::size_t least_frames) {
  const std::size_t whole = data_.submaps.size() - (open_ && !is_over_ ? 1 : 0);
  std::size_t frames = 0;
  for (std::size_t i = earlier_; i < whole; ++i) frames += data_.submaps[i].map->frames();
  if (whole <= stored_ || frames < least_frames) return false;
  const std::int64_t first = data_.submaps[stored_].id;
  const std::int64_t end = data_.submaps[whole - 1].id + 1;
  AtlasData added;
  AtlasData solved;
  if (stored_ == earlier_) added.sessions.push_back(data_.sessions.back());
  const auto division = data_.submaps.begin() + static_cast<std::ptrdiff_t>(stored_);
  solved.submaps.assign(data_.submaps.begin(), division);
  added.submaps.assign(division, data_.submaps.begin() + static_cast<std::ptrdiff_t>(whole));
  for (const Keyframe& key : data_.keyframes)
    if (key.submap >= first && key.submap < end) added.keyframes.push_back(key);
  for (const Link& link : data_.links) {
    const std::int64_t later = std::max(link.from_submap, link.to_submap);
    if (later < end) (later < first ? solved : added).links.push_back(link);
  }
  write(added, solved);
  stored_ = whole;
  return true;
}

std::vector<std::pair<std::int64_t, AtlasBuilder::Trajectory>> AtlasBuilder::trajectories() const {
  std::vector<std::pair<std::int64_t, Trajectory>> all;
  for (std::size_t i = earlier_; i < data_.submaps.size(); ++i) {
    const Submap& submap = data_.submaps[i];
    auto part = std::find_if(all.begin(), all.end(),
                             [&](const auto& one) { return one.first == submap.component; });
    if (part == all.end()) part = all.insert(part, {submap.component, {}});
    for (const auto& [timestamp, T_submap_sensor] : submap.map->trajectory())
      part->second.emplace_back(timestamp, submap.T_world_submap * T_submap_sensor);
  }
  return all;
}

std::size_t AtlasBuilder::memoryBytes() const {
  return closed_bytes_;
}

}  // namespace planar_mapping
