// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/detail/view_map.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "cv_image.h"
#include "planar_mapping/core/base/detail/state_archive.h"
#include "planar_mapping/core/base/error.h"
#include "views/view.h"

namespace planar_mapping {
void ViewMapParams::validate() const {
  camera.validate();
  requireInRange("max_features", max_features, 8, 20000);
  requireInRange("max_views", max_views, 1, 10000);
  requireInRange("max_attempts", max_attempts, 1, 10000);
}

class ViewMap::Implementation {
 public:
  explicit Implementation(const ViewMapParams& params) : params_(params) { params.validate(); }

  void insert(const ViewPtr& view, const Pose& T_world_sensor) {
    views_.push_back({view, T_world_sensor});
    if (views_.size() > static_cast<std::size_t>(params_.max_views)) views_.pop_front();
  }
  bool empty() const { return views_.empty(); }

  PoseVerdict judge(const View& view, const Pose& T_world_sensor, const Pose* expected,
                    bool strict) const {
    const Support support = supportOf(view, T_world_sensor, 1);
    if (support.verdict != PoseVerdict::Confirmed) return support.verdict;
    if (strict && support.score < kStrict) return PoseVerdict::Doubtful;
    const double surprise =
        expected == nullptr ? 0.0 : (T_world_sensor.translation() - expected->translation()).norm();
    if (expected != nullptr) {
      if (surprise < shiftToElsewhere(view)) return support.verdict;
      if (support.score < kStrict) return PoseVerdict::Doubtful;
    }
    return repeats(view, T_world_sensor, expected) ? PoseVerdict::Ambiguous : support.verdict;
  }

  std::optional<Pose> refined(const View& view, const Pose& T_world_sensor) const {
    Hypothesis one{T_world_sensor, supportOf(view, T_world_sensor, kStep), 0};
    climb(view, one);
    if (!isSamePlace(view, one.pose, T_world_sensor)) return std::nullopt;
    return one.pose;
  }

  std::optional<Pose> locateByFeatures(View& view, const Pose& guess) const {
    const std::vector<Hypothesis> found = registerToSome(view, guess);
    const Hypothesis* one = byManyFeatures(view, found);
    return one == nullptr ? std::nullopt : std::optional<Pose>(one->pose);
  }

  Location locate(View& view, const Pose& guess, const std::vector<Pose>& candidates,
                  ViewGuess known) const {
    std::vector<Hypothesis> found;
    for (const Pose& pose : candidates) found.push_back({pose, supportOf(view, pose, kStep)});
    for (Hypothesis& one : registerToSome(view, guess)) found.push_back(one);
    Location location;
    if (const Hypothesis* one = byManyFeatures(view, found)) {
      location.T_world_sensor = one->pose;
      location.found = true;
      return location;
    }
    sortBySupport(found);
    std::vector<Hypothesis> apart;
    for (const Hypothesis& one : found) {
      if (one.support.score < kHopeless - kRoughness || apart.size() == kMostClimbed) break;
      const auto same = [&](const Hypothesis& h) { return isSamePlace(view, h.pose, one.pose); };
      if (std::none_of(apart.begin(), apart.end(), same)) apart.push_back(one);
    }
    location.reason = "no earlier view shows enough of the same";
    if (apart.empty()) return location;
    for (Hypothesis& one : apart) climb(view, one);
    sortBySupport(apart);
    const Hypothesis best = apart.front();
    // What it may be confused with, also: the same shifted along what is open.
    for (Hypothesis& one : shiftedOf(view, best.pose, shiftToElsewhere(view))) {
      climb(view, one);
      apart.push_back(one);
    }
    constexpr double kOfOverlap = 0.25;
    const bool one_wall = known != ViewGuess::Motion && isOneWall(view, best.pose);
    double rival = 0.0;
    for (const Hypothesis& one : apart) {
      if (isSamePlace(view, one.pose, best.pose)) continue;
      if (isComparable(one, best) || (known != ViewGuess::Motion && isRival(one, best)) ||
          (one_wall && one.support.score > kComparable * best.support.score &&
           one.support.overlap > kOfOverlap * best.support.overlap)) {
        location.reason = "it looks the same from another place";
        return location;
      }
      rival = std::max(rival, one.support.score);
    }
    // Many features tell the pose better than gray values do.
    location.T_world_sensor = best.pose;
    for (const Hypothesis& one : found) {
      if (best.inliers >= kManyInliers && one.inliers == best.inliers) {
        location.T_world_sensor = one.pose;
      }
    }
    const Support support = supportOf(view, location.T_world_sensor, 1);
    if (one_wall && support.overlap < kMostOfWall && support.score < kStrong &&
        (rival > kFarBehind * support.score || (best.inliers == 0 && support.score < kStrict))) {
      location.reason = "it looks the same from another place";
    } else {
      location.found = isEnough(known, best.inliers, support, rival, distance(best.pose, guess));
    }
    return location;
  }

