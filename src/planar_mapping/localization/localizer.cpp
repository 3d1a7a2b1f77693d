// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/localizer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/pose_evidence.h"
#include "planar_mapping/localization/pose_search.h"
#include "planar_mapping/stereo/opencv_threads.h"

namespace planar_mapping {

class Localizer::Impl {
 public:
  explicit Impl(const LocalizerParams& params) : params_(params) { params_.validate(); }

  Localization locate(const LocalizerFrame& frame) {
    io::requireSound(frame.gray, "gray");
    if (frame.gray.channels != 1) throw InputError("the image of a frame has to be gray");
    if (static_cast<int>(frame.cloud.width) != frame.gray.width ||
        static_cast<int>(frame.cloud.height) != frame.gray.height)
      throw InputError("the cloud of a frame has to be as large as its image");
    const detail::OpenCvThreads one(1);
    detail::View view = detail::makeView(frame, params_.noise);
    Localization result = place(view, frame);
    remember(std::move(view), frame, result);
    joinBefore(result);
    return result;
  }

  std::size_t submaps() const { return submaps_; }

 private:
  /// A keyframe, or the last frame.
  struct Key {
    detail::View view;
    Pose T_submap_camera = Pose::Identity();
    std::size_t submap = 0;
    std::size_t frame = 0;
    bool is_keyframe = true;
  };

  /// How the camera moved last in a submap.
  struct Track {
    Pose T_submap_camera = Pose::Identity();
    Pose T_before_now = Pose::Identity();
    bool has_step = false;
    std::size_t frame = 0;
    std::size_t frames = 0;
    std::optional<Pose> prior;  ///< of that frame
  };

  static constexpr std::size_t kMapKeys = 3;    // keyframes of a local map
  static constexpr std::size_t kKeptKeys = 24;  // keyframes that are remembered
  // A camera moves as before, changed by half of it and by this.
  static constexpr double kVelocityChange = 0.5;
  static constexpr double kFreeShift = 0.1;  // metres
  static constexpr double kFreeTurn = 0.2;   // radians

  Localization place(detail::View& view, const LocalizerFrame& frame) {
    Localization result;
    std::vector<std::size_t> submaps;  // the newest first
    for (auto key = keys_.rbegin(); key != keys_.rend(); ++key) {
      if (std::find(submaps.begin(), submaps.end(), key->submap) == submaps.end())
        submaps.push_back(key->submap);
    }
    constexpr std::size_t kTried = 2;
    submaps.resize(std::min(submaps.size(), kTried));
    bool placed = false;
    for (const std::size_t submap : submaps) {
      Localization here;
      const bool found = placeIn(submap, view, frame, here);
      if (found > placed ||
          (found == placed &&
           (submap == submaps[0] || here.evidence.log_odds > result.evidence.log_odds)))
        result = here;
      placed = placed || found;
      const auto frames = std::count_if(keys_.begin(), keys_.end(),
                                        [&](const Key& key) { return key.submap == submap; });
      if (found && frames > 1) break;  // one that begins need not go on
    }
    if (placed) return result;
    if (frame.prior && !submaps.empty() && tracks_.at(submaps[0]).prior)
      return followPrior(submaps[0], frame, result.evidence);
    result.submap = submaps_++;
    result.begins_submap = true;
    result.is_keyframe = true;
    return result;
  }

  /// By the steps between guesses alone.
  Localization followPrior(std::size_t submap, const LocalizerFrame& frame,
                           const PoseEvidence& evidence) const {
    const Track& track = tracks_.at(submap);
    Localization result;
    result.submap = submap;
    result.is_keyframe = true;
    result.T_submap_camera = track.T_submap_camera * (track.prior->inverse() * *frame.prior);
    result.covariance_in_camera =
        static_cast<double>(frames_ - track.frame) * frame.prior_covariance;
    result.drift_in_camera = result.covariance_in_camera;
    result.covariance = turnedCovariance(result.T_submap_camera, result.covariance_in_camera);
    result.evidence = evidence;
    return result;
  }

