// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/plane_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace planar_mapping::detail {
namespace {

/// A window may have this many cells for each occupied one before it is held in pieces.
constexpr double kWindowPerCell = 16.0;
constexpr double kSmallWindow = 4096.0;
/// Side of the pieces, in cells.
constexpr std::int64_t kPieceSide = 128;
/// Cell numbers are kept where doubles still count exactly.
constexpr double kLargestCell = 4e15;

struct CellSum {
  std::int64_t a = 0;
  std::int64_t b = 0;
  std::int64_t count = 0;
  double probability = 0.0;
  std::uint8_t quarters = 0;
};

struct Window {
  std::int64_t low_a = std::numeric_limits<std::int64_t>::max();
  std::int64_t low_b = std::numeric_limits<std::int64_t>::max();
  std::int64_t high_a = std::numeric_limits<std::int64_t>::min();
  std::int64_t high_b = std::numeric_limits<std::int64_t>::min();

  void add(const CellSum& cell) {
    low_a = std::min(low_a, cell.a);
    low_b = std::min(low_b, cell.b);
    high_a = std::max(high_a, cell.a);
    high_b = std::max(high_b, cell.b);
  }
  double area() const {
    return (static_cast<double>(high_a - low_a) + 1.0) *
           (static_cast<double>(high_b - low_b) + 1.0);
  }
};

bool isCompactWindow(double area, std::size_t cells) {
  return area <= kSmallWindow + kWindowPerCell * static_cast<double>(cells);
}

/// Cells sorted by (b, a), each once.
std::vector<CellSum> sumUp(std::vector<CellSum> cells) {
  std::sort(cells.begin(), cells.end(),
            [](const CellSum& l, const CellSum& r) { return l.b != r.b ? l.b < r.b : l.a < r.a; });
  std::vector<CellSum> sums;
  for (const CellSum& cell : cells) {
    if (sums.empty() || sums.back().a != cell.a || sums.back().b != cell.b) {
      sums.push_back(cell);
    } else {
      sums.back().count += cell.count;
      sums.back().probability += cell.probability;
      sums.back().quarters |= cell.quarters;
    }
  }
  return sums;
}

/// Connected components (8 neighbours) of sorted cells, as a component number per cell.
std::vector<std::size_t> componentsOf(const std::vector<CellSum>& cells) {
  std::vector<std::size_t> parent(cells.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto join = [&](std::size_t i, std::size_t j) {
    const std::size_t r = root(i);
    const std::size_t q = root(j);
    parent[std::max(r, q)] = std::min(r, q);
  };
  std::size_t below = 0;  // first cell of the row below that may touch cell i
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const CellSum& cell = cells[i];
    if (i > 0 && cells[i - 1].b == cell.b && cells[i - 1].a == cell.a - 1) join(i, i - 1);
    while (cells[below].b < cell.b - 1 ||
           (cells[below].b == cell.b - 1 && cells[below].a < cell.a - 1)) {
      ++below;
    }
    for (std::size_t j = below; cells[j].b == cell.b - 1 && cells[j].a <= cell.a + 1; ++j) {
      join(i, j);
    }
  }
  for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = root(i);
  return parent;
}

class SparseRasterizer {
 public:
  SparseRasterizer(const PlanePoints& input, const PlaneFrame& frame,
                   const CuboidApproximationParams& params)
      : input_(input), frame_(frame), params_(params) {}

  std::vector<PlanePatch> run(std::size_t& points_dropped) {
    std::vector<CellSum> cells = cellsOfPoints();
    points_dropped += input_.inliers.size() - cells.size();
    cells = sumUp(std::move(cells));
    const auto too_few = [&](const CellSum& cell) {
      if (cell.count >= params_.min_points_per_cell) return false;
      points_dropped += static_cast<std::size_t>(cell.count);
      return true;
    };
    cells.erase(std::remove_if(cells.begin(), cells.end(), too_few), cells.end());
    return patchesOf(cells);
  }