  const ViewMapParams& params() const { return params_; }
  template <typename Archive>
  void visitState(Archive& archive) {
    archive(views_);
  }

 private:
  static constexpr int kWitnesses = 2;
  static constexpr double kMinOverlap = 0.1;  ///< of the cells
  static constexpr int kStep = 3;             ///< cells, where much is compared
  static constexpr double kHopeless = 0.1;    ///< a score that chance gives
  static constexpr double kRoughness = 0.5;   ///< what it may gain by climbing
  static constexpr std::size_t kMostClimbed = 4;
  static constexpr std::size_t kManyInliers = 20;
  static constexpr double kStrong = 0.7;      ///< score of a pose beyond doubt
  static constexpr double kStrict = 0.5;      ///< least score of a pose by little but gray values
  static constexpr double kConfirmed = 0.4;   ///< least correlation of a confirmed pose
  static constexpr double kLeast = 0.2;       ///< score of a place at all
  static constexpr double kComparable = 0.9;  ///< of the best score
  static constexpr double kFarBehind = 0.5;   ///< of the best score: the next one is no rival
  static constexpr double kNearGuess = 0.6;   ///< see distance()
  /// Least overlap before one wall, where another place comes near: panels repeat beyond it.
  static constexpr double kMostOfWall = 0.75;
  static constexpr double kSameTurn = 8.0;  ///< cells
  static constexpr double kMaxShift = 2.5;

  struct Placed {
    ViewPtr view;
    Pose T_world_sensor = Pose::Identity();
    template <typename Archive>
    void visitState(Archive& archive) {
      if (!view) view = std::make_shared<View>();
      archive(*view, T_world_sensor);
    }
  };

  /// What the witnesses say of a pose.
  struct Support {
    PoseVerdict verdict = PoseVerdict::Unknown;
    double score = 0.0;        ///< mean, by how much they see; at most 1
    double correlation = 0.0;  ///< likewise
    double agreeing = 0.0;     ///< likewise
    double overlap = 0.0;      ///< of the one that sees most
  };
  struct Hypothesis {
    Pose pose;
    Support support;
    std::size_t inliers = 0;  ///< features, where it is by them
  };

  static void sortBySupport(std::vector<Hypothesis>& hypotheses) {
    std::stable_sort(
        hypotheses.begin(), hypotheses.end(),
        [](const Hypothesis& a, const Hypothesis& b) { return a.support.score > b.support.score; });
  }

  static double distance(const Pose& a, const Pose& b) {
    const double turn = Eigen::AngleAxisd(Matrix3(a.linear().transpose() * b.linear())).angle();
    return (a.translation() - b.translation()).norm() + 4.0 * turn;
  }
  /// What moves the view by more than a few cells and the noise of its depths, metres.
  double shiftToElsewhere(const View& view) const {
    constexpr double kCells = 5.0;
    constexpr double kSigmas = 3.0;
    const double cell = shiftOfACell(view.cells);
    return kCells * cell + kSigmas * params_.camera.depthError(cell * view.cells.camera.fx);
  }

  /// Whether what is seen moves by few cells between two poses.
  bool isSamePlace(const View& view, const Pose& a, const Pose& b) const {
    const double turn = Eigen::AngleAxisd(Matrix3(a.linear().transpose() * b.linear())).angle();
    return (a.translation() - b.translation()).norm() < shiftToElsewhere(view) &&
           turn * view.cells.camera.fx < kSameTurn;
  }

  /// Whether a support is as good as the best one, but for doubt.
  static bool isComparable(const Support& one, const Support& best) {
    return one.score > kComparable * best.score && one.overlap > 0.5 * best.overlap;
  }
  /// Likewise by features, where gray values agree somewhat.
  static bool isComparable(const Hypothesis& one, const Hypothesis& best) {
    constexpr double kScore = 0.8;
    constexpr double kInliers = 0.7;
    return isComparable(one.support, best.support) ||
           (one.inliers > 0 && one.support.score > kScore * best.support.score &&
            static_cast<double>(one.inliers) > kInliers * static_cast<double>(best.inliers));
  }

