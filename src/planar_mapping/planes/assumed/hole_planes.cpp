// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/assumed/hole_planes.h"

#include <Eigen/LU>
#include <iterator>

namespace planar_mapping::detail {
namespace {

constexpr double kMaxTurn = 0.03;    // radians: largest error of a plane that continues
constexpr double kMinOn = 0.9;       // fraction of the tiles of a plane that lie on it
constexpr double kMaxBehind = 0.1;   // fraction of ends behind a plane, or of planes across it
constexpr int kSamples = 150;        // finds planes of a third of the ends with 99.6 %
constexpr double kTilesAlike = 2.0;  // with one error: matching looks at windows

}  // namespace

bool HolePlanes::isSeen(const Hole& hole, const Plane& plane, Indices& ends) const {
  ends.clear();
  std::size_t behind = 0;
  for (const int i : hole.ends) {
    const Vector3& point = tiles_[i].point;
    const double distance = plane.signedDistance(point);
    const double most = band(point);
    if (std::abs(distance) <= most) {
      ends.push_back(i);
    } else if (distance < 0.0) {
      ++behind;
    }
  }
  // Where others end the hole of a floor or a table, what stands on it goes on in the hole.
  const double least = up_.isZero() || isUpright(plane) ? 0.0 : kMinOn;
  return ends.size() >= kMinEnds &&
         static_cast<double>(ends.size()) >= least * static_cast<double>(hole.ends.size()) &&
         static_cast<double>(behind) <= kMaxBehind * static_cast<double>(ends.size());
}

/// Least squares in inverse depth, where the noise of a stereo camera is the same everywhere: the
/// plane q . p = 1 has the inverse depth q . ray.
bool HolePlanes::fit(HolePlane& candidate) const {
  Matrix3 squares = Matrix3::Zero();
  Vector3 sums = Vector3::Zero();
  for (const int i : candidate.ends) {
    const Vector3& point = tiles_[i].point;
    const Vector3 ray = point / point.z();
    squares += ray * ray.transpose();
    sums += ray / point.z();
  }
  const Matrix3 inverse = squares.inverse();
  const Vector3 q = inverse * sums;
  const double length = q.norm();
  if (!inverse.allFinite() || !(length > 0.0)) return false;
  double variance = 0.0;
  for (const int i : candidate.ends) {
    const Vector3& point = tiles_[i].point;
    const double error = (q.dot(point) - 1.0) / point.z();
    variance += error * error / static_cast<double>(candidate.ends.size());
  }
  if (params_.noise) {
    const double smooth = params_.noise->depthError(1.0);  // of inverse depth, too
    variance = std::max(variance, smooth * smooth);
  }
  candidate.plane = {-q / length, 1.0 / length};
  candidate.covariance = kTilesAlike * variance / (length * length) * inverse;
  return candidate.covariance.trace() <= kMaxTurn * kMaxTurn;
}

bool HolePlanes::lieOn(const Indices& tiles, const Plane& plane) const {
  const auto on = std::count_if(tiles.begin(), tiles.end(), [&](int i) {
    const Vector3& point = tiles_[i].point;
    return std::abs(plane.signedDistance(point)) <= band(point);
  });
  return static_cast<double>(on) >= kMinOn * static_cast<double>(tiles.size());
}

bool HolePlanes::join(const Indices& tiles, HolePlane& candidate) const {
  HolePlane both;
  both.number = candidate.number;
  std::set_union(candidate.ends.begin(), candidate.ends.end(), tiles.begin(), tiles.end(),
                 std::back_inserter(both.ends));
  if (!fit(both)) return false;
  if (!lieOn(candidate.ends, both.plane) || !lieOn(tiles, both.plane)) return false;
  candidate = std::move(both);
  return true;
}

/// Are its tiles of planes that are turned otherwise? A strip that lies on it, as base board and a
/// hand of floor do together, does not tell how it is turned.
bool HolePlanes::isAcross(const HolePlane& candidate,
                          const std::vector<PlaneSegment>& known) const {
  std::vector<std::size_t> tiles(known.size(), 0);
  for (const int i : candidate.ends) {
    if (tiles_[i].plane >= 0) ++tiles[static_cast<std::size_t>(tiles_[i].plane)];
  }
  std::size_t across = 0;
  for (std::size_t k = 0; k < known.size(); ++k) {
    if (tiles[k] == 0 || areTurnedAlike(known[k].plane, candidate.plane)) continue;
    if (!lieOn(tiles_.tilesOf(k), candidate.plane)) across += tiles[k];
  }
  return static_cast<double>(across) > kMaxBehind * static_cast<double>(candidate.ends.size());
}

bool HolePlanes::search(const Hole& hole, const Indices& ends,
                        const std::vector<PlaneSegment>& known, Random& random,
                        HolePlane& best) const {
  best.ends.clear();
  if (ends.size() < kMinEnds || up_.isZero()) return false;
  HolePlane candidate;
  const auto count = static_cast<std::uint32_t>(ends.size());
  for (int k = 0; k < kSamples; ++k) {
    Vector3 points[3];
    for (Vector3& point : points) point = tiles_[ends[random.below(count)]].point;
    Plane plane;
    if (!planeFromPoints(points[0], points[1], points[2], plane)) continue;
    plane = orientedTowards(plane, Vector3::Zero());
    if (!isUpright(plane)) continue;
    if (isSeen(hole, plane, candidate.ends) && candidate.ends.size() > best.ends.size()) {
      candidate.plane = plane;
      std::swap(best, candidate);
    }
  }
  return !best.ends.empty() && fit(best) && isSeen(hole, best.plane, best.ends) && fit(best) &&
         isUpright(best.plane) && !isAcross(best, known);
}

}  // namespace planar_mapping::detail
