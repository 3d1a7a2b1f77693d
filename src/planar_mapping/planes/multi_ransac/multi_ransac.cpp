// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/base/simd.h"
#include "planar_mapping/planes/multi_ransac/sparse_points.h"
#include "planar_mapping/planes/plane_search.h"
#include "planar_mapping/planes/point_cells.h"
#include "planar_mapping/planes/surface_leaves.h"

// Multi-RANSAC after Zuliani, Kenney and Manjunath (ICIP 2005): every iteration draws up to W
// models one after the other on what the ones before left over, and fuses old and new models into
// the set that explains most. [ours] Samples are local, models are refitted in a growing reach,
// points at edges go to the nearest plane instead of being fought for, and W follows from
// significance: the points of a plane that have others of it around them, against the same number
// in the slabs beside it.
namespace planar_mapping::detail {

namespace {

constexpr int kSeedsPerDraw = 16;
constexpr int kSamplesPerSeed = 3;
// The last round is without limit too.
constexpr double kReachInRadii[] = {1.5, 4.0, 10.0, 1e9, 1e9};
constexpr std::uint8_t kFree = 255, kTaken = 0;
constexpr std::uint8_t kOn = 1, kAbove = 2, kBelow = 3;
// A point of a plane has at least so many others of it among its neighbours.
constexpr int kCompany = 3;
// Clutter beside a plane is counted at least so high, points: with none seen there the best of many
// samples would still find some on it ...
constexpr double kMinClutter = 4.0;
// ... it comes in groups, so its variance is this many times its number ...
constexpr double kClutterSpread = 2.0;
// ... and the plane was chosen for having most: it must have this many times what is beside it.
constexpr double kClutterDoubt = 3.0;
// Seeds that fall on a plane and still miss it, because their samples are mixed.
constexpr double kGoodSeedFraction = 0.5;
constexpr int kFailuresInARow = 2;
constexpr int kMinIterations = 2;
constexpr int kMaxIterations = 1000;
constexpr std::size_t kMaxModels = 256;

struct Model {
  Plane plane;                        ///< about the origin of the points
  std::vector<std::int32_t> inliers;  ///< unique points
  double support = 0.0;               ///< inliers in company
};

/// Where each point is as seen from a plane: kOn (within its band), kAbove and kBelow in the slab
/// of the same thickness beside it, 0 elsewhere, farther than the square of the reach from
/// (cx, cy, cz), or where \p mask is kTaken.
PLANAR_MAPPING_MULTIVERSION
void classify(const float* x, const float* y, const float* z, const float* inverse_band,
              const std::uint8_t* mask, std::size_t n, float a, float b, float c, float d, float cx,
              float cy, float cz, float squared_reach, std::uint8_t* place) {
  for (std::size_t i = 0; i < n; ++i) {
    const float distance = (a * x[i] + b * y[i] + c * z[i] + d) * inverse_band[i];
    const float dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz;
    const float away = dx * dx + dy * dy + dz * dz;
    const int on = static_cast<int>(distance <= 1.0f) & static_cast<int>(distance >= -1.0f);
    const int above = static_cast<int>(distance > 1.0f) & static_cast<int>(distance <= 3.0f);
    const int below = static_cast<int>(distance < -1.0f) & static_cast<int>(distance >= -3.0f);
    const int within = -static_cast<int>(away <= squared_reach);
    place[i] = static_cast<std::uint8_t>((on + 2 * above + 3 * below) & within & mask[i]);
  }
}

class MultiRansac {
 public:
  MultiRansac(const SparsePoints& points, const MultiPlaneParams& params,
              PlaneSearchDiagnostics& diagnostics)
      : points_(points),
        params_(params),
        diagnostics_(diagnostics),
        random_(params.seed),
        place_((points.size() + 7) / 8 * 8, 0),
        free_(points.size(), kFree) {}

  std::vector<Plane> run() {
    if (points_.size() < static_cast<std::size_t>(params_.min_inliers)) return {};
    double seeds_in_vain = 0.0;
    bool better = true;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      // While the models improve all are drawn anew; later only what they leave over is searched.
      const std::size_t left = drawModels(better || iteration < kMinIterations);
      better = fuse();
      seeds_in_vain = better ? 0.0 : seeds_in_vain + kFailuresInARow * kSeedsPerDraw;
      if (iteration + 1 >= kMinIterations && seeds_in_vain >= seedsNeeded(left)) break;
      if (isOver()) {
        diagnostics_.stopped_by_itself = false;
        break;
      }
    }
    std::vector<Plane> planes;
    for (const Model& model : models_) {
      planes.push_back(
          {model.plane.normal, model.plane.offset - model.plane.normal.dot(points_.origin)});
    }
    return planes;
  }

