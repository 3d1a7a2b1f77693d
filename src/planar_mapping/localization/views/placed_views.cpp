// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/views/placed_views.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/opencv_threads.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kMaxViews = 24;  // kept, the latest
constexpr int kMaxAttempts = 6;        // views that a frame is registered to
constexpr int kWitnesses = 2;
constexpr double kMinOverlap = 0.1;  // of the cells
constexpr double kSameTurn = 8.0;    // cells
constexpr double kMaxShift = 2.5;    // metres
constexpr double kMatchRatio = 0.85;

/// Largest standard deviation of the position, metres.
double errorOf(const MotionEstimate& estimate) {
  const Matrix3 position = estimate.covariance.topLeftCorner<3, 3>();
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Matrix3>(position, Eigen::EigenvaluesOnly).eigenvalues()[2]);
}

/// How many points do not lie on the plane that holds most of them.
std::size_t offOnePlane(const std::vector<const FeatureMatch*>& points, std::uint64_t seed) {
  constexpr int kDraws = 200;
  constexpr double kThickness = 0.03;  // metres
  constexpr double kSigmas = 3.0;
  Random random(seed);
  const auto any = [&]() {
    return points[random.below(static_cast<std::uint32_t>(points.size()))]->before;
  };
  std::size_t most = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vector3 point = any();
    const Vector3 along = any() - point;
    const Vector3 normal = along.cross(any() - point).normalized();  // zero of the same twice
    const auto on = std::count_if(points.begin(), points.end(), [&](const FeatureMatch* one) {
      const double distance = normal.dot(one->before - point);
      return distance * distance <
             kThickness * kThickness + kSigmas * kSigmas * normal.dot(one->covariance * normal);
    });
    if (!normal.isZero()) most = std::max(most, static_cast<std::size_t>(on));
  }
  return points.size() - most;
}

/// Depth between pixels: on one surface interpolated, else of the nearest surface around.
double depthAt(const std::vector<float>& depths, int width, int height, double column, double row) {
  constexpr float kSameSurface = 0.02f;  // of the depth
  const int left = static_cast<int>(column);
  const int top = static_cast<int>(row);
  if (left < 0 || top < 0 || left + 1 >= width || top + 1 >= height) return 0.0;
  const float* at = depths.data() + static_cast<std::size_t>(top) * width + left;
  const float around[] = {at[0], at[1], at[width], at[width + 1]};
  float nearest = std::numeric_limits<float>::infinity();
  float farthest = 0.0f;
  bool all = true;
  for (const float depth : around) {
    all = all && depth > 0.0f;
    if (depth > 0.0f) nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  if (farthest <= 0.0f) return 0.0;
  if (!all || farthest - nearest > kSameSurface * nearest) return nearest;
  const double a = column - left;
  const double b = row - top;
  return (1.0 - b) * ((1.0 - a) * around[0] + a * around[1]) +
         b * ((1.0 - a) * around[2] + a * around[3]);
}

/// Where a view shows a point that another one sees, if it is not hidden and seen from about the
/// same side and distance, where a feature looks much the same.
/// \param point  in the frame of the other view
std::optional<FeatureSighting> expectedAt(const ViewMap::View& view, const Vector3& point,
                                          const Pose& T_view_other, const FeatureCamera& camera) {
  constexpr double kMaxTurn = 0.35;  // radians between the rays
  constexpr double kMaxScale = 4.0 / 3.0;
  constexpr double kSlack = 0.05;          // metres,
  constexpr double kRelativeSlack = 0.02;  // and of the depth
  const Vector3 seen = T_view_other * point;
  const double scale = seen.norm() / point.norm();
  if (!(seen.z() > kSlack) || std::max(scale, 1.0 / scale) > kMaxScale ||
      angleBetween(seen, seen - T_view_other.translation()) > kMaxTurn) {
    return std::nullopt;
  }
  const PinholeCamera& cells = view.cells.camera;
  const double column = cells.fx * seen.x() / seen.z() + cells.cx;
  const double row = cells.fy * seen.y() / seen.z() + cells.cy;
  if (!(column >= 0.0 && row >= 0.0 && column < cells.width - 1 && row < cells.height - 1))
    return std::nullopt;
  const std::size_t at =
      static_cast<std::size_t>(row + 0.5) * cells.width + static_cast<std::size_t>(column + 0.5);
  const double slack = kSlack + kRelativeSlack * seen.z();
  const bool is_seen = view.cells.nearest[at] > 0.0f && seen.z() > view.cells.nearest[at] - slack &&
                       seen.z() < view.cells.farthest[at] + slack;
  return is_seen ? std::optional<FeatureSighting>(project(camera, seen)) : std::nullopt;
}

}  // namespace

