// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Edges between planes in noise. The nearest plane is no fair judge there: near the edge noise
// decides which pixels a plane keeps, those it keeps turn the plane, and every further round turns
// it more. Two planes that meet are seen in one of two ways, though: of a ray's two intersections
// always the farther one (a corner of a room) or always the nearer one (that of a box). All
// pixels around a tile vote for one of them; which side a pixel is on then depends on its ray
// alone.
#include <algorithm>
#include <cmath>

#include "organized_lanes.h"
#include "organized_refinement.h"
#include "planar_mapping/core/parallel.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

/// A plane as seen from the sensor.
struct EdgePlane {
  float normal[3];
  float offset;
  float height;  ///< of the sensor over the plane, signed
};

/// Squared noise over squared range = a / r^2 + b + c r^2.
struct EdgeNoise {
  float a, b, c;
  float near;  ///< squared sigmas by which ranges on two planes may differ where they meet
  float sensor[3];
};

/// Errors along the rays to two planes and the squared noise, in units of the (squared) range.
struct EdgeErrors {
  FloatLanes first, second, variance;
};

PLANAR_MAPPING_INLINE void errorsAlongRays(const float* x, const float* y, const float* z,
                                           const EdgePlane& first, const EdgePlane& second,
                                           const EdgeNoise& noise, EdgeErrors& errors) {
  FloatLanes px, py, pz;
  load(x, px);
  load(y, py);
  load(z, pz);
  const FloatLanes rx = px - noise.sensor[0];
  const FloatLanes ry = py - noise.sensor[1];
  const FloatLanes rz = pz - noise.sensor[2];
  const FloatLanes square = rx * rx + ry * ry + rz * rz;
  const FloatLanes p =
      first.normal[0] * px + first.normal[1] * py + first.normal[2] * pz + first.offset;
  const FloatLanes q =
      second.normal[0] * px + second.normal[1] * py + second.normal[2] * pz + second.offset;
  errors.first = p / (p - first.height);
  errors.second = q / (q - second.height);
  errors.variance = noise.a / square + noise.b + noise.c * square;
}

// Adds how much worse the farther intersections fit the pixels of a tile than the nearer ones.
PLANAR_MAPPING_MULTIVERSION
void addVotes(const float* x, const float* y, const float* z, const EdgePlane& first,
              const EdgePlane& second, const EdgeNoise& noise, float* votes) {
  const FloatLanes zero = {};
  FloatLanes sum[2] = {zero, zero};
  for (int k = 0; k < kTileArea; k += kLanes) {
    EdgeErrors at;
    errorsAlongRays(x + k, y + k, z + k, first, second, noise, at);
    const FloatLanes e = at.first * at.first;
    const FloatLanes f = at.second * at.second;
    const FloatLanes apart = (at.first - at.second) * (at.first - at.second);
    const FloatLanes limit = at.variance * noise.near;
    FloatLanes vote = (at.first < at.second ? e - f : f - e) / at.variance;
    // Comparisons with NaN are false: pixels without a point do not vote.
    vote = apart <= limit ? vote : zero;
    vote = e <= limit ? vote : zero;
    vote = f <= limit ? vote : zero;
    sum[k / kLanes % 2] += vote;
  }
  *votes += sumOf(sum);
}

// Gives the pixels of both planes, where these are near to each other, to the one that is farther
// (or nearer) along their ray.
PLANAR_MAPPING_MULTIVERSION
void settle(const float* x, const float* y, const float* z, const EdgePlane& first,
            const EdgePlane& second, const EdgeNoise& noise, bool farther, std::int16_t first_label,
            std::int16_t second_label, std::int16_t* labels) {
  for (int k = 0; k < kTileArea; k += kLanes) {
    IntLanes label;
    load(labels + k, label);
    EdgeErrors at;
    errorsAlongRays(x + k, y + k, z + k, first, second, noise, at);
    const FloatLanes apart = (at.first - at.second) * (at.first - at.second);
    // A positive error is that of a plane before the point.
    const IntLanes is_first = farther ? at.first < at.second : at.first > at.second;
    const IntLanes to = is_first ? IntLanes{} + first_label : IntLanes{} + second_label;
    const IntLanes either = (label == first_label) | (label == second_label);
    const IntLanes near = apart <= at.variance * noise.near;
    label = (either & near) ? to : label;
    store(label, labels + k);
  }
}

}  // namespace

