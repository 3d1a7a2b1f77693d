// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover_window.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/cuboids/plane_cover.h"

namespace planar_mapping::detail {
namespace {

/// \return false beyond all half cells, or if the point is not finite
bool halfCellOf(const Vector3& point, double half, HalfCell& cell) {
  bool is_inside = true;
  for (std::size_t k = 0; k < 3; ++k) {
    constexpr double kFarthest = 4e9;
    const double at = point[static_cast<Vector3::Index>(k)] / half;
    is_inside &= std::abs(at) < kFarthest;
    const auto whole = static_cast<std::int64_t>(std::abs(at) < kFarthest ? at : 0.0);
    cell[k] = whole - (static_cast<double>(whole) > at ? 1 : 0);
  }
  return is_inside;
}

/// Room around the required cells.
constexpr std::int32_t kRim = 2;

/// Cells start at even numbers.
std::int64_t startFor(std::int64_t low) {
  return low - (low & 1) - kRim;
}

/// Where a line of half cells along x is within a cuboid.
class CuboidRows {
 public:
  /// \param corner centre of the first half cell of all
  CuboidRows(const Cuboid& cuboid, const Vector3& corner, double half)
      : extent_(0.5 * cuboid.size) {
    const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
    start_ = to_local * (corner - cuboid.center);
    step_ = half * to_local;
    for (int k = 0; k < 3; ++k) {
      is_along_[k] = std::abs(to_local(k, 0)) < 1e-9;
      inverse_[k] = is_along_[k] ? 0.0 : 1.0 / step_(k, 0);
    }
  }
  /// Narrows [first, last] of row (y, z).
  void narrow(std::int32_t y, std::int32_t z, double& first, double& last) const {
    const Vector3 start = start_ + step_.col(1) * y + step_.col(2) * z;
    for (int k = 0; k < 3; ++k) {
      if (is_along_[k]) {
        if (std::abs(start[k]) > extent_[k]) last = first - 1.0;
        continue;
      }
      const double a = (-extent_[k] - start[k]) * inverse_[k];
      const double b = (extent_[k] - start[k]) * inverse_[k];
      first = std::max(first, std::ceil(std::min(a, b)));
      last = std::min(last, std::floor(std::max(a, b)));
    }
  }