ViewMap::View::View(const io::Image& image, const PointsView& cloud, const PinholeCamera& pinhole,
                    const FeatureCamera& noise)
    : gray_(io::toGray(image)), camera_(pinhole) {
  cells = viewCellsOf(gray_.pixels.data(), cloud, pinhole, noise);
  depths_.resize(cloud.size);
  for (std::size_t i = 0; i < cloud.size; ++i) {
    const float depth = cloud[i][2];
    depths_[i] = std::isfinite(depth) && depth > 0.0f ? depth : 0.0f;
  }
}

void ViewMap::View::detect(const ViewMapParams& params) {
  if (detected_) return;
  detected_ = true;
  FeatureTrackerParams detection;
  detection.detector = FeatureDetector::Sift;
  detection.detection_threshold = 0.015;  // half the usual contrast: plain walls have some
  const detail::OpenCvThreads threads(params.threads);
  const detail::DetectedFeatures found =
      detail::detectFeatures(detail::matOf(gray_), detection, params.max_features);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const detail::Detection& place = found.places[i];
    const double depth = depthAt(depths_, camera_.width, camera_.height, place.column, place.row);
    if (!(depth > 0.0)) continue;
    sightings.push_back({place.column, place.row, 1.0 / depth});
    descriptors.add(found.descriptors, i);
  }
  gray_ = io::Image();
  depths_ = {};
}

void ViewMap::PlacedViews::insert(const ViewPtr& view, const Pose& T_world_sensor) {
  views_.push_back({view, T_world_sensor});
  if (views_.size() > kMaxViews) views_.pop_front();
}

double ViewMap::PlacedViews::distance(const Pose& a, const Pose& b) {
  const double turn = rotationAngle(a.linear().transpose() * b.linear());
  return (a.translation() - b.translation()).norm() + 4.0 * turn;
}
double ViewMap::PlacedViews::shiftToElsewhere(const View& view) const {
  constexpr double kCells = 5.0;
  constexpr double kSigmas = 3.0;
  const double cell = shiftOfACell(view.cells);
  return kCells * cell + kSigmas * params_.camera.depthError(cell * view.cells.camera.fx);
}

bool ViewMap::PlacedViews::isSamePlace(const View& view, const Pose& a, const Pose& b) const {
  const double turn = rotationAngle(a.linear().transpose() * b.linear());
  return (a.translation() - b.translation()).norm() < shiftToElsewhere(view) &&
         turn * view.cells.camera.fx < kSameTurn;
}

std::vector<const ViewMap::PlacedViews::Placed*> ViewMap::PlacedViews::latest() const {
  std::vector<const Placed*> order;
  for (auto it = views_.rbegin(); it != views_.rend(); ++it) order.push_back(&*it);
  return order;
}

std::vector<const ViewMap::PlacedViews::Placed*> ViewMap::PlacedViews::nearestTo(
    const Pose& pose) const {
  std::vector<const Placed*> order = latest();
  std::stable_sort(order.begin(), order.end(), [&](const Placed* a, const Placed* b) {
    return distance(a->T_world_sensor, pose) < distance(b->T_world_sensor, pose);
  });
  return order;
}

/// The latest two, then those next to the guess.
std::vector<const ViewMap::PlacedViews::Placed*> ViewMap::PlacedViews::attemptsFor(
    const Pose& guess) const {
  constexpr std::size_t kLatest = 2;
  std::vector<const Placed*> order = latest();
  if (order.size() > kLatest) order.resize(kLatest);
  for (const Placed* one : nearestTo(guess))
    if (std::find(order.begin(), order.end(), one) == order.end()) order.push_back(one);
  return order;
}