  /// Likewise where nobody knows how far the camera has moved: where things repeat, the true place
  /// is not always the one that agrees best.
  static bool isRival(const Hypothesis& one, const Hypothesis& best) {
    constexpr double kElsewhere = 0.25;  // metres
    constexpr double kScore = 0.75;
    constexpr double kScoreByFeatures = 0.65;  // with so many as these:
    constexpr double kInliers = 0.4;
    if (best.inliers >= kManyInliers || one.support.overlap <= 0.5 * best.support.overlap ||
        (one.pose.translation() - best.pose.translation()).norm() < kElsewhere) {
      return false;
    }
    const bool has_features =
        static_cast<double>(one.inliers) >= kInliers * static_cast<double>(best.inliers);
    return one.support.score > (has_features ? kScoreByFeatures : kScore) * best.support.score;
  }

  /// Whether a pose has enough for what is known before. \param rival  see locate()
  static bool isEnough(ViewGuess known, std::size_t inliers, const Support& support, double rival,
                       double distance) {
    constexpr double kOfPlace = 0.35;
    const double score = support.score;
    const bool confirmed = support.verdict == PoseVerdict::Confirmed;
    const bool many = inliers >= kManyInliers;
    if ((!confirmed && support.verdict != PoseVerdict::Doubtful) || score <= kLeast) return false;
    if (known == ViewGuess::Motion) {
      // From a view that shows most of the same the true place would be among the others.
      return many || confirmed || rival < kFarBehind * score || distance < kNearGuess;
    }
    if (known == ViewGuess::Nothing) return confirmed && inliers > 0 && score > kStrict;
    return (confirmed || many) && score > kOfPlace;
  }

  /// The pose of very many features, where none else has half of them and what lies at the same
  /// depth looks the same. What else differs may have moved: a person fills much of a view.
  const Hypothesis* byManyFeatures(const View& view, const std::vector<Hypothesis>& found) const {
    constexpr std::size_t kVeryMany = 60;
    constexpr double kMinAgreeing = 0.25;
    const auto best = std::max_element(
        found.begin(), found.end(),
        [](const Hypothesis& a, const Hypothesis& b) { return a.inliers < b.inliers; });
    if (best == found.end() || best->inliers < kVeryMany) return nullptr;
    const Support support = supportOf(view, best->pose, 1);
    if (support.agreeing < kMinAgreeing || support.correlation < kConfirmed) return nullptr;
    const bool fits = support.score > kLeast;
    const auto isOther = [&](const Hypothesis& one) {
      return !isSamePlace(view, one.pose, best->pose) &&
             (2 * one.inliers > best->inliers ||
              (fits && isComparable(one.support, best->support)));
    };
    if (std::any_of(found.begin(), found.end(), isOther)) return nullptr;
    // Where all repeats, so do the features.
    std::vector<Hypothesis> shifted;
    if (fits) shifted = shiftedOf(view, best->pose, shiftToElsewhere(view));
    for (Hypothesis& one : shifted) climb(view, one);
    return std::none_of(shifted.begin(), shifted.end(), isOther) ? &*best : nullptr;
  }

  /// Whether the view, or the one next to it, sees little but one wall.
  bool isOneWall(const View& view, const Pose& T_world_sensor) const {
    const View& next = *nearestTo(T_world_sensor).front()->view;
    return openAxes(view.cells).size() > 1 || openAxes(next.cells).size() > 1;
  }

  std::vector<const Placed*> nearestTo(const Pose& pose) const {
    std::vector<const Placed*> order;
    for (auto it = views_.rbegin(); it != views_.rend(); ++it) order.push_back(&*it);
    std::stable_sort(order.begin(), order.end(), [&](const Placed* a, const Placed* b) {
      return distance(a->T_world_sensor, pose) < distance(b->T_world_sensor, pose);
    });
    return order;
  }

  /// The latest two, then those next to the guess.
  std::vector<const Placed*> attemptsFor(const Pose& guess) const {
    std::vector<const Placed*> order;
    const std::size_t latest = std::min<std::size_t>(2, views_.size());
    for (std::size_t i = 0; i < latest; ++i) order.push_back(&views_[views_.size() - 1 - i]);
    for (const Placed* one : nearestTo(guess)) {
      if (std::find(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(latest), one) ==
          order.begin() + static_cast<std::ptrdiff_t>(latest)) {
        order.push_back(one);
      }
    }
    return order;
  }

