// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/file/label_tree.h"

#include <algorithm>

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

std::size_t countInner(const std::vector<std::uint8_t>& labels) {
  return static_cast<std::size_t>(std::count(labels.begin(), labels.end(), kInner));
}

}  // namespace

LabelTree::Bits LabelTree::bitsOf(std::uint8_t label) {
  return {(label & 1u) != 0 ? kAll : 0, (label & 2u) != 0 ? kAll : 0};
}

Int3 LabelTree::regionOf(const Int3& bundle) const {
  return {bundle.x >> 3, bundle.y >> 3, dimensions_ == 2 ? 0 : bundle.z >> 3};
}

void LabelTree::add(std::vector<CellLabels>& bundles, Label background) {
  const auto isFirst = [this](const CellLabels& l, const CellLabels& r) {
    const Int3 a = regionOf(l.at);
    const Int3 b = regionOf(r.at);
    return a == b ? placeOf(l.at) < placeOf(r.at) : a < b;
  };
  if (!std::is_sorted(bundles.begin(), bundles.end(), isFirst)) {
    std::sort(bundles.begin(), bundles.end(), isFirst);
  }
  std::vector<Bits> cells(bundlesPerRegion());
  std::vector<std::uint8_t> labels(bundlesPerRegion());
  for (std::size_t i = 0; i < bundles.size();) {
    const Int3 region = regionOf(bundles[i].at);
    std::fill(labels.begin(), labels.end(), background);
    for (; i < bundles.size() && regionOf(bundles[i].at) == region; ++i) {
      const CellLabels& b = bundles[i];
      const std::size_t place = placeOf(b.at);
      cells[place] = {b.low, b.high};
      const bool is_mixed = (b.low != 0 && b.low != kAll) || (b.high != 0 && b.high != kAll);
      labels[place] = is_mixed ? static_cast<std::uint8_t>(kInner)
                               : static_cast<std::uint8_t>((b.low & 1u) | (b.high & 1u) << 1u);
    }
    const bool is_uniform =
        labels[0] != kInner && std::count(labels.begin(), labels.end(), labels[0]) ==
                                   static_cast<std::ptrdiff_t>(labels.size());
    addRegion(region, is_uniform ? static_cast<Label>(labels[0]) : kInner);
    if (is_uniform) continue;
    bundle_labels_.insert(bundle_labels_.end(), labels.begin(), labels.end());
    for (std::size_t place = 0; place < labels.size(); ++place) {
      if (labels[place] == kInner) cells_.push_back(cells[place]);
    }
  }
}

void LabelTree::addRegion(const Int3& region, Label label) {
  regions_.push_back({static_cast<std::int16_t>(region.x), static_cast<std::int16_t>(region.y),
                      static_cast<std::int16_t>(region.z)});
  region_labels_.push_back(label);
}

std::uint64_t LabelTree::occupied() const {
  const auto countOccupied = [](const std::vector<std::uint8_t>& labels) {
    return static_cast<std::uint64_t>(std::count(labels.begin(), labels.end(), kOccupied));
  };
  std::uint64_t cells =
      64 * (countOccupied(bundle_labels_) + bundlesPerRegion() * countOccupied(region_labels_));
  for (const Bits& b : cells_) {
    cells += static_cast<std::uint64_t>(__builtin_popcountll(b.low & ~b.high));
  }
  return cells;
}

void LabelTree::code(Columns& columns) {
  const auto axes = static_cast<std::size_t>(dimensions_);
  columns.size(regions_, 2 * axes);
  for (std::size_t k = 0; k < axes; ++k) {
    columns.column(regions_, [k](auto& region) -> std::int16_t& { return region[k]; });
  }
  constexpr std::int32_t kFarthest = kLatticeLimit / (8 * kSide);  // of tiles; blocks always fit
  for (const auto& region : regions_) {
    if (dimensions_ == 2 && (std::max(std::abs(region[0]), std::abs(region[1])) > kFarthest)) {
      columns.fail("has cells outside the world");
    }
  }
  columns.labels(region_labels_, regions_.size());
  columns.labels(bundle_labels_, bundlesPerRegion() * countInner(region_labels_));
  std::vector<std::uint8_t> labels;
  const std::size_t inner = countInner(bundle_labels_);
  for (const Bits& b : cells_) {
    for (std::size_t bit = 0; bit < 64; ++bit) {
      labels.push_back(static_cast<std::uint8_t>((b.low >> bit & 1u) | (b.high >> bit & 1u) << 1u));
    }
  }
  columns.labels(labels, 64 * inner);
  if (!columns.isReading()) return;
  cells_.assign(inner, {});
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == kInner) columns.fail("has a cell with parts");
    cells_[i / 64].low |= static_cast<std::uint64_t>(labels[i] & 1u) << (i % 64);
    cells_[i / 64].high |= static_cast<std::uint64_t>(labels[i] >> 1u) << (i % 64);
  }
}

}  // namespace planar_mapping::detail
