// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/map_query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "planar_mapping/core/error.h"

namespace planar_mapping {
namespace {

constexpr double kMostCells = 1e7;

/// The part [from, to] of a line that lies in a box around the origin. \return whether there is one
bool clip(const Vector3& half, const Vector3& origin, const Vector3& direction, double& from,
          double& to) {
  for (int i = 0; i < 3; ++i) {
    if (direction[i] == 0.0) {
      if (std::abs(origin[i]) > half[i]) return false;
      continue;
    }
    const double a = (-half[i] - origin[i]) / direction[i];
    const double b = (half[i] - origin[i]) / direction[i];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from <= to;
}

bool clip(const Cuboid& cuboid, const Vector3& origin, const Vector3& direction, double& from,
          double& to) {
  const Quaternion to_local = cuboid.orientation.conjugate();
  return clip(0.5 * cuboid.size, to_local * (origin - cuboid.center), to_local * direction, from,
              to);
}

/// Do an oriented and an axis-aligned box meet? No axis separates them: those of both and their
/// cross products.
bool meets(const Cuboid& cuboid, const Vector3& center, const Vector3& half) {
  const Matrix3 axes = cuboid.orientation.toRotationMatrix();
  const Vector3 between = cuboid.center - center;
  const auto separates = [&](const Vector3& axis) {
    const double reach =
        half.dot(axis.cwiseAbs()) + 0.5 * cuboid.size.dot((axes.transpose() * axis).cwiseAbs());
    return std::abs(between.dot(axis)) > reach;
  };
  for (int i = 0; i < 3; ++i) {
    if (separates(Vector3::Unit(i)) || separates(axes.col(i))) return false;
    for (int k = 0; k < 3; ++k) {
      if (separates(Vector3::Unit(i).cross(axes.col(k)))) return false;
    }
  }
  return true;
}

double unknownSide(const PlanarMap& map) {
  const PlanarMapParams& params = map.params();
  return params.unknown_resolution > 0.0 ? params.unknown_resolution
                                         : params.approximation.resolution;
}

void requireFinite(const Vector3& v, const char* what) {
  if (!v.allFinite()) throw ParameterError(std::string(what) + " must be three finite numbers");
}

void requireFew(double cells, const char* what) {
  if (cells <= kMostCells) return;
  throw ParameterError(std::string(what) +
                       " meets more than 10 million cells: ask for a smaller one");
}

/// Distance at which a ray enters unknown space, at most \p range.
double enterUnknown(const PlanarMap& map, const Vector3& origin, const Vector3& direction,
                    double range) {
  const double side = unknownSide(map);
  requireFew(3.0 * range / side, "the ray");
  // From border to border of the cells; between two of them the state is the same.
  double next[3], step[3];
  for (int i = 0; i < 3; ++i) {
    step[i] = direction[i] != 0.0 ? side / std::abs(direction[i])
                                  : std::numeric_limits<double>::infinity();
    const double cell = std::floor(origin[i] / side);
    const double border = side * (direction[i] > 0.0 ? cell + 1.0 : cell);
    next[i] = direction[i] != 0.0 ? (border - origin[i]) / direction[i] : step[i];
  }
  for (double from = 0.0; from < range;) {
    const int axis = static_cast<int>(std::min_element(next, next + 3) - next);
    const double to = std::min(next[axis], range);
    if (to > from && map.isUnknown(origin + 0.5 * (from + to) * direction)) return from;
    from = std::max(from, to);
    next[axis] += step[axis];
  }
  return range;
}

using Cell = std::array<std::int32_t, 3>;

/// Cells with their centres in an occupied cuboid; ascending, none twice.
std::vector<Cell> occupiedCells(const PlanarMap& map, double side) {
  std::vector<Cell> cells;
  const auto first = [side](double from) {
    return static_cast<std::int32_t>(std::ceil(from / side - 0.5));
  };
  const auto last = [side](double to) {
    return static_cast<std::int32_t>(std::floor(to / side - 0.5));
  };
  for (const Cuboid& cuboid : map.cuboids()) {
    const Vector3 reach = cuboid.orientation.toRotationMatrix().cwiseAbs() * (0.5 * cuboid.size);
    const Vector3 low = cuboid.center - reach;
    const Vector3 high = cuboid.center + reach;
    for (std::int32_t x = first(low.x()); x <= last(high.x()); ++x) {
      for (std::int32_t y = first(low.y()); y <= last(high.y()); ++y) {
        const Vector3 column(side * (x + 0.5), side * (y + 0.5), low.z());
        double from = 0.0;
        double to = high.z() - low.z();
        if (!clip(cuboid, column, Vector3::UnitZ(), from, to)) continue;
        for (std::int32_t z = first(low.z() + from); z <= last(low.z() + to); ++z) {
          cells.push_back({x, y, z});
        }
      }
    }
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

}  // namespace

std::optional<RayHit> castRay(const PlanarMap& map, const Vector3& origin, const Vector3& direction,
                              double range, UnknownSpaceIs unknown) {
  requireFinite(origin, "the origin of a ray");
  requireFinite(direction, "the direction of a ray");
  if (direction.norm() == 0.0) throw ParameterError("the direction of a ray must not be 0,0,0");
  if (!(range > 0.0) || !std::isfinite(range)) {
    throw ParameterError("the range of a ray must be positive");
  }
  const Vector3 along = direction.normalized();
  RayHit hit;
  hit.distance = range;
  const std::vector<Cuboid>& cuboids = map.cuboids();
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    double from = 0.0;
    double to = hit.distance;
    if (!clip(cuboids[i], origin, along, from, to)) continue;
    if (hit.cuboid >= 0 && from >= hit.distance) continue;
    hit.distance = from;
    hit.cuboid = static_cast<std::int32_t>(i);
  }
  if (unknown == UnknownSpaceIs::AnObstacle) {
    const double distance = enterUnknown(map, origin, along, hit.distance);
    if (distance < hit.distance) {
      hit.distance = distance;
      hit.state = CellState::Unknown;
      hit.cuboid = -1;
    }
  }
  if (hit.cuboid < 0 && hit.state != CellState::Unknown) return std::nullopt;
  hit.point = origin + hit.distance * along;
  return hit;
}

BoxState stateOfBox(const PlanarMap& map, const Vector3& low, const Vector3& high) {
  requireFinite(low, "the lower corner of a box");
  requireFinite(high, "the upper corner of a box");
  if ((low.array() > high.array()).any()) {
    throw ParameterError("the lower corner of a box must not exceed the upper one");
  }
  BoxState result;
  const std::vector<Cuboid>& cuboids = map.cuboids();
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    if (meets(cuboids[i], 0.5 * (low + high), 0.5 * (high - low))) {
      result.cuboids.push_back(static_cast<int>(i));
    }
  }
  if (!result.cuboids.empty()) {
    result.state = CellState::Occupied;
    return result;
  }
  // What of each cell lies in the box has one state.
  const double side = unknownSide(map);
  const Vector3 first = (low / side).array().floor();
  const Vector3 count = (high / side).array().floor() - first.array() + 1.0;
  requireFew(count.prod(), "the box");
  for (double x = 0; x < count.x(); ++x) {
    for (double y = 0; y < count.y(); ++y) {
      for (double z = 0; z < count.z(); ++z) {
        const Vector3 corner = side * (first + Vector3(x, y, z));
        const Vector3 from = corner.cwiseMax(low);
        const Vector3 to = (corner + Vector3::Constant(side)).cwiseMin(high);
        if (!map.isUnknown(0.5 * (from + to))) continue;
        result.state = CellState::Unknown;
        return result;
      }
    }
  }
  return result;
}

double MapDifference::share() const {
  const std::size_t either = only_in_a + only_in_b + in_both;
  return either == 0 ? 0.0
                     : static_cast<double>(only_in_a + only_in_b) / static_cast<double>(either);
}

MapDifference compareMaps(const PlanarMap& a, const PlanarMap& b) {
  MapDifference difference;
  difference.cell =
      0.5 * std::min(a.params().approximation.resolution, b.params().approximation.resolution);
  const std::vector<Cell> in_a = occupiedCells(a, difference.cell);
  const std::vector<Cell> in_b = occupiedCells(b, difference.cell);
  std::vector<Cell> common;
  std::set_intersection(in_a.begin(), in_a.end(), in_b.begin(), in_b.end(),
                        std::back_inserter(common));
  difference.in_both = common.size();
  difference.only_in_a = in_a.size() - common.size();
  difference.only_in_b = in_b.size() - common.size();
  return difference;
}

}  // namespace planar_mapping