  Support supportOf(const View& view, const Pose& T_world_sensor, int step) const {
    constexpr double kMaxThrough = 0.25;
    constexpr double kMinAgreeing = 0.5;
    constexpr double kMinTexture = 0.05;
    constexpr double kRefused = 0.2;
    constexpr double kThroughWeight = 2.0;  // what cannot be counts more than what differs
    Support support;
    int witnesses = 0;
    double weights = 0.0;
    double texture = 0.0;
    for (const Placed* other : nearestTo(T_world_sensor)) {
      if (witnesses == kWitnesses) break;
      const ViewAgreement one =
          agreementOf(view.cells, other->view->cells,
                      other->T_world_sensor.inverse() * T_world_sensor, params_.camera, step);
      const double overlap = static_cast<double>(one.judged) /
                             static_cast<double>(std::max<std::size_t>(1, one.cells));
      if (overlap < kMinOverlap) continue;
      ++witnesses;
      if (one.share(one.through) > kMaxThrough || one.share(one.agreeing) < kMinAgreeing) {
        support.verdict = PoseVerdict::Refused;
      }
      support.correlation += overlap * one.correlation;
      support.agreeing += overlap * one.share(one.agreeing);
      support.score += overlap * (one.correlation * one.share(one.agreeing) -
                                  kThroughWeight * one.share(one.through));
      texture += overlap * one.texture;
      weights += overlap;
      support.overlap = std::max(support.overlap, overlap);
    }
    if (witnesses == 0) return support;
    support.score /= weights;
    support.correlation /= weights;
    support.agreeing /= weights;
    if (support.verdict == PoseVerdict::Refused || texture / weights < kMinTexture) return support;
    support.verdict = PoseVerdict::Doubtful;
    if (support.correlation < kRefused) support.verdict = PoseVerdict::Refused;
    if (support.correlation > kConfirmed) support.verdict = PoseVerdict::Confirmed;
    return support;
  }

  /// To the next maximum of the correlation.
  void climb(const View& view, Hypothesis& hypothesis) const {
    double turn = 2.0 / view.cells.camera.fx;
    double shift = 2.0 * shiftOfACell(view.cells);
    constexpr int kMostRounds = 16;
    constexpr double kFinest = 0.2;  // cells
    for (int round = 0; round < kMostRounds && turn * view.cells.camera.fx > kFinest; ++round) {
      bool better = false;
      for (int axis = 0; axis < 6; ++axis) {
        for (const double sign : {-1.0, 1.0}) {
          Vector6 step = Vector6::Zero();
          step[axis] = sign * (axis < 3 ? shift : turn);
          const Pose pose = hypothesis.pose * motionStep(step);
          const Support support = supportOf(view, pose, kStep);
          if (support.score <= hypothesis.support.score) continue;
          hypothesis.pose = pose;
          hypothesis.support = support;
          better = true;
          break;
        }
      }
      if (!better) {
        turn *= 0.5;
        shift *= 0.5;
      }
    }
  }

  /// The best of each side along each axis that is open.
  std::vector<Hypothesis> shiftedOf(const View& view, const Pose& pose, double min_shift) const {
    std::vector<Hypothesis> best;
    const double step = shiftOfACell(view.cells);
    for (const Vector3& axis : openAxes(view.cells)) {
      for (const double sign : {-1.0, 1.0}) {
        Hypothesis one;
        one.support.score = kHopeless;
        for (double shift = min_shift; shift <= kMaxShift; shift += step) {
          Pose shifted = pose;
          shifted.translation() += sign * shift * (pose.linear() * axis);
          const Support support = supportOf(view, shifted, 2 * kStep);
          if (support.score > one.support.score) one = {shifted, support, 0};
        }
        if (one.support.score > kHopeless) best.push_back(one);
      }
    }
    return best;
  }

  /// Whether the view agrees as well with the others where it is shifted along what is open, about
  /// as near to where it is expected.
  bool repeats(const View& view, const Pose& pose, const Pose* expected) const {
    const auto surpriseOf = [&](const Pose& at) {
      return expected == nullptr ? 0.0 : (at.translation() - expected->translation()).norm();
    };
    const double surprise = surpriseOf(pose);
    const Support here = supportOf(view, pose, 2 * kStep);
    for (const Hypothesis& one :
         shiftedOf(view, pose, std::max(shiftToElsewhere(view), 0.5 * surprise))) {
      const bool is_near = surpriseOf(one.pose) <= 3.0 * surprise;
      if (is_near && isComparable(one.support, here)) return true;
    }
    return false;
  }

