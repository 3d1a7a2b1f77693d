// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where a cloud was seen from.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/geometry/cloud_sample.h"
#include "planar_mapping/geometry/cloud_scale.h"

namespace planar_mapping {
namespace {

using detail::isUsable;
using detail::kLargestSample;

constexpr std::size_t kMinSights = 100;  // fewer tell nothing of what is hidden
constexpr double kMaxSlope = 2.0;        // 63 degrees; a scan with its floor at z = 0 goes beyond

/// How far a cloud's nearest points are in each direction from the origin. Directions lie in rings
/// of equal height, which are cut into pieces of equal width.
class NearestRanges {
 public:
  /// \param degrees  width of a direction
  NearestRanges(const PointsView& points, const Indices& indices, double degrees)
      : width_(degrees * kRadiansPerDegree),
        rings_(static_cast<int>(std::ceil(180.0 / degrees)) + 2),
        pieces_(2 * rings_),
        ranges_(static_cast<std::size_t>(rings_) * static_cast<std::size_t>(pieces_), kNothing) {
    for (const int i : indices) {
      const Vector3 p = points.point(static_cast<std::size_t>(i));
      float& nearest = ranges_[cellOf(ringOf(p), 0, p)];
      nearest = std::min(nearest, static_cast<float>(p.norm()));
    }
  }

  /// Whether the nearest point in the direction of \p p is less than 1 / \p times as far.
  bool isBehind(const Vector3& p, double times) const {
    return p.norm() > times * ranges_[cellOf(ringOf(p), 0, p)];
  }

  /// Whether those of the directions on all four sides of it are: no edge of what is before it.
  bool isSurrounded(const Vector3& p, double times) const {
    const int ring = ringOf(p);
    const double range = p.norm();
    for (const auto& [up, aside] : {std::pair(0, -1), {0, 1}, {-1, 0}, {1, 0}}) {
      if (!(range > times * ranges_[cellOf(ring + up, aside, p)])) return false;
    }
    return true;
  }

 private:
  static constexpr float kNothing = std::numeric_limits<float>::infinity();

  int ringOf(const Vector3& p) const {
    return static_cast<int>(std::floor(std::asin(p.z() / p.norm()) / width_));
  }

  /// \param aside  pieces beside that of the point
  std::size_t cellOf(int ring, int aside, const Vector3& p) const {
    const double shrink = std::cos((ring + 0.5) * width_);
    const int piece = static_cast<int>(std::floor(std::atan2(p.y(), p.x()) * shrink / width_));
    const int row = std::clamp(ring + rings_ / 2, 0, rings_ - 1);
    const int column = std::clamp(piece + aside + pieces_ / 2, 0, pieces_ - 1);
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(pieces_) +
           static_cast<std::size_t>(column);
  }

  double width_;
  int rings_;
  int pieces_;
  std::vector<float> ranges_;
};

/// The points but for those on the sensor itself or its robot, which are all about the origin.
Indices pointsAround(const PointsView& points, const Indices* indices) {
  constexpr double kNear = 0.07;  // of the median range
  Indices around;
  std::vector<float> ranges;
  for (std::size_t k = 0; k < detail::countOf(points, indices); ++k) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i)) continue;
    around.push_back(static_cast<int>(i));
    ranges.push_back(static_cast<float>(points.point(i).norm()));
  }
  if (ranges.empty()) return around;
  const double near = kNear * detail::ranked(ranges, ranges.size() / 2);
  detail::eraseIf(around,
                  [&](int i) { return points.point(static_cast<std::size_t>(i)).norm() < near; });
  return around;
}

/// Whether much of a cloud lies behind the rest of it, seen from the origin.
/// docs/dev/automatic_parameters.md has the fractions of single scans.
bool hidesItself(const PointsView& points, const Indices* indices) {
  const Indices around = pointsAround(points, indices);
  const NearestRanges coarse(points, around, 1.0);
  const NearestRanges fine(points, around, 0.125);
  const std::size_t n = around.size();
  double sights = 0.0;
  double far_behind = 0.0;
  double behind = 0.0;
  double surrounded = 0.0;
  for (std::size_t k = 0; k < n; k += n / kLargestSample + 1) {
    const Vector3 p = points.point(static_cast<std::size_t>(around[k]));
    sights += 1.0;
    far_behind += coarse.isBehind(p, 1.5) ? 1.0 : 0.0;
    behind += fine.isBehind(p, 1.12) ? 1.0 : 0.0;
    surrounded += coarse.isSurrounded(p, 1.2) ? 1.0 : 0.0;
  }
  // A ray meets one thing: in a fine direction nothing is behind the wires of a fence.
  const bool is_through = surrounded > 0.06 * sights && behind > 0.005 * sights;
  return sights >= kMinSights &&
         (far_behind > 0.25 * sights || behind > 0.08 * sights || is_through);
}

constexpr double kAbove = 10.0;  // metres over the origin

/// Of a cloud without its outliers.
struct Heights {
  double lowest = 0.0;
  double extent = 0.0;  ///< of the whole cloud
};

Heights heightsOf(const PointsView& points, const Indices* indices) {
  const std::size_t n = detail::countOf(points, indices);
  std::vector<float> values[3];
  for (std::size_t k = 0; k < n; k += n / kLargestSample + 1) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i)) continue;
    for (int axis = 0; axis < 3; ++axis) values[axis].push_back(points[i][axis]);
  }
  if (values[0].empty()) return {};
  Vector3 low, high;
  detail::boundsOf(values, low, high);
  return {low.z(), (high - low).norm()};
}

