// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/grid/cell_table.h"
#include "planar_mapping/localization/registration/surface_map.h"

namespace planar_mapping::detail {

constexpr double kMaxNormalAngle = 0.5;  ///< between planes that may be the same, radians

/// The plane of one cell, or its line.
struct Surfel {
  Vector3 center = Vector3::Zero();
  Vector3 normal = Vector3::Zero();  ///< towards where it was seen from; of a line its direction
  double deviation = 0.0;            ///< of the points across it, metres
  double error = 0.0;                ///< standard deviation of the depth of one of them, metres
  double normal_error = 0.0;         ///< standard deviation of the normal, radians
  bool planar = false;
  bool gone = false;  ///< a later cloud was seen through it, and none has hit it since
};

enum class CellShape : std::uint8_t { Plane, Line };

/// Weighted moments of points in the cells of one grid, and the planes or lines they are on.
class SurfaceCells {
 public:
  explicit SurfaceCells(double cell, CellShape shape = CellShape::Plane)
      : cell_(cell), shape_(shape) {}

  double cell() const { return cell_; }
  /// \param error  standard deviation of the point along its ray; sets its weight
  void add(const Vector3& point, const Vector3& sensor, double error, std::int64_t frame);
  /// Fits the planes of the cells that have changed.
  void fit();
  /// Plane of this cell, or null.
  const Surfel* at(const CellKey& index) const;
  /// The plane next to a point, of the eight cells around it, that faces \p normal; the line that
  /// runs along it, either way.
  const Surfel* nearest(const Vector3& point, const Vector3& normal, double min_cosine) const;
  /// Planes in the order in which their cells came about.
  std::vector<Surfel> planes() const;
  /// Marks the planes for which isGone(plane), until a point is added to their cells.
  template <typename IsGone>
  void markGone(const IsGone& isGone) {
    for (Cell& cell : cells_) {
      if (cell.surfel.planar && isGone(cell.surfel)) cell.surfel.gone = true;
    }
  }
  std::size_t size() const { return cells_.size(); }
  /// Whether the cell that a point is in has a plane.
  bool hasPlaneAt(const Vector3& point) const;
  /// Keeps the cells seen last.
  void limit(std::size_t most);

 private:
  struct Cell {
    CellKey index;
    int points = 0;
    double weight = 0.0;
    Vector3 sum = Vector3::Zero();  ///< about the cell's corner
    Matrix3 squares = Matrix3::Zero();
    Vector3 towards = Vector3::Zero();  ///< sum of directions to the sensor
    std::int64_t last_frame = 0;
    bool changed = false;
    Surfel surfel;
  };
  Vector3 corner(const CellKey& index) const { return cell_ * Vector3(index.x, index.y, index.z); }
  void fitCell(Cell& cell) const;
  void numberCells();

  double cell_;
  CellShape shape_;
  std::vector<Cell> cells_;
  CellTable number_;
};

/// Planes or lines for a search within a distance, in cells of that size.
class PlaneNeighbours {
 public:
  /// \param reach  of the search, metres, > 0
  PlaneNeighbours(std::vector<Surfel> planes, double reach, CellShape shape);

  /// The next plane within \p reach that faces the same way, or null; lines
  /// have no side. \param reach  at most that of the constructor
  const Surfel* nearest(const Vector3& point, const Vector3& normal, double reach,
                        double min_cosine) const;

 private:
  double reach_;
  CellShape shape_;
  std::vector<Surfel> planes_;
  CellTable cells_;
  std::vector<std::vector<std::uint32_t>> members_;  ///< planes in each cell
};

}  // namespace planar_mapping::detail
