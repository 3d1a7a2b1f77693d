// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/compact_cover.h"

#include <algorithm>
#include <cmath>
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
using detail::LatticeCell;

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
    for (const CellRectangle& r :
         splitAndMerge(mask, params.density_threshold,
                       detail::lengthInCells(params.min_width, params.resolution),
                       detail::lengthInCells(params.min_height, params.resolution))) {
      result.rectangles.push_back({2 * r.a, 2 * r.b, 2 * r.width, 2 * r.height});
    }
    return finish();
  }
  const bool tolerant = isTolerant(params);
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
    if (fill) allowed = allowed.dilated({1, 1, 0});
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

namespace {

using HalfCell = std::array<std::int64_t, 3>;

/// What a half cell holds.
struct Element {
  HalfCell at{};
  float probability = 0.0f;
  bool required = false;
};

/// Half cells that are covered together, a cube of this many where they lie too far apart.
constexpr int kWindowBits = 8;
/// A window may have this many half cells for each element, beyond a small one.
constexpr double kVolumePerElement = 512.0;
constexpr double kSmallVolume = 1 << 22;

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
      const Vector3 middle = 8.0 * half_ * centerOf(block);
      const double radius = 4.0 * std::sqrt(3.0) * half_;
      for (std::size_t i = 0; i < boxes_.size(); ++i) {
        const Vector3 q = (boxes_[i].to_local * middle + boxes_[i].offset).cwiseAbs();
        if (((q - boxes_[i].extent).array() <= radius).all()) near_.push_back(i);
      }
    }
    const Vector3 p = half_ * centerOf(cell);
    return std::any_of(near_.begin(), near_.end(), [&](std::size_t i) {
      const Vector3 q = (boxes_[i].to_local * p + boxes_[i].offset).cwiseAbs();
      return (q.array() <= boxes_[i].extent.array()).all();
    });
  }

 private:
  static Vector3 centerOf(const HalfCell& c) {
    return Vector3(static_cast<double>(c[0]), static_cast<double>(c[1]),
                   static_cast<double>(c[2])) +
           Vector3::Constant(0.5);
  }
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

/// The distinct elements, block by block of 8 x 8 x 8.
std::vector<Element> collectElements(const std::vector<NonPlanarCell>& cells,
                                     const std::vector<SurfacePiece>& pieces, double half,
                                     bool tolerant, int min_points) {
  std::vector<Element> elements;
  for (const NonPlanarCell& cell : cells) {
    if (min_points > 1 && cell.weight < static_cast<float>(min_points)) continue;
    for (int k = 0; k < 8; ++k) {
      const bool holds = (cell.octants >> k & 1) != 0;
      if (tolerant && !holds && cell.octants != 0) continue;
      elements.push_back({{2 * static_cast<std::int64_t>(cell.x) + (k & 1),
                           2 * static_cast<std::int64_t>(cell.y) + (k >> 1 & 1),
                           2 * static_cast<std::int64_t>(cell.z) + (k >> 2 & 1)},
                          cell.probability,
                          cell.octants != 0});
    }
  }
  for (const SurfacePiece& piece : pieces) {
    const Eigen::Array3d at = (piece.center / half).array().floor();
    if (!(at.abs() < 4e9).all()) continue;  // beyond all cells, or not finite
    elements.push_back({{static_cast<std::int64_t>(at.x()), static_cast<std::int64_t>(at.y()),
                         static_cast<std::int64_t>(at.z())},
                        piece.probability,
                        true});
  }
  const auto rank = [](const Element& e) {
    return std::make_tuple(e.at[2] >> 3, e.at[1] >> 3, e.at[0] >> 3, e.at[2], e.at[1], e.at[0],
                           !e.required, -e.probability);
  };
  std::sort(elements.begin(), elements.end(),
            [&](const Element& l, const Element& r) { return rank(l) < rank(r); });
  elements.erase(std::unique(elements.begin(), elements.end(),
                             [](const Element& l, const Element& r) { return l.at == r.at; }),
                 elements.end());
  return elements;
}

