// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/surface_map.h"

#include <algorithm>
#include <deque>

#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/registration/seen_through.h"
#include "planar_mapping/localization/registration/surface_registration.h"
#include "planar_mapping/localization/registration/surface_search.h"
#include "planar_mapping/localization/registration/surface_shape.h"

namespace planar_mapping {

namespace {

/// 65 kB each.
constexpr std::size_t kMaxViews = 32;
constexpr double kSecondBest = 0.9;     // of the best place's worth, which is no more certain then
constexpr double kContradiction = 5.0;  // a plane seen through costs as much as so many that fit

}  // namespace

class SurfaceMap::Implementation {
 public:
  explicit Implementation(const SurfaceMapParams& params)
      : params_(params),
        rest_{detail::SurfaceCells(params.cell), Pose::Identity()},
        fine_(params.cell),
        coarse_(2.0 * params.cell),
        edges_(2.0 * params.cell, detail::CellShape::Line) {
    params.validate();
  }

  void insert(const PointsView& cloud, const Pose& T_world_sensor) {
    constexpr double kSamePlace = 1e-6;  // metres, radians: rounding
    const bool is_scanner = isScanner();
    // Added again, the clouds of a scanner that creeps would draw it along.
    if (is_scanner && rest_.seen.size() > 0 &&
        motionDifference(T_world_sensor, rest_.T_world_sensor).norm() < kSamePlace) {
      return;
    }
    ++frame_;
    views_.push_back({detail::SeenRanges(cloud, params_), T_world_sensor.inverse()});
    if (views_.size() > kMaxViews) views_.pop_front();
    if (is_scanner) views_.back().seen.markGone(coarse_, views_.back().T_sensor_world);
    rest_ = {detail::SurfaceCells(params_.cell), T_world_sensor};
    const Vector3 sensor = T_world_sensor.translation();
    detail::forSample(cloud, params_, [&](const Vector3& p, double error) {
      const Vector3 q = T_world_sensor * p;
      fine_.add(q, sensor, error, frame_);
      coarse_.add(q, sensor, error, frame_);
      if (is_scanner) rest_.seen.add(p, Vector3::Zero(), error, 0);
    });
    for (const Vector3& p : detail::occludingEdges(cloud)) {
      edges_.add(T_world_sensor * p, sensor, detail::kEdgeError, frame_);
    }
    rest_.seen.fit();
    for (detail::SurfaceCells* cells : {&fine_, &coarse_, &edges_}) {
      cells->fit();
      cells->limit(static_cast<std::size_t>(params_.max_cells));
    }
  }

  CloudRegistration locateNear(const PointsView& cloud, const Pose& guess, int lost) const {
    const detail::CloudShape shape = detail::shapeOf(cloud, params_);
    const detail::MappedSurfaces map = near(guess.translation(), rangeOf(shape));
    const detail::SurfaceRegistration registration(params_, shape, map);
    const detail::RegistrationCandidate drawn = registration.run(guess);
    CloudRegistration result = registration.resultOf(drawn);
    if (isAtRest(shape, drawn.T_sensor_world)) {
      const CloudRegistration at_rest =
          registration.resultOf(registration.at(rest_.T_world_sensor.inverse()));
      if (at_rest.found) result = at_rest;
    }
    return verified(result, shape, detail::SeenRanges(cloud, params_), lost, true);
  }

  /// At the one place where it fits; nowhere if there are two.
  /// \param near   a place found already
  /// \param lost   clouds before that were not found: so many times farther around
  CloudRegistration locateFar(const PointsView& cloud, const Pose& guess,
                              const CloudRegistration& near, int lost) const {
    if (isScanner()) return locateScan(cloud, guess, near, lost);
    constexpr double kBetter = 1.1;  // times the fit at the place next to the guess
    constexpr double kAsGood = 0.9;  // likewise, for what is that place
    std::vector<CloudRegistration> found;
    for (const CloudRegistration& place : lookAround(cloud, guess, 0))
      if (place.found && (place.known || isSamePlace(place, near))) found.push_back(place);
    if (near.found) found.push_back(near);
    CloudRegistration best = bestOf(found);
    // Rays may contradict the place next to the guess because depths are noisy: a camera is not
    // placed elsewhere unless its cloud fits better there.
    const double needed = isSamePlace(best, near) ? kAsGood : kBetter;
    if (best.fraction < needed * near.fraction || hasRival(best, found)) return {};
    return best;
  }

  const SurfaceMapParams& params() const { return params_; }
  std::size_t cells() const { return fine_.size(); }

