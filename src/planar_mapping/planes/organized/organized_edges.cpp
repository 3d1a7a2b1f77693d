// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Edges between planes in noise. The nearest plane is biased there: near the edge noise
// decides which pixels a plane keeps, those it keeps turn the plane, and every further round turns
// it more. Two planes that meet are seen in one of two ways, though: of a ray's two intersections
// always the farther one (a corner of a room) or always the nearer one (that of a box), and three
// planes in one of eight: of the first two the farther or nearer one, of that one and the third
// again. All pixels around a tile vote for one of them; which side a pixel is on then depends on
// its ray alone.
#include <algorithm>
#include <iterator>
#include <utility>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"
#include "planar_mapping/planes/organized/organized_assignment.h"

namespace planar_mapping::detail {

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

namespace {

/// Errors along the rays to the planes and the squared noise, in units of the (squared) range.
struct EdgeErrors {
  FloatLanes errors[3], variance;
};

PLANAR_MAPPING_INLINE void errorsAlongRays(const float* x, const EdgePlane* planes, int count,
                                           const EdgeNoise& noise, EdgeErrors& at) {
  FloatLanes px, py, pz;
  load(x, px, py, pz);
  const FloatLanes rx = px - noise.sensor[0];
  const FloatLanes ry = py - noise.sensor[1];
  const FloatLanes rz = pz - noise.sensor[2];
  const FloatLanes square = rx * rx + ry * ry + rz * rz;
  for (int p = 0; p < count; ++p) {
    const EdgePlane& plane = planes[p];
    const FloatLanes off =
        plane.normal[0] * px + plane.normal[1] * py + plane.normal[2] * pz + plane.offset;
    at.errors[p] = off / (off - plane.height);
  }
  at.variance = noise.a / square + noise.b + noise.c * square;
}

/// Which of up to three planes a ray ends on: of the first two the farther or the nearer one, of
/// that and the third the farther or the nearer one.
struct EdgeOrder {
  std::int8_t planes[3];
  bool farther[2];
};

constexpr EdgeOrder kOrders[] = {{{0, 1, 2}, {true, true}},  {{0, 1, 2}, {false, false}},
                                 {{0, 1, 2}, {true, false}}, {{0, 1, 2}, {false, true}},
                                 {{0, 2, 1}, {true, false}}, {{0, 2, 1}, {false, true}},
                                 {{1, 2, 0}, {true, false}}, {{1, 2, 0}, {false, true}}};
constexpr int kOrdersOfTwo = 2;
constexpr int kOrdersOfThree = 8;

/// Rows and columns from a tile to those that vote about it.
constexpr int kVoters[5][2] = {{0, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, 0}};

/// The error of the plane that a ray ends on: a positive one is that of a plane before the point.
PLANAR_MAPPING_INLINE void errorOf(const EdgeOrder& order, const FloatLanes* errors, int planes,
                                   FloatLanes& error) {
  const FloatLanes& first = errors[order.planes[0]];
  const FloatLanes& second = errors[order.planes[1]];
  const FloatLanes least = first < second ? first : second;
  const FloatLanes most = first < second ? second : first;
  error = order.farther[0] ? least : most;
  if (planes < 3) return;
  const FloatLanes& third = errors[order.planes[2]];
  const FloatLanes lower = error < third ? error : third;
  const FloatLanes upper = error < third ? third : error;
  error = order.farther[1] ? lower : upper;
}

// The squared errors of the pixels of a tile in every order, in squared sigmas.
PLANAR_MAPPING_MULTIVERSION
void sumErrors(const float* x, const EdgePlane* planes, int count, const EdgeNoise& noise,
               float* votes) {
  const int orders = count < 3 ? kOrdersOfTwo : kOrdersOfThree;
  const FloatLanes zero = {};
  FloatLanes sums[kOrdersOfThree];
  for (int o = 0; o < orders; ++o) sums[o] = zero;
  for (int k = 0; k < kTileArea; k += kLanes) {
    EdgeErrors at;
    errorsAlongRays(x + k, planes, count, noise, at);
    const IntLanes finite = at.variance == at.variance;  // pixels without a point do not vote
    const FloatLanes inverse = finite ? 1.0F / at.variance : zero;
    const FloatLanes limit = zero + noise.near;
    for (int p = 0; p < count; ++p) at.errors[p] = finite ? at.errors[p] : zero;
    for (int o = 0; o < orders; ++o) {
      FloatLanes error;
      errorOf(kOrders[o], at.errors, count, error);
      const FloatLanes square = error * error * inverse;
      sums[o] += square < limit ? square : limit;
    }
  }
  for (int o = 0; o < orders; ++o) {
    const FloatLanes halves[2] = {sums[o], zero};
    votes[o] = sumOf(halves);
  }
}

// Gives the pixels of the planes to the one their ray ends on, if that is near to their own.
PLANAR_MAPPING_MULTIVERSION
void settleTile(const float* x, const EdgePlane* planes, int count, const EdgeNoise& noise,
                const EdgeOrder& order, const std::int16_t* plane_labels, std::int16_t* labels) {
  for (int k = 0; k < kTileArea; k += kLanes) {
    IntLanes label;
    load(labels + k, label);
    EdgeErrors at;
    errorsAlongRays(x + k, planes, count, noise, at);
    FloatLanes error;
    errorOf(order, at.errors, count, error);
    IntLanes to = label;
    IntLanes held = {};
    FloatLanes own = error;
    for (int p = 0; p < count; ++p) {
      const IntLanes name = IntLanes{} + plane_labels[p];
      to = at.errors[p] == error ? name : to;
      own = label == name ? at.errors[p] : own;
      held |= label == name;
    }
    const FloatLanes apart = (own - error) * (own - error);
    const IntLanes near = apart <= at.variance * noise.near;
    label = (held & near) ? to : label;
    store(label, labels + k);
  }
}

}  // namespace

bool PixelAssigner::isNoisy(int tile) const {
  return tiles_.count(tile) > 0.0 &&
         fit_.blursEdges((meanOf(tiles_, tile) - cloud_.sensor).squaredNorm());
}

bool PixelAssigner::isNoisy() const {
  for (int tile = 0; tile < cloud_.tiles(); ++tile) {
    if (isNoisy(tile)) return true;
  }
  return false;
}

int PixelAssigner::commonestAround(int tile, std::int16_t* planes) const {
  constexpr int kMinPixels = kTileArea / 4;  // of a third plane
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  int counts[kMaxAround] = {};
  int size = 0;
  std::int16_t labels[kMaxAround];
  for (int r = std::max(0, row - 1); r <= std::min(cloud_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(cloud_.columns - 1, column + 1); ++c) {
      const Summary& held = summaries_[static_cast<std::size_t>(r) * cloud_.columns + c];
      for (int k = 0; k < held.planes.size; ++k) {
        int at = 0;
        while (at < size && labels[at] != held.planes.label[k]) ++at;
        if (at == kMaxAround) continue;
        if (at == size) labels[size++] = held.planes.label[k];
        counts[at] += held.count[k];
      }
    }
  }
  int found = 0;
  for (; found < std::min(size, kEdgePlanes); ++found) {
    const auto most = static_cast<int>(std::max_element(counts, counts + size) - counts);
    if (found == 2 && counts[most] < kMinPixels) break;
    planes[found] = labels[most];
    counts[most] = -1;
  }
  return found;
}

/// What a tile says about the planes that meet in and around it.
struct PixelAssigner::EdgeTile {
  int tile = 0;
  int planes = 0;
  std::int16_t labels[kEdgePlanes] = {};
  float ballots[std::size(kVoters)][kOrdersOfThree] = {};  ///< squared errors, squared sigmas
  float votes[kOrdersOfThree] = {};                        ///< their sums