ViewMap::PlacedViews::Support ViewMap::PlacedViews::supportOf(const View& view,
                                                              const Pose& T_world_sensor, int step,
                                                              bool goes_on) const {
  constexpr double kMaxThrough = 0.25;
  constexpr double kMaxBehind = 0.07;
  constexpr double kMaxBehindIfGoesOn = 0.1;  // depths come a little later or earlier than images
  constexpr double kMinAgreeing = 0.5;
  constexpr double kDecisive = 0.5;  // of the largest overlap
  constexpr double kMinTexture = 0.05;
  constexpr double kRefused = 0.2;
  constexpr double kThroughWeight = 2.0;  // what cannot be counts more than what differs
  Support support;
  int witnesses = 0;
  double weights = 0.0;
  double texture = 0.0;
  double misfit = 0.0;
  double contradicted = 0.0;  // largest overlap of a witness that does
  for (const Placed* other : goes_on ? latest() : nearestTo(T_world_sensor)) {
    if (witnesses == kWitnesses) break;
    const ViewAgreement one =
        agreementOf(view.cells, other->view->cells,
                    other->T_world_sensor.inverse() * T_world_sensor, params_.camera, step);
    const double overlap = static_cast<double>(one.compared) /
                           static_cast<double>(std::max<std::size_t>(1, one.cells));
    if (overlap < kMinOverlap) continue;
    ++witnesses;
    if (one.fraction(one.through) > kMaxThrough || one.fraction(one.agreeing) < kMinAgreeing)
      contradicted = std::max(contradicted, overlap);
    support.correlation += overlap * one.correlation;
    support.agreeing += overlap * one.fraction(one.agreeing);
    support.through += overlap * one.fraction(one.through);
    support.behind += overlap * one.fraction(one.behind);
    misfit += overlap * one.misfit;
    support.score += overlap * (one.correlation * one.fraction(one.agreeing) -
                                kThroughWeight * one.fraction(one.through));
    texture += overlap * one.texture;
    weights += overlap;
    support.overlap = std::max(support.overlap, overlap);
  }
  if (witnesses == 0) return support;
  support.misfit = misfit / weights;
  support.score /= weights;
  support.correlation /= weights;
  support.agreeing /= weights;
  support.through /= weights;
  support.behind /= weights;
  support.contested = contradicted > 0.0;
  // What little of a view sees round corners contradicts also where all is right.
  if (contradicted > kDecisive * support.overlap) support.verdict = PoseVerdict::Refused;
  if (support.behind > (goes_on ? kMaxBehindIfGoesOn : kMaxBehind))
    support.verdict = PoseVerdict::Refused;
  if (support.verdict == PoseVerdict::Refused || texture / weights < kMinTexture) return support;
  support.verdict = PoseVerdict::Doubtful;
  if (support.correlation < kRefused) support.verdict = PoseVerdict::Refused;
  if (support.correlation > kConfirmedView) support.verdict = PoseVerdict::Confirmed;
  return support;
}

