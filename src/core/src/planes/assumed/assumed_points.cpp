// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/planes/detail/assumed_points.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

constexpr int kSide = kEvenTileSide;
constexpr float kStep = 3.0f;        // gray levels between neighbouring tiles that are an edge
constexpr float kEven = 3.0f;        // standard deviations of the noise within an even tile
constexpr float kLeastNoise = 2.0f;  // gray levels: saturated parts of an image have none
constexpr double kMinCosine = 0.1;   // between ray and normal: along a wall nothing can be said
constexpr int kMinMeasured = kSide * kSide / 2;  // pixels of a tile at the end of a hole
constexpr int kRim = 3;              // tiles between a hole and what is measured beside it
constexpr std::size_t kMinEnds = 8;  // tiles of a plane at the ends of a hole
constexpr double kReach = 1.2;       // farthest assumed depth, in units of that of the ends
constexpr double kMaxTurn = 0.03;    // radians: largest error of a plane that continues
constexpr double kMinOn = 0.9;       // fraction of the tiles of a plane that lie on it
constexpr double kMaxBehind = 0.1;   // fraction of ends behind a plane, or of planes across it
constexpr double kMinGain = 1.25;    // factor of ends by which a new plane beats those of the frame
constexpr int kMaxPlanes = 3;        // new ones of a hole: at most a corner of a room
constexpr int kSamples = 150;        // finds planes of a third of the ends with 99.6 %
constexpr double kUpright = 0.17;    // radians: ten degrees
constexpr double kTilesAlike = 2.0;  // with one error: matching looks at windows

/// Opposite ones are four apart.
constexpr std::array<std::array<int, 2>, 8> kDirections = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

struct Tile {
  int measured = 0;
  bool is_visited = false;
  int plane = -1;                   ///< that most of what is measured belongs to
  Vector3 point = Vector3::Zero();  ///< the mean in an image of inverse depth
};

/// Even tiles without a step between them that are not measured, and measured ones around them.
struct Hole {
  Indices tiles;
  Indices ends;  ///< ascending
};

/// A plane that may continue in a hole.
struct Candidate {
  std::size_t number = 0;  ///< of the frame's planes
  Plane plane;
  Matrix3 covariance = Matrix3::Zero();  ///< of its distance from points p: p . covariance . p
  Indices ends;                          ///< tiles on it, ascending
};

