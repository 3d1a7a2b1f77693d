// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/pose_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/motion_refinement.h"
#include "planar_mapping/localization/pose_evidence.h"
#include "planar_mapping/localization/view_alignment.h"
#include "planar_mapping/localization/view_tracking.h"

namespace planar_mapping::detail {
namespace {

constexpr int kMinInliers = 8;  // of three that fix a pose
// Errors that neighbouring measurements share.
constexpr double kSharedDepthError = 0.005;  // of the median depth
constexpr double kSharedTurn = 0.002;        // radians
constexpr double kLeastPrior = -3.0;         // motions do change suddenly
constexpr double kConfident = 3.0;           // log odds (20 : 1): nothing else is looked for
constexpr double kAlike = 0.5;               // log odds that do not tell
constexpr std::size_t kRefinedStarts = 3;
constexpr double kSameTurn = 5.0 * kRadiansPerDegree;  // optima nearer than this are one,
constexpr double kSameShift = 0.1;                     // and this, of the depth
constexpr std::size_t kOffPlane = 8;         // inliers that fix a pose beside what a plane does
constexpr std::size_t kPlentyOffPlane = 19;  // that more of them say nothing more, see logOdds()

class PoseSearch {
 public:
  PoseSearch(const LocalMap& map, const View& now, const ExpectedPose& expected, int frame_gap)
      : map_(map), now_(now), expected_(expected), frame_gap_(frame_gap) {
    depth_ = now.median_depth > 0.0 ? now.median_depth : map[0].view->median_depth;
    params_.min_matches = kMinInliers;
    params_.min_inliers = kMinInliers;
    params_.max_translation_error = 0.1 * std::max(1.0, depth_);
  }

  std::optional<PoseCandidate> track() {
    const Pose start = alignViews(map_, now_, expected_.T_now_map, AlignLevel::Track).T_now_map;
    const TrackedFeatures tracked = trackFeatures(map_, now_, start);
    Random random(Random::kDefaultSeed);
    const MotionEstimate motion =
        estimateMotion(tracked.matches, now_.camera, params_, random, &start);
    if (!motion.found()) return std::nullopt;
    const Alignment aligned = alignViews(map_, now_, motion.T_now_before, AlignLevel::Refine);
    const Matrix6 of_features = inverseOf(motion.covariance * static_cast<double>(map_.size()));
    const Matrix6 both = aligned.information + of_features;
    PoseCandidate result;
    result.T_now_map = meanOf(motion.T_now_before, of_features, aligned);
    weighCells(map_, now_, result.T_now_map, result.evidence);
    weighFeatures(tracked.matches, tracked.views, tracked.expected, result);
    if (!result.by_features || result.evidence.off_plane < kOffPlane ||
        result.evidence.log_odds < kConfident || !setCovariance(both, result))
      return std::nullopt;
    return result;
  }

  std::optional<PoseCandidate> run() {
    const std::vector<FeaturePair> pairs = matchFeatures(map_, now_);
    const MotionEstimate motion = estimate(pairs, &expected_.T_now_map);
    if (motion.found()) consider(motion.T_now_before);
    if (candidates_.empty() || best().evidence.log_odds < kConfident) searchBySurfaces();
    if (candidates_.empty()) return std::nullopt;
    return againstRivals();
  }

 private:
  MotionEstimate estimate(const std::vector<FeaturePair>& pairs, const Pose* guess) {
    Random random(Random::kDefaultSeed);
    return estimateMotion(featureMatches(map_, now_, pairs), now_.camera, params_, random, guess);
  }

  /// Many starts on the coarse level, the best of them on the fine one.
  void searchBySurfaces() {
    struct Optimum {
      Pose T_now_map;
      double score;
    };
    std::vector<Pose> starts = {expected_.T_now_map, Pose::Identity()};
    if (!candidates_.empty()) starts.push_back(best().T_now_map);
    for (const Pose& start : startsAround(expected_.T_now_map, depth_)) starts.push_back(start);
    std::vector<Optimum> optima;
    for (const Pose& start : starts) {
      const Pose found = alignViews(map_, now_, start, AlignLevel::Search).T_now_map;
      const bool known = std::any_of(optima.begin(), optima.end(), [&](const Optimum& other) {
        return isSame(other.T_now_map, found);
      });
      if (known) continue;
      PoseEvidence evidence;
      weighCells(map_, now_, found, evidence);
      optima.push_back({found, logOdds(evidence, false) + priorOf(found)});
    }
    std::stable_sort(optima.begin(), optima.end(),
                     [](const Optimum& a, const Optimum& b) { return a.score > b.score; });
    for (std::size_t i = 0; i < std::min(kRefinedStarts, optima.size()); ++i)
      consider(optima[i].T_now_map);
  }

