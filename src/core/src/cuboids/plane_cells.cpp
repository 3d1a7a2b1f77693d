// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/plane_cells.h"

#include <algorithm>
#include <cmath>

#include "cuboids/raster_kernels.h"

namespace planar_mapping::detail {
namespace {

/// Points that are projected at a time; what they need stays in the cache.
constexpr std::size_t kChunk = 8192;
static_assert(kChunk % kKernelBlock == 0);
/// A raster may have this many cells for each point, beyond a small one that is always allowed.
constexpr double kWindowPerPoint = 4.0;
constexpr double kSmallWindow = 65536.0;
constexpr double kLargestWindow = 1 << 27;

/// Cells are counted by quarters: a raster of twice the columns and rows.
class DenseRasterizer {
 public:
  DenseRasterizer(const PlanePoints& input, const PlaneFrame& frame,
                  const CuboidApproximationParams& params)
      : input_(input), frame_(frame), params_(params), u_(kChunk), v_(kChunk), number_(kChunk) {
    for (int k = 0; k < 3; ++k) {
      axes_.u[k] = frame.u[k];
      axes_.v[k] = frame.v[k];
    }
    axes_.u_offset = -frame.u.dot(frame.origin);
    axes_.v_offset = -frame.v.dot(frame.origin);
  }

  /// \return false if the points are spread too far for one raster
  bool fit() {
    PlaneBounds all{1.0, 1.0, -1.0, -1.0};
    for (std::size_t first = 0; first < input_.inliers.size(); first += kChunk) {
      const PlaneBounds some = project(first);
      if (some.low_u > some.high_u || some.low_v > some.high_v) continue;
      if (all.low_u > all.high_u) all = some;
      all = {std::min(all.low_u, some.low_u), std::min(all.low_v, some.low_v),
             std::max(all.high_u, some.high_u), std::max(all.high_v, some.high_v)};
    }
    if (all.low_u > all.high_u) return false;
    const double s = params_.resolution;
    const double extent_u = all.high_u - all.low_u;
    const double extent_v = all.high_v - all.low_v;
    const double columns = cellsAcross(extent_u, s);
    const double rows = cellsAcross(extent_v, s);
    const double most =
        std::min(kLargestWindow,
                 kSmallWindow + kWindowPerPoint * static_cast<double>(input_.inliers.size()));
    if (!(columns * rows <= most)) return false;
    columns_ = static_cast<std::int32_t>(columns);
    rows_ = static_cast<std::int32_t>(rows);
    grid_ = {all.low_u - 0.5 * (columns * s - extent_u), all.low_v - 0.5 * (rows * s - extent_v),
             2.0 / s, 2 * columns_, 2 * rows_};
    return true;
  }

  PlanePatch run(std::size_t& points_dropped) {
    PlanePatch patch;
    patch.frame = frame_;
    patch.frame.origin = frame_.fromPlane({grid_.low_u, grid_.low_v, 0.0});
    patch.mask.width = columns_;
    patch.mask.height = rows_;
    patch.mask.cells.assign(static_cast<std::size_t>(columns_) * rows_, 0);
    patch.quarters.assign(patch.mask.cells.size(), 0);
    if (params_.min_points_per_cell > 1 || input_.probability) {
      sumUp(patch, points_dropped);
    } else {
      mark(patch, points_dropped);
    }
    return patch;
  }

 private:
  std::size_t chunkSize(std::size_t first) const {
    return std::min(kChunk, input_.inliers.size() - first);
  }

  PlaneBounds project(std::size_t first) {
    const PointSelection some{input_.points.data, input_.points.stride,
                              input_.inliers.data() + first, chunkSize(first)};
    return projectToPlane(some, axes_, u_.data(), v_.data());
  }

  /// Quarter of each point from \p first on, -1 if it is not finite.
  std::size_t number(std::size_t first) {
    if (input_.inliers.size() > kChunk) project(first);  // else still there from fit()
    const std::size_t size = chunkSize(first);
    cellNumbers(u_.data(), v_.data(), size, grid_, number_.data());
    return size;
  }