 private:
  bool isScanner() const { return params_.optical_axis.isZero(); }

  static double worth(const CloudRegistration& r) {
    return r.fraction - kContradiction * r.seen_through;
  }

  /// The first of those of most worth; not found where there is none.
  static CloudRegistration bestOf(const std::vector<CloudRegistration>& found) {
    const auto best =
        std::max_element(found.begin(), found.end(),
                         [](const auto& a, const auto& b) { return worth(a) < worth(b); });
    return best == found.end() ? CloudRegistration() : *best;
  }

  /// Is the cloud worth nearly as much in another place?
  bool hasRival(const CloudRegistration& best, const std::vector<CloudRegistration>& found) const {
    return std::any_of(found.begin(), found.end(), [&](const CloudRegistration& other) {
      return worth(other) > kSecondBest * worth(best) && !isSamePlace(best, other);
    });
  }

  /// A hall looks alike from its other end: what fits in several places fits nowhere.
  CloudRegistration locateScan(const PointsView& cloud, const Pose& guess,
                               const CloudRegistration& near, int lost) const {
    if (!(params_.search_reach > 0.0)) return near;
    std::vector<CloudRegistration> found;
    if (near.found) found.push_back(near);
    for (const CloudRegistration& place : lookAround(cloud, guess, lost))
      if (place.found) found.push_back(place);
    const CloudRegistration best = bestOf(found);
    if (!best.found || worth(best) < params_.min_fraction || hasRival(best, found)) return {};
    if (near.found && isSamePlace(best, near)) return near;
    return best.known ? best : CloudRegistration();
  }

  static std::vector<detail::Surfel> within(const detail::SurfaceCells& cells, const Vector3& place,
                                            double range) {
    std::vector<detail::Surfel> planes;
    for (const detail::Surfel& plane : cells.planes()) {
      if ((plane.center - place).norm() < range) planes.push_back(plane);
    }
    return planes;
  }

  /// Whether a scanner has hardly moved and its cloud lies no better for it. What stands still is
  /// cut into the same cells as the cloud before; in the map it is cut otherwise, and slides a
  /// little with each cloud.
  bool isAtRest(const detail::CloudShape& shape, const Pose& T_sensor_world) const {
    constexpr double kSlide = 0.08;     // of a cell
    constexpr double kTurn = 0.02;      // radians
    constexpr double kNoBetter = 0.98;  // a shift by four tenths of the depth error costs as much
    const Vector6 moved = motionDifference(T_sensor_world, Pose(rest_.T_world_sensor.inverse()));
    if (!isScanner() || moved.head<3>().norm() > kSlide * params_.cell ||
        moved.tail<3>().norm() > kTurn) {
      return false;
    }
    const detail::SurfaceCells none(params_.cell, detail::CellShape::Line);
    const detail::MappedSurfaces before{
        rest_.seen, none, detail::PlaneNeighbours({}, params_.reach, detail::CellShape::Plane),
        detail::PlaneNeighbours({}, params_.reach, detail::CellShape::Line)};
    const detail::SurfaceRegistration registration(params_, shape, before);
    const double at_rest = registration.at(Pose::Identity()).at_end.score;
    const double drawn = registration.at(T_sensor_world * rest_.T_world_sensor).at_end.score;
    return at_rest > 0.0 && at_rest >= kNoBetter * drawn;
  }

  double rangeOf(const detail::CloudShape& shape) const {
    double range = params_.reach;
    for (const detail::Surfel& plane : shape.coarse.planes) {
      range = std::max(range, plane.center.norm() + params_.reach);
    }
    return range;
  }

  /// What of the map is near a place.
  detail::MappedSurfaces near(const Vector3& place, double range) const {
    return {fine_, edges_,
            detail::PlaneNeighbours(within(coarse_, place, range), params_.reach,
                                    detail::CellShape::Plane),
            detail::PlaneNeighbours(within(edges_, place, range), params_.reach,
                                    detail::CellShape::Line)};
  }

  /// Refuses what sees through the map. Planes that have gone (trails of people) do not count next
  /// to the guess, nor in the worth of places, unless clouds before were not found.
  CloudRegistration verified(CloudRegistration result, const detail::CloudShape& shape,
                             const detail::SeenRanges& seen, int lost, bool is_near = false) const {
    if (!result.found) return result;
    detail::SeenThrough now;
    detail::SeenThrough lasting;
    for (const detail::Surfel& plane : coarse_.planes()) {
      const detail::SeenThrough one = seen.compare(plane, result.T_world_sensor.inverse());
      now += one;
      if (!plane.gone || lost > 0) lasting += one;
    }
    detail::SeenThrough before;
    for (const View& view : views_) {
      before += view.seen.compare(shape.coarse.planes, view.T_sensor_world * result.T_world_sensor);
    }
    result.seen_through = std::max(lasting.fraction(), before.fraction());
    const double fraction = is_near ? lasting.fraction() : now.fraction();
    result.found = std::max(fraction, before.fraction()) <= params_.max_seen_through;
    return result;
  }