/// Covers elements that lie near each other. Those that are not required may lie anywhere.
void coverWindow(const std::vector<Element>& elements, const CuboidApproximationParams& params,
                 std::vector<Cuboid>& cuboids) {
  constexpr std::int64_t kRim = 2;
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
  if (first) return;
  for (std::int64_t& start : low) start -= (start & 1) + kRim;  // cells start at even numbers
  const auto size = [&](std::size_t k) {
    return static_cast<std::int32_t>(high[k] + 1 + kRim - low[k]);
  };
  BitGrid required(size(0), size(1), size(2));
  BitGrid allowed = required;
  std::vector<std::pair<LatticeCell, float>> probability;
  for (const Element& e : elements) {
    LatticeCell at{};
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int64_t offset = e.at[k] - low[k];
      inside &= offset >= 0 && offset < size(k);
      at[k] = static_cast<std::int32_t>(offset);
    }
    if (!inside) continue;
    allowed.set(at[0], at[1], at[2]);
    if (!e.required) continue;
    required.set(at[0], at[1], at[2]);
    probability.emplace_back(at, e.probability);
  }
  std::sort(probability.begin(), probability.end());
  CoverRules rules;
  rules.smallest = {2, 2, 2};
  if (isTolerant(params)) {
    rules.tolerance = {1, 1, 1};
    allowed = allowed.dilated({1, 1, 1});
  }
  const double half = 0.5 * params.resolution;
  for (const CoverBox& c : detail::coverWithin(required, allowed, rules)) {
    Cuboid cuboid;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Vector3::Index>(k);
      cuboid.size[axis] = half * c.box.size(k);
      cuboid.center[axis] =
          half * (static_cast<double>(low[k]) + 0.5 * c.box.low[k] + 0.5 * c.box.high[k]);
    }
    double sum = 0.0;
    for (const LatticeCell& m : c.members) {
      const auto at =
          std::lower_bound(probability.begin(), probability.end(), m,
                           [](const auto& p, const LatticeCell& l) { return p.first < l; });
      sum += static_cast<double>(at->second);
    }
    cuboid.probability = static_cast<float>(sum / static_cast<double>(c.members.size()));
    cuboids.push_back(cuboid);
  }
}

}  // namespace

std::vector<Cuboid> coverRest(const std::vector<NonPlanarCell>& cells,
                              const std::vector<SurfacePiece>& pieces,
                              const std::vector<Cuboid>& present,
                              const CuboidApproximationParams& params) {
  params.validate();
  const bool tolerant = isTolerant(params);
  const double half = 0.5 * params.resolution;
  std::vector<Element> elements =
      collectElements(cells, pieces, half, tolerant, params.min_points_per_cell);
  // Of a half cell within this margin all is within the tolerance.
  const double margin = tolerant ? params.absorption * params.resolution - 0.5 * half : 0.0;
  Presence presence(present, half, margin);
  HalfCell low{}, high{};
  for (Element& e : elements) {
    if (e.required && presence.holds(e.at)) e.required = false;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = &e == elements.data() ? e.at[k] : std::min(low[k], e.at[k]);
      high[k] = &e == elements.data() ? e.at[k] : std::max(high[k], e.at[k]);
    }
  }
  std::vector<Cuboid> cuboids;
  double volume = 1.0;
  for (std::size_t k = 0; k < 3; ++k) volume *= static_cast<double>(high[k] - low[k] + 1);
  if (volume <= kSmallVolume + kVolumePerElement * static_cast<double>(elements.size())) {
    coverWindow(elements, params, cuboids);
    return cuboids;
  }
  const auto window = [](const Element& e) {
    return std::make_tuple(e.at[2] >> kWindowBits, e.at[1] >> kWindowBits, e.at[0] >> kWindowBits);
  };
  std::stable_sort(elements.begin(), elements.end(),
                   [&](const Element& l, const Element& r) { return window(l) < window(r); });
  for (auto begin = elements.begin(); begin != elements.end();) {
    const auto end = std::find_if(begin, elements.end(),
                                  [&](const Element& e) { return window(e) != window(*begin); });
    coverWindow({begin, end}, params, cuboids);
    begin = end;
  }
  return cuboids;
}

}  // namespace planar_mapping
