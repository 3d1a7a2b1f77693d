// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/plane_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr double kMost = std::numeric_limits<double>::max();
constexpr double kMaxInt = std::numeric_limits<int>::max();

/// Range of a plane along a unit direction from the origin; 0 if the ray does not meet it.
double rangeOf(const Plane& plane, const Vector3& direction) {
  const double range = -plane.offset / plane.normal.dot(direction);
  return std::isfinite(range) && range > 0.0 ? range : 0.0;
}

/// Max-product belief propagation with the same cost for every pair of different labels.
class PottsGrid {
 public:
  /// \param costs label fastest, then column, then row
  PottsGrid(std::uint32_t width, std::uint32_t height, std::size_t labels, std::vector<float> costs,
            float edge_cost)
      : width_(width),
        height_(height),
        labels_(labels),
        edge_cost_(edge_cost),
        costs_(std::move(costs)),
        belief_(labels) {
    for (std::vector<float>& side : messages_) side.assign(costs_.size(), 0.0F);
  }

  void sweep() {
    for (std::size_t row = 0; row < height_; ++row) {
      for (std::size_t c = 1; c < width_; ++c) pass(at(row, c - 1), at(row, c), kLeft, kRight);
      for (std::size_t c = width_; --c > 0;) pass(at(row, c), at(row, c - 1), kRight, kLeft);
    }
    for (std::size_t row = 1; row < height_; ++row) {
      for (std::size_t c = 0; c < width_; ++c) pass(at(row - 1, c), at(row, c), kAbove, kBelow);
    }
    for (std::size_t row = height_; --row > 0;) {
      for (std::size_t c = 0; c < width_; ++c) pass(at(row, c), at(row - 1, c), kBelow, kAbove);
    }
  }

  std::size_t best(std::size_t pixel) {
    believe(pixel, kSides);
    return static_cast<std::size_t>(std::min_element(belief_.begin(), belief_.end()) -
                                    belief_.begin());
  }

 private:
  enum Side { kLeft, kRight, kAbove, kBelow, kSides };

  std::size_t at(std::size_t row, std::size_t column) const { return row * width_ + column; }

  /// Costs of the labels of a pixel by all messages but those from one side.
  void believe(std::size_t pixel, Side without) {
    const std::size_t first = pixel * labels_;
    for (std::size_t l = 0; l < labels_; ++l) belief_[l] = costs_[first + l];
    for (int side = kLeft; side < kSides; ++side) {
      if (side == without) continue;
      const float* message = messages_[static_cast<std::size_t>(side)].data() + first;
      for (std::size_t l = 0; l < labels_; ++l) belief_[l] += message[l];
    }
  }

  /// \param side on which \p from lies of \p to, \p back on which \p to lies of \p from
  void pass(std::size_t from, std::size_t to, Side side, Side back) {
    believe(from, back);
    const float least = *std::min_element(belief_.begin(), belief_.end());
    float* message = messages_[side].data() + to * labels_;
    for (std::size_t l = 0; l < labels_; ++l) message[l] = std::min(belief_[l] - least, edge_cost_);
  }

  std::size_t width_, height_, labels_;
  float edge_cost_;
  std::vector<float> costs_;
  std::vector<float> belief_;
  std::array<std::vector<float>, kSides> messages_;  ///< [side the sender lies on]
};

std::vector<float> errorCosts(const PointsView& points, const std::vector<Plane>& planes,
                              const KnownPlanesParams& params) {
  const auto most = static_cast<float>(params.most_cost);
  std::vector<float> costs(points.size * planes.size(), 0.0F);
  for (std::size_t i = 0; i < points.size; ++i) {
    if (!points.isMeasured(i)) continue;
    const Vector3 point = points.point(i);
    const double range = point.norm();
    for (std::size_t l = 0; l < planes.size(); ++l) {
      const double there = range > 0.0 ? rangeOf(planes[l], point / range) : 0.0;
      const double error = (range - there) / params.range_noise;
      const double cost = there > 0.0 ? 0.5 * error * error : params.most_cost;
      costs[i * planes.size() + l] = std::min(static_cast<float>(cost), most);
    }
  }
  return costs;
}

void requireImage(const PointsView& points) {
  if (!points.isOrganized()) throw InputError("neighbours are those of an image only");
}

}  // namespace

void KnownPlanesParams::validate() const {
  requirePositive("range_noise", range_noise, "m");
  requirePositive("edge_cost", edge_cost);
  requirePositive("most_cost", most_cost);
  requireInRange("sweeps", sweeps, 0, kMaxInt);
  requireInRange("min_points", min_points, 1, kMaxInt, "points");
}

std::vector<PlaneSegment> assignToKnownPlanes(const PointsView& points,
                                              const std::vector<Plane>& planes,
                                              const KnownPlanesParams& params) {
  params.validate();
  requireImage(points);
  if (planes.empty()) return {};
  PottsGrid grid(points.width, points.height, planes.size(), errorCosts(points, planes, params),
                 static_cast<float>(params.edge_cost));
  for (int sweep = 0; sweep < params.sweeps; ++sweep) grid.sweep();
  std::vector<PlaneSegment> all(planes.size());
  for (std::size_t i = 0; i < points.size; ++i) {
    if (points.isMeasured(i)) all[grid.best(i)].inliers.push_back(static_cast<int>(i));
  }
  std::vector<PlaneSegment> segments;
  for (std::size_t l = 0; l < planes.size(); ++l) {
    if (all[l].inliers.size() < static_cast<std::size_t>(params.min_points)) continue;
    all[l].plane = planes[l];
    segments.push_back(std::move(all[l]));
  }
  return segments;
}

std::vector<float> measuredAgain(const PointsView& points, const PlaneTruth& truth,
                                 double range_noise, std::uint64_t seed) {
  requireInRange("range_noise", range_noise, 0.0, kMost, "m");
  if (truth.labels.size() != points.size) {
    throw InputError(std::to_string(truth.labels.size()) + " labels for " +
                     std::to_string(points.size) + " points");
  }
  Random random(seed);
  std::vector<float> xyz;
  xyz.reserve(3 * points.size);
  for (std::size_t i = 0; i < points.size; ++i) {
    Vector3 point = points.point(i);
    const int label = truth.labels[i];
    if (label >= 0 && points.isMeasured(i)) {
      const Vector3 direction = point.normalized();
      const double range = rangeOf(truth.planes.at(static_cast<std::size_t>(label)), direction);
      point = direction * (range + range_noise * random.normal());
    }
    for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(point[axis]));
  }
  return xyz;
}

}  // namespace evaluation
}  // namespace planar_mapping
