// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/compact_cover.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "cell_mask.h"
#include "lattice_cover.h"
#include "planar_mapping/core/error.h"
#include "plane_cover.h"

namespace planar_mapping {
namespace {

using detail::BitGrid;
using detail::CoverBox;
using detail::CoverRules;
using detail::LatticeBox;

/// A cell takes part only if a box can stand for the half cell next to it.
bool isTolerant(const CuboidApproximationParams& params) {
  return params.absorption >= 0.5;
}

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

SurfaceCover coverSurface(const CellMask& mask, const std::uint8_t* quarters,
                          const std::vector<float>& cell_probability,
                          const CuboidApproximationParams& params) {
  params.validate();
  detail::requireConsistent(mask);
  if (!cell_probability.empty() && cell_probability.size() != mask.cells.size()) {
    throw InputError("cell mask of " + std::to_string(mask.cells.size()) + " cells comes with " +
                     std::to_string(cell_probability.size()) + " probabilities");
  }
  SurfaceCover result;
  if (mask.cells.empty()) return result;
  const auto finish = [&]() {
    for (const HalfCellRectangle& r : result.rectangles) {
      result.probability.push_back(
          cell_probability.empty() ? 1.0f : meanProbability(mask, cell_probability, r));
    }
    return result;
  };
  if (params.profile == Profile::Paper) {
    for (const CellRectangle& r : detail::rectanglesOfPlane(mask, nullptr, params)) {
      result.rectangles.push_back({2 * r.a, 2 * r.b, 2 * r.width, 2 * r.height});
    }
    return finish();
  }
  const bool tolerant = isTolerant(params);
  constexpr std::int32_t kRim = 1;
  BitGrid required(2 * mask.width + 2 * kRim, 2 * mask.height + 2 * kRim, 1);
  BitGrid allowed = required;
  CellMask filled = mask;
  if (!(params.hole_size > 0.0 && params.hole_size < params.resolution)) {
    detail::fillHoles(filled, detail::lengthInCells(params.hole_size, params.resolution));
  }
  for (std::int32_t b = 0; b < mask.height; ++b) {
    for (std::int32_t a = 0; a < mask.width; ++a) {
      if (!filled.at(a, b)) continue;
      const bool occupied = mask.at(a, b);
      for (std::int32_t q = 0; q < 4; ++q) {
        const std::int32_t x = 2 * a + (q & 1) + kRim;
        const std::int32_t y = 2 * b + (q >> 1) + kRim;
        allowed.set(x, y, 0);
        const unsigned holds =
            quarters ? quarters[static_cast<std::size_t>(b) * mask.width + a] : 0xFu;
        if (occupied && (!tolerant || (holds >> q & 1u) != 0)) required.set(x, y, 0);
      }
    }
  }
  CoverRules rules;
  rules.smallest = {2, 2, 1};
  if (tolerant) {
    rules.tolerance = {1, 1, 0};
    allowed = allowed.dilated({1, 1, 0});
  }
  const double least = 4.0 * params.rectangle_cells;
  for (const CoverBox& c : detail::coverWithin(required, allowed, rules)) {
    if (static_cast<double>(c.members.size()) < least) {
      for (const auto& m : c.members) {
        const std::int32_t a = (m[0] - kRim) / 2;
        const std::int32_t b = (m[1] - kRim) / 2;
        result.loose.push_back({m[0] - kRim + 2 * mask.a0, m[1] - kRim + 2 * mask.b0,
                                cell_probability.empty()
                                    ? 1.0f
                                    : cell_probability[static_cast<std::size_t>(b) * mask.width +
                                                       static_cast<std::size_t>(a)]});
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

namespace {

using HalfCell = std::array<std::int32_t, 3>;

/// What a half cell holds.
struct Element {
  HalfCell at{};
  float probability = 0.0f;
  bool required = false;
};

/// Many half cells ask for the cuboids near them: those of a block of them share the search.
class Presence {
 public:
  Presence(const std::vector<Cuboid>& cuboids, double half, double margin)
      : half_(half), margin_(margin) {
    for (const Cuboid& c : cuboids) {
      Box box;
      box.to_local = c.orientation.conjugate().toRotationMatrix();
      box.offset = -(box.to_local * c.center);
      box.extent = 0.5 * c.size + Vector3::Constant(margin + 1e-9 * (1.0 + c.center.norm()));
      boxes_.push_back(box);
    }
  }

  bool holds(const HalfCell& cell) {
    const HalfCell block{cell[0] >> 3, cell[1] >> 3, cell[2] >> 3};
    if (!(block == block_) || !any_) {
      block_ = block;
      any_ = true;
      near_.clear();
      const Vector3 middle = 8.0 * half_ * Vector3(block[0] + 0.5, block[1] + 0.5, block[2] + 0.5);
      const double radius = 4.0 * std::sqrt(3.0) * half_;
      for (std::size_t i = 0; i < boxes_.size(); ++i) {
        const Vector3 q = (boxes_[i].to_local * middle + boxes_[i].offset).cwiseAbs();
        if (((q - boxes_[i].extent).array() <= radius).all()) near_.push_back(i);
      }
    }
    const Vector3 p = half_ * Vector3(cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5);
    return std::any_of(near_.begin(), near_.end(), [&](std::size_t i) {
      const Vector3 q = (boxes_[i].to_local * p + boxes_[i].offset).cwiseAbs();
      return (q.array() <= boxes_[i].extent.array()).all();
    });
  }

 private:
  struct Box {
    Matrix3 to_local;
    Vector3 offset;
    Vector3 extent;
  };
  double half_;
  double margin_;
  std::vector<Box> boxes_;
  HalfCell block_{};
  bool any_ = false;
  std::vector<std::size_t> near_;
};

}  // namespace

std::vector<Cuboid> coverRest(const std::vector<NonPlanarCell>& cells,
                              const std::vector<SurfacePiece>& pieces,
                              const std::vector<Cuboid>& present,
                              const CuboidApproximationParams& params) {
  params.validate();
  const bool tolerant = isTolerant(params);
  const double half = 0.5 * params.resolution;
  std::vector<Element> elements;
  for (const NonPlanarCell& cell : cells) {
    for (int k = 0; k < 8; ++k) {
      const bool holds = (cell.octants >> k & 1) != 0;
      if (tolerant && !holds && cell.octants != 0) continue;
      elements.push_back(
          {{2 * cell.x + (k & 1), 2 * cell.y + (k >> 1 & 1), 2 * cell.z + (k >> 2 & 1)},
           cell.probability,
           cell.octants != 0});
    }
  }
  for (const SurfacePiece& piece : pieces) {
    const Vector3 at = (piece.center / half).array().floor();
    if (!(at.cwiseAbs().maxCoeff() < 1e9)) continue;
    elements.push_back({{static_cast<std::int32_t>(at.x()), static_cast<std::int32_t>(at.y()),
                         static_cast<std::int32_t>(at.z())},
                        piece.probability,
                        true});
  }
  // Block by block of 8 x 8 x 8, for Presence.
  const auto rank = [](const Element& e) {
    return std::make_tuple(e.at[2] >> 3, e.at[1] >> 3, e.at[0] >> 3, e.at[2], e.at[1], e.at[0],
                           !e.required);
  };
  std::stable_sort(elements.begin(), elements.end(),
                   [&](const Element& l, const Element& r) { return rank(l) < rank(r); });
  elements.erase(std::unique(elements.begin(), elements.end(),
                             [](const Element& l, const Element& r) { return l.at == r.at; }),
                 elements.end());
  Presence presence(present, half,
                    tolerant ? params.absorption * params.resolution - 0.5 * half : 0.0);
  for (Element& e : elements) {
    if (e.required && presence.holds(e.at)) e.required = false;
  }
  std::vector<Cuboid> cuboids;
  if (std::none_of(elements.begin(), elements.end(), [](const Element& e) { return e.required; })) {
    return cuboids;
  }
  constexpr std::int32_t kRim = 2;
  HalfCell low{}, high{};
  bool first = true;
  for (const Element& e : elements) {
    if (!e.required) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = first ? e.at[k] : std::min(low[k], e.at[k]);
      high[k] = first ? e.at[k] : std::max(high[k], e.at[k]);
    }
    first = false;
  }
  BitGrid required(high[0] - low[0] + 1 + 2 * kRim, high[1] - low[1] + 1 + 2 * kRim,
                   high[2] - low[2] + 1 + 2 * kRim);
  BitGrid allowed = required;
  std::map<HalfCell, float> probability;
  for (const Element& e : elements) {
    const HalfCell at{e.at[0] - low[0] + kRim, e.at[1] - low[1] + kRim, e.at[2] - low[2] + kRim};
    if (!allowed.contains({at, {at[0] + 1, at[1] + 1, at[2] + 1}})) continue;
    allowed.set(at[0], at[1], at[2]);
    if (e.required) {
      required.set(at[0], at[1], at[2]);
      probability[at] = e.probability;
    }
  }
  CoverRules rules;
  rules.smallest = {2, 2, 2};
  if (tolerant) {
    rules.tolerance = {1, 1, 1};
    allowed = allowed.dilated({1, 1, 1});
  }
  for (const CoverBox& c : detail::coverWithin(required, allowed, rules)) {
    Cuboid cuboid;
    double sum = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Vector3::Index>(k);
      cuboid.size[axis] = half * c.box.size(k);
      cuboid.center[axis] =
          half * (low[k] - kRim + 0.5 * (static_cast<double>(c.box.low[k]) + c.box.high[k]));
    }
    for (const auto& m : c.members) sum += static_cast<double>(probability[m]);
    cuboid.probability = static_cast<float>(sum / static_cast<double>(c.members.size()));
    cuboids.push_back(cuboid);
  }
  return cuboids;
}

}  // namespace planar_mapping