  void mark(PlanePatch& patch, std::size_t& points_dropped) {
    // The first element takes what is not finite, so that the loop needs no branch.
    std::vector<std::uint8_t> quarter(4 * patch.mask.cells.size() + 1, 0);
    std::uint8_t* const marks = quarter.data() + 1;
    for (std::size_t first = 0; first < input_.inliers.size(); first += kChunk) {
      const std::size_t size = number(first);
      for (std::size_t i = 0; i < size; ++i) marks[number_[i]] = 1;
      if (quarter[0]) {
        quarter[0] = 0;
        points_dropped += static_cast<std::size_t>(
            std::count(number_.begin(), number_.begin() + static_cast<std::ptrdiff_t>(size), -1));
      }
    }
    for (std::int32_t b = 0; b < rows_; ++b) {
      const std::uint8_t* low = marks + std::size_t{4} * static_cast<std::size_t>(b) * columns_;
      const std::uint8_t* high = low + std::size_t{2} * columns_;
      const std::size_t row = static_cast<std::size_t>(b) * columns_;
      for (std::int32_t a = 0; a < columns_; ++a) {
        const auto bits = static_cast<std::uint8_t>(low[2 * a] | low[2 * a + 1] << 1 |
                                                    high[2 * a] << 2 | high[2 * a + 1] << 3);
        patch.quarters[row + a] = bits;
        patch.mask.cells[row + a] = bits != 0;
      }
    }
  }

  void sumUp(PlanePatch& patch, std::size_t& points_dropped) {
    std::vector<std::uint32_t> count(patch.mask.cells.size(), 0);
    std::vector<double> belief(input_.probability ? count.size() : 0, 0.0);
    for (std::size_t first = 0; first < input_.inliers.size(); first += kChunk) {
      const std::size_t size = number(first);
      for (std::size_t i = 0; i < size; ++i) {
        if (number_[i] < 0) {
          ++points_dropped;
          continue;
        }
        const std::int32_t column = number_[i] % grid_.columns;
        const std::int32_t row = number_[i] / grid_.columns;
        const std::size_t cell = static_cast<std::size_t>(row / 2) * columns_ + column / 2;
        ++count[cell];
        patch.quarters[cell] |= static_cast<std::uint8_t>(1u << (column % 2 + 2 * (row % 2)));
        if (input_.probability) {
          belief[cell] +=
              (*input_.probability)[static_cast<std::size_t>(input_.inliers[first + i])];
        }
      }
    }
    if (input_.probability) patch.probability.assign(count.size(), 0.0f);
    for (std::size_t i = 0; i < count.size(); ++i) {
      if (count[i] == 0) continue;
      if (count[i] < static_cast<std::uint32_t>(params_.min_points_per_cell)) {
        points_dropped += count[i];
        patch.quarters[i] = 0;
        continue;
      }
      patch.mask.cells[i] = 1;
      if (input_.probability) patch.probability[i] = static_cast<float>(belief[i] / count[i]);
    }
  }

  const PlanePoints& input_;
  const PlaneFrame& frame_;
  const CuboidApproximationParams& params_;
  PlaneAxes axes_{};
  RasterGrid grid_{};
  std::int32_t columns_ = 0;
  std::int32_t rows_ = 0;
  std::vector<double> u_;
  std::vector<double> v_;
  std::vector<std::int32_t> number_;
};

}  // namespace

double cellsAcross(double extent, double resolution) {
  constexpr double kRounding = 1e-6;
  return std::max(1.0, std::ceil(extent / resolution - kRounding));
}

std::vector<PlanePatch> rasterizePlane(const PlanePoints& input, const PlaneFrame& frame,
                                       const CuboidApproximationParams& params,
                                       std::size_t& points_dropped) {
  if (input.inliers.empty()) return {};
  DenseRasterizer rasterizer(input, frame, params);
  if (!rasterizer.fit()) return rasterizeSparsely(input, frame, params, points_dropped);
  std::vector<PlanePatch> patches;
  patches.push_back(rasterizer.run(points_dropped));
  return patches;
}

}  // namespace planar_mapping::detail
