// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "lattice_cover.h"
#include "planar_mapping/core/compact_cover.h"
#include "plane_cover.h"
#include "rest_elements.h"

namespace planar_mapping {
namespace {

using detail::BitGrid;
using detail::CellSet;
using detail::CoverBox;
using detail::CoverRules;
using detail::Element;
using detail::HalfCell;
using detail::halfCellOf;
using detail::isTolerant;
using detail::LatticeBox;
using detail::LatticeCell;

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

/// Covers elements that lie near each other. Those that are not required may lie anywhere.
class Window {
 public:
  Window(const std::vector<Element>& elements, const CuboidApproximationParams& params)
      : tolerant_(isTolerant(params)), half_(0.5 * params.resolution), low_(lowOf(elements)) {
    HalfCell high = low_;
    for (const Element& e : elements) {
      if (!e.required) continue;
      const HalfCell at = e.at();
      for (std::size_t k = 0; k < 3; ++k) high[k] = std::max(high[k], at[k]);
    }
    const auto size = [&](std::size_t k) {
      return static_cast<std::int32_t>(high[k] + 1 + kRim - low_[k]);
    };
    required_ = allowed_ = exact_ = BitGrid(size(0), size(1), size(2));
    for (const Element& e : elements) {
      LatticeCell at{};
      if (!find(e.at(), at)) continue;
      allowed_.set(at[0], at[1], at[2]);
      if (!e.required) continue;
      required_.set(at[0], at[1], at[2]);
      if (e.exact) exact_.set(at[0], at[1], at[2]);
      probability_.emplace_back(at, e.probability);
    }
    std::sort(probability_.begin(), probability_.end());
  }

  /// Boxes may also lie where a cuboid is.
  void allow(const Cuboid& cuboid) {
    const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
    const Vector3 extent = 0.5 * cuboid.size;
    const LatticeBox box = boxAround(cuboid, 0.0);
    for (std::int32_t z = box.low[2]; z < box.high[2]; ++z) {
      for (std::int32_t y = box.low[1]; y < box.high[1]; ++y) {
        const Vector3 start = to_local * (centerOf({0, y, z}) - cuboid.center);
        double first = box.low[0];
        double last = box.high[0] - 1;
        for (int k = 0; k < 3; ++k) {
          const double slope = half_ * to_local(k, 0);
          if (std::abs(slope) < 1e-9 * half_) {
            if (std::abs(start[k]) > extent[k]) last = first - 1.0;
            continue;
          }
          const double a = (-extent[k] - start[k]) / slope;
          const double b = (extent[k] - start[k]) / slope;
          first = std::max(first, std::ceil(std::min(a, b)));
          last = std::min(last, std::floor(std::max(a, b)));
        }
        for (auto x = static_cast<std::int32_t>(first); x <= last; ++x) allowed_.set(x, y, z);
      }
    }
  }

  /// The required cells that a cuboid stands for: those of its own surface and those it is near.
  CellSet cellsOf(const ReplaceableCuboid& replaceable, double margin) const {
    CellSet cells;
    HalfCell at{};
    LatticeCell cell{};
    for (const SurfacePiece& piece : replaceable.pieces) {
      if (!halfCellOf(piece.center, half_, at) || !find(at, cell)) continue;
      if (required_.at(cell[0], cell[1], cell[2]) && !exact_.at(cell[0], cell[1], cell[2])) {
        if (cells.empty() || cells.back() != cell) cells.push_back(cell);
      }
    }
    Presence presence({replaceable.cuboid}, half_, margin);
    required_.forEach(boxAround(replaceable.cuboid, margin + half_),
                      [&](std::int32_t x, std::int32_t y, std::int32_t z) {
                        if (presence.holds({low_[0] + x, low_[1] + y, low_[2] + z})) {
                          cells.push_back({x, y, z});
                        }
                      });
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
  }