  bool placeIn(std::size_t submap, detail::View& view, const LocalizerFrame& frame,
               Localization& result) {
    const Track& track = tracks_.at(submap);
    const auto gap = static_cast<double>(frames_ - track.frame);
    detail::ExpectedPose expected;
    const Pose T_submap_expected = expectedPose(track, frame, gap, expected);
    const std::vector<Key*> nearest = nearestKeys(submap, T_submap_expected);
    const auto [map, T_submap_map] = localMap(nearest);
    detail::LocalMap keyframes;
    for (const detail::PlacedView& placed : map)
      if (!placed.view->corners.empty()) keyframes.push_back(placed);
    expected.T_now_map = T_submap_expected.inverse() * T_submap_map;
    std::optional<detail::PoseCandidate> found;
    if (track.frame + 1 == frames_) found = detail::trackPose(keyframes, view, expected);
    if (!found) {
      for (Key* key : nearest) detail::addFeatures(key->view);
      detail::addFeatures(view);
      found = detail::searchPose(map, view, expected, static_cast<int>(gap));
    }
    if (!found || found->evidence.log_odds < params_.min_log_odds) {
      if (found) result.evidence = found->evidence;
      return false;
    }
    result.submap = submap;
    result.T_submap_camera = T_submap_map * found->T_now_map.inverse();
    result.evidence = found->evidence;
    result.covariance_in_camera = found->covariance;
    result.covariance = turnedCovariance(result.T_submap_camera, found->covariance);
    result.is_keyframe = true;
    for (std::size_t k = 0; k < map.size(); ++k) {
      if (!nearest[k]->is_keyframe) continue;
      PoseEvidence beside;
      detail::weighCells({map[k]}, view, found->T_now_map, beside);
      if (beside.overlap >= params_.keyframe_overlap) result.is_keyframe = false;
    }
    if (result.is_keyframe) result.drift_in_camera = found->independent;
    return true;
  }

  /// Looks for the last frame before a submap among the first two of it.
  void joinBefore(Localization& result) {
    const std::size_t submap = result.submap;
    const Track& track = tracks_.at(submap);
    if (track.frames != 2 || !track.has_step) return;
    const auto last = std::find_if(keys_.rbegin(), keys_.rend(),
                                   [&](const Key& key) { return key.submap != submap; });
    if (last == keys_.rend()) return;
    const std::size_t gap = track.frame - 1 - last->frame;
    detail::ExpectedPose expected;
    const Pose T_submap_expected =
        movedOn(track.T_submap_camera * track.T_before_now.inverse(), track.T_before_now.inverse(),
                static_cast<double>(gap), expected);
    const std::vector<Key*> nearest = nearestKeys(submap, T_submap_expected);
    for (Key* key : nearest) detail::addFeatures(key->view);
    const auto [map, T_submap_map] = localMap(nearest);
    expected.T_now_map = T_submap_expected.inverse() * T_submap_map;
    const std::optional<detail::PoseCandidate> found =
        detail::searchPose(map, last->view, expected, static_cast<int>(gap));
    if (!found || found->evidence.log_odds < params_.min_log_odds) return;
    JoinedSubmap joined;
    joined.submap = submap;
    joined.T_other_submap =
        last->T_submap_camera * (T_submap_map * found->T_now_map.inverse()).inverse();
    joined.covariance = turnedCovariance(last->T_submap_camera, found->covariance);
    moveInto(last->submap, joined, result);
  }

  /// What is in a submap is in the other one from now on.
  void moveInto(std::size_t other, const JoinedSubmap& joined, Localization& result) {
    for (Key& key : keys_) {
      if (key.submap != joined.submap) continue;
      key.submap = other;
      key.T_submap_camera = joined.T_other_submap * key.T_submap_camera;
    }
    Track moved = tracks_.at(joined.submap);
    moved.T_submap_camera = joined.T_other_submap * moved.T_submap_camera;
    moved.frames += tracks_.at(other).frames;
    tracks_[other] = moved;
    tracks_.erase(joined.submap);
    result.submap = other;
    result.T_submap_camera = moved.T_submap_camera;
    result.covariance_in_camera +=
        turnedCovariance(moved.T_submap_camera.inverse(), joined.covariance);
    result.drift_in_camera += turnedCovariance(moved.T_submap_camera.inverse(), joined.covariance);
    result.covariance = turnedCovariance(result.T_submap_camera, result.covariance_in_camera);
    result.joined = joined;
  }

