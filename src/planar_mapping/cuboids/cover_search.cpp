// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/cuboids/cover_window.h"
#include "planar_mapping/cuboids/plane_cover.h"

namespace planar_mapping {
namespace {

using detail::CellSet;
using detail::CoverWindow;
using detail::CuboidReach;
using detail::Element;
using detail::ElementRange;
using detail::HalfCell;
using detail::isTolerant;
using detail::WindowSurface;

/// No box holds half cells of two cubes of this many that do not touch: it reaches one beyond each.
constexpr int kApartBits = 2;
/// What is covered again may have as many as this, however few hold something.
constexpr double kMaxVolume = 1 << 26;

ElementRange rangeOf(const std::vector<Element>& elements, std::size_t first, std::size_t last) {
  return {elements.data() + first, elements.data() + last};
}

/// Half cells of the least box that holds all elements.
double volumeOf(const std::vector<Element>& elements) {
  if (elements.empty()) return 0.0;
  detail::HalfCellBox box;
  for (const Element& e : elements) detail::include(box, e.at);
  return (box.sizes().array() + 1).cast<double>().prod();
}

HalfCell cubeOf(const Element& e) {
  return {e.at[2] >> kApartBits, e.at[1] >> kApartBits, e.at[0] >> kApartBits};
}

/// Sorts elements by parts that no box can hold together.
/// \return where those of each begin, and the end
std::vector<std::size_t> sortByParts(std::vector<Element>& elements) {
  std::sort(elements.begin(), elements.end(),
            [](const Element& l, const Element& r) { return cubeOf(l) < cubeOf(r); });
  std::vector<HalfCell> cubes;
  std::vector<std::uint32_t> cube_of;
  for (const Element& e : elements) {
    const HalfCell cube = cubeOf(e);
    if (cubes.empty() || cubes.back() != cube) cubes.push_back(cube);
    cube_of.push_back(static_cast<std::uint32_t>(cubes.size() - 1));
  }
  DisjointParts parts(cubes.size());
  for (std::uint32_t i = 0; i < cubes.size(); ++i) {
    const auto& [z, y, x] = cubes[i];
    // Cubes that touch this one and come later, by rows of three.
    for (const HalfCell& row :
         {HalfCell{z, y, x}, {z, y + 1, x}, {z + 1, y - 1, x}, {z + 1, y, x}, {z + 1, y + 1, x}}) {
      const HalfCell last{row[0], row[1], x + 1};
      auto at = std::lower_bound(cubes.begin() + i, cubes.end(), HalfCell{row[0], row[1], x - 1});
      for (; at != cubes.end() && *at <= last; ++at) {
        parts.unite(i, static_cast<std::uint32_t>(at - cubes.begin()));
      }
    }
  }
  const auto group = [&](std::size_t i) { return parts.of(cube_of[i]); };
  std::vector<std::size_t> order(elements.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) {
    return std::make_pair(group(l), l) < std::make_pair(group(r), r);
  });
  std::vector<Element> sorted;
  std::vector<std::size_t> starts;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k == 0 || group(order[k]) != group(order[k - 1])) starts.push_back(k);
    sorted.push_back(elements[order[k]]);
  }
  starts.push_back(sorted.size());
  elements = std::move(sorted);
  return starts;
}

/// The choice between boxes and small rectangles.
class CoverSearch {
 public:
  CoverSearch(const std::vector<NonPlanarCell>& cells, const std::vector<SurfacePiece>& pieces,
              const std::vector<Cuboid>& present, const std::vector<ReplaceableCuboid>& replaceable,
              const CuboidApproximationParams& params, CoverEffort effort)
      : present_(present), replaceable_(replaceable), params_(params), effort_(effort) {
    const double half = 0.5 * params.resolution;
    // Of a half cell within this margin all is within the tolerance.
    if (isTolerant(params)) margin_ = params.absorption * params.resolution - 0.5 * half;
    addElements(cells, isTolerant(params), params.min_points_per_cell, elements_);
    addElements(pieces, half, elements_);
    surfaces_.push_back(elements_.size());
    for (const ReplaceableCuboid& r : replaceable) {
      addElements(r.pieces, half, elements_);
      surfaces_.push_back(elements_.size());
    }
    for (const Cuboid& c : present) reaches_.emplace_back(c, margin_);
  }

  /// Boxes for what \p boxes stand for, if fewer are found.
  std::vector<Cuboid> runAgain(const std::vector<Cuboid>& boxes) {
    if (volumeOf(elements_) > kMaxVolume) return boxes;
    CoverWindow window(rangeOf(elements_, 0, elements_.size()), params_);
    std::vector<CuboidReach> own;
    for (const Cuboid& c : boxes) own.emplace_back(c, margin_);
    window.keepOf(own);
    window.leaveTo(reaches_);
    std::vector<Cuboid> fewer;
    if (!window.anyRequired()) return fewer;
    for (const Cuboid& cuboid : present_) window.allow(cuboid);
    window.cover({}, effort_, fewer);
    return fewer.size() < boxes.size() ? fewer : boxes;
  }