  /// Far from the guess, the best place first.
  std::vector<CloudRegistration> lookAround(const PointsView& cloud, const Pose& guess,
                                            int lost) const {
    if (!(params_.search_reach > 0.0)) return {};
    const detail::CloudShape shape = detail::shapeOf(cloud, params_);
    const detail::SeenRanges seen(cloud, params_);
    const double reach = (1 + lost) * params_.search_reach;
    const double range = rangeOf(shape) + reach;
    SurfaceMapParams params = params_;
    params.search_reach = reach;
    const detail::MappedSurfaces map = near(guess.translation(), range);
    const detail::SurfaceRegistration registration(params_, shape, map);
    const detail::SurfaceSearch search(params, shape.coarse,
                                       within(coarse_, guess.translation(), range));
    std::vector<CloudRegistration> found;
    for (const Pose& start : search.candidates(guess)) {
      CloudRegistration result =
          verified(registration.resultOf(registration.settle(start)), shape, seen, lost);
      result.known = search.knowsPlace(result.T_world_sensor);
      found.push_back(result);
    }
    std::stable_sort(found.begin(), found.end(),
                     [&](const auto& a, const auto& b) { return worth(a) > worth(b); });
    return found;
  }

  bool isSamePlace(const CloudRegistration& a, const CloudRegistration& b) const {
    constexpr double kSameTurn = 0.1;  // radians
    const Vector6 apart = motionDifference(a.T_world_sensor, b.T_world_sensor);
    return apart.head<3>().norm() < params_.reach && apart.tail<3>().norm() < kSameTurn;
  }

  /// Where a cloud was seen from, and how far.
  struct View {
    detail::SeenRanges seen;
    Pose T_sensor_world = Pose::Identity();
  };

  /// The cloud with which the sensor came to rest, in its own frame.
  struct Rest {
    detail::SurfaceCells seen;
    Pose T_world_sensor = Pose::Identity();
  };

  SurfaceMapParams params_;
  std::deque<View> views_;
  Rest rest_;
  detail::SurfaceCells fine_;
  detail::SurfaceCells coarse_;
  detail::SurfaceCells edges_;
  std::int64_t frame_ = 0;
};

SurfaceMap::SurfaceMap(const SurfaceMapParams& params)
    : implementation_(std::make_unique<Implementation>(params)) {}
SurfaceMap::~SurfaceMap() = default;
SurfaceMap::SurfaceMap(const SurfaceMap& other)
    : implementation_(std::make_unique<Implementation>(*other.implementation_)) {}
SurfaceMap& SurfaceMap::operator=(const SurfaceMap& other) {
  return *this = SurfaceMap(other);
}
SurfaceMap::SurfaceMap(SurfaceMap&&) noexcept = default;
SurfaceMap& SurfaceMap::operator=(SurfaceMap&&) noexcept = default;

const SurfaceMapParams& SurfaceMap::params() const {
  return implementation_->params();
}

void SurfaceMap::insert(const PointsView& cloud, const Pose& T_world_sensor) {
  requireRigid("the pose of a cloud", T_world_sensor);
  implementation_->insert(cloud, T_world_sensor);
}

CloudRegistration SurfaceMap::locate(const PointsView& cloud, const Pose& guess, int lost) const {
  CloudRegistration near = locateNear(cloud, guess, lost);
  if (near.found) return near;
  CloudRegistration far = locateFar(cloud, guess, near, lost);
  return far.found ? far : near;
}

CloudRegistration SurfaceMap::locateFar(const PointsView& cloud, const Pose& guess,
                                        const CloudRegistration& near, int lost) const {
  return implementation_->locateFar(cloud, guess, near, lost);
}

CloudRegistration SurfaceMap::locateNear(const PointsView& cloud, const Pose& guess,
                                         int lost) const {
  requireRigid("the guessed pose of a cloud", guess);
  return implementation_->locateNear(cloud, guess, lost);
}

std::size_t SurfaceMap::cells() const {
  return implementation_->cells();
}

}  // namespace planar_mapping