 private:
  Vector3 extent_;
  Vector3 start_;
  Matrix3 step_;
  double inverse_[3];
  bool is_along_[3];  ///< the row changes nothing along this axis of the cuboid
};

}  // namespace

void addElements(const std::vector<SurfacePiece>& pieces, double half,
                 std::vector<Element>& elements) {
  // Pieces of a quarter follow each other, mostly in one half cell or two.
  constexpr std::size_t kLast = 4;
  const std::size_t first = elements.size();
  for (const SurfacePiece& piece : pieces) {
    Element element{{}, piece.probability, true, false};
    if (!halfCellOf(piece.center, half, element.at)) continue;
    const std::size_t last = std::min(kLast, elements.size() - first);
    const bool is_known = std::any_of(
        elements.end() - static_cast<std::ptrdiff_t>(last), elements.end(), [&](const Element& e) {
          return e.at == element.at && e.probability >= element.probability;
        });
    if (!is_known) elements.push_back(element);
  }
}

void addElements(const std::vector<NonPlanarCell>& cells, bool tolerant, int min_points,
                 std::vector<Element>& elements) {
  for (const NonPlanarCell& cell : cells) {
    if (min_points > 1 && cell.weight < static_cast<float>(min_points)) continue;
    const bool required = cell.octants != 0;
    for (int k = 0; k < 8; ++k) {
      const bool holds = (cell.octants >> k & 1) != 0;
      if (tolerant && !holds && required) continue;
      elements.push_back({{2 * static_cast<std::int64_t>(cell.x) + (k & 1),
                           2 * static_cast<std::int64_t>(cell.y) + (k >> 1 & 1),
                           2 * static_cast<std::int64_t>(cell.z) + (k >> 2 & 1)},
                          cell.probability,
                          required,
                          required});
    }
  }
}

CoverWindow::CoverWindow(ElementRange elements, const CuboidApproximationParams& params)
    : elements_(elements), half_(0.5 * params.resolution) {
  // Within the tolerance a thin surface needs no whole cell, half of which is free space.
  if (isTolerant(params)) {
    rules_.tolerance = rules_.smallest = {1, 1, 1};
  } else {
    rules_.smallest = {2, 2, 2};
  }
  HalfCellBox hull;
  for (const Element& e : elements) {
    if (e.required) include(hull, e.at);
  }
  if (hull.isEmpty()) return;
  const auto size = [&](std::size_t k) {
    const auto axis = static_cast<Eigen::Index>(k);
    low_[k] = startFor(hull.min()[axis]);
    return static_cast<std::int32_t>(hull.max()[axis] + 1 + kRim - low_[k]);
  };
  required_ = allowed_ = exact_ = BitGrid(size(0), size(1), size(2));
  for (const Element& e : elements) {
    LatticeCell at{};
    if (!find(e.at, at)) continue;
    allowed_.set(at[0], at[1], at[2]);
    if (e.required) required_.set(at[0], at[1], at[2]);
    if (e.exact) exact_.set(at[0], at[1], at[2]);
  }
}

/// No longer requires what the cuboids stand for, or what they do not.
void CoverWindow::release(const std::vector<CuboidReach>& cuboids, bool inside) {
  std::vector<const CuboidReach*> near;
  required_.forEachBlock([&](const LatticeBox& block) {
    constexpr double kHalfSide = 0.5 * BitGrid::kBlock;
    const Vector3 middle = centerOf(block.low) + Vector3::Constant((kHalfSide - 0.5) * half_);
    near.clear();
    for (const CuboidReach& reach : cuboids) {
      if (reach.mayReach(middle, std::sqrt(3.0) * kHalfSide * half_)) near.push_back(&reach);
    }
    if (near.empty() && inside) return;
    required_.forEach(block, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      const Vector3 p = centerOf({x, y, z});
      if (std::any_of(near.begin(), near.end(),
                      [&](const auto* reach) { return reach->holds(p); }) != inside)
        return;
      required_.reset(x, y, z);
      exact_.reset(x, y, z);
    });
  });
  shrink();
}

void CoverWindow::shrink() {
  if (!anyRequired()) return;
  const LatticeBox hull = required_.hull();
  LatticeBox kept;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int64_t start = startFor(low_[k] + hull.low[k]);
    kept.low[k] = static_cast<std::int32_t>(start - low_[k]);
    kept.high[k] = hull.high[k] + kRim;
    low_[k] = start;
  }
  required_ = required_.cropped(kept);
  allowed_ = allowed_.cropped(kept);
  exact_ = exact_.cropped(kept);
}

void CoverWindow::allow(const Cuboid& cuboid) {
  const CuboidRows rows(cuboid, centerOf({0, 0, 0}), half_);
  const LatticeBox box = boxAround(cuboid, 0.0);
  for (std::int32_t z = box.low[2]; z < box.high[2]; ++z) {
    for (std::int32_t y = box.low[1]; y < box.high[1]; ++y) {
      double first = box.low[0];
      double last = box.high[0] - 1;
      rows.narrow(y, z, first, last);
      if (first > last) continue;
      const auto low = static_cast<std::int32_t>(first);
      const auto high = static_cast<std::int32_t>(last) + 1;
      allowed_.fill({{low, y, z}, {high, y + 1, z + 1}});
    }
  }
}

/// \return a box around the cells that are marked
LatticeBox CoverWindow::markCells(const WindowSurface& surface, double margin,
                                  BitGrid& marks) const {
  LatticeBox around = boxAround(surface.cuboid, margin + half_);
  LatticeCell at{};
  for (const Element& e : surface.elements) {
    if (!find(e.at, at)) continue;
    if (!required_.at(at[0], at[1], at[2]) || exact_.at(at[0], at[1], at[2])) continue;
    marks.set(at[0], at[1], at[2]);
    include(around, boxOf(at));
  }
  const CuboidReach reach(surface.cuboid, margin);
  required_.forEach(around, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    if (reach.holds(centerOf({x, y, z}))) marks.set(x, y, z);
  });
  return around;
}