  BoxCover run() {
    BoxCover cover;
    cover.kept.assign(replaceable_.size(), 1);
    if (replaceable_.empty() && present_.empty()) {
      coverApart(cover);
      return cover;
    }
    CoverWindow window(rangeOf(elements_, 0, elements_.size()), params_);
    window.leaveTo(reaches_);
    if (!window.anyRequired()) {
      cover.kept.assign(replaceable_.size(), 0);
      return cover;
    }
    choose(window, cover);
    return cover;
  }

 private:
  void choose(CoverWindow& window, BoxCover& cover) {
    std::vector<WindowSurface> surfaces;
    for (std::size_t i = 0; i < replaceable_.size(); ++i) {
      surfaces.push_back(
          {replaceable_[i].cuboid, rangeOf(elements_, surfaces_[i], surfaces_[i + 1])});
    }
    const std::vector<CellSet> sets = window.cellsOf(surfaces, margin_);
    for (const Cuboid& cuboid : present_) window.allow(cuboid);
    const auto kept = window.cover(sets, effort_, cover.boxes);
    cover.is_clutter = !kept;
    const std::size_t cuboids = (kept ? kept->size() : 0) + cover.boxes.size();
    // The search is no proof: with all of them it may need fewer boxes than it has in their place.
    if (kept && cuboids > replaceable_.size()) {
      const std::size_t most = cuboids - replaceable_.size() - 1;
      if (std::optional<std::vector<Cuboid>> boxes = boxesBesideAll(most)) {
        cover.boxes = std::move(*boxes);
        return;
      }
    }
    cover.kept.assign(replaceable_.size(), 0);
    if (!kept) return;
    for (const std::size_t i : *kept) cover.kept[i] = 1;
  }

  /// Boxes beside all of the replaceable cuboids, if no more than \p most are found.
  std::optional<std::vector<Cuboid>> boxesBesideAll(std::size_t most) {
    if (replaceable_.empty()) return std::nullopt;
    for (const ReplaceableCuboid& r : replaceable_) {
      present_.push_back(r.cuboid);
      reaches_.emplace_back(r.cuboid, margin_);
    }
    CoverWindow window(rangeOf(elements_, 0, surfaces_.front()), params_);
    window.leaveTo(reaches_);
    std::vector<Cuboid> boxes;
    if (!window.anyRequired()) return boxes;
    for (const Cuboid& cuboid : present_) window.allow(cuboid);
    if (window.needsAtLeast(most + 1)) return std::nullopt;
    window.cover({}, effort_, boxes);
    if (boxes.size() > most) return std::nullopt;
    return boxes;
  }

  /// Boxes for elements part by part, where no cuboid is.
  void coverApart(BoxCover& cover) {
    const std::vector<std::size_t> starts = sortByParts(elements_);
    for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
      CoverWindow some(rangeOf(elements_, starts[i], starts[i + 1]), params_);
      if (some.anyRequired()) cover.is_clutter |= !some.cover({}, effort_, cover.boxes);
    }
  }

  std::vector<Cuboid> present_;
  const std::vector<ReplaceableCuboid>& replaceable_;
  const CuboidApproximationParams& params_;
  const CoverEffort effort_;
  double margin_ = 0.0;
  std::vector<Element> elements_;      ///< of cells and pieces, then of each surface
  std::vector<std::size_t> surfaces_;  ///< where those of each begin, and the end
  std::vector<CuboidReach> reaches_;   ///< of the present ones
};

}  // namespace

BoxCover coverWithBoxes(const std::vector<NonPlanarCell>& cells,
                        const std::vector<SurfacePiece>& pieces, const std::vector<Cuboid>& present,
                        const std::vector<ReplaceableCuboid>& replaceable,
                        const CuboidApproximationParams& params, CoverEffort effort) {
  params.validate();
  return CoverSearch(cells, pieces, present, replaceable, params, effort).run();
}

std::vector<Cuboid> coverAgain(const std::vector<Cuboid>& boxes,
                               const std::vector<NonPlanarCell>& cells,
                               const std::vector<SurfacePiece>& pieces,
                               const std::vector<Cuboid>& present,
                               const CuboidApproximationParams& params) {
  params.validate();
  return CoverSearch(cells, pieces, present, {}, params, CoverEffort::Full).runAgain(boxes);
}

}  // namespace planar_mapping
