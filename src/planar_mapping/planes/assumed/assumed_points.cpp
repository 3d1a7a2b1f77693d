// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/assumed/assumed_points.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/planes/assumed/hole_planes.h"

namespace planar_mapping {
namespace {

using detail::Hole;
using detail::HolePlane;
using detail::HolePlanes;
using detail::TileImage;

constexpr double kMinCosine = 0.1;  // between ray and normal: along a wall nothing can be said
constexpr double kMinGain = 1.25;   // factor of ends by which a new plane beats those of the frame
constexpr int kMaxPlanes = 3;       // new ones of a hole: at most a corner of a room

/// The rectangle around points of a plane.
class Extent {
 public:
  /// \param across  direction of a side, in the plane
  Extent(const Vector3& normal, const Vector3& across) {
    axes_.row(0) = across.normalized();
    axes_.row(1) = normal.cross(across).normalized();
  }
  void add(const Vector3& point) { box_.extend(Vector2(axes_ * point)); }
  bool contains(const Vector3& point) const { return box_.contains(Vector2(axes_ * point)); }

 private:
  Eigen::Matrix<double, 2, 3> axes_;
  Eigen::AlignedBox2d box_;
};

/// A plane, and the columns that show it.
struct Bound {
  Plane plane;
  double first = std::numeric_limits<double>::infinity(), last = 0.0;
  std::size_t tiles = 0;
};

class Assumption {
 public:
  Assumption(const PointsView& cloud, const Indices& indices, const Indices& ground,
             const PinholeCamera& camera, const std::vector<std::uint8_t>& even, const Vector3& up,
             const MultiPlaneParams& params, std::vector<PlaneSegment>& planes)
      : cloud_(cloud),
        camera_(camera),
        params_(params),
        planes_(planes),
        tiles_(cloud, camera, even),
        search_(tiles_, up, params),
        is_free_(cloud.size, 0) {
    for (const int i : indices) is_free_[static_cast<std::size_t>(i)] = 1;
    for (const PlaneSegment& plane : planes) {
      for (const int i : plane.inliers) is_free_[static_cast<std::size_t>(i)] = 0;
    }
    tiles_.label(planes);
    if (ground.size() < static_cast<std::size_t>(params.min_inliers)) return;
    PlaneMoments moments;
    for (const int i : ground) moments.add(cloud.point(static_cast<std::size_t>(i)));
    const PlaneMoments::Fit fit = moments.fit();
    // Ground that bends ends no wall here.
    const auto middle = static_cast<std::size_t>(ground[ground.size() / 2]);
    if (fit.valid && fit.rms <= 2.0 * search_.band(cloud.point(middle)))
      ground_ = orientedTowards(fit.plane, Vector3::Zero());
  }

  AssumedPoints run();

 private:
  /// Makes a plane of the frame of it.
  void add(HolePlane& candidate);
  std::vector<HolePlane> candidatesOf(const Hole& hole);
  void fill(const Hole& hole, const std::vector<HolePlane>& candidates);
  /// What ends a wall: the ground, and planes in the columns that show them.
  std::vector<Bound> bounds() const;