/// Whether a cloud lies so far above its origin, for its size, that its z are no depths and no
/// sensor stands there: heights above the sea.
bool isHigh(const Heights& heights) {
  constexpr double kExtents = 1.5;  // a view across of less than 37 degrees: no camera of a robot
  return heights.lowest > kAbove && heights.lowest > kExtents * heights.extent;
}

/// Likewise of any size, if it hides itself.
bool isAboveTheSea(const PointsView& points, const Indices* indices) {
  const Heights heights = heightsOf(points, indices);
  return isHigh(heights) || (heights.lowest > kAbove && hidesItself(points, indices));
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  using Values = Eigen::Map<const Eigen::ArrayXd>;
  const auto n = static_cast<Eigen::Index>(a.size());
  const Eigen::ArrayXd u = Values(a.data(), n) - Values(a.data(), n).mean();
  const Eigen::ArrayXd v = Values(b.data(), n) - Values(b.data(), n).mean();
  return (u * v).sum() / std::sqrt(u.square().sum() * v.square().sum());
}

/// The axis of an organized cloud's frame that points upwards in its image; nothing where rows and
/// columns are not those of a pinhole camera that looks along z or -z.
std::optional<Vector3> upwardsInImage(const PointsView& points, const Indices* indices) {
  constexpr double kMinCorrelation = 0.999;
  if (points.height < 2 || points.width < 2) return std::nullopt;
  detail::requireIndices(points, indices);
  std::vector<double> columns, rows, x, y;
  std::size_t ahead = 0;
  const std::size_t n = detail::countOf(points, indices);
  for (std::size_t k = 0; k < n; k += n / kLargestSample + 1) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i)) continue;
    const Vector3 p = points.point(i);
    const double depth = std::abs(p.z());
    if (!(p.head<2>().norm() < kMaxSlope * depth)) return std::nullopt;
    ahead += p.z() > 0.0 ? 1 : 0;
    columns.push_back(static_cast<double>(i % points.width));
    rows.push_back(static_cast<double>(i / points.width));
    x.push_back(p.x() / depth);
    y.push_back(p.y() / depth);
  }
  if (x.empty() || (ahead != 0 && ahead != x.size())) return std::nullopt;
  const double down = correlation(rows, y);
  if (!(std::abs(down) > kMinCorrelation) ||
      !(std::abs(correlation(columns, x)) > kMinCorrelation)) {
    return std::nullopt;
  }
  return Vector3(0.0, down > 0.0 ? -1.0 : 1.0, 0.0);
}

}  // namespace

bool isCameraView(const PointsView& points, const Indices* indices) {
  constexpr std::size_t kMaxSample = 100000;
  constexpr double kMinFraction = 0.99;
  detail::requireIndices(points, indices);
  const std::size_t n = detail::countOf(points, indices);
  std::size_t usable = 0;
  for (std::size_t k = 0; k < n; ++k) usable += isUsable(points, detail::at(indices, k)) ? 1 : 0;
  const std::size_t step = usable / kMaxSample + 1;
  std::size_t number = 0;
  std::size_t sampled = 0;
  std::size_t in_view = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i) || number++ % step != 0) continue;
    const Vector3 p = points.point(i);
    ++sampled;
    in_view += p.z() > 0.0 && p.head<2>().norm() < kMaxSlope * p.z() ? 1 : 0;
  }
  return sampled > 0 &&
         static_cast<double>(in_view) >= kMinFraction * static_cast<double>(sampled) &&
         (points.height > 1 || !isAboveTheSea(points, indices));
}

Vector3 verticalOf(const PointsView& points, const Indices* indices, const Pose& T_world_sensor) {
  std::optional<Vector3> up = upwardsInImage(points, indices);
  if (!up && isCameraView(points, indices)) up = -Vector3::UnitY();
  return up ? nearestAxis(T_world_sensor.linear() * *up) : Vector3(Vector3::UnitZ());
}

Vector3 nearestAxis(const Vector3& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return direction[axis] < 0.0 ? Vector3(-Vector3::Unit(axis)) : Vector3(Vector3::Unit(axis));
}

std::vector<float> seenFrom(const Vector3& origin, const PointsView& points) {
  if (!origin.allFinite()) throw InputError("the position of the sensor is not finite");
  std::vector<float> xyz(3 * points.size, std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < points.size; ++i) {
    if (!points.isMeasured(i)) continue;
    Eigen::Vector3f::Map(xyz.data() + 3 * i) = (points.point(i) - origin).cast<float>();
  }
  return xyz;
}

bool isMerged(const PointsView& points, const Indices* indices) {
  constexpr double kMaxExtents = 10.0;
  constexpr double kEarth = 1e7;  // metres; farther away nothing is a coordinate
  if (points.height > 1) return false;
  detail::requireIndices(points, indices);
  const std::size_t n = detail::countOf(points, indices);
  std::size_t looked_at = 0;
  Vector3 low = Vector3::Constant(1e300);
  Vector3 high = -low;
  for (std::size_t k = 0; k < n; k += n / kLargestSample + 1) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i)) continue;
    ++looked_at;
    low = low.cwiseMin(points.point(i));
    high = high.cwiseMax(points.point(i));
  }
  if (looked_at < kMinSights) return false;
  const double away = Vector3::Zero().cwiseMax(low).cwiseMin(high).norm();
  if (away > kMaxExtents * (high - low).norm() && away < kEarth) return true;
  return isHigh(heightsOf(points, indices)) || hidesItself(points, indices);
}

}  // namespace planar_mapping
