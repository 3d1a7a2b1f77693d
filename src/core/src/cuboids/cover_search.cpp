// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "cuboids/cover_window.h"
#include "cuboids/plane_cover.h"

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

/// Half cells that are covered together, a cube of this many where they lie too far apart.
constexpr int kWindowBits = 8;
/// A window may have this many half cells for each element, beyond a small one.
constexpr double kVolumePerElement = 512.0;
constexpr double kSmallVolume = 1 << 22;
/// What is covered again may have as many as this, however few hold something.
constexpr double kMostVolume = 1 << 26;

ElementRange rangeOf(const std::vector<Element>& elements, std::size_t first, std::size_t last) {
  return {elements.data() + first, elements.data() + last};
}

/// Half cells of the least box that holds all elements.
double volumeOf(const std::vector<Element>& elements) {
  if (elements.empty()) return 0.0;
  HalfCell low = elements.front().at;
  HalfCell high = low;
  for (const Element& e : elements) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], e.at[k]);
      high[k] = std::max(high[k], e.at[k]);
    }
  }
  double volume = 1.0;
  for (std::size_t k = 0; k < 3; ++k) volume *= static_cast<double>(high[k] - low[k] + 1);
  return volume;
}

/// May all elements share one window?
bool isCompactSet(const std::vector<Element>& elements) {
  const double volume = volumeOf(elements);
  if (volume <= kSmallVolume) return true;
  return volume <=
         kSmallVolume + kVolumePerElement * static_cast<double>(detail::countHalfCells(elements));
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
    if (volumeOf(elements_) > kMostVolume) return boxes;
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
    if (!isCompactSet(elements_)) {
      keepAll();
      coverFar(cover);
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
    keepAll();
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

  void keepAll() {
    for (const ReplaceableCuboid& r : replaceable_) {
      present_.push_back(r.cuboid);
      reaches_.emplace_back(r.cuboid, margin_);
    }
  }

  /// Boxes for elements that lie far apart, window by window, where no cuboid is.
  void coverFar(BoxCover& cover) {
    const auto window = [](const Element& e) {
      return std::make_tuple(e.at[2] >> kWindowBits, e.at[1] >> kWindowBits,
                             e.at[0] >> kWindowBits);
    };
    elements_.resize(surfaces_.front());
    std::stable_sort(elements_.begin(), elements_.end(),
                     [&](const Element& l, const Element& r) { return window(l) < window(r); });
    for (std::size_t first = 0; first < elements_.size();) {
      std::size_t last = first;
      while (last < elements_.size() && window(elements_[last]) == window(elements_[first])) ++last;
      CoverWindow some(rangeOf(elements_, first, last), params_);
      some.leaveTo(reaches_);
      if (some.anyRequired()) cover.is_clutter |= !some.cover({}, effort_, cover.boxes);
      first = last;
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
