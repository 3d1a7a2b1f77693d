// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/plan/plan.h"

namespace planar_mapping::detail {

/// Squares of a map seen from above.
struct PlanRaster {
  Vector2 origin = Vector2::Zero();
  double cell = 0.1;  ///< side
  int width = 0;
  int height = 0;

  std::size_t count() const { return std::size_t(width) * std::size_t(height); }
  bool has(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  std::size_t at(int x, int y) const {
    return std::size_t(y) * std::size_t(width) + std::size_t(x);
  }
  int xOf(std::size_t cell_number) const {
    return int(std::uint32_t(cell_number) % std::uint32_t(width));
  }
  int yOf(std::size_t cell_number) const {
    return int(std::uint32_t(cell_number) / std::uint32_t(width));
  }
  Vector2 middleOf(int x, int y) const { return origin + cell * Vector2(x + 0.5, y + 0.5); }
  int columnOf(double x) const { return int(std::floor((x - origin.x()) / cell)); }
  int rowOf(double y) const { return int(std::floor((y - origin.y()) / cell)); }
  /// Calls visit(x, y) for the cells that a box around a place meets.
  template <typename Visit>
  void around(const Vector2& place, const Vector2& reach, const Visit& visit) const {
    const auto bound = [](double value, int last) {
      return int(std::min(std::max(std::floor(value), 0.0), double(last)));
    };
    const Vector2 low = (place - reach - origin) / cell, high = (place + reach - origin) / cell;
    if (high.x() < 0.0 || high.y() < 0.0 || low.x() >= width || low.y() >= height) return;
    const int last_x = bound(high.x(), width - 1), last_y = bound(high.y(), height - 1);
    for (int y = bound(low.y(), height - 1); y <= last_y; ++y)
      for (int x = bound(low.x(), width - 1); x <= last_x; ++x) visit(x, y);
  }
};

/// Values of each cell, in one array.
template <typename Value>
class CellLists {
 public:
  using Found = std::vector<std::pair<std::uint32_t, Value>>;  ///< cell, value
  void build(std::size_t cells, const Found& found) {
    first_.assign(cells + 1, 0);
    for (const auto& entry : found) ++first_[entry.first + 1];
    for (std::size_t i = 0; i < cells; ++i) first_[i + 1] += first_[i];
    values_.resize(found.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (const auto& entry : found) values_[next[entry.first]++] = entry.second;
  }
  std::uint32_t begin(std::size_t cell) const { return first_[cell]; }
  std::uint32_t end(std::size_t cell) const { return first_[cell + 1]; }
  Value& operator[](std::size_t i) { return values_[i]; }
  const Value& operator[](std::size_t i) const { return values_[i]; }
  std::size_t size() const { return values_.size(); }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<Value> values_;
};

/// A surface over the middle of a cell that was measured from above. Guessed: by the surface around
/// it, which cuboids and squares of removed ground carry over gaps.
struct FloorLevel {
  enum class Kind : std::uint8_t { Clutter, Guessed, Floor, Path };
  float height = 0.0f;
  float slope_x = 0.0f, slope_y = 0.0f;
  Kind kind = Kind::Guessed;
  bool isMeasured() const { return kind >= Kind::Floor; }
};

/// What stands over a cell, metres along up.
struct Interval {
  float low, high;
};

/// Which steps of height over each cell were seen free.
class FreeColumns {
 public:
  FreeColumns(const PlanRaster& raster, double low, double high, double step);
  /// [first, last), those with their middles between two heights.
  struct Steps {
    int first, last;
  };
  Steps stepsOf(double from, double to) const { return {stepAbove(from), stepAbove(to)}; }
  void mark(std::size_t cell, const Steps& steps);
  void invert();
  /// Of the steps with their middles between two heights: how many there are, and are free.
  struct Count {
    int all = 0, free = 0;
  };
  Count count(std::size_t cell, double from, double to) const;

 private:
  /// First step with its middle above a height, within the column.
  int stepAbove(double height) const;
  static std::uint64_t maskOf(int word, const Steps& steps);

  double low_, step_;
  int steps_;
  std::size_t words_;  ///< of a column
  std::vector<std::uint64_t> bits_;
};

}  // namespace planar_mapping::detail