  const PointsView& cloud_;
  const PinholeCamera& camera_;
  const MultiPlaneParams& params_;
  std::vector<PlaneSegment>& planes_;
  TileImage tiles_;
  HolePlanes search_;
  std::vector<char> is_free_;  ///< points that belong to no plane
  std::optional<Plane> ground_;
  AssumedPoints out_;
};

void Assumption::add(HolePlane& candidate) {
  PlaneSegment segment;
  candidate.number = planes_.size();
  out_.of_plane.emplace_back();
  // Planes of the frame that lie on it are parts of it: pictures on a wall.
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    PlaneSegment& part = planes_[k];
    if (part.inliers.empty() || !search_.areTurnedAlike(part.plane, candidate.plane)) continue;
    const Indices tiles = tiles_.tilesOf(k);
    if (tiles.empty() || !search_.join(tiles, candidate)) continue;
    segment.inliers.insert(segment.inliers.end(), part.inliers.begin(), part.inliers.end());
    segment.moments.merge(part.moments);
    part.inliers.clear();
    Indices& assumed = out_.of_plane.back();
    assumed.insert(assumed.end(), out_.of_plane[k].begin(), out_.of_plane[k].end());
    out_.of_plane[k].clear();
  }
  segment.plane = candidate.plane;
  segment.covariance.topLeftCorner<3, 3>() = candidate.covariance;
  segment.tilt = normalizedTilt(candidate.plane);
  for (const int own : candidate.ends) {
    tiles_[own].plane = static_cast<int>(candidate.number);
    tiles_.forEachPixel(own, [&](int column, int row) {
      const int i = row * static_cast<int>(cloud_.width) + column;
      const auto k = static_cast<std::size_t>(i);
      if (is_free_[k] == 0 || !cloud_.isMeasured(k)) return;
      const Vector3 point = cloud_.point(k);
      if (!(std::abs(segment.plane.signedDistance(point)) <= search_.band(point))) return;
      is_free_[k] = 0;
      segment.inliers.push_back(i);
      segment.moments.add(point);
    });
  }
  std::sort(segment.inliers.begin(), segment.inliers.end());
  segment.rms = segment.moments.fit().rms;
  planes_.push_back(std::move(segment));
}

std::vector<HolePlane> Assumption::candidatesOf(const Hole& hole) {
  std::vector<HolePlane> candidates;
  std::size_t most = 0;
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    HolePlane known;
    known.number = k;
    const Plane& plane = planes_[k].plane;
    if (planes_[k].inliers.empty() || !search_.isSeen(hole, plane, known.ends)) continue;
    const std::size_t seen = known.ends.size();
    HolePlane with_own;
    with_own.number = k;
    const Indices own = tiles_.tilesOf(k);
    std::set_union(known.ends.begin(), known.ends.end(), own.begin(), own.end(),
                   std::back_inserter(with_own.ends));
    known = std::move(with_own);
    if (!search_.fit(known)) continue;
    most = std::max(most, seen);
    candidates.push_back(std::move(known));
  }
  Random random;
  Indices rest = hole.ends;
  for (int k = 0; k < kMaxPlanes; ++k) {
    HolePlane fresh;
    if (!search_.search(hole, rest, planes_, random, fresh)) break;
    const bool is_new =
        k > 0 || static_cast<double>(fresh.ends.size()) >= kMinGain * static_cast<double>(most);
    if (is_new) {
      add(fresh);
      const auto isGone = [&](const HolePlane& c) { return planes_[c.number].inliers.empty(); };
      detail::eraseIf(candidates, isGone);
      if (!isGone(fresh)) candidates.push_back(std::move(fresh));
    }
    rest = hole.ends;
    for (const HolePlane& one : candidates) {
      Indices left;
      std::set_difference(rest.begin(), rest.end(), one.ends.begin(), one.ends.end(),
                          std::back_inserter(left));
      rest = std::move(left);
    }
  }
  return candidates;
}

std::vector<Bound> Assumption::bounds() const {
  std::vector<Bound> found;
  for (const PlaneSegment& segment : planes_) found.push_back({segment.plane});
  for (int i = 0; i < tiles_.size(); ++i) {
    if (tiles_[i].plane < 0) continue;
    Bound& bound = found[static_cast<std::size_t>(tiles_[i].plane)];
    ++bound.tiles;
    bound.first = std::min(bound.first, tiles_.middleOf(i).x());
    bound.last = std::max(bound.last, tiles_.middleOf(i).x());
  }
  detail::eraseIf(found, [](const Bound& bound) { return bound.tiles < detail::kMinEnds; });
  if (ground_) found.push_back({*ground_, 0.0, static_cast<double>(camera_.width)});
  return found;
}