std::vector<CellSet> CoverWindow::cellsOf(const std::vector<WindowSurface>& surfaces,
                                          double margin) const {
  const CellNumbers numbers(required_);
  BitGrid marks(required_.size()[0], required_.size()[1], required_.size()[2]);
  std::vector<CellSet> sets;
  for (const WindowSurface& surface : surfaces) {
    const LatticeBox around = markCells(surface, margin, marks);
    sets.emplace_back();
    marks.forEach(around, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      sets.back().push_back(static_cast<std::uint32_t>(numbers.at(x, y, z)));
    });
    marks.clear(around);
  }
  return sets;
}

/// Of each required cell.
std::vector<float> CoverWindow::probabilities(const CellNumbers& numbers) const {
  std::vector<float> of_cell(numbers.count(), 0.0f);
  LatticeCell at{};
  for (const Element& e : elements_) {
    if (!e.required || !find(e.at, at) || !required_.at(at[0], at[1], at[2])) continue;
    if (!e.exact && exact_.at(at[0], at[1], at[2])) continue;
    float& probability = of_cell[numbers.at(at[0], at[1], at[2])];
    probability = std::max(probability, e.probability);
  }
  return of_cell;
}

/// Boxes may reach into a half cell beside those that hold something by the tolerance.
BitGrid CoverWindow::roomForBoxes() const {
  return allowed_.dilated(rules_.tolerance);
}

bool CoverWindow::needsAtLeast(std::size_t boxes) const {
  return fewestBoxes(required_, roomForBoxes(), rules_, boxes) >= boxes;
}

std::optional<std::vector<std::size_t>> CoverWindow::cover(const std::vector<CellSet>& sets,
                                                           CoverEffort effort,
                                                           std::vector<Cuboid>& cuboids) const {
  const BitGrid room = roomForBoxes();
  LatticeCoverage coverage{sweptOver(required_, room, rules_), {}};
  const bool is_clutter = !coverage.boxes.empty();
  if (!is_clutter) coverage = coverWithin(required_, room, rules_, sets, effort);
  const CellNumbers numbers(required_);
  const std::vector<float> probability = probabilities(numbers);
  for (const CoverBox& c : coverage.boxes) {
    Cuboid cuboid;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Vector3::Index>(k);
      cuboid.size[axis] = half_ * c.box.size(k);
      cuboid.center[axis] =
          half_ * (static_cast<double>(low_[k]) + 0.5 * c.box.low[k] + 0.5 * c.box.high[k]);
    }
    double sum = 0.0;
    for (const LatticeCell& m : c.members) sum += probability[numbers.at(m[0], m[1], m[2])];
    cuboid.probability = static_cast<float>(sum / static_cast<double>(c.members.size()));
    cuboids.push_back(cuboid);
  }
  if (is_clutter) return std::nullopt;
  return std::move(coverage.sets);
}

bool CoverWindow::find(const HalfCell& at, LatticeCell& cell) const {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int64_t offset = at[k] - low_[k];
    if (offset < 0 || offset >= required_.size()[k]) return false;
    cell[k] = static_cast<std::int32_t>(offset);
  }
  return true;
}

Vector3 CoverWindow::centerOf(const LatticeCell& cell) const {
  Vector3 center;
  for (std::size_t k = 0; k < 3; ++k) {
    center[static_cast<Vector3::Index>(k)] = half_ * (static_cast<double>(low_[k] + cell[k]) + 0.5);
  }
  return center;
}

/// Cells of the window that come within \p margin of the cuboid, and some more.
LatticeBox CoverWindow::boxAround(const Cuboid& cuboid, double margin) const {
  const Vector3 half = reach(cuboid) + Vector3::Constant(margin);
  LatticeBox box;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Vector3::Index>(k);
    const auto toCell = [&](double coordinate) {
      const double cell = std::floor(coordinate / half_) - static_cast<double>(low_[k]);
      return static_cast<std::int32_t>(
          std::clamp(cell, 0.0, static_cast<double>(required_.size()[k])));
    };
    box.low[k] = toCell(cuboid.center[axis] - half[axis]);
    box.high[k] = std::min(toCell(cuboid.center[axis] + half[axis]) + 1, required_.size()[k]);
  }
  return box;
}

}  // namespace planar_mapping::detail