double turn(const Vector2& a, const Vector2& b, const Vector2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Andrew's monotone chain.
std::vector<Vector2> convexHull(std::vector<Vector2> points) {
  std::sort(points.begin(), points.end(), [](const Vector2& a, const Vector2& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Vector2> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t start = hull.size();
    for (const Vector2& p : points) {
      while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0.0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

bool isWithin(const std::vector<Vector2>& hull, const Vector2& point) {
  for (std::size_t i = 0; i < hull.size(); ++i) {
    if (turn(hull[i], hull[(i + 1) % hull.size()], point) < 0.0) return false;
  }
  return hull.size() > 2;
}

class Assumption {
 public:
  Assumption(const PointsView& cloud, const Indices& indices, const PinholeCamera& camera,
             const std::vector<std::uint8_t>& even, const Vector3& up,
             const MultiPlaneParams& params, std::vector<PlaneSegment>& planes)
      : cloud_(cloud),
        camera_(camera),
        even_(even),
        up_(up),
        params_(params),
        planes_(planes),
        width_(static_cast<int>(cloud.width) / kSide),
        height_(static_cast<int>(cloud.height) / kSide),
        tiles_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)),
        is_free_(cloud.size, 0) {
    for (const int i : indices) is_free_[static_cast<std::size_t>(i)] = 1;
  }

  AssumedPoints run();

 private:
  Tile& tile(int i) { return tiles_[static_cast<std::size_t>(i)]; }
  const Tile& tile(int i) const { return tiles_[static_cast<std::size_t>(i)]; }
  bool isEven(int i, std::size_t bit) const {
    return (even_[static_cast<std::size_t>(i)] >> bit) % 2 == 1;
  }
  bool isHole(int i) const { return tile(i).measured == 0 && isEven(i, 0); }
  Vector2 middleOf(int i) const {
    return {kSide * (i % width_ + 0.5) - 0.5, kSide * (i / width_ + 0.5) - 0.5};
  }
  /// The tile so many steps away in a direction; -1 outside.
  int beside(int i, std::size_t direction, int steps = 1) const {
    const int x = i % width_ + steps * kDirections[direction][0];
    const int y = i / width_ + steps * kDirections[direction][1];
    return x >= 0 && y >= 0 && x < width_ && y < height_ ? y * width_ + x : -1;
  }
  /// How far off a plane a point of it may seem.
  double band(const Vector3& point) const {
    return params_.noise
               ? std::max(params_.distance_threshold, params_.noise->depthError(point.z()))
               : params_.distance_threshold;
  }
  void measureTiles();
  void labelTiles();
  std::vector<Hole> findHoles();
  Indices endsOf(const Hole& hole) const;
  /// The ends that lie on a plane. \return false if they are too few or the plane is seen through
  bool isSeen(const Hole& hole, const Plane& plane, Indices& ends) const;
  bool isUpright(const Plane& plane) const {
    return !up_.isZero() && std::abs(plane.normal.dot(up_)) <= kUpright;
  }
  /// \return false if the tiles leave open how the plane is turned
  bool fit(Candidate& candidate) const;
  /// Fits a plane to tiles as well. \return false if not all of them lie on one
  bool join(const Indices& tiles, Candidate& candidate) const;
  Indices tilesOf(std::size_t plane) const;
  /// Are its tiles of planes that are turned otherwise?
  bool isAcross(const Candidate& candidate) const;
  bool search(const Hole& hole, const Indices& ends, Random& random, Candidate& best) const;
  /// Makes a plane of the frame of it.
  void add(Candidate& candidate);
  std::vector<Candidate> candidatesOf(const Hole& hole);
  void fill(const Hole& hole, const std::vector<Candidate>& candidates);

  const PointsView& cloud_;
  const PinholeCamera& camera_;
  const std::vector<std::uint8_t>& even_;
  const Vector3 up_;
  const MultiPlaneParams& params_;
  std::vector<PlaneSegment>& planes_;
  int width_;
  int height_;
  std::vector<Tile> tiles_;
  std::vector<char> is_free_;  ///< points that belong to no plane
  AssumedPoints out_;
};

void Assumption::measureTiles() {
  for (int i = 0; i < width_ * height_; ++i) {
    Vector3 sum = Vector3::Zero();  // of column, row and inverse depth
    int count = 0;
    for (int row = kSide * (i / width_), last = row + kSide; row < last; ++row) {
      for (int column = kSide * (i % width_), end = column + kSide; column < end; ++column) {
        const std::size_t k =
            static_cast<std::size_t>(row) * cloud_.width + static_cast<std::size_t>(column);
        if (!cloud_.isFinite(k)) continue;
        sum += Vector3(column, row, 1.0 / double{cloud_[k][2]});
        ++count;
      }
    }
    tile(i).measured = count;
    if (count > 0) tile(i).point = camera_.rayOf(sum[0] / count, sum[1] / count) * count / sum[2];
  }
}

void Assumption::labelTiles() {
  std::vector<int> votes(tiles_.size());
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    std::fill(votes.begin(), votes.end(), 0);
    for (const int i : planes_[k].inliers) {
      is_free_[static_cast<std::size_t>(i)] = 0;
      const int column = i % static_cast<int>(cloud_.width) / kSide;
      const int row = i / static_cast<int>(cloud_.width) / kSide;
      if (column >= width_ || row >= height_) continue;
      const int own = row * width_ + column;
      if (2 * ++votes[static_cast<std::size_t>(own)] > tile(own).measured)
        tile(own).plane = static_cast<int>(k);
    }
  }
}

Indices Assumption::tilesOf(std::size_t plane) const {
  Indices tiles;
  for (int i = 0; i < width_ * height_; ++i) {
    if (tile(i).plane == static_cast<int>(plane)) tiles.push_back(i);
  }
  return tiles;
}

std::vector<Hole> Assumption::findHoles() {
  std::vector<Hole> holes;
  for (int seed = 0; seed < width_ * height_; ++seed) {
    if (!isHole(seed) || tile(seed).is_visited) continue;
    Hole hole;
    hole.tiles.push_back(seed);
    tile(seed).is_visited = true;
    for (std::size_t k = 0; k < hole.tiles.size(); ++k) {
      const int own = hole.tiles[k];
      for (std::size_t direction = 0; direction < 8; direction += 2) {
        const int next = beside(own, direction);
        if (next < 0 || !isHole(next) || tile(next).is_visited) continue;
        const bool is_step =
            direction < 4 ? isEven(own, 1 + direction) : isEven(next, direction - 3);
        if (is_step) continue;
        tile(next).is_visited = true;
        hole.tiles.push_back(next);
      }
    }
    hole.ends = endsOf(hole);
    if (hole.ends.size() >= kMinEnds) holes.push_back(std::move(hole));
  }
  // What is seen best comes first: its planes are known to the others.
  std::stable_sort(holes.begin(), holes.end(),
                   [](const Hole& a, const Hole& b) { return a.ends.size() > b.ends.size(); });
  return holes;
}

Indices Assumption::endsOf(const Hole& hole) const {
  Indices ends;
  for (const int own : hole.tiles) {
    for (std::size_t direction = 0; direction < 8; ++direction) {
      for (int steps = 1; steps <= kRim + 1; ++steps) {
        const int next = beside(own, direction, steps);
        if (next < 0 || isHole(next)) break;
        if (tile(next).measured < kMinMeasured) continue;
        ends.push_back(next);
        break;
      }
    }
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

bool Assumption::isSeen(const Hole& hole, const Plane& plane, Indices& ends) const {
  ends.clear();
  std::size_t behind = 0;
  for (const int i : hole.ends) {
    const Vector3& point = tile(i).point;
    const double distance = plane.signedDistance(point);
    const double most = band(point);
    if (std::abs(distance) <= most) {
      ends.push_back(i);
    } else if (distance < 0.0) {
      ++behind;
    }
  }
  return ends.size() >= kMinEnds &&
         static_cast<double>(behind) <= kMaxBehind * static_cast<double>(ends.size());
}

/// Least squares in inverse depth, where the noise of a stereo camera is the same everywhere: the
/// plane q . p = 1 has the inverse depth q . ray.
bool Assumption::fit(Candidate& candidate) const {
  Matrix3 squares = Matrix3::Zero();
  Vector3 sums = Vector3::Zero();
  for (const int i : candidate.ends) {
    const Vector3& point = tile(i).point;
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
    const Vector3& point = tile(i).point;
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

bool Assumption::join(const Indices& tiles, Candidate& candidate) const {
  Candidate both;
  both.number = candidate.number;
  std::set_union(candidate.ends.begin(), candidate.ends.end(), tiles.begin(), tiles.end(),
                 std::back_inserter(both.ends));
  if (!fit(both)) return false;
  for (const Indices* set : {static_cast<const Indices*>(&candidate.ends), &tiles}) {
    const auto on = std::count_if(set->begin(), set->end(), [&](int i) {
      const Vector3& point = tile(i).point;
      return std::abs(both.plane.signedDistance(point)) <= band(point);
    });
    if (static_cast<double>(on) < kMinOn * static_cast<double>(set->size())) return false;
  }
  candidate = std::move(both);
  return true;
}

bool Assumption::isAcross(const Candidate& candidate) const {
  const auto across = std::count_if(candidate.ends.begin(), candidate.ends.end(), [&](int i) {
    const int own = tile(i).plane;
    return own >= 0 && planes_[static_cast<std::size_t>(own)].plane.normal.dot(
                           candidate.plane.normal) < std::cos(kUpright);
  });
  return static_cast<double>(across) > kMaxBehind * static_cast<double>(candidate.ends.size());
}

bool Assumption::search(const Hole& hole, const Indices& ends, Random& random,
                        Candidate& best) const {
  best.ends.clear();
  if (ends.size() < kMinEnds || up_.isZero()) return false;
  Candidate candidate;
  const auto count = static_cast<std::uint32_t>(ends.size());
  for (int k = 0; k < kSamples; ++k) {
    Vector3 points[3];
    for (Vector3& point : points) point = tile(ends[random.below(count)]).point;
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
         isUpright(best.plane) && !isAcross(best);
}

void Assumption::add(Candidate& candidate) {
  PlaneSegment segment;
  candidate.number = planes_.size();
  out_.of_plane.emplace_back();
  // Planes of the frame that lie on it are parts of it: pictures on a wall.
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    PlaneSegment& part = planes_[k];
    if (part.inliers.empty() || part.plane.normal.dot(candidate.plane.normal) < std::cos(kUpright))
      continue;
    const Indices tiles = tilesOf(k);
    if (tiles.empty() || !join(tiles, candidate)) continue;
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
    tile(own).plane = static_cast<int>(candidate.number);
    for (int row = kSide * (own / width_), last = row + kSide; row < last; ++row) {
      for (int column = kSide * (own % width_), end = column + kSide; column < end; ++column) {
        const int i = row * static_cast<int>(cloud_.width) + column;
        const auto k = static_cast<std::size_t>(i);
        if (is_free_[k] == 0 || !cloud_.isFinite(k)) continue;
        const Vector3 point = cloud_.point(k);
        if (!(std::abs(segment.plane.signedDistance(point)) <= band(point))) continue;
        is_free_[k] = 0;
        segment.inliers.push_back(i);
        segment.moments.add(point);
      }
    }
  }
  std::sort(segment.inliers.begin(), segment.inliers.end());
  segment.rms = segment.moments.fit().rms;
  planes_.push_back(std::move(segment));
}

std::vector<Candidate> Assumption::candidatesOf(const Hole& hole) {
  std::vector<Candidate> candidates;
  std::size_t most = 0;
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    Candidate known;
    known.number = k;
    const Plane& plane = planes_[k].plane;
    if (planes_[k].inliers.empty() || !isSeen(hole, plane, known.ends)) continue;
    const std::size_t seen = known.ends.size();
    Candidate with_own;
    with_own.number = k;
    const Indices own = tilesOf(k);
    std::set_union(known.ends.begin(), known.ends.end(), own.begin(), own.end(),
                   std::back_inserter(with_own.ends));
    known = std::move(with_own);
    if (!fit(known)) continue;
    most = std::max(most, seen);
    candidates.push_back(std::move(known));
  }
  Random random;
  Indices rest = hole.ends;
  for (int k = 0; k < kMaxPlanes; ++k) {
    Candidate fresh;
    if (!search(hole, rest, random, fresh)) break;
    const bool is_new =
        k > 0 || static_cast<double>(fresh.ends.size()) >= kMinGain * static_cast<double>(most);
    if (is_new) {
      add(fresh);
      const auto isGone = [&](const Candidate& c) { return planes_[c.number].inliers.empty(); };
      candidates.erase(std::remove_if(candidates.begin(), candidates.end(), isGone),
                       candidates.end());
      if (!isGone(fresh)) candidates.push_back(std::move(fresh));
    }
    rest = hole.ends;
    for (const Candidate& one : candidates) {
      Indices left;
      std::set_difference(rest.begin(), rest.end(), one.ends.begin(), one.ends.end(),
                          std::back_inserter(left));
      rest = std::move(left);
    }
  }
  return candidates;
}

void Assumption::fill(const Hole& hole, const std::vector<Candidate>& candidates) {
  std::vector<std::vector<Vector2>> hulls;
  std::vector<double> reach;
  for (const Candidate& candidate : candidates) {
    std::vector<Vector2> points;
    reach.push_back(0.0);
    for (const int i : candidate.ends) {
      points.push_back(middleOf(i));
      reach.back() = std::max(reach.back(), kReach * tile(i).point.z());
    }
    // A wall goes on above and below what is seen of it.
    if (isUpright(candidate.plane)) {
      const std::size_t size = points.size();
      for (std::size_t i = 0; i < size; ++i) {
        const double column = points[i].x();
        points[i].y() = -1.0;
        points.emplace_back(column, camera_.height);
      }
    }
    hulls.push_back(convexHull(std::move(points)));
  }
  const double most = params_.distance_threshold;
  for (const int own : hole.tiles) {
    const Vector2 middle = middleOf(own);
    const Vector3 ray = camera_.rayOf(middle.x(), middle.y());
    const Candidate* nearest = nullptr;
    double depth = INFINITY;
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      const Candidate& candidate = candidates[k];
      const double toward = -candidate.plane.normal.dot(ray);
      if (!isWithin(hulls[k], middle) || !(toward > kMinCosine * ray.norm())) continue;
      const double far = candidate.plane.offset / toward;
      const Vector3 point = far * ray;
      const bool is_certain =
          far <= reach[k] && point.dot(candidate.covariance * point) <= most * most &&
          std::abs(planes_[candidate.number].plane.signedDistance(point)) <= most;
      if (!is_certain || !(far < depth)) continue;
      depth = far;
      nearest = &candidate;
    }
    if (nearest == nullptr) continue;
    for (int row = kSide * (own / width_), last = row + kSide; row < last; ++row) {
      for (int column = kSide * (own % width_), end = column + kSide; column < end; ++column) {
        const Vector3 to = camera_.rayOf(column, row);
        const double far = -nearest->plane.offset / nearest->plane.normal.dot(to);
        if (!(far > 0.0)) continue;
        out_.of_plane[nearest->number].push_back(static_cast<int>(out_.xyz.size() / 3));
        for (int k = 0; k < 3; ++k) out_.xyz.push_back(static_cast<float>(far * to[k]));
      }
    }
  }
}

AssumedPoints Assumption::run() {
  out_.of_plane.resize(planes_.size());
  measureTiles();
  labelTiles();
  for (const Hole& hole : findHoles()) fill(hole, candidatesOf(hole));
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

}  // namespace

std::vector<std::uint8_t> evenTiles(const std::uint8_t* gray, int width, int height) {
  const int columns = width / kSide;
  const int rows = height / kSide;
  constexpr float kPixels = kSide * kSide;
  std::vector<float> means;
  std::vector<float> deviations;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      int sum = 0;
      int squares = 0;
      for (int row = kSide * y; row < kSide * (y + 1); ++row) {
        const std::uint8_t* values = gray + static_cast<std::ptrdiff_t>(row) * width + kSide * x;
        for (int column = 0; column < kSide; ++column) {
          sum += values[column];
          squares += values[column] * values[column];
        }
      }
      const float mean = static_cast<float>(sum) / kPixels;
      means.push_back(mean);
      deviations.push_back(
          std::sqrt(std::max(0.0f, static_cast<float>(squares) / kPixels - mean * mean)));
    }
  }
  std::vector<std::uint8_t> even(means.size(), 0);
  if (means.empty()) return even;
  // The evenest tenth shows the noise of the camera.
  std::vector<float> sorted = deviations;
  const auto tenth = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 10);
  std::nth_element(sorted.begin(), tenth, sorted.end());
  const float most = std::max(kEven * *tenth, kLeastNoise);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const auto i = static_cast<std::size_t>(y * columns + x);
      unsigned flags = deviations[i] <= most ? 1u : 0u;
      for (unsigned k = 0; k < 4; ++k) {
        const int u = x + kDirections[k][0];
        const int v = y + kDirections[k][1];
        if (u < 0 || u >= columns || v >= rows) continue;
        const float step = means[i] - means[static_cast<std::size_t>(v * columns + u)];
        flags |= std::fabs(step) > kStep ? 2u << k : 0u;
      }
      even[i] = static_cast<std::uint8_t>(flags);
    }
  }
  return even;
}

AssumedPoints assumePoints(const PointsView& cloud, const Indices& indices,
                           const PinholeCamera& camera, const std::vector<std::uint8_t>& even,
                           const Vector3& up, const MultiPlaneParams& params,
                           std::vector<PlaneSegment>& planes) {
  const std::size_t tiles = std::size_t{cloud.width / kSide} * (cloud.height / kSide);
  if (!cloud.isOrganized() || static_cast<int>(cloud.width) != camera.width ||
      static_cast<int>(cloud.height) != camera.height || even.size() != tiles) {
    throw InputError("points are assumed for the pixels of an organized cloud of the camera only");
  }
  return Assumption(cloud, indices, camera, even, up, params, planes).run();
}

}  // namespace planar_mapping