 private:
  std::vector<CellSum> cellsOfPoints() {
    const double inf = std::numeric_limits<double>::infinity();
    low_ = Vector2(inf, inf);
    Vector2 high = -low_;
    std::vector<Vector2> local;
    std::vector<double> belief;
    for (const int i : input_.inliers) {
      const auto index = static_cast<std::size_t>(i);
      if (!input_.points.isFinite(index)) continue;
      local.push_back(frame_.toPlane(input_.points.point(index)).head<2>());
      if (input_.probability) belief.push_back((*input_.probability)[index]);
      low_ = low_.cwiseMin(local.back());
      high = high.cwiseMax(local.back());
    }
    const double s = params_.resolution;
    Vector2 cells_across = Vector2::Zero();
    for (int axis = 0; axis < 2 && !local.empty(); ++axis) {
      cells_across[axis] = cellsAcross(high[axis] - low_[axis], s);
      low_[axis] -= 0.5 * (cells_across[axis] * s - (high[axis] - low_[axis]));
    }
    std::vector<CellSum> cells(local.size());
    for (std::size_t i = 0; i < local.size(); ++i) {
      const Vector2 half = (local[i] - low_) * (2.0 / s);
      const std::int64_t a = halfCell(half.x(), cells_across.x());
      const std::int64_t b = halfCell(half.y(), cells_across.y());
      cells[i] = {a >> 1, b >> 1, 1, belief.empty() ? 1.0 : belief[i],
                  static_cast<std::uint8_t>(1u << ((a & 1) + 2 * (b & 1)))};
    }
    return cells;
  }

  static std::int64_t halfCell(double half, double cells_across) {
    const double last = std::min(2.0 * cells_across - 1.0, kLargestCell);
    return static_cast<std::int64_t>(std::clamp(std::floor(half), 0.0, last));
  }

  std::vector<PlanePatch> patchesOf(const std::vector<CellSum>& cells) const {
    std::vector<PlanePatch> patches;
    if (cells.empty()) return patches;
    Window window;
    for (const CellSum& cell : cells) window.add(cell);
    if (isCompactWindow(window.area(), cells.size())) {
      patches.push_back(patchOf(cells, window));
      return patches;
    }
    const std::vector<std::size_t> component = componentsOf(cells);
    std::vector<std::vector<CellSum>> groups(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) groups[component[i]].push_back(cells[i]);
    for (const std::vector<CellSum>& group : groups) {
      if (group.empty()) continue;
      Window box;
      for (const CellSum& cell : group) box.add(cell);
      if (isCompactWindow(box.area(), group.size())) {
        patches.push_back(patchOf(group, box));
      } else {
        addPieces(group, patches);
      }
    }
    return patches;
  }

  void addPieces(std::vector<CellSum> cells, std::vector<PlanePatch>& patches) const {
    const auto piece = [](const CellSum& cell) {
      return std::make_pair(cell.b / kPieceSide, cell.a / kPieceSide);
    };
    std::stable_sort(cells.begin(), cells.end(),
                     [&](const CellSum& l, const CellSum& r) { return piece(l) < piece(r); });
    for (std::size_t first = 0; first < cells.size();) {
      Window box;
      std::size_t next = first;
      while (next < cells.size() && piece(cells[next]) == piece(cells[first])) {
        box.add(cells[next++]);
      }
      patches.push_back(patchOf({cells.begin() + static_cast<std::ptrdiff_t>(first),
                                 cells.begin() + static_cast<std::ptrdiff_t>(next)},
                                box));
      first = next;
    }
  }

  PlanePatch patchOf(const std::vector<CellSum>& cells, const Window& window) const {
    PlanePatch patch;
    patch.frame = frame_;
    patch.frame.origin =
        frame_.fromPlane({low_.x() + static_cast<double>(window.low_a) * params_.resolution,
                          low_.y() + static_cast<double>(window.low_b) * params_.resolution, 0.0});
    patch.mask.width = static_cast<std::int32_t>(window.high_a - window.low_a + 1);
    patch.mask.height = static_cast<std::int32_t>(window.high_b - window.low_b + 1);
    patch.mask.cells.assign(static_cast<std::size_t>(patch.mask.width) * patch.mask.height, 0);
    patch.quarters.assign(patch.mask.cells.size(), 0);
    if (input_.probability) patch.probability.assign(patch.mask.cells.size(), 0.0f);
    for (const CellSum& cell : cells) {
      const std::size_t i = static_cast<std::size_t>(cell.b - window.low_b) * patch.mask.width +
                            static_cast<std::size_t>(cell.a - window.low_a);
      patch.mask.cells[i] = 1;
      patch.quarters[i] = cell.quarters;
      if (input_.probability) {
        patch.probability[i] =
            static_cast<float>(cell.probability / static_cast<double>(cell.count));
      }
    }
    return patch;
  }

  const PlanePoints& input_;
  const PlaneFrame& frame_;
  const CuboidApproximationParams& params_;
  Vector2 low_ = Vector2::Zero();
};

}  // namespace

std::vector<PlanePatch> rasterizeSparsely(const PlanePoints& input, const PlaneFrame& frame,
                                          const CuboidApproximationParams& params,
                                          std::size_t& points_dropped) {
  return SparseRasterizer(input, frame, params).run(points_dropped);
}

}  // namespace planar_mapping::detail