bool PixelAssigner::isNoisy(int tile) const {
  const double n = tiles_.count(tile);
  if (!(n > 0.0)) return false;
  const Vector3 mean(tiles_.moment(kX)[tile] / n, tiles_.moment(kY)[tile] / n,
                     tiles_.moment(kZ)[tile] / n);
  return noise_.at((mean - cloud_.sensor).squaredNorm()) >
         params_.flat_share * params_.distance_threshold;
}

bool PixelAssigner::isNoisy() const {
  if (noise_.correlated_pixels > params_.white_correlation) return false;
  for (int tile = 0; tile < cloud_.tiles(); ++tile) {
    if (isNoisy(tile)) return true;
  }
  return false;
}

bool PixelAssigner::commonestAround(int tile, std::int16_t* pair) const {
  constexpr int kMost = 12;
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  int counts[kMost] = {};
  int size = 0;
  std::int16_t labels[kMost];
  for (int r = std::max(0, row - 1); r <= std::min(cloud_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(cloud_.columns - 1, column + 1); ++c) {
      const Summary& held = summaries_[static_cast<std::size_t>(r) * cloud_.columns + c];
      for (int k = 0; k < held.planes.size; ++k) {
        int at = 0;
        while (at < size && labels[at] != held.planes.label[k]) ++at;
        if (at == kMost) continue;
        if (at == size) labels[size++] = held.planes.label[k];
        counts[at] += held.count[k];
      }
    }
  }
  if (size < 2) return false;
  for (int i = 0; i < 2; ++i) {
    const auto most = static_cast<int>(std::max_element(counts, counts + size) - counts);
    pair[i] = labels[most];
    counts[most] = -1;
  }
  return true;
}

void PixelAssigner::settleTile(int tile, const std::vector<PlaneCandidate>& planes) {
  std::int16_t pair[2];
  if (!commonestAround(tile, pair) || !isNoisy(tile)) return;
  EdgePlane edge[2];
  for (int i = 0; i < 2; ++i) {
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(pair[i])];
    for (int axis = 0; axis < 3; ++axis)
      edge[i].normal[axis] = static_cast<float>(plane.normal[axis]);
    edge[i].offset = static_cast<float>(plane.offset);
    edge[i].height = static_cast<float>(plane.distance(cloud_.sensor.data()));
  }
  const double constant = noise_.constant;
  const double quadratic = noise_.quadratic;
  EdgeNoise noise;
  noise.a = static_cast<float>(constant * constant);
  noise.b = static_cast<float>(2.0 * constant * quadratic);
  noise.c = static_cast<float>(quadratic * quadratic);
  noise.near = static_cast<float>(params_.edge_factor * params_.edge_factor);
  for (int axis = 0; axis < 3; ++axis) noise.sensor[axis] = static_cast<float>(cloud_.sensor[axis]);
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  float votes = 0.0F;
  constexpr int kVoters[5][2] = {{0, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, 0}};
  for (const auto& step : kVoters) {
    const int r = row + step[0];
    const int c = column + step[1];
    if (r < 0 || r >= cloud_.rows || c < 0 || c >= cloud_.columns) continue;
    const int other = r * cloud_.columns + c;
    addVotes(cloud_.x(other), cloud_.y(other), cloud_.z(other), edge[0], edge[1], noise, &votes);
  }
  settle(cloud_.x(tile), cloud_.y(tile), cloud_.z(tile), edge[0], edge[1], noise, votes < 0.0F,
         pair[0], pair[1], labels_.data() + static_cast<std::size_t>(tile) * kTileArea);
}

void PixelAssigner::settleEdges(const std::vector<PlaneCandidate>& planes) {
  parallelFor(static_cast<std::size_t>(cloud_.rows), threads_, [&](std::size_t row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      settleTile(static_cast<int>(row) * cloud_.columns + column, planes);
    }
  });
  for (int tile = 0; tile < cloud_.tiles(); ++tile) summarize(tile);
}

}  // namespace planar_mapping::detail