 private:
  std::size_t mostModels() const {
    return params_.number_of_models > 0 ? static_cast<std::size_t>(params_.number_of_models)
                                        : kMaxModels;
  }
  bool isOver() const {
    return params_.max_iterations > 0 &&
           diagnostics_.hypotheses >= static_cast<std::size_t>(params_.max_iterations);
  }
  /// Seeds until the smallest plane among \p left points is missed with the given probability.
  double seedsNeeded(std::size_t left) const {
    const double hit = kGoodSeedFraction * params_.min_inliers /
                       static_cast<double>(std::max<std::size_t>(left, 1));
    return hit >= 1.0 ? 1.0 : std::log(params_.miss_probability) / std::log1p(-hit);
  }

  /// W models one after the other, each on what is left of all points or of the models so far.
  /// \return points left
  std::size_t drawModels(bool anew) {
    drawn_.clear();
    setAllFree();
    std::size_t left = points_.size();
    if (!anew) {
      for (const Model& model : models_) left -= takePoints(model);
    }
    int failures = 0;
    while (drawn_.size() < mostModels() && failures < kFailuresInARow && !isOver() &&
           left >= static_cast<std::size_t>(params_.min_inliers)) {
      Model model;
      if (!draw(model)) {
        ++failures;
        continue;
      }
      failures = 0;
      left -= takePoints(model);
      drawn_.push_back(std::move(model));
    }
    return left;
  }

  std::size_t takePoints(const Model& model) {
    for (const std::int32_t i : model.inliers) free_[static_cast<std::size_t>(i)] = kTaken;
    return model.inliers.size();
  }
  void setAllFree() { std::fill(free_.begin(), free_.end(), kFree); }

  Vector3 at(std::size_t i) const { return {points_.x[i], points_.y[i], points_.z[i]}; }

  /// A free neighbour of \p i, or -1.
  std::int32_t freeNeighbour(std::size_t i) {
    const std::int32_t first = points_.first_near[i];
    const auto n = static_cast<std::uint32_t>(points_.first_near[i + 1] - first);
    if (n == 0) return -1;
    const std::int32_t j = points_.near[static_cast<std::size_t>(first) + random_.below(n)];
    return free_[static_cast<std::size_t>(j)] != kTaken ? j : -1;
  }

  /// The best of some local samples, grown to all its free points.
  bool draw(Model& model) {
    Plane best;
    std::size_t best_seed = 0;
    double best_score = 0.0;
    for (int s = 0; s < kSeedsPerDraw; ++s) {
      const std::size_t seed = random_.below(static_cast<std::uint32_t>(points_.size()));
      if (free_[seed] == kTaken) continue;
      for (int t = 0; t < kSamplesPerSeed; ++t) {
        const std::int32_t j = freeNeighbour(seed), k = freeNeighbour(seed);
        if (j < 0 || k < 0) continue;
        Plane plane;
        ++diagnostics_.hypotheses;
        if (j == k || !planeFromPoints(at(seed), at(static_cast<std::size_t>(j)),
                                       at(static_cast<std::size_t>(k)), plane)) {
          continue;
        }
        const double score = scoreAround(seed, plane);
        if (score <= best_score) continue;
        best_score = score;
        best = plane;
        best_seed = seed;
      }
    }
    if (!(best_score > 0.0)) return false;
    model.plane = best;
    return grow(best_seed, model.plane) && evaluate(model);
  }

  /// Neighbours of the seed on the plane, counted by how near they are.
  double scoreAround(std::size_t seed, const Plane& plane) const {
    double score = 0.0;
    for (std::int32_t k = points_.first_near[seed]; k < points_.first_near[seed + 1]; ++k) {
      const auto i = static_cast<std::size_t>(points_.near[static_cast<std::size_t>(k)]);
      if (free_[i] == kTaken) continue;
      const double d = plane.signedDistance(at(i)) * points_.inverse_band[i];
      if (d * d < 1.0) score += 1.0 - d * d;
    }
    return score;
  }

  /// Calls visit(point, place) for the free points on the plane and in the slabs beside it.
  template <typename Visit>
  void forEachNear(const Plane& plane, const Vector3& middle, double reach, Visit visit) {
    const Eigen::Vector3f n = plane.normal.cast<float>(), m = middle.cast<float>();
    classify(points_.x.data(), points_.y.data(), points_.z.data(), points_.inverse_band.data(),
             free_.data(), points_.size(), n[0], n[1], n[2], static_cast<float>(plane.offset), m[0],
             m[1], m[2], static_cast<float>(reach * reach), place_.data());
    // Few points are near: eight places at once tell whether any is.
    for (std::size_t word = 0; word < place_.size(); word += 8) {
      std::uint64_t places;
      std::memcpy(&places, place_.data() + word, sizeof(places));
      if (places == 0) continue;
      for (std::size_t i = word; i < word + 8; ++i) {
        if (place_[i] != 0) visit(i, place_[i]);
      }
    }
  }

  /// Refits the plane to its free points in a reach around the seed that widens until it is all.
  bool grow(std::size_t seed, Plane& plane) {
    for (const double radii : kReachInRadii) {
      PointSums sums;
      forEachNear(plane, at(seed), radii * points_.radius, [&](std::size_t i, std::uint8_t place) {
        if (place == kOn) sums.add(points_.x[i], points_.y[i], points_.z[i]);
      });
      if (!refit(sums, plane)) return false;
    }
    return true;
  }