  /// \return which of the sets take part
  std::vector<std::size_t> cover(const std::vector<CellSet>& sets, std::vector<Cuboid>& cuboids) {
    CoverRules rules;
    rules.smallest = {2, 2, 2};
    if (tolerant_) {
      rules.tolerance = {1, 1, 1};
      allowed_ = allowed_.dilated({1, 1, 1});
    }
    detail::LatticeCoverage coverage = detail::coverWithin(required_, allowed_, rules, sets);
    for (const CoverBox& c : coverage.boxes) {
      Cuboid cuboid;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Vector3::Index>(k);
        cuboid.size[axis] = half_ * c.box.size(k);
        cuboid.center[axis] =
            half_ * (static_cast<double>(low_[k]) + 0.5 * c.box.low[k] + 0.5 * c.box.high[k]);
      }
      double sum = 0.0;
      for (const LatticeCell& m : c.members) {
        const auto at =
            std::lower_bound(probability_.begin(), probability_.end(), m,
                             [](const auto& p, const LatticeCell& l) { return p.first < l; });
        sum += static_cast<double>(at->second);
      }
      cuboid.probability = static_cast<float>(sum / static_cast<double>(c.members.size()));
      cuboids.push_back(cuboid);
    }
    return coverage.sets;
  }

 private:
  static constexpr std::int64_t kRim = 2;

  static HalfCell lowOf(const std::vector<Element>& elements) {
    HalfCell low{};
    bool first = true;
    for (const Element& e : elements) {
      if (!e.required) continue;
      const HalfCell at = e.at();
      for (std::size_t k = 0; k < 3; ++k) low[k] = first ? at[k] : std::min(low[k], at[k]);
      first = false;
    }
    for (std::int64_t& start : low) start -= (start & 1) + kRim;  // cells start at even numbers
    return low;
  }
  /// \return false outside the window
  bool find(const HalfCell& at, LatticeCell& cell) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int64_t offset = at[k] - low_[k];
      if (offset < 0 || offset >= required_.size()[k]) return false;
      cell[k] = static_cast<std::int32_t>(offset);
    }
    return true;
  }
  Vector3 centerOf(const LatticeCell& cell) const {
    Vector3 center;
    for (std::size_t k = 0; k < 3; ++k) {
      center[static_cast<Vector3::Index>(k)] =
          half_ * (static_cast<double>(low_[k] + cell[k]) + 0.5);
    }
    return center;
  }
  /// Cells of the window that come within \p margin of the cuboid, and some more.
  LatticeBox boxAround(const Cuboid& cuboid, double margin) const {
    const Vector3 reach = cuboid.orientation.toRotationMatrix().cwiseAbs() * (0.5 * cuboid.size) +
                          Vector3::Constant(margin);
    LatticeBox box;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Vector3::Index>(k);
      const auto toCell = [&](double coordinate) {
        const double cell = std::floor(coordinate / half_) - static_cast<double>(low_[k]);
        return static_cast<std::int32_t>(
            std::clamp(cell, 0.0, static_cast<double>(required_.size()[k])));
      };
      box.low[k] = toCell(cuboid.center[axis] - reach[axis]);
      box.high[k] = std::min(toCell(cuboid.center[axis] + reach[axis]) + 1, required_.size()[k]);
    }
    return box;
  }

  bool tolerant_;
  double half_;
  HalfCell low_;
  BitGrid required_{0, 0, 0};
  BitGrid allowed_{0, 0, 0};
  BitGrid exact_{0, 0, 0};
  std::vector<std::pair<LatticeCell, float>> probability_;
};

bool anyRequired(const std::vector<Element>& elements) {
  return std::any_of(elements.begin(), elements.end(), [](const Element& e) { return e.required; });
}

/// May all elements share one window?
bool isCompactSet(const std::vector<Element>& elements) {
  HalfCell low = elements.front().at();
  HalfCell high = low;
  for (const Element& e : elements) {
    const HalfCell at = e.at();
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], at[k]);
      high[k] = std::max(high[k], at[k]);
    }
  }
  double volume = 1.0;
  for (std::size_t k = 0; k < 3; ++k) volume *= static_cast<double>(high[k] - low[k] + 1);
  return volume <= kSmallVolume + kVolumePerElement * static_cast<double>(elements.size());
}

