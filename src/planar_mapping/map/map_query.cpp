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

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/map/planar_map_impl.h"

namespace planar_mapping {
namespace {

constexpr double kMaxCells = 1e7;
constexpr double kMaxOccupied = 1e9;  ///< cells of maps that are compared

void requireFinite(const Vector3& v, const char* what) {
  if (!v.allFinite()) throw ParameterError(std::string(what) + " must be three finite numbers");
}

void requireFew(double cells, const char* what) {
  if (cells <= kMaxCells) return;
  throw ParameterError(std::string(what) +
                       " meets more than 10 million cells: ask for a smaller one");
}

/// Goes from cube to cube of space: from cell to cell where a block has unknown ones, else from
/// block to block, and from region to region where a region has none.
class SpaceWalk {
 public:
  /// \param side of a cell
  SpaceWalk(const detail::UnknownSpace& space, double side, const Vector3& origin,
            const Vector3& direction)
      : space_(space), side_(side), origin_(origin), direction_(direction) {
    cell_ = (origin / side).array().floor();
  }

  /// Distance at which the ray enters unknown space, at most \p range.
  double enterUnknown(double range) {
    for (double at = 0.0; at < range;) {
      int level = kRegionLevel;  // also outside the lattice
      if (cell_.cwiseAbs().maxCoeff() < detail::kLatticeLimit) {
        const detail::Int3 cell = detail::toInt3(cell_);
        const detail::UnknownSpace::Surroundings around = space_.around(cell);
        if ((around.unknown >> detail::UnknownSpace::bitOf(cell) & 1u) != 0) return at;
        level = around.region_is_alike ? kRegionLevel : around.unknown == 0 ? kBlockLevel : 0;
      } else if (space_.isUnseenUnknown()) {
        return at;
      }
      at = std::max(at, leave(level));
    }
    return range;
  }

 private:
  static constexpr int kBlockLevel = 2;
  static constexpr int kRegionLevel = 5;

  /// Goes on to the first cell after the cube of 2^level cells around this one.
  /// \return the distance there
  double leave(int level) {
    const double cells = 1 << level;
    const Vector3 low = cells * (cell_ / cells).array().floor();
    double nearest = std::numeric_limits<double>::infinity();
    int axis = 0;
    for (int i = 0; i < 3; ++i) {
      if (direction_[i] == 0.0) continue;
      const double border = side_ * (direction_[i] > 0.0 ? low[i] + cells : low[i]);
      const double distance = (border - origin_[i]) / direction_[i];
      if (distance < nearest) {
        nearest = distance;
        axis = i;
      }
    }
    // Rounding must not lead out of the cube on another side, nor back into it.
    const Vector3 point = origin_ + nearest * direction_;
    cell_ = (point / side_).array().floor();
    cell_ = cell_.cwiseMax(low).cwiseMin(low + Vector3::Constant(cells - 1.0));
    cell_[axis] = direction_[axis] > 0.0 ? low[axis] + cells : low[axis] - 1.0;
    return nearest;
  }

