// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "export/conventions.h"
#include "planar_mapping/io/occupancy_grid.h"

namespace planar_mapping::io {

GroundHeights::GroundHeights(const std::vector<GroundPoint>& ground, const Vector3& up,
                             double elsewhere)
    : turn_(turning(up, Vector3::UnitZ())),
      lowest_(elsewhere),
      highest_(elsewhere),
      middle_(elsewhere),
      heights_(1, static_cast<float>(elsewhere)) {
  constexpr std::size_t kFewest = 2;     // of 4 square metres each
  constexpr double kSide = 2.0;          // metres, of PlanarMap::ground()
  constexpr double kMaxCells = 1000000;  // of the raster
  if (ground.size() < kFewest) return;
  std::vector<Vector3> places;
  Vector2 high = Vector2::Constant(-INFINITY);
  low_ = Vector2::Constant(INFINITY);
  for (const GroundPoint& point : ground) {
    places.push_back(turn_ * point.position);
    low_ = low_.cwiseMin(places.back().head<2>());
    high = high.cwiseMax(places.back().head<2>());
  }
  cell_ = std::max(kSide, std::sqrt((high - low_).prod() / kMaxCells));
  size_ = ((high - low_) / cell_).array().round().cast<int>() + 1;
  const auto count = static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y());
  heights_.assign(count, std::numeric_limits<float>::quiet_NaN());
  std::vector<std::uint32_t> points(count, 0);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vector2 place = placeOf(places[k]).array().round();
    const auto i = static_cast<std::size_t>(place.y() * size_.x() + place.x());
    if (!std::isnan(heights_[i]) && ground[k].points <= points[i]) continue;
    points[i] = ground[k].points;
    heights_[i] = static_cast<float>(places[k].z());
  }
  std::vector<float> all;
  for (const float height : heights_)
    if (!std::isnan(height)) all.push_back(height);
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2),
                   all.end());
  middle_ = all[all.size() / 2];
  const auto [lowest, highest] = std::minmax_element(all.begin(), all.end());
  lowest_ = *lowest;
  highest_ = *highest;
  spread();
}

/// Cells without ground get the height of the nearest ones that have it.
void GroundHeights::spread() {
  std::vector<int> queue;
  for (std::size_t i = 0; i < heights_.size(); ++i)
    if (!std::isnan(heights_[i])) queue.push_back(static_cast<int>(i));
  for (std::size_t k = 0; k < queue.size(); ++k) {
    const int x = queue[k] % size_.x();
    const int y = queue[k] / size_.x();
    for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
      if (x + dx < 0 || x + dx >= size_.x() || y + dy < 0 || y + dy >= size_.y()) continue;
      const int other = queue[k] + dx + dy * size_.x();
      if (!std::isnan(heights_[static_cast<std::size_t>(other)])) continue;
      heights_[static_cast<std::size_t>(other)] = heights_[static_cast<std::size_t>(queue[k])];
      queue.push_back(other);
    }
  }
}

/// In cells from the middle of the first one, within those of the rim.
Vector2 GroundHeights::placeOf(const Vector3& turned) const {
  const Vector2 last = size_.cast<double>().matrix() - Vector2::Ones();
  const Vector2 at = (turned.head<2>() - low_) / cell_;
  return at.cwiseMax(0.0).cwiseMin(last);
}

/// Between the middles of four cells.
double GroundHeights::at(const Vector3& point) const {
  const Vector2 place = placeOf(turn_ * point);
  const Eigen::Array2i first = place.array().cast<int>();
  const Eigen::Array2i next = (first + 1).min(size_ - 1);
  const Vector2 part = place - first.cast<double>().matrix();
  const auto height = [this](int x, int y) {
    return double{heights_[static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x()) +
                           static_cast<std::size_t>(x)]};
  };
  const auto along = [&](int y) {
    return (1.0 - part.x()) * height(first.x(), y) + part.x() * height(next.x(), y);
  };
  return (1.0 - part.y()) * along(first.y()) + part.y() * along(next.y());
}

}  // namespace planar_mapping::io