  int orders() const { return planes < 3 ? kOrdersOfTwo : kOrdersOfThree; }
  /// Do the same planes meet here?
  bool meets(const EdgeTile& other) const {
    return planes == other.planes && std::equal(labels, labels + planes, other.labels);
  }
  void count() {
    for (const auto& ballot : ballots) {
      for (int o = 0; o < orders(); ++o) votes[o] += ballot[o];
    }
  }
};

void PixelAssigner::describe(const EdgeTile& at, const std::vector<PlaneCandidate>& planes,
                             EdgePlane* edge) const {
  for (int i = 0; i < at.planes; ++i) {
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(at.labels[i])];
    for (int axis = 0; axis < 3; ++axis)
      edge[i].normal[axis] = static_cast<float>(plane.normal[axis]);
    edge[i].offset = static_cast<float>(plane.offset);
    edge[i].height = static_cast<float>(plane.height);
  }
}

EdgeNoise PixelAssigner::edgeNoise() const {
  const double constant = fit_.noise().constant;
  const double quadratic = fit_.noise().quadratic;
  EdgeNoise noise;
  noise.a = static_cast<float>(constant * constant);
  noise.b = static_cast<float>(2.0 * constant * quadratic);
  noise.c = static_cast<float>(quadratic * quadratic);
  noise.near = static_cast<float>(fit_.params().edge_factor * fit_.params().edge_factor);
  for (int axis = 0; axis < 3; ++axis) noise.sensor[axis] = static_cast<float>(cloud_.sensor[axis]);
  return noise;
}