  /// Where all that agrees is on one plane, the same may be there again: panels, tiles, windows.
  void searchRivals() {
    // Of the depth: as far as half of the view is still seen.
    constexpr std::array<double, 8> kShifts = {-0.75, -0.5, -0.3, -0.15, 0.15, 0.3, 0.5, 0.75};
    const Pose T_now_map = best().T_now_map;
    std::vector<Pose> starts = {expected_.T_now_map};
    for (int axis = 0; axis < 3; ++axis) {
      for (const double shift : kShifts) {
        starts.push_back(T_now_map);
        starts.back().translation()[axis] += shift * depth_;
      }
    }
    for (const Pose& start : starts) {
      const Pose found = alignViews(map_, now_, start, AlignLevel::Search).T_now_map;
      const bool known =
          std::any_of(candidates_.begin(), candidates_.end(),
                      [&](const PoseCandidate& other) { return isSame(other.T_now_map, found); });
      if (!known) consider(found);
    }
  }

  /// The best one; its odds are those against all other explanations.
  PoseCandidate againstRivals() {
    const bool on_plane = best().evidence.off_plane < kOffPlane;
    if (on_plane) searchRivals();
    PoseCandidate result = best();
    PoseEvidence& evidence = result.evidence;
    for (const PoseCandidate& other : candidates_) {
      if (isSame(other.T_now_map, result.T_now_map)) continue;
      evidence.rival += std::exp(other.evidence.log_odds - evidence.log_odds);
    }
    if (on_plane && result.by_features) {
      // What speaks against planes is that there may be rivals, which are known by now.
      PoseEvidence sought = evidence;
      sought.off_plane = kPlentyOffPlane;
      evidence.log_odds += logOdds(sought, true) - logOdds(evidence, true);
    }
    evidence.log_odds = -std::log(std::exp(-evidence.log_odds) + evidence.rival);
    return result;
  }

  const PoseCandidate& best() const {
    return *std::max_element(candidates_.begin(), candidates_.end(),
                             [](const PoseCandidate& a, const PoseCandidate& b) {
                               return a.evidence.log_odds < b.evidence.log_odds;
                             });
  }

  bool isSame(const Pose& a, const Pose& b) const {
    const Vector6 off = motionDifference(a, b);
    return off.tail<3>().norm() < kSameTurn && off.head<3>().norm() < kSameShift * depth_;
  }

  /// Adds the pose, refined.
  void consider(const Pose& start) {
    std::optional<PoseCandidate> candidate = refined(start);
    if (candidate) candidates_.push_back(std::move(*candidate));
  }

  std::optional<PoseCandidate> refined(const Pose& start) {
    const Alignment aligned = alignViews(map_, now_, start, AlignLevel::Refine);
    Matrix6 information = aligned.information;
    PoseCandidate by_surfaces = weighed(aligned.T_now_map);
    const GuidedPairs guided = guidedPairs(map_, now_, start);
    const MotionEstimate motion = estimate(guided.pairs, &start);
    PoseCandidate result = by_surfaces;
    if (motion.found()) {
      PoseCandidate by_features = weighed(motion.T_now_before);
      const Matrix6 of_features = inverseOf(motion.covariance * distinctness(guided.pairs));
      const Matrix6 both = aligned.information + of_features;
      PoseCandidate mean = weighed(meanOf(motion.T_now_before, of_features, aligned));
      result = std::move(mean);
      information = both;
      if (by_features.evidence.log_odds > result.evidence.log_odds + kAlike) {
        result = std::move(by_features);
        information = of_features;
      }
      if (by_surfaces.evidence.log_odds > result.evidence.log_odds + kAlike) {
        result = std::move(by_surfaces);
        information = aligned.information;
      }
    }
    if (!setCovariance(information, result)) return std::nullopt;
    return result;
  }

  /// Of two poses by their information.
  static Pose meanOf(const Pose& by_features, const Matrix6& information,
                     const Alignment& aligned) {
    const Matrix6 both = aligned.information + information;
    const Vector6 step = Eigen::LDLT<Eigen::Matrix<double, 6, 6>>(both).solve(
        aligned.information * motionDifference(by_features, aligned.T_now_map));
    return motionStep(step) * by_features;
  }