void ViewMap::PlacedViews::climb(const View& view, Hypothesis& hypothesis) const {
  double turn = 2.0 / view.cells.camera.fx;
  double shift = 2.0 * shiftOfACell(view.cells);
  constexpr int kMaxRounds = 16;
  constexpr double kFinest = 0.2;  // cells
  for (int round = 0; round < kMaxRounds && turn * view.cells.camera.fx > kFinest; ++round) {
    bool better = false;
    for (int axis = 0; axis < 6; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Vector6 step = Vector6::Zero();
        step[axis] = sign * (axis < 3 ? shift : turn);
        const Pose pose = hypothesis.pose * motionStep(step);
        const Support support = supportOf(view, pose, kCoarseView);
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

std::vector<ViewMap::PlacedViews::Hypothesis> ViewMap::PlacedViews::shiftedOf(
    const View& view, const Pose& pose, double min_shift) const {
  std::vector<Hypothesis> best;
  const double step = shiftOfACell(view.cells);
  for (const Vector3& axis : openAxes(view.cells.facing)) {
    for (const double sign : {-1.0, 1.0}) {
      Hypothesis one;
      one.support.score = kHopelessView;
      for (double shift = min_shift; shift <= kMaxShift; shift += step) {
        Pose shifted = pose;
        shifted.translation() += sign * shift * (pose.linear() * axis);
        const Support support = supportOf(view, shifted, 2 * kCoarseView);
        if (support.score > one.support.score) one = {shifted, support, 0};
      }
      if (one.support.score > kHopelessView) best.push_back(one);
    }
  }
  return best;
}

bool ViewMap::PlacedViews::missesFeatures(View& view, const Pose& T_world_sensor) const {
  constexpr std::size_t kMinFeatures = 150;  // of both views: blurred and plain ones tell nothing
  constexpr int kMinExpected = 100;
  constexpr double kMinAlike = 0.25;      // of those expected
  constexpr int kManyMatched = 60;        // enough, however many are expected
  constexpr double kReach = 5.0;          // cells by which a feature may lie beside its place
  constexpr std::int32_t kAlike = 92000;  // squared distance of descriptors of length 512
  view.detect(params_);
  const double reach = kReach * params_.camera.fx / view.cells.camera.fx;
  int witnesses = 0;
  int expected = 0;
  int alike = 0;
  int matched = 0;
  for (const Placed* other : nearestTo(T_world_sensor)) {
    if (witnesses == kWitnesses) break;
    View& before = *other->view;
    before.detect(params_);
    if (std::min(view.sightings.size(), before.sightings.size()) < kMinFeatures) continue;
    const std::vector<int> match = detail::matchDescriptors(before.descriptors, view.descriptors,
                                                            kMatchRatio, params_.threads);
    const Pose T_view_other = T_world_sensor.inverse() * other->T_world_sensor;
    const int expected_before = expected;
    for (std::size_t i = 0; i < before.sightings.size(); ++i) {
      const std::optional<FeatureSighting> place = expectedAt(
          view, backProject(params_.camera, before.sightings[i]), T_view_other, params_.camera);
      if (!place) continue;
      ++expected;
      bool is_alike = false;
      for (std::size_t k = 0; k < view.sightings.size(); ++k) {
        const FeatureSighting& now = view.sightings[k];
        if (std::hypot(now.column - place->column, now.row - place->row) > reach) continue;
        is_alike = is_alike || before.descriptors.distance(i, view.descriptors, k) < kAlike;
        matched += match[i] == static_cast<int>(k) ? 1 : 0;
      }
      alike += is_alike ? 1 : 0;
    }
    if (expected > expected_before) ++witnesses;
  }
  return expected >= kMinExpected && alike < kMinAlike * expected && matched < kManyMatched;
}

std::vector<ViewMap::PlacedViews::Hypothesis> ViewMap::PlacedViews::registerTo(
    View& view, const Pose& guess) const {
  std::vector<Hypothesis> found;
  int attempts = 0;
  for (const Placed* other : attemptsFor(guess)) {
    if (attempts++ == kMaxAttempts) break;
    for (Hypothesis& one : registerTo(view, *other, guess)) {
      one.support = supportOf(view, one.pose, kCoarseView);
      found.push_back(one);
    }
  }
  return found;
}

/// Poses that matches of descriptors give: of many wrong matches some agree by chance or because
/// things repeat, so more than one.
std::vector<ViewMap::PlacedViews::Hypothesis> ViewMap::PlacedViews::registerTo(
    View& view, const Placed& other, const Pose& guess) const {
  constexpr int kMaxMotions = 3;
  view.detect(params_);
  other.view->detect(params_);
  const std::vector<int> found = detail::matchDescriptors(view.descriptors, other.view->descriptors,
                                                          kMatchRatio, params_.threads);
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
  const std::size_t matched = matches.size();
  MotionParams motion;
  motion.min_inliers = 6;
  motion.min_inlier_fraction = 0.0;
  motion.max_iterations = 5000;
  Random random(params_.seed);
  const Pose expected = guess.inverse() * other.T_world_sensor;
  std::vector<Hypothesis> poses;
  while (poses.size() < kMaxMotions) {
    const MotionEstimate estimate =
        estimateMotion(matches, params_.camera, motion, random, &expected);
    if (!estimate.found()) break;
    std::vector<FeatureMatch> rest;
    std::vector<const FeatureMatch*> agreeing;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (estimate.is_inlier[i] == 0) {
        rest.push_back(matches[i]);
      } else {
        agreeing.push_back(&matches[i]);
      }
    }
    poses.push_back({other.T_world_sensor * estimate.T_now_before.inverse(),
                     {},
                     estimate.inliers,
                     static_cast<double>(estimate.inliers) / static_cast<double>(matched),
                     errorOf(estimate),
                     offOnePlane(agreeing, params_.seed)});
    matches = std::move(rest);
  }
  return poses;
}

}  // namespace planar_mapping