void PixelAssigner::voteOf(int tile, const std::vector<PlaneCandidate>& planes,
                           const std::vector<EdgeTile*>& edge_of) const {
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  const EdgeNoise noise = edgeNoise();
  std::pair<const EdgeTile*, const float*> given[std::size(kVoters)];
  std::size_t different = 0;
  for (std::size_t k = 0; k < std::size(kVoters); ++k) {
    const int r = row - kVoters[k][0];
    const int c = column - kVoters[k][1];
    if (r < 0 || r >= cloud_.rows || c < 0 || c >= cloud_.columns) continue;
    EdgeTile* at = edge_of[static_cast<std::size_t>(r) * cloud_.columns + c];
    if (at == nullptr) continue;
    // Around a tile mostly the same planes meet, about which it says the same.
    const auto same = std::find_if(given, given + different,
                                   [&](const auto& other) { return other.first->meets(*at); });
    if (same != given + different) {
      std::copy_n(same->second, kOrdersOfThree, at->ballots[k]);
      continue;
    }
    EdgePlane edge[kEdgePlanes];
    describe(*at, planes, edge);
    sumErrors(cloud_.x(tile), edge, at->planes, noise, at->ballots[k]);
    given[different++] = {at, at->ballots[k]};
  }
}

void PixelAssigner::vote(const std::vector<PlaneCandidate>& planes,
                         std::vector<std::vector<EdgeTile>>& rows) const {
  std::vector<EdgeTile*> edge_of(static_cast<std::size_t>(cloud_.tiles()), nullptr);
  for (std::vector<EdgeTile>& row : rows) {
    for (EdgeTile& at : row) edge_of[static_cast<std::size_t>(at.tile)] = &at;
  }
  parallelFor(rows.size(), threads_, [&](std::size_t row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      voteOf(static_cast<int>(row) * cloud_.columns + column, planes, edge_of);
    }
  });
  for (std::vector<EdgeTile>& row : rows) {
    for (EdgeTile& at : row) at.count();
  }
}

void PixelAssigner::settle(const std::vector<PlaneCandidate>& planes, EdgeTile& at) {
  EdgePlane edge[kEdgePlanes];
  describe(at, planes, edge);
  const EdgeOrder& order = kOrders[std::min_element(at.votes, at.votes + at.orders()) - at.votes];
  std::int16_t* labels = labels_.data() + static_cast<std::size_t>(at.tile) * kTileArea;
  std::int16_t before[kTileArea];
  std::copy_n(labels, kTileArea, before);
  settleTile(cloud_.x(at.tile), edge, at.planes, edgeNoise(), order, at.labels, labels);
  if (!std::equal(before, before + kTileArea, labels)) summarize(at.tile);
}

void PixelAssigner::settleEdges(const std::vector<PlaneCandidate>& planes) {
  std::vector<std::vector<EdgeTile>> rows(static_cast<std::size_t>(cloud_.rows));
  parallelFor(rows.size(), threads_, [&](std::size_t row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      EdgeTile at;
      at.tile = static_cast<int>(row) * cloud_.columns + column;
      at.planes = commonestAround(at.tile, at.labels);
      if (at.planes < 2 || !isNoisy(at.tile)) continue;
      rows[row].push_back(at);
    }
  });
  vote(planes, rows);
  parallelFor(rows.size(), threads_, [&](std::size_t row) {
    for (EdgeTile& at : rows[row]) settle(planes, at);
  });
}

}  // namespace planar_mapping::detail
