// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/surface_cells.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

/// More points make a plane no better: their errors are not independent. What came first stays, so
/// that the map does not follow the drift of what is registered to it.
constexpr int kEnoughPoints = 2000;

}  // namespace

void SurfaceCells::add(const Vector3& point, const Vector3& sensor, double error,
                       std::int64_t frame) {
  CellKey index;
  if (!cellOf(point / cell_, index)) return;
  const auto number = static_cast<std::size_t>(number_.insert(index));
  if (number == cells_.size()) {
    cells_.emplace_back();
    cells_.back().index = index;
  }
  Cell& cell = cells_[number];
  cell.last_frame = frame;
  cell.surfel.gone = false;
  if (cell.points >= kEnoughPoints) return;
  const double weight = 1.0 / (error * error);
  const Vector3 p = point - corner(index);
  ++cell.points;
  cell.weight += weight;
  cell.sum += weight * p;
  cell.squares.noalias() += weight * p * p.transpose();
  const Vector3 ray = sensor - point;
  const double range = ray.norm();
  if (range > 0.0) cell.towards += (weight / range) * ray;
  cell.changed = true;
}

void SurfaceCells::fit() {
  for (Cell& cell : cells_) {
    if (!cell.changed) continue;
    cell.changed = false;
    fitCell(cell);
  }
}

void SurfaceCells::fitCell(Cell& cell) const {
  constexpr int kMinPoints = 6;
  constexpr double kMaxThickness = 0.25;  // in sides of a cell
  // What is too small says nothing about its direction.
  constexpr double kMinWidth = 0.1;
  constexpr double kElongation = 2.0;
  constexpr double kMinNormalError = 0.02;  // radians: surfaces are not even
  Surfel& surfel = cell.surfel;
  surfel.planar = false;
  if (cell.points < kMinPoints) return;
  const Vector3 mean = cell.sum / cell.weight;
  const Matrix3 covariance = cell.squares / cell.weight - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Matrix3> solver;
  solver.computeDirect(covariance);
  const Vector3 spread = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const int across = shape_ == CellShape::Plane ? 0 : 1;  // the widest axis that must be narrow
  if (!(spread[across] <= kMaxThickness * cell_) || !(spread[across + 1] > kMinWidth * cell_) ||
      !(spread[across + 1] > kElongation * spread[across])) {
    return;
  }
  surfel.center = corner(cell.index) + mean;
  surfel.normal = solver.eigenvectors().col(shape_ == CellShape::Plane ? 0 : 2);
  if (surfel.normal.dot(cell.towards) < 0.0) surfel.normal = -surfel.normal;
  surfel.deviation = spread[across];
  surfel.normal_error =
      std::max(kMinNormalError, spread[across] / (spread[across + 1] * std::sqrt(cell.points)));
  surfel.error = std::sqrt(static_cast<double>(cell.points) / cell.weight);
  surfel.planar = surfel.normal.allFinite();
}

const Surfel* SurfaceCells::at(const CellKey& index) const {
  const std::int32_t found = number_.find(index);
  if (found < 0) return nullptr;
  const Surfel& surfel = cells_[static_cast<std::size_t>(found)].surfel;
  return surfel.planar ? &surfel : nullptr;
}

const Surfel* SurfaceCells::nearest(const Vector3& point, const Vector3& normal,
                                    double min_cosine) const {
  CellKey low;
  if (!cellOf((point - Vector3::Constant(0.5 * cell_)) / cell_, low)) return nullptr;
  const Surfel* best = nullptr;
  double best_distance = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Surfel* surfel = at({low.x + (i & 1), low.y + ((i >> 1) & 1), low.z + ((i >> 2) & 1)});
    if (surfel == nullptr) continue;
    const double cosine = surfel->normal.dot(normal);
    if (!((shape_ == CellShape::Line ? std::abs(cosine) : cosine) >= min_cosine)) continue;
    const double distance = (surfel->center - point).squaredNorm();
    if (best == nullptr || distance < best_distance) {
      best = surfel;
      best_distance = distance;
    }
  }
  return best;
}

std::vector<Surfel> SurfaceCells::planes() const {
  std::vector<Surfel> result;
  for (const Cell& cell : cells_) {
    if (cell.surfel.planar) result.push_back(cell.surfel);
  }
  return result;
}

bool SurfaceCells::hasPlaneAt(const Vector3& point) const {
  CellKey index;
  return cellOf(point / cell_, index) && at(index) != nullptr;
}

void SurfaceCells::limit(std::size_t most) {
  if (cells_.size() <= most) return;
  std::vector<std::int64_t> frames;
  frames.reserve(cells_.size());
  for (const Cell& cell : cells_) frames.push_back(cell.last_frame);
  // A tenth more than needed: not again with every frame.
  const std::int64_t oldest = ranked(frames, cells_.size() - most + most / 10);
  std::vector<Cell> kept;
  for (Cell& cell : cells_) {
    if (cell.last_frame >= oldest) kept.push_back(std::move(cell));
  }
  cells_ = std::move(kept);
  numberCells();
}

void SurfaceCells::numberCells() {
  number_ = CellTable(cells_.size());
  for (const Cell& cell : cells_) number_.insert(cell.index);
}

PlaneNeighbours::PlaneNeighbours(std::vector<Surfel> planes, double reach, CellShape shape)
    : reach_(reach), shape_(shape), planes_(std::move(planes)) {
  for (const Surfel& plane : planes_) {
    CellKey cell;
    if (!cellOf(plane.center / reach_, cell)) continue;
    const auto number = static_cast<std::size_t>(cells_.insert(cell));
    if (number == members_.size()) members_.emplace_back();
    members_[number].push_back(static_cast<std::uint32_t>(&plane - planes_.data()));
  }
}

const Surfel* PlaneNeighbours::nearest(const Vector3& point, const Vector3& normal, double reach,
                                       double min_cosine) const {
  CellKey middle;
  if (!cellOf(point / reach_, middle)) return nullptr;
  double best = reach * reach;
  const Surfel* found = nullptr;
  for (int i = 0; i < 27; ++i) {
    const std::int32_t cell =
        cells_.find({middle.x + i / 9 - 1, middle.y + i / 3 % 3 - 1, middle.z + i % 3 - 1});
    if (cell < 0) continue;
    for (const std::uint32_t member : members_[static_cast<std::size_t>(cell)]) {
      const Surfel& plane = planes_[member];
      const double squared = (plane.center - point).squaredNorm();
      if (squared >= best) continue;
      const double cosine = plane.normal.dot(normal);
      if ((shape_ == CellShape::Line ? std::abs(cosine) : cosine) < min_cosine) continue;
      best = squared;
      found = &plane;
    }
  }
  return found;
}

}  // namespace planar_mapping::detail
