// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/views/view_map.h"

#include <algorithm>

#include "planar_mapping/base/error.h"
#include "planar_mapping/localization/views/placed_views.h"
#include "planar_mapping/stereo/cv_image.h"

namespace planar_mapping {
namespace {

using Views = ViewMap::PlacedViews;
using Hypothesis = Views::Hypothesis;
using Support = Views::Support;

constexpr const char* kLooksTheSame = "it looks the same from another place";
constexpr int kFineView = 2;        // cells between those compared
constexpr double kRoughness = 0.5;  // what a score may gain by climbing
constexpr std::size_t kMaxClimbed = 4;
constexpr std::size_t kManyInliers = 20;
constexpr double kStrong = 0.7;      // score of a pose beyond doubt
constexpr double kStrict = 0.5;      // least score of a pose by little but gray values
constexpr double kLeast = 0.2;       // score of a place at all
constexpr double kComparable = 0.9;  // of the best score
constexpr double kFarBehind = 0.5;   // of the best score: the next one is no rival
constexpr double kNearGuess = 0.6;   // see PlacedViews::distance()
/// Least overlap before one wall, where another place comes near: panels repeat beyond it.
constexpr double kMinOverlapOfWall = 0.75;

void sortBySupport(std::vector<Hypothesis>& hypotheses) {
  std::stable_sort(
      hypotheses.begin(), hypotheses.end(),
      [](const Hypothesis& a, const Hypothesis& b) { return a.support.score > b.support.score; });
}

/// \param expected  or null: nothing is
bool isAsExpected(const Pose& pose, const Pose* expected) {
  constexpr double kNear = 0.15;  // see PlacedViews::distance()
  return expected != nullptr && Views::distance(pose, *expected) < kNear;
}

/// Whether a support is as good as the best one, but for doubt.
bool isComparable(const Support& one, const Support& best) {
  return one.score > kComparable * best.score && one.overlap > 0.5 * best.overlap;
}
/// Likewise by features, where gray values agree somewhat.
bool isComparable(const Hypothesis& one, const Hypothesis& best) {
  constexpr double kScore = 0.8;
  constexpr double kInliers = 0.7;
  return isComparable(one.support, best.support) ||
         (one.inliers > 0 && one.support.score > kScore * best.support.score &&
          static_cast<double>(one.inliers) > kInliers * static_cast<double>(best.inliers));
}

/// Likewise where nobody knows how far the camera has moved: where things repeat, the true place
/// is not always the one that agrees best.
/// \param leaves_open  panels that repeat may have many features
bool isRival(const Hypothesis& one, const Hypothesis& best, bool leaves_open) {
  constexpr double kElsewhere = 0.25;  // metres
  constexpr double kScore = 0.75;
  constexpr double kScoreByFeatures = 0.65;  // with so many as these:
  constexpr double kInliers = 0.4;
  if ((best.inliers >= kManyInliers && !leaves_open) ||
      one.support.overlap <= 0.5 * best.support.overlap ||
      (one.pose.translation() - best.pose.translation()).norm() < kElsewhere) {
    return false;
  }
  const bool has_features =
      static_cast<double>(one.inliers) >= kInliers * static_cast<double>(best.inliers);
  return one.support.score > (has_features ? kScoreByFeatures : kScore) * best.support.score;
}

/// Whether a pose has enough for what is known before. \param rival  see locate()
bool isEnough(ViewGuess known, bool leaves_open, std::size_t inliers, const Support& support,
              double rival, double distance) {
  constexpr double kOfPlace = 0.35;
  const double score = support.score;
  const bool confirmed = support.verdict == PoseVerdict::Confirmed;
  const bool many = inliers >= kManyInliers;
  if ((!confirmed && support.verdict != PoseVerdict::Doubtful) || score <= kLeast) return false;
  if (known == ViewGuess::Motion) {
    // From a view that shows most of the same the true place would be among the others.
    return many || confirmed || rival < kFarBehind * score || distance < kNearGuess;
  }
  if (known == ViewGuess::Nothing)
    return confirmed && inliers > 0 && score > (leaves_open ? kStrong : kStrict);
  return (confirmed || many) && score > kOfPlace;
}

/// The pose of many features, where none else has half of them. Very many are enough where what
/// lies at the same depth looks the same: what else differs may have moved, as a person who fills
/// much of a view, and more of it where the pose is just the expected one. Where it looks
/// different, as texture does from afar or aslant, they have to lie in space, since the tiles of a
/// floor or wall repeat, or be most of those that look alike (docs/dev/motion.md).
/// \param expected  by the motion before, or null
const Hypothesis* byManyFeatures(const Views& views, const ViewMap::View& view,
                                 const std::vector<Hypothesis>& found, const Pose* expected) {
  constexpr std::size_t kVeryMany = 60;
  constexpr std::size_t kManyInSpace = 30;
  constexpr std::size_t kOffPlane = 5;
  constexpr double kMinMatchFraction = 0.4;
  constexpr double kSameDepth = 0.8;
  constexpr double kMaxError = 0.1;    // metres
  constexpr double kMaxThrough = 0.1;  // of a pose that too little of the same is seen from
  constexpr double kMaxBehind = 0.02;  // at right poses with people none of the cells is
  constexpr double kMinAgreeing = 0.25;
  constexpr double kMinAgreeingAsExpected = 0.1;
  const auto best = std::max_element(
      found.begin(), found.end(),
      [](const Hypothesis& a, const Hypothesis& b) { return a.inliers < b.inliers; });
  if (best == found.end()) return nullptr;
  const bool many = best->inliers >= kVeryMany;
  const bool in_space = best->inliers >= kManyInSpace && best->off_plane >= kOffPlane;
  if ((!many && !in_space) || !(best->error <= kMaxError)) return nullptr;
  const Support support = views.supportOf(view, best->pose, 1);
  const double least = isAsExpected(best->pose, expected) ? kMinAgreeingAsExpected : kMinAgreeing;
  const bool looks_alike = support.agreeing >= least && support.correlation >= kConfirmedView;
  const bool most = best->match_fraction >= kMinMatchFraction;
  const bool is_known =
      support.verdict == PoseVerdict::Refused
          ? most && many && best->off_plane >= kManyInSpace && support.through < kMaxThrough
          : in_space || (most && support.agreeing >= kSameDepth);
  if (!(many && looks_alike) && !is_known) return nullptr;
  // What seems to have moved is no person before the room, but the room.
  if (support.behind > kMaxBehind) return nullptr;
  const bool fits = support.score > kLeast;
  const auto isOther = [&](const Hypothesis& one) {
    return !views.isSamePlace(view, one.pose, best->pose) &&
           (2 * one.inliers > best->inliers || (fits && isComparable(one.support, best->support)));
  };
  if (std::any_of(found.begin(), found.end(), isOther)) return nullptr;
  // Where all repeats, so do the features.
  std::vector<Hypothesis> shifted;
  if (fits && looks_alike)
    shifted = views.shiftedOf(view, best->pose, views.shiftToElsewhere(view));
  for (Hypothesis& one : shifted) views.climb(view, one);
  return std::none_of(shifted.begin(), shifted.end(), isOther) ? &*best : nullptr;
}

/// The place that a cloud gives, where nothing is seen through and gray values correlate somewhat:
/// at wrong places they hardly do, unless things repeat. What lies behind corners may be most of a
/// view (docs/dev/motion.md). Not of a view that may show what was never seen.
const Hypothesis* byItsCloud(const Views& views, const ViewMap::View& view,
                             const std::vector<Hypothesis>& found) {
  constexpr double kMaxThrough = 0.02;
  constexpr double kMinCorrelation = 0.3;
  constexpr double kMinAgreeing = 0.4;
  constexpr double kMinOverlap = 0.25;
  constexpr double kRival = 0.5;    // of its score
  constexpr double kShifted = 0.8;  // likewise, of the same place shifted along what is open
  const Hypothesis* best = nullptr;
  for (const Hypothesis& one : found) {
    if (one.fits && (best == nullptr || one.support.score > best->support.score)) best = &one;
  }
  if (best == nullptr) return nullptr;
  const Support support = views.supportOf(view, best->pose, 1);
  if (support.verdict == PoseVerdict::Unknown || support.through > kMaxThrough ||
      support.correlation < kMinCorrelation || support.agreeing < kMinAgreeing ||
      support.overlap < kMinOverlap) {
    return nullptr;
  }
  const auto isRivalOf = [&](const std::vector<Hypothesis>& others, double fraction) {
    return std::any_of(others.begin(), others.end(), [&](const Hypothesis& one) {
      return one.support.score > fraction * support.score &&
             !views.isSamePlace(view, one.pose, best->pose);
    });
  };
  const bool alone =
      !isRivalOf(found, kRival) &&
      !isRivalOf(views.shiftedOf(view, best->pose, views.shiftToElsewhere(view)), kShifted);
  return alone ? best : nullptr;
}

/// Whether the view, or the one next to it, sees little but one wall.
bool isOneWall(const Views& views, const ViewMap::View& view, const Pose& T_world_sensor) {
  const ViewMap::View& next = views.nextTo(T_world_sensor);
  return openAxes(view.cells.facing).size() > 1 || openAxes(next.cells.facing).size() > 1;
}

/// Whether the view agrees as well with the others where it is shifted along what is open, about
/// as near to where it is expected.
bool repeats(const Views& views, const ViewMap::View& view, const Pose& pose,
             const Pose* expected) {
  const auto surpriseOf = [&](const Pose& at) {
    return expected == nullptr ? 0.0 : (at.translation() - expected->translation()).norm();
  };
  const double surprise = surpriseOf(pose);
  const Support here = views.supportOf(view, pose, 2 * kCoarseView);
  for (const Hypothesis& one :
       views.shiftedOf(view, pose, std::max(views.shiftToElsewhere(view), 0.5 * surprise))) {
    const bool is_near = surpriseOf(one.pose) <= 3.0 * surprise;
    if (is_near && isComparable(one.support, here)) return true;
  }
  return false;
}

/// The place of those found at which depths and gray values agree best, if there is no other like
/// it.
ViewMap::Location bestOf(const Views& views, const ViewMap::View& view, const Pose& guess,
                         std::vector<Hypothesis> found, ViewGuess known) {
  ViewMap::Location location;
  sortBySupport(found);
  std::vector<Hypothesis> apart;
  for (const Hypothesis& one : found) {
    if (one.support.score < kHopelessView - kRoughness || apart.size() == kMaxClimbed) break;
    const auto same = [&](const Hypothesis& h) {
      return views.isSamePlace(view, h.pose, one.pose);
    };
    if (std::none_of(apart.begin(), apart.end(), same)) apart.push_back(one);
  }
  location.reason = "no earlier view shows enough of the same";
  if (apart.empty()) return location;
  for (Hypothesis& one : apart) views.climb(view, one);
  sortBySupport(apart);
  const Hypothesis best = apart.front();
  // What it may be confused with, also: the same shifted along what is open.
  for (Hypothesis& one : views.shiftedOf(view, best.pose, views.shiftToElsewhere(view))) {
    views.climb(view, one);
    apart.push_back(one);
  }
  constexpr double kOfOverlap = 0.25;
  const bool leaves_open = !openAxes(view.cells.facing).empty();
  const bool one_wall = known != ViewGuess::Motion && isOneWall(views, view, best.pose);
  double rival = 0.0;
  for (const Hypothesis& one : apart) {
    if (views.isSamePlace(view, one.pose, best.pose)) continue;
    if (isComparable(one, best) ||
        (known != ViewGuess::Motion && isRival(one, best, leaves_open)) ||
        (one_wall && one.support.score > kComparable * best.support.score &&
         one.support.overlap > kOfOverlap * best.support.overlap)) {
      location.reason = kLooksTheSame;
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
  const Support support = views.supportOf(view, location.T_world_sensor, 1);
  if (one_wall && support.overlap < kMinOverlapOfWall && support.score < kStrong &&
      (rival > kFarBehind * support.score || (best.inliers == 0 && support.score < kStrict))) {
    location.reason = kLooksTheSame;
  } else {
    location.found = isEnough(known, leaves_open, best.inliers, support, rival,
                              Views::distance(best.pose, guess));
  }
  return location;
}

}  // namespace

void ViewMapParams::validate() const {
  camera.validate();
  requireInRange("max_features", max_features, 8, 20000);
  requireInRange("threads", threads, 0, 4096);
}

ViewMap::ViewMap(const ViewMapParams& params) : views_(std::make_unique<PlacedViews>(params)) {}
ViewMap::~ViewMap() = default;
ViewMap::ViewMap(ViewMap&&) noexcept = default;
ViewMap& ViewMap::operator=(ViewMap&&) noexcept = default;

ViewMap::ViewPtr ViewMap::see(const io::Image& image, const PointsView& cloud,
                              const PinholeCamera& camera) const {
  io::requireSound(image, "colour");
  return std::make_shared<View>(image, cloud, camera, views_->params().camera);
}

void ViewMap::insert(const ViewPtr& view, const Pose& T_world_sensor) {
  views_->insert(view, T_world_sensor);
}

bool ViewMap::empty() const {
  return views_->empty();
}

PoseVerdict ViewMap::check(const ViewPtr& view, const Pose& T_world_sensor, const Pose* expected,
                           bool strict) const {
  const Support support =
      views_->supportOf(*view, T_world_sensor, 1, isAsExpected(T_world_sensor, expected));
  if (support.contested) return PoseVerdict::Refused;
  if (support.verdict != PoseVerdict::Confirmed) return support.verdict;
  if (support.score < (strict ? kStrict : kLeast)) return PoseVerdict::Doubtful;
  if (expected == nullptr && views_->missesFeatures(*view, T_world_sensor))
    return PoseVerdict::Ambiguous;
  const double surprise =
      expected == nullptr ? 0.0 : (T_world_sensor.translation() - expected->translation()).norm();
  if (expected != nullptr) {
    if (surprise < views_->shiftToElsewhere(*view)) return support.verdict;
    if (support.score < kStrict) return PoseVerdict::Doubtful;
  }
  return repeats(*views_, *view, T_world_sensor, expected) ? PoseVerdict::Ambiguous
                                                           : support.verdict;
}

bool ViewMap::fitsBetter(const ViewPtr& view, const Pose& one, const Pose& other) const {
  constexpr double kMinApart = 0.1;    // see PlacedViews::distance()
  constexpr double kMaxMisfit = 0.75;  // of the other one's
  constexpr double kSameCorrelation = 0.02;
  constexpr double kMinOverlap = 0.8;  // of the other one's
  if (Views::distance(one, other) < kMinApart) return false;
  const Support a = views_->supportOf(*view, one, kFineView);
  if (a.correlation < kConfirmedView) return false;
  const Support b = views_->supportOf(*view, other, kFineView);
  return a.misfit < kMaxMisfit * b.misfit && a.correlation > b.correlation - kSameCorrelation &&
         a.overlap > kMinOverlap * b.overlap;
}

bool ViewMap::leavesOpen(const ViewPtr& view) {
  return !openAxes(view->cells.facing_nearby).empty();
}

bool ViewMap::fitsBadly(const ViewPtr& view, const Pose& T_world_sensor) const {
  constexpr double kUsualMisfit = 0.45;
  return views_->supportOf(*view, T_world_sensor, kFineView).misfit > kUsualMisfit;
}

std::optional<Pose> ViewMap::refined(const ViewPtr& view, const Pose& T_world_sensor) const {
  Hypothesis one{T_world_sensor, views_->supportOf(*view, T_world_sensor, kCoarseView), 0};
  views_->climb(*view, one);
  if (!views_->isSamePlace(*view, one.pose, T_world_sensor)) return std::nullopt;
  return one.pose;
}

std::optional<Pose> ViewMap::locateByFeatures(const ViewPtr& view, const Pose& guess) const {
  const std::vector<Hypothesis> found = views_->registerTo(*view, guess);
  const Hypothesis* one = byManyFeatures(*views_, *view, found, nullptr);
  return one == nullptr ? std::nullopt : std::optional<Pose>(one->pose);
}

ViewMap::Location ViewMap::locate(const ViewPtr& view, const Pose& guess,
                                  const std::vector<PoseCandidate>& candidates,
                                  ViewGuess known) const {
  std::vector<Hypothesis> found;
  for (const PoseCandidate& one : candidates) {
    found.push_back(
        {one.T_world_sensor, views_->supportOf(*view, one.T_world_sensor, kCoarseView)});
    found.back().fits = one.fits;
  }
  // The views next to a place where the cloud fits tell more than those next to where a camera was
  // lost.
  sortBySupport(found);
  const bool fits = known == ViewGuess::Nothing && !found.empty() &&
                    found.front().support.verdict == PoseVerdict::Confirmed;
  const Pose near = fits ? found.front().pose : guess;
  for (Hypothesis& one : views_->registerTo(*view, near)) found.push_back(one);
  const Pose* expected = known == ViewGuess::Motion ? &guess : nullptr;
  const Hypothesis* one = byManyFeatures(*views_, *view, found, expected);
  Location location;
  const bool many = one != nullptr;
  if (one == nullptr) {
    location = bestOf(*views_, *view, guess, found, known);
    if (!location.found && known != ViewGuess::Nothing) one = byItsCloud(*views_, *view, found);
  }
  if (one != nullptr) {
    location.T_world_sensor = one->pose;
    location.found = true;
  }
  if (location.found && !many && views_->missesFeatures(*view, location.T_world_sensor)) {
    location.found = false;
    location.reason = kLooksTheSame;
  }
  return location;
}

}  // namespace planar_mapping