  const detail::UnknownSpace& space_;
  const double side_;
  const Vector3 origin_;
  const Vector3 direction_;
  Vector3 cell_;
};

/// Is a cell that meets the box unknown?
bool anyUnknown(const detail::UnknownSpace& space, double side, const Vector3& low,
                const Vector3& high) {
  const Vector3 first = (low / side).array().floor();
  const Vector3 last = (high / side).array().floor();
  requireFew((last - first + Vector3::Ones()).prod(), "the box");
  constexpr double kLimit = detail::kLatticeLimit - 1;
  if (space.isUnseenUnknown() && (first.minCoeff() < -kLimit || last.maxCoeff() > kLimit)) {
    return true;
  }
  if (first.maxCoeff() > kLimit || last.minCoeff() < -kLimit) return false;
  const auto within = [kLimit](double at) {
    return static_cast<std::int32_t>(std::clamp(at, -kLimit, kLimit));
  };
  for (std::int32_t z = within(first.z()); z <= within(last.z()); ++z) {
    for (std::int32_t y = within(first.y()); y <= within(last.y()); ++y) {
      for (std::int32_t x = within(first.x()); x <= within(last.x()); ++x) {
        if (space.isUnknown({x, y, z})) return true;
      }
    }
  }
  return false;
}

using Cell = std::array<std::int32_t, 3>;

/// Cells with their centres in an occupied cuboid; ascending, none twice.
/// \throws ParameterError if cuboids are far too large: so that a file cannot ask for any memory
std::vector<Cell> occupiedCells(const PlanarMap& map, double side) {
  std::vector<Cell> cells;
  const auto first = [side](double from) {
    return static_cast<std::int32_t>(std::ceil(from / side - 0.5));
  };
  const auto last = [side](double to) {
    return static_cast<std::int32_t>(std::floor(to / side - 0.5));
  };
  double total = 0.0;
  for (const Cuboid& cuboid : map.cuboids()) {
    const Vector3 half = reach(cuboid);
    const Vector3 low = cuboid.center - half;
    const Vector3 high = cuboid.center + half;
    total += std::max((cuboid.size / side).prod(), (2.0 * half / side).head<2>().prod());
    if (!(total < kMaxOccupied)) {
      throw ParameterError("a map whose cuboids hold more than 1e9 cells cannot be compared");
    }
    for (std::int32_t x = first(low.x()); x <= last(high.x()); ++x) {
      for (std::int32_t y = first(low.y()); y <= last(high.y()); ++y) {
        const Vector3 column(side * (x + 0.5), side * (y + 0.5), low.z());
        double from = 0.0;
        double to = high.z() - low.z();
        if (!detail::clipToCuboid(cuboid, column, Vector3::UnitZ(), from, to)) continue;
        for (std::int32_t z = first(low.z() + from); z <= last(low.z() + to); ++z) {
          cells.push_back({x, y, z});
        }
      }
    }
  }
  detail::makeDistinct(cells);
  return cells;
}

/// Rounding, metres: a point of a face, whatever face, is in its cuboid.
constexpr double kOnFace = 1e-9;

}  // namespace

namespace {

/// State of a point that no cuboid holds.
CellState stateOfSpace(const detail::MapData& map, const Vector3& point) {
  if (!point.allFinite()) return CellState::Unknown;
  const Vector3 cell = (point / map.unknownResolution()).array().floor();
  const bool is_unknown = cell.cwiseAbs().maxCoeff() < detail::kLatticeLimit
                              ? map.space.isUnknown(detail::toInt3(cell))
                              : map.space.isUnseenUnknown();
  return is_unknown ? CellState::Unknown : CellState::Free;
}

}  // namespace

CellState PlanarMap::stateAt(const Vector3& point) const {
  const Impl::Occupied known = impl_->occupied();
  bool occupied = false;
  known.index.visit(point, kOnFace, [&](std::uint32_t i) {
    occupied = contains(known.cuboids[i], point, kOnFace);
    return !occupied;
  });
  return occupied ? CellState::Occupied : stateOfSpace(impl_->data, point);
}

double PlanarMap::occupancyAt(const Vector3& point) const {
  const Impl::Occupied known = impl_->occupied();
  double belief = -1.0;
  known.index.visit(point, kOnFace, [&](std::uint32_t i) {
    if (contains(known.cuboids[i], point, kOnFace)) {
      belief = std::max(belief, static_cast<double>(known.cuboids[i].probability));
    }
    return true;
  });
  if (belief >= 0.0) return belief;
  return stateOfSpace(impl_->data, point) == CellState::Unknown ? 0.5 : 0.0;
}

Indices PlanarMap::cuboidsAt(const Vector3& point, double margin) const {
  requireInRange("margin", margin, 0.0, 1e9, "m");
  const Impl::Occupied known = impl_->occupied();
  Indices found;
  known.index.visit(point, margin + kOnFace, [&](std::uint32_t i) {
    if (contains(known.cuboids[i], point, margin + kOnFace)) found.push_back(static_cast<int>(i));
    return true;
  });
  std::sort(found.begin(), found.end());
  return found;
}

std::optional<RayHit> castRay(const PlanarMap& map, const Vector3& origin, const Vector3& direction,
                              double range, UnknownSpaceIs unknown) {
  requireFinite(origin, "the origin of a ray");
  requireFinite(direction, "the direction of a ray");
  if (direction.isZero(0.0)) throw ParameterError("the direction of a ray must not be 0,0,0");
  if (!(range > 0.0) || !std::isfinite(range)) {
    throw ParameterError("the range of a ray must be positive");
  }
  const auto& data = detail::MapAccess::of(map);
  const std::vector<Cuboid>& cuboids = map.cuboids();
  const Vector3 along = direction.stableNormalized();
  RayHit hit;
  hit.distance = range;
  data.occupied().index.visitAlong(origin, along, hit.distance, [&](std::uint32_t i) {
    const auto number = static_cast<std::int32_t>(i);
    double from = 0.0;
    double to = hit.distance;
    if (!detail::clipToCuboid(cuboids[i], origin, along, from, to)) return;
    // Of two entered at once the one that comes first in the list.
    if (from == hit.distance && hit.cuboid >= 0 && hit.cuboid < number) return;
    hit.distance = from;
    hit.cuboid = number;
  });
  if (unknown == UnknownSpaceIs::AnObstacle) {
    const double side = data.data.unknownResolution();
    requireFew(3.0 * hit.distance / side, "the ray");
    const double distance =
        SpaceWalk(data.data.space, side, origin, along).enterUnknown(hit.distance);
    // Of a cell that a cuboid cuts the rest is mostly unknown: that is no obstacle of its own.
    const double gap = hit.cuboid >= 0 && distance > 0.0 ? std::sqrt(3.0) * side : 0.0;
    if (distance < hit.distance - gap) {
      hit.distance = distance;
      hit.state = CellState::Unknown;
      hit.cuboid = -1;
    }
  }
  if (hit.cuboid < 0 && hit.state != CellState::Unknown) return std::nullopt;
  hit.point = origin + hit.distance * along;
  return hit;
}

CellState stateAlong(const PlanarMap& map, const Vector3& origin, const Vector3& direction,
                     double range) {
  const std::optional<RayHit> hit = castRay(map, origin, direction, range);
  return hit ? hit->state : CellState::Free;
}

BoxState stateOfBox(const PlanarMap& map, const Vector3& low, const Vector3& high) {
  requireFinite(low, "the lower corner of a box");
  requireFinite(high, "the upper corner of a box");
  if ((low.array() > high.array()).any()) {
    throw ParameterError("the lower corner of a box must not exceed the upper one");
  }
  const auto& data = detail::MapAccess::of(map);
  const std::vector<Cuboid>& cuboids = map.cuboids();
  BoxState result;
  data.occupied().index.visitBox(low, high, [&](std::uint32_t i) {
    if (detail::OrientedBox(cuboids[i]).meets(0.5 * (low + high), 0.5 * (high - low))) {
      result.cuboids.push_back(static_cast<int>(i));
    }
    return true;
  });
  if (!result.cuboids.empty()) {
    std::sort(result.cuboids.begin(), result.cuboids.end());
    result.state = CellState::Occupied;
    return result;
  }
  if (anyUnknown(data.data.space, data.data.unknownResolution(), low, high)) {
    result.state = CellState::Unknown;
  }
  return result;
}

double MapDifference::fraction() const {
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
