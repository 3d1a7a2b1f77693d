// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/compact_cover.h"

#include <algorithm>
#include <string>
#include <tuple>

#include "planar_mapping/base/error.h"
#include "planar_mapping/cuboids/cover/lattice_cover.h"
#include "planar_mapping/cuboids/plane_cover.h"

namespace planar_mapping {
namespace {

using detail::BitGrid;
using detail::CoverBox;
using detail::CoverRules;

/// Mean over the occupied cells that the rectangle touches.
float meanProbability(const CellMask& mask, const std::vector<float>& probability,
                      const HalfCellRectangle& r) {
  double sum = 0.0;
  std::int64_t count = 0;
  for (std::int32_t b = (r.b >> 1) - mask.b0; b <= ((r.b + r.height - 1) >> 1) - mask.b0; ++b) {
    for (std::int32_t a = (r.a >> 1) - mask.a0; a <= ((r.a + r.width - 1) >> 1) - mask.a0; ++a) {
      if (!mask.at(a, b)) continue;  // a filled hole has no belief of its own
      sum += probability[static_cast<std::size_t>(b) * mask.width + static_cast<std::size_t>(a)];
      ++count;
    }
  }
  return count > 0 ? static_cast<float>(sum / static_cast<double>(count)) : 1.0f;
}

}  // namespace

SurfaceCover coverSurface(const CellMask& mask, const std::vector<float>& cell_probability,
                          const CuboidApproximationParams& params) {
  params.validate();
  detail::requireConsistent(mask);
  if (cell_probability.size() != mask.cells.size()) {
    throw InputError("cell mask of " + std::to_string(mask.cells.size()) + " cells comes with " +
                     std::to_string(cell_probability.size()) + " probabilities");
  }
  SurfaceCover result;
  if (mask.cells.empty()) return result;
  const auto finish = [&]() {
    for (const HalfCellRectangle& r : result.rectangles) {
      result.probability.push_back(meanProbability(mask, cell_probability, r));
    }
    return result;
  };
  if (params.profile == Profile::Paper) {
    for (const CellRectangle& r :
         splitAndMerge(mask, params.density_threshold,
                       detail::lengthInCells(params.min_width, params.resolution),
                       detail::lengthInCells(params.min_height, params.resolution))) {
      result.rectangles.push_back({2 * r.a, 2 * r.b, 2 * r.width, 2 * r.height});
    }
    return finish();
  }
  const bool tolerant = detail::isTolerant(params);
  constexpr std::int32_t kRim = 2;  // room to grow, and whole cells start at even numbers
  BitGrid required(2 * mask.width + 2 * kRim, 2 * mask.height + 2 * kRim, 1);
  BitGrid allowed = required;
  // [ours] 0 stands for one cell; a side below one cell leaves every hole open.
  const bool fill = !(params.hole_size > 0.0 && params.hole_size < params.resolution);
  CellMask filled = mask;
  if (fill) detail::fillHoles(filled, detail::lengthInCells(params.hole_size, params.resolution));
  for (std::int32_t b = 0; b < mask.height; ++b) {
    for (std::int32_t a = 0; a < mask.width; ++a) {
      if (!filled.at(a, b)) continue;
      const bool occupied = mask.at(a, b);
      for (std::int32_t q = 0; q < 4; ++q) {
        const std::int32_t x = 2 * a + (q & 1) + kRim;
        const std::int32_t y = 2 * b + (q >> 1) + kRim;
        allowed.set(x, y, 0);
        if (occupied) required.set(x, y, 0);
      }
    }
  }
  CoverRules rules;
  rules.smallest = {2, 2, 1};
  if (tolerant) {
    rules.tolerance = {1, 1, 0};
    if (fill) allowed = allowed.dilated({1, 1, 0});
  }
  const double least = 4.0 * params.rectangle_cells;
  for (const CoverBox& c : detail::coverWithin(required, allowed, rules).boxes) {
    if (static_cast<double>(c.members.size()) < least) {
      for (const auto& m : c.members) {
        const auto cell = static_cast<std::size_t>((m[1] - kRim) / 2) * mask.width +
                          static_cast<std::size_t>((m[0] - kRim) / 2);
        result.loose.push_back(
            {m[0] - kRim + 2 * mask.a0, m[1] - kRim + 2 * mask.b0, cell_probability[cell]});
      }
      continue;
    }
    result.rectangles.push_back({c.box.low[0] - kRim + 2 * mask.a0,
                                 c.box.low[1] - kRim + 2 * mask.b0, c.box.size(0), c.box.size(1)});
  }
  std::sort(result.rectangles.begin(), result.rectangles.end(), [](const auto& l, const auto& r) {
    return std::tie(l.b, l.a, l.height, l.width) < std::tie(r.b, r.a, r.height, r.width);
  });
  std::sort(result.loose.begin(), result.loose.end(),
            [](const auto& l, const auto& r) { return std::tie(l.b, l.a) < std::tie(r.b, r.a); });
  return finish();
}

Cuboid cuboidOf(const HalfCellRectangle& r, const PlaneFrame& frame,
                const CuboidApproximationParams& params) {
  const double half = 0.5 * params.resolution;
  const double thickness = detail::thicknessOf(params);
  Matrix3 axes;
  axes << frame.u, frame.v, frame.n;
  Cuboid cuboid;
  cuboid.size = {r.width * half, r.height * half, thickness};
  cuboid.center = frame.fromPlane(
      {(r.a + 0.5 * r.width) * half, (r.b + 0.5 * r.height) * half, -0.5 * thickness});
  cuboid.orientation = Quaternion(axes);
  return cuboid;
}

void addPieces(const LooseQuarter& quarter, const PlaneFrame& frame,
               const CuboidApproximationParams& params, std::vector<SurfacePiece>& pieces) {
  const double half = 0.5 * params.resolution;
  for (const double b : {0.25, 0.75}) {
    for (const double a : {0.25, 0.75}) {
      pieces.push_back({frame.fromPlane({half * (quarter.a + a), half * (quarter.b + b), 0.0}),
                        quarter.probability});
    }
  }
}

std::vector<std::uint8_t> replaceableOf(const std::vector<Cuboid>& cuboids,
                                        const CuboidApproximationParams& params) {
  // 32 cells: the faces of furniture stay planes, what is smaller is seldom one to a planner.
  constexpr double kMaxCells = 32.5;
  constexpr double kMaxCellsBesideALarger = 128.5;
  constexpr double kMaxSlant = 0.5;         // cells, the tolerance of a cover
  constexpr double kMaxSlantedCells = 8.5;  // of a face that slants farther
  std::vector<std::uint8_t> replaceable(cuboids.size(), 0);
  if (!(params.rectangle_cells > 0.0)) return replaceable;
  const auto area = [](const Cuboid& c) { return c.size.x() * c.size.y(); };
  const auto largest =
      std::max_element(cuboids.begin(), cuboids.end(),
                       [&](const Cuboid& l, const Cuboid& r) { return area(l) < area(r); });
  for (auto c = cuboids.begin(); c != cuboids.end(); ++c) {
    const Matrix3 axes = c->orientation.toRotationMatrix().cwiseAbs();
    Vector3::Index along = 0;
    axes.col(2).maxCoeff(&along);
    const double slant = axes(along, 0) * c->size.x() + axes(along, 1) * c->size.y();
    const double cells = area(*c) / (params.resolution * params.resolution);
    const bool is_along = slant <= kMaxSlant * params.resolution;
    const double most =
        is_along ? (c == largest ? kMaxCells : kMaxCellsBesideALarger) : kMaxSlantedCells;
    replaceable[static_cast<std::size_t>(c - cuboids.begin())] = cells <= most ? 1 : 0;
  }
  return replaceable;
}

}  // namespace planar_mapping