  static bool refit(const PointSums& sums, Plane& plane) {
    if (sums.n < 3.0) return false;
    const LocalFit fit = fitLocally(sums);
    if (!(fit.normal.squaredNorm() > 0.5) || !fit.normal.allFinite()) return false;
    plane = {fit.normal, -fit.normal.dot(fit.mean)};
    return true;
  }

  /// Collects the free inliers and tells whether they stand out from what is beside the plane.
  bool evaluate(Model& model) {
    model.inliers.clear();
    near_.clear();
    forEachNear(model.plane, Vector3::Zero(), std::numeric_limits<double>::infinity(),
                [&](std::size_t i, std::uint8_t place) {
                  near_.push_back(static_cast<std::int32_t>(i));
                  if (place == kOn) model.inliers.push_back(static_cast<std::int32_t>(i));
                });
    double in_company[4] = {0, 0, 0, 0};
    for (const std::int32_t name : near_) {
      const auto i = static_cast<std::size_t>(name);
      int company = 0;
      for (std::int32_t k = points_.first_near[i]; k < points_.first_near[i + 1]; ++k) {
        const std::int32_t j = points_.near[static_cast<std::size_t>(k)];
        company += place_[static_cast<std::size_t>(j)] == place_[i] ? 1 : 0;
      }
      if (company >= kCompany) in_company[place_[i]] += 1.0;
    }
    const double beside = 0.5 * (in_company[kAbove] + in_company[kBelow]);
    model.support = in_company[kOn];
    const bool significant =
        model.support - kClutterDoubt * beside >=
        params_.significance * std::sqrt(kClutterSpread * (beside + kMinClutter));
    if (model.inliers.size() < static_cast<std::size_t>(params_.min_inliers)) {
      ++diagnostics_.rejected_too_small;
      return false;
    }
    if (!significant && params_.number_of_models == 0) {
      ++diagnostics_.rejected_not_significant;
      return false;
    }
    return true;
  }

  /// Old and new models to the disjoint ones that explain most, the largest first.
  bool fuse() {
    if (drawn_.empty()) return false;
    std::vector<Model> pool = models_;
    pool.insert(pool.end(), drawn_.begin(), drawn_.end());
    std::vector<Model> chosen;
    setAllFree();
    double total = 0.0;
    // Support only gets less as points are taken: evaluate the first again until it stays the
    // first.
    std::vector<std::size_t> age(pool.size(), 0);
    const auto less = [&](std::size_t a, std::size_t b) {
      return pool[a].support != pool[b].support ? pool[a].support < pool[b].support : a > b;
    };
    std::vector<std::size_t> queue(pool.size());
    std::iota(queue.begin(), queue.end(), 0);
    for (std::size_t k : queue) pool[k].support = std::numeric_limits<double>::infinity();
    std::make_heap(queue.begin(), queue.end(), less);
    while (chosen.size() < mostModels() && !queue.empty()) {
      std::pop_heap(queue.begin(), queue.end(), less);
      const std::size_t best = queue.back();
      if (age[best] != chosen.size() + 1) {
        queue.pop_back();
        age[best] = chosen.size() + 1;
        if (!evaluate(pool[best])) continue;
        queue.push_back(best);
        std::push_heap(queue.begin(), queue.end(), less);
        continue;
      }
      queue.pop_back();
      takePoints(pool[best]);
      total += pool[best].support;
      chosen.push_back(std::move(pool[best]));
    }
    if (!(total > total_)) return false;
    // A gain of less than a small plane is no reason to go on searching.
    const bool better = total >= total_ + 0.5 * params_.min_inliers;
    total_ = total;
    models_ = std::move(chosen);
    return better;
  }

  const SparsePoints& points_;
  const MultiPlaneParams& params_;
  PlaneSearchDiagnostics& diagnostics_;
  Random random_;
  std::vector<std::uint8_t> place_;  ///< padded with zeros to whole words
  std::vector<std::uint8_t> free_;
  std::vector<std::int32_t> near_;
  std::vector<Model> models_;
  std::vector<Model> drawn_;
  double total_ = 0.0;
};

}  // namespace

PlaneSet findPlanesMultiRansac(const PointsView& points, const Indices* indices,
                               const MultiPlaneParams& params, const Vector3& sensor) {
  const SparsePoints sparse = prepareSparsePoints(points, indices, DistanceBand(params));
  PlaneSearchDiagnostics diagnostics;
  diagnostics.points_not_measured = sparse.points_not_measured;
  diagnostics.duplicate_points = sparse.duplicate_points;
  const std::vector<Plane> planes = MultiRansac(sparse, params, diagnostics).run();

  const std::vector<std::int32_t> labels = clusterIndexed(points, indices, planes, params);
  PlaneSet set =
      assemblePlaneSet(points, labels, planes, params, sensor, InlierRule::WithinThreshold);
  set.diagnostics = diagnostics;
  return set;
}

}  // namespace planar_mapping::detail