  struct PlacedMap {
    detail::LocalMap views;
    Pose T_submap_map;
  };
  /// The views of keyframes, in the frame of the first.
  static PlacedMap localMap(const std::vector<Key*>& keys) {
    PlacedMap map{{}, keys[0]->T_submap_camera};
    for (const Key* key : keys)
      map.views.push_back({&key->view, map.T_submap_map.inverse() * key->T_submap_camera});
    return map;
  }

  /// By the motion before, or by the steps of given poses.
  Pose expectedPose(const Track& track, const LocalizerFrame& frame, double gap,
                    detail::ExpectedPose& expected) const {
    if (frame.prior && track.prior) {
      const Vector6 variance = frame.prior_covariance.diagonal();
      expected.translation_sigma = std::sqrt(variance.head<3>().maxCoeff() * gap);
      expected.rotation_sigma = std::sqrt(variance.tail<3>().maxCoeff() * gap);
      return track.T_submap_camera * (track.prior->inverse() * *frame.prior);
    }
    if (!track.has_step) return track.T_submap_camera;
    return movedOn(track.T_submap_camera, track.T_before_now, gap, expected);
  }

  /// \param step  of the frame before
  /// \param gap   steps from a pose to the expected one
  static Pose movedOn(const Pose& from, const Pose& step, double gap,
                      detail::ExpectedPose& expected) {
    const Vector6 size = motionDifference(Pose::Identity(), step);
    expected.translation_sigma = gap * (kVelocityChange * size.head<3>().norm() + kFreeShift);
    expected.rotation_sigma = gap * (kVelocityChange * size.tail<3>().norm() + kFreeTurn);
    Pose moved = from;
    for (int i = 0; i < static_cast<int>(gap); ++i) moved = moved * step;
    return moved;
  }

  /// The latest keyframe of a submap, and those nearest to a pose.
  std::vector<Key*> nearestKeys(std::size_t submap, const Pose& T_submap_camera) {
    std::vector<Key*> keys;
    for (auto key = keys_.rbegin(); key != keys_.rend(); ++key) {
      if (key->submap == submap) keys.push_back(&*key);
    }
    const auto distance = [&](const Key* key) {
      constexpr double kTurnOfDepth = 0.5;  // radians: half a view, as is a shift by the depth
      const Pose off = key->T_submap_camera.inverse() * T_submap_camera;
      return off.translation().norm() / std::max(0.1, key->view.median_depth) +
             rotationAngle(off.linear()) / kTurnOfDepth;
    };
    std::stable_sort(keys.begin() + 1, keys.end(),
                     [&](const Key* a, const Key* b) { return distance(a) < distance(b); });
    keys.resize(std::min(keys.size(), kMapKeys));
    return keys;
  }

  void remember(detail::View&& view, const LocalizerFrame& frame, const Localization& result) {
    Track& track = tracks_[result.submap];
    track.has_step = !result.begins_submap && track.frame + 1 == frames_;
    if (track.has_step)
      track.T_before_now = track.T_submap_camera.inverse() * result.T_submap_camera;
    track.T_submap_camera = result.T_submap_camera;
    track.frame = frames_;
    ++track.frames;
    track.prior = frame.prior;
    if (!keys_.empty() && !keys_.back().is_keyframe) {
      if (result.begins_submap)
        keys_.back().is_keyframe = true;  // it was looked for in vain: it has features
      else
        keys_.pop_back();
    }
    if (result.is_keyframe) detail::addCorners(view);
    keys_.push_back(
        {std::move(view), result.T_submap_camera, result.submap, frames_, result.is_keyframe});
    if (keys_.size() > kKeptKeys) keys_.erase(keys_.begin());
    ++frames_;
  }

  LocalizerParams params_;
  std::vector<Key> keys_;
  std::size_t submaps_ = 0;
  std::size_t frames_ = 0;
  std::map<std::size_t, Track> tracks_;  ///< by submap
};

Localizer::Localizer(const LocalizerParams& params) : impl_(std::make_unique<Impl>(params)) {}
Localizer::~Localizer() = default;
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;

Localization Localizer::locate(const LocalizerFrame& frame) {
  return impl_->locate(frame);
}

std::size_t Localizer::submaps() const {
  return impl_->submaps();
}

}  // namespace planar_mapping