  /// \return false if a direction is open
  bool setCovariance(const Matrix6& information, PoseCandidate& candidate) const {
    Vector6 shared;
    shared << Vector3::Constant(std::pow(kSharedDepthError * depth_, 2)),
        Vector3::Constant(kSharedTurn * kSharedTurn);
    candidate.covariance = inverseOf(information);
    if (!candidate.covariance.allFinite() || candidate.covariance.diagonal().minCoeff() <= 0.0)
      return false;
    candidate.independent = candidate.covariance;
    candidate.covariance.diagonal() += shared;
    return true;
  }

  static Matrix6 inverseOf(const Matrix6& m) {
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> solver(m);
    const Matrix6 inverse = solver.solve(Eigen::Matrix<double, 6, 6>::Identity());
    return 0.5 * (inverse + inverse.transpose());
  }

  /// Pairs over features of the frame in them: several views of the map have the same feature.
  static double distinctness(const std::vector<FeaturePair>& pairs) {
    std::vector<std::size_t> now;
    for (const FeaturePair& pair : pairs) now.push_back(pair.now);
    makeDistinct(now);
    return static_cast<double>(pairs.size()) / static_cast<double>(now.size());
  }

  PoseCandidate weighed(const Pose& T_now_map) const {
    PoseCandidate candidate;
    candidate.T_now_map = T_now_map;
    PoseEvidence& evidence = candidate.evidence;
    weighCells(map_, now_, T_now_map, evidence);
    const GuidedPairs guided = guidedPairs(map_, now_, T_now_map);
    const std::vector<FeatureMatch> matches = featureMatches(map_, now_, guided.pairs);
    std::vector<std::size_t> views, expected(map_.size(), 0);
    for (const FeaturePair& pair : guided.pairs) views.push_back(pair.view);
    for (const FeaturePair& pair : guided.expected) ++expected[pair.view];
    weighFeatures(matches, views, expected, candidate);
    return candidate;
  }

  /// Features at a pose, and what all says together.
  void weighFeatures(const std::vector<FeatureMatch>& matches,
                     const std::vector<std::size_t>& views,
                     const std::vector<std::size_t>& expected, PoseCandidate& candidate) const {
    PoseEvidence& evidence = candidate.evidence;
    const double gate = params_.inlier_sigmas * params_.inlier_sigmas;
    std::vector<std::uint8_t> is_inlier(matches.size(), 0);
    std::vector<std::size_t> inliers(map_.size(), 0);
    std::size_t all = 0;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (squaredError(matches[i], now_.camera, candidate.T_now_map) > gate) continue;
      is_inlier[i] = 1;
      ++inliers[views[i]];
      ++all;
    }
    // Views farther away see less of the same: the one that agrees best tells.
    double most = -1.0;
    for (std::size_t k = 0; k < map_.size(); ++k) {
      PoseEvidence here;
      here.inliers = inliers[k];
      here.expected = std::max(expected[k], inliers[k]);
      if (here.seenAgain() <= most) continue;
      most = here.seenAgain();
      evidence.inliers = here.inliers;
      evidence.expected = here.expected;
    }
    Random random(Random::kDefaultSeed);
    evidence.off_plane = offPlane(matches, is_inlier, random);
    candidate.by_features = all >= static_cast<std::size_t>(kMinInliers);
    evidence.log_odds = logOdds(evidence, candidate.by_features) + priorOf(candidate.T_now_map);
    if (!candidate.by_features) evidence.log_odds -= frame_gap_ - 1;
  }

  double priorOf(const Pose& T_now_map) const {
    if (!(expected_.translation_sigma > 0.0)) return 0.0;
    const Vector6 off = motionDifference(expected_.T_now_map, T_now_map);
    const double t = off.head<3>().norm() / expected_.translation_sigma;
    const double r = off.tail<3>().norm() / expected_.rotation_sigma;
    return std::max(kLeastPrior, -0.5 * (t * t + r * r));
  }

  const LocalMap& map_;
  const View& now_;
  const ExpectedPose& expected_;
  int frame_gap_;
  double depth_ = 1.0;
  MotionParams params_;
  std::vector<PoseCandidate> candidates_;
};

}  // namespace

std::optional<PoseCandidate> trackPose(const LocalMap& map, const View& now,
                                       const ExpectedPose& expected) {
  if (map.empty()) return std::nullopt;
  return PoseSearch(map, now, expected, 1).track();
}

std::optional<PoseCandidate> searchPose(const LocalMap& map, const View& now,
                                        const ExpectedPose& expected, int frame_gap) {
  if (map.empty()) return std::nullopt;
  return PoseSearch(map, now, expected, frame_gap).run();
}

}  // namespace planar_mapping::detail