/// Covers elements that lie far apart, window by window.
void coverFar(std::vector<Element> elements, const CuboidApproximationParams& params,
              std::vector<Cuboid>& cuboids) {
  const auto window = [](const Element& e) {
    const HalfCell at = e.at();
    return std::make_tuple(at[2] >> kWindowBits, at[1] >> kWindowBits, at[0] >> kWindowBits);
  };
  std::stable_sort(elements.begin(), elements.end(),
                   [&](const Element& l, const Element& r) { return window(l) < window(r); });
  for (auto begin = elements.begin(); begin != elements.end();) {
    const auto end = std::find_if(begin, elements.end(),
                                  [&](const Element& e) { return window(e) != window(*begin); });
    const std::vector<Element> some(begin, end);
    if (anyRequired(some)) Window(some, params).cover({}, cuboids);
    begin = end;
  }
}

/// What cuboids stand for needs no box.
void leaveToCuboids(const std::vector<Cuboid>& present, double half, double margin,
                    std::vector<Element>& elements) {
  Presence presence(present, half, margin);
  for (Element& e : elements) {
    if (e.required && presence.holds(e.at())) e.required = e.exact = false;
  }
}

}  // namespace

RestCover coverRest(const std::vector<NonPlanarCell>& cells,
                    const std::vector<SurfacePiece>& pieces, const std::vector<Cuboid>& present,
                    const std::vector<ReplaceableCuboid>& replaceable,
                    const CuboidApproximationParams& params) {
  params.validate();
  const double half = 0.5 * params.resolution;
  // Of a half cell within this margin all is within the tolerance.
  const double margin =
      isTolerant(params) ? params.absorption * params.resolution - 0.5 * half : 0.0;
  RestCover result;
  result.kept.assign(replaceable.size(), 1);
  std::vector<Element> rest;
  addElements(cells, isTolerant(params), params.min_points_per_cell, rest);
  addElements(pieces, half, rest);
  std::vector<Element> elements = rest;
  for (const ReplaceableCuboid& r : replaceable) addElements(r.pieces, half, elements);
  sortElements(elements);
  leaveToCuboids(present, half, margin, elements);
  if (!anyRequired(elements)) {
    result.kept.assign(replaceable.size(), 0);
    return result;
  }
  if (!isCompactSet(elements)) {
    std::vector<Cuboid> all = present;
    for (const ReplaceableCuboid& r : replaceable) all.push_back(r.cuboid);
    sortElements(rest);
    leaveToCuboids(all, half, margin, rest);
    coverFar(std::move(rest), params, result.boxes);
    return result;
  }
  Window window(elements, params);
  std::vector<CellSet> sets;
  for (const ReplaceableCuboid& r : replaceable) sets.push_back(window.cellsOf(r, margin));
  for (const Cuboid& cuboid : present) window.allow(cuboid);
  const std::vector<std::size_t> kept = window.cover(sets, result.boxes);
  if (replaceable.empty()) return result;
  // The search is no proof: with all of them it may need fewer boxes than it has in their place.
  if (kept.size() + result.boxes.size() > replaceable.size()) {
    std::vector<Cuboid> all = present;
    for (const ReplaceableCuboid& r : replaceable) all.push_back(r.cuboid);
    std::vector<Cuboid> boxes = coverRest(cells, pieces, all, params);
    if (replaceable.size() + boxes.size() < kept.size() + result.boxes.size()) {
      result.boxes = std::move(boxes);
      return result;
    }
  }
  result.kept.assign(replaceable.size(), 0);
  for (const std::size_t i : kept) result.kept[i] = 1;
  return result;
}

std::vector<Cuboid> coverRest(const std::vector<NonPlanarCell>& cells,
                              const std::vector<SurfacePiece>& pieces,
                              const std::vector<Cuboid>& present,
                              const CuboidApproximationParams& params) {
  return coverRest(cells, pieces, present, {}, params).boxes;
}

}  // namespace planar_mapping
