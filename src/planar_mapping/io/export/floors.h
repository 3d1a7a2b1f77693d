// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/io/export/occupancy_grid.h"

namespace planar_mapping::io {

/// Squares of a map seen from above.
struct Raster {
  Vector2 origin = Vector2::Zero();
  double cell = 1.0;  ///< side
  Eigen::Array2i size = {0, 0};

  std::size_t count() const { return numberOf({0, size.y()}); }
  std::size_t numberOf(const Eigen::Array2i& place) const {
    return static_cast<std::size_t>(place.y()) * static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(place.x());
  }
  Eigen::Array2i placeOf(std::size_t number) const {
    const auto width = static_cast<std::size_t>(size.x());
    return {static_cast<int>(number % width), static_cast<int>(number / width)};
  }
  Vector2 middleOf(const Eigen::Array2i& place) const {
    return origin + cell * Vector2(place.x() + 0.5, place.y() + 0.5);
  }

  /// Calls visit(place) for the cells from one to another, both included, that there are.
  template <typename Visit>
  void forCells(const Eigen::Array2i& from, const Eigen::Array2i& to, const Visit& visit) const {
    const Eigen::Array2i first = from.max(0), last = to.min(size - 1);
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x) visit(Eigen::Array2i(x, y));
  }
  /// Calls visit(number, middle) for the cells within a distance of a place along x and y.
  template <typename Visit>
  void forCellsAround(const Vector2& place, const Vector2& reach, const Visit& visit) const {
    const auto cellOf = [this](const Vector2& at) {
      const Eigen::Array2d last = size.cast<double>() - 1.0;
      return ((at - origin) / cell).array().max(0.0).min(last).template cast<int>().eval();
    };
    forCells(cellOf(place - reach), cellOf(place + reach),
             [&](const Eigen::Array2i& at) { visit(numberOf(at), middleOf(at)); });
  }
};

/// What one drives on: a raster of the heights of level faces, in axes whose third is up. A face is
/// floor where it is level with the ground, or where a robot has room and gets there without a
/// step; but not where free space was measured right under it: that is a table.
class Floors {
 public:
  /// \param free  what was measured free
  /// \param low  what is at most so high over the ground is level with it, metres, above 0
  Floors(const std::vector<Cuboid>& cuboids, const std::vector<Cuboid>& free,
         const GroundHeights& ground, double low, double cell);

  /// Whether most of a cuboid is floor.
  bool contains(std::size_t cuboid) const { return is_floor_[cuboid] != 0; }
  struct Place {
    double height;
    bool is_inside;  ///< of a rectangle, not up to half a cell beside it
  };
  /// The highest floor at a place that is at most a metre from a height; of several that are level
  /// with the ground the lowest: the others are noise.
  std::optional<Place> at(const Vector2& place, double near) const;
  /// A place in each square of 2 m, the lowest of several floors over each other.
  std::vector<GroundPoint> ground() const;

 private:
  /// Of a face at the middle of a cell.
  struct Sample {
    float height;
    std::uint32_t cuboid;
    float free_below = 0.0f;  ///< metres
    float highest = 0.0f;     ///< of another plane that one gets to from here
    bool is_level = false;    ///< with the ground
    bool is_inside = false;   ///< of the rectangle
    bool is_wide = false;     ///< a robot has room
    bool is_floor = false;
  };
  void sampleFaces(const std::vector<Cuboid>& cuboids);
  void measureBelow(const std::vector<Cuboid>& free);
  void findFloor(const GroundHeights& ground, double low);
  template <typename Visit>
  void forNeighbours(std::size_t cell, double radius, const Visit& visit) const;

  Raster raster_;
  std::vector<std::uint32_t> first_;  ///< sample of each cell, and of one after the last
  std::vector<Sample> samples_;
  std::vector<std::int32_t> plane_of_;
  std::vector<std::uint8_t> is_floor_;
  double raise_ = 0.0;  ///< of a floor to ground of one height, metres
};

/// Where free space under a floor says that there is none: depths, metres.
struct DepthBelow {
  double from, to, enough;
  explicit DepthBelow(double cell)
      : from(std::max(cell, 0.1)), to(3.0 * from), enough(1.3 * from) {}
};

/// How much of the vertical line through a place is in the cuboid, between two heights.
double lengthInside(const Matrix3& to_local, const Cuboid& cuboid, const Vector2& at, double low,
                    double high);

}  // namespace planar_mapping::io