  /// To as many views as may be tried.
  std::vector<Hypothesis> registerToSome(View& view, const Pose& guess) const {
    std::vector<Hypothesis> found;
    int attempts = 0;
    for (const Placed* other : attemptsFor(guess)) {
      if (attempts++ == params_.max_attempts) break;
      for (Hypothesis& one : registerTo(view, *other, guess)) {
        one.support = supportOf(view, one.pose, kStep);
        found.push_back(one);
      }
    }
    return found;
  }

  /// Poses that matches of descriptors give: of many wrong matches some agree by chance or because
  /// things repeat, so more than one.
  std::vector<Hypothesis> registerTo(View& view, const Placed& other, const Pose& guess) const {
    constexpr int kMostMotions = 3;
    view.detect(params_);
    other.view->detect(params_);
    detail::DescriptorMatchParams match;
    match.ratio = 0.85;
    match.threads = params_.threads;
    const std::vector<int> found =
        detail::matchDescriptors(view.descriptors, other.view->descriptors, match);
    std::vector<FeatureMatch> matches;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i] < 0) continue;
      const FeatureSighting& before = other.view->sightings[static_cast<std::size_t>(found[i])];
      FeatureMatch one;
      one.before = backProject(params_.camera, before);
      one.covariance = positionCovariance(params_.camera, before);
      one.now = view.sightings[i];
      matches.push_back(one);
    }
    MotionParams motion;
    motion.min_inliers = 6;
    motion.min_inlier_share = 0.0;
    motion.max_iterations = 5000;
    Random random(params_.seed);
    const Pose expected = guess.inverse() * other.T_world_sensor;
    std::vector<Hypothesis> poses;
    while (poses.size() < kMostMotions) {
      const MotionEstimate estimate =
          estimateMotion(matches, params_.camera, motion, random, &expected);
      if (!estimate.found()) break;
      poses.push_back(
          {other.T_world_sensor * estimate.T_now_before.inverse(), {}, estimate.inliers});
      std::vector<FeatureMatch> rest;
      for (std::size_t i = 0; i < matches.size(); ++i) {
        if (estimate.is_inlier[i] == 0) rest.push_back(matches[i]);
      }
      matches = std::move(rest);
    }
    return poses;
  }

  ViewMapParams params_;
  std::deque<Placed> views_;
};

ViewMap::ViewMap(const ViewMapParams& params)
    : implementation_(std::make_unique<Implementation>(params)) {}
ViewMap::~ViewMap() = default;
ViewMap::ViewMap(ViewMap&&) noexcept = default;
ViewMap& ViewMap::operator=(ViewMap&&) noexcept = default;

ViewMap::ViewPtr ViewMap::see(const io::Image& image, const PointsView& cloud,
                              const PinholeCamera& camera) const {
  detail::requireSound(image, "colour");
  return std::make_shared<View>(image, cloud, camera);
}

void ViewMap::insert(const ViewPtr& view, const Pose& T_world_sensor) {
  implementation_->insert(view, T_world_sensor);
}

std::string ViewMap::saveState() const {
  return detail::stateOf(*implementation_);
}
void ViewMap::loadState(std::string_view bytes) {
  detail::restoreState(*implementation_, bytes);
}

bool ViewMap::empty() const {
  return implementation_->empty();
}

PoseVerdict ViewMap::judge(const ViewPtr& view, const Pose& T_world_sensor, const Pose* expected,
                           bool strict) const {
  return implementation_->judge(*view, T_world_sensor, expected, strict);
}

std::optional<Pose> ViewMap::refined(const ViewPtr& view, const Pose& T_world_sensor) const {
  return implementation_->refined(*view, T_world_sensor);
}

std::optional<Pose> ViewMap::locateByFeatures(const ViewPtr& view, const Pose& guess) const {
  return implementation_->locateByFeatures(*view, guess);
}

ViewMap::Location ViewMap::locate(const ViewPtr& view, const Pose& guess,
                                  const std::vector<Pose>& candidates, ViewGuess known) const {
  return implementation_->locate(*view, guess, candidates, known);
}

}  // namespace planar_mapping
