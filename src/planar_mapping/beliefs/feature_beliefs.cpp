// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/feature_beliefs.h"

#include <algorithm>
#include <limits>
#include <string>

#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

using Observation = FeatureBeliefs::Observation;

// One observation per track, ascending by track, so that the order of features does not matter.
std::vector<Observation> perTrack(std::vector<Observation> frame) {
  std::sort(frame.begin(), frame.end(), [](const Observation& a, const Observation& b) {
    if (a.track != b.track) return a.track < b.track;
    if (a.probability != b.probability) return a.probability < b.probability;
    return std::lexicographical_compare(a.position.data(), a.position.data() + 3, b.position.data(),
                                        b.position.data() + 3);
  });
  std::vector<Observation> merged;
  for (std::size_t first = 0; first < frame.size();) {
    Observation mean{frame[first].track, Vector3::Zero(), 0.0, true};
    std::size_t last = first;
    for (; last < frame.size() && frame[last].track == mean.track; ++last) {
      mean.position += frame[last].position;
      mean.probability += frame[last].probability;
      mean.keeps = mean.keeps && frame[last].keeps;
    }
    const double count = static_cast<double>(last - first);
    mean.position /= count;
    mean.probability = std::clamp(mean.probability / count, 0.0, 1.0);
    merged.push_back(mean);
    first = last;
  }
  return merged;
}

void requireValid(const std::vector<Observation>& frame) {
  for (const Observation& seen : frame) {
    if (seen.track < 0) throw InputError("track " + std::to_string(seen.track) + " is negative");
    requireInRange("probability", seen.probability, 0.0, 1.0);
    for (int i = 0; i < 3; ++i) {
      requireInRange("position", seen.position[i], -FeatureBeliefs::kFarthest,
                     FeatureBeliefs::kFarthest, "m");
    }
  }
}

}  // namespace

void FrameMotion::validate() const {
  requireRigid("a motion", T_now_before);
  if (predicted) requireRigid("a predicted motion", *predicted);
  // Throws for a covariance that is none.
  motionFactor(Vector6(Vector6::Zero()), covariance);
}

void FeatureBeliefParams::validate() const {
  occupancy.validate();
  update.validate();
  requireInRange("motion_reading", static_cast<int>(motion_reading), 0,
                 static_cast<int>(MotionReading::RobotPose));
  requireInRange("max_unseen_frames", max_unseen_frames, 0, std::numeric_limits<int>::max());
}

FeatureBeliefs::FeatureBeliefs(const FeatureBeliefParams& params) {
  setParams(params);
}

void FeatureBeliefs::setParams(const FeatureBeliefParams& params) {
  params.validate();
  params_ = params;
}

FeatureBeliefs::Summary FeatureBeliefs::update(const std::vector<Observation>& frame,
                                               const std::optional<FrameMotion>& motion) {
  requireValid(frame);
  if (motion) motion->validate();

  double pose_factor = 1.0;
  if (motion) {
    now_.T_sensor_chain = motion->T_now_before * now_.T_sensor_chain;
    // [ours] The errors of the frames add up; the lever arm between them is neglected.
    now_.covariance += motion->covariance;
    if (motion->predicted && params_.motion_reading == MotionReading::RobotPose) {
      pose_factor = poseMotionFactor(motion->T_now_before, *motion->predicted, motion->covariance);
    }
  } else {
    const std::int64_t chain = now_.chain + 1;
    now_ = Place();
    now_.chain = chain;
  }
  ++frame_;

  Summary summary;
  for (const Observation& seen : perTrack(frame)) {
    const auto [place, is_new] = known_.try_emplace(seen.track);
    Track& track = place->second;
    if (is_new) {
      track.belief = firstBelief(seen.probability, params_.update);
      ++summary.created;
    } else {
      if (!seen.keeps) {
        const double factor = factorOf(track, seen.position, pose_factor);
        track.belief = nextBelief(track.belief, seen.probability, factor, params_.update);
      }
      leave(track.frame);
      ++summary.updated;
    }
    track.position = seen.position;
    track.frame = frame_;
  }
  Place& here = seen_in_[frame_] = now_;
  here.tracks = summary.created + summary.updated;
  if (here.tracks == 0) seen_in_.erase(frame_);
  summary.forgotten = forgetUnseen();
  summary.unseen = known_.size() - summary.created - summary.updated;
  return summary;
}

double FeatureBeliefs::factorOf(const Track& track, const Vector3& position,
                                double pose_factor) const {
  if (params_.motion_reading == MotionReading::RobotPose) return pose_factor;
  const Place& then = seen_in_.at(track.frame);
  if (then.chain != now_.chain) return 1.0;
  return featureMotionFactor(position, track.position,
                             now_.T_sensor_chain * then.T_sensor_chain.inverse(),
                             now_.covariance - then.covariance, params_.occupancy);
}

/// A track is no longer one that was last seen in the frame.
void FeatureBeliefs::leave(std::int64_t frame) {
  const auto place = seen_in_.find(frame);
  if (--place->second.tracks == 0) seen_in_.erase(place);
}

std::size_t FeatureBeliefs::forgetUnseen() {
  if (params_.max_unseen_frames == 0) return 0;
  std::size_t forgotten = 0;
  for (auto track = known_.begin(); track != known_.end();) {
    if (frame_ - track->second.frame > params_.max_unseen_frames) {
      leave(track->second.frame);
      track = known_.erase(track);
      ++forgotten;
    } else {
      ++track;
    }
  }
  return forgotten;
}

std::optional<double> FeatureBeliefs::belief(std::int64_t track) const {
  const auto place = known_.find(track);
  if (place == known_.end()) return std::nullopt;
  return place->second.belief;
}

std::vector<std::int64_t> FeatureBeliefs::tracks() const {
  std::vector<std::int64_t> all;
  all.reserve(known_.size());
  for (const auto& [track, state] : known_) all.push_back(track);
  std::sort(all.begin(), all.end());
  return all;
}

void FeatureBeliefs::clear() {
  known_.clear();
  seen_in_.clear();
  now_ = Place();
  frame_ = 0;
}

}  // namespace planar_mapping