void Assumption::fill(const Hole& hole, const std::vector<HolePlane>& candidates) {
  const std::vector<Bound> bounding = bounds();
  std::vector<Extent> extents;
  for (const HolePlane& candidate : candidates) {
    extents.emplace_back(candidate.plane.normal, search_.levelAlong(candidate.plane));
    for (const int i : candidate.ends) {
      if (std::binary_search(hole.ends.begin(), hole.ends.end(), i))
        extents.back().add(tiles_[i].point);
    }
  }
  const double most = params_.distance_threshold;
  for (const int own : hole.tiles) {
    const Vector2 middle = tiles_.middleOf(own);
    const Vector3 ray = camera_.rayOf(middle.x(), middle.y());
    const HolePlane* nearest = nullptr;
    double depth = INFINITY;
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      const HolePlane& candidate = candidates[k];
      const double toward = -candidate.plane.normal.dot(ray);
      if (!(toward > kMinCosine * ray.norm())) continue;
      const double far = candidate.plane.offset / toward;
      const Vector3 point = far * ray;
      const bool is_certain =
          extents[k].contains(point) && point.dot(candidate.covariance * point) <= most * most &&
          std::abs(planes_[candidate.number].plane.signedDistance(point)) <= most;
      if (!is_certain || !(far < depth)) continue;
      depth = far;
      nearest = &candidate;
    }
    if (nearest == nullptr) continue;
    const Vector3 point = depth * ray;
    const auto hides = [&](const Bound& bound) {
      return middle.x() >= bound.first && middle.x() <= bound.last &&
             !search_.areTurnedAlike(bound.plane, nearest->plane) &&
             bound.plane.signedDistance(point) < -search_.band(point);
    };
    if (std::any_of(bounding.begin(), bounding.end(), hides)) continue;
    tiles_.forEachPixel(own, [&](int column, int row) {
      const Vector3 to = camera_.rayOf(column, row);
      const double far = -nearest->plane.offset / nearest->plane.normal.dot(to);
      if (!(far > 0.0)) return;
      out_.of_plane[nearest->number].push_back(static_cast<int>(out_.xyz.size() / 3));
      for (int k = 0; k < 3; ++k) out_.xyz.push_back(static_cast<float>(far * to[k]));
    });
  }
}

AssumedPoints Assumption::run() {
  out_.of_plane.resize(planes_.size());
  for (const Hole& hole : tiles_.findHoles()) fill(hole, candidatesOf(hole));
  std::size_t kept = 0;
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    if (planes_[k].inliers.empty()) continue;
    if (kept != k) {
      planes_[kept] = std::move(planes_[k]);
      out_.of_plane[kept] = std::move(out_.of_plane[k]);
    }
    ++kept;
  }
  planes_.resize(kept);
  out_.of_plane.resize(kept);
  return std::move(out_);
}

void requireTiles(const PointsView& cloud, const PinholeCamera& camera,
                  const std::vector<std::uint8_t>& even) {
  const std::size_t tiles =
      std::size_t{cloud.width / kEvenTileSide} * (cloud.height / kEvenTileSide);
  if (!cloud.isOrganized() || static_cast<int>(cloud.width) != camera.width ||
      static_cast<int>(cloud.height) != camera.height || even.size() != tiles) {
    throw InputError("points are assumed for the pixels of an organized cloud of the camera only");
  }
}

}  // namespace

Indices carriedPoints(const PointsView& cloud, const PinholeCamera& camera,
                      const std::vector<std::uint8_t>& even) {
  requireTiles(cloud, camera, even);
  const TileImage tiles(cloud, camera, even);
  Indices carried;
  for (const int tile : tiles.besideHoles()) {
    tiles.forEachPixel(tile, [&](int column, int row) {
      const int i = row * static_cast<int>(cloud.width) + column;
      if (cloud.isMeasured(static_cast<std::size_t>(i))) carried.push_back(i);
    });
  }
  std::sort(carried.begin(), carried.end());
  return carried;
}

AssumedPoints assumePoints(const PointsView& cloud, const Indices& indices, const Indices& ground,
                           const PinholeCamera& camera, const std::vector<std::uint8_t>& even,
                           const Vector3& up, const MultiPlaneParams& params,
                           std::vector<PlaneSegment>& planes) {
  requireTiles(cloud, camera, even);
  return Assumption(cloud, indices, ground, camera, even, up, params, planes).run();
}

}  // namespace planar_mapping
