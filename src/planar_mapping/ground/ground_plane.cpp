// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/base/simd.h"
#include "planar_mapping/geometry/point_sums.h"
#include "planar_mapping/grid/cell_table.h"
#include "planar_mapping/ground/ground_model.h"

namespace planar_mapping::detail {
namespace {

constexpr int kMaxDraws = 3000;          // triples drawn
constexpr int kMaxScored = 600;          // hypotheses scored on the small sample
constexpr std::size_t kSmall = 512;      // points of the small sample
constexpr int kFinalists = 8;            // hypotheses scored on the whole sample
constexpr int kRefits = 3;               // rounds of least squares
constexpr double kNarrowFraction = 0.4;  // of the band, in the last of them

/// Points within the band minus points below it, times 256: nothing lies under the ground but
/// noise.
PLANAR_MAPPING_MULTIVERSION
int score(const float* x, const float* y, const float* z, const float* band, std::size_t n,
          float slope_x, float slope_y, float offset, float cosine, int below_weight_256) {
  int inside = 0;
  int below = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const float d = (z[i] - slope_x * x[i] - slope_y * y[i] - offset) * cosine;
    inside += ((d <= band[i]) & (d >= -band[i])) ? 1 : 0;
    below += d < -2.0f * band[i] ? 1 : 0;
  }
  return 256 * inside - below_weight_256 * below;
}

struct Hypothesis {
  GroundPlane plane;
  int score = 0;
};

bool byScore(const Hypothesis& a, const Hypothesis& b) {
  return a.score > b.score;
}

/// Points that may be ground by the priors alone, with their band.
struct Candidates {
  std::vector<float> x, y, z, band;
  std::size_t size() const { return x.size(); }
  void reserve(std::size_t n) {
    for (auto* values : {&x, &y, &z, &band}) values->reserve(n);
  }
  void add(const GroundSample& s, std::size_t i, double width) {
    x.push_back(s.x[i]);
    y.push_back(s.y[i]);
    z.push_back(s.z[i]);
    band.push_back(static_cast<float>(width));
  }
};

int scoreOf(const Candidates& c, std::size_t n, const GroundPlane& p, double below_weight) {
  return score(c.x.data(), c.y.data(), c.z.data(), c.band.data(), n, static_cast<float>(p.slope_x),
               static_cast<float>(p.slope_y), static_cast<float>(p.offset),
               static_cast<float>(p.cosine()), static_cast<int>(256.0 * below_weight));
}

bool withinPriors(const GroundPlane& plane, const GroundParams& params) {
  if (!(std::abs(std::atan(plane.slope_x)) <= params.pitch_tolerance)) return false;
  if (!(std::abs(std::atan(plane.slope_y)) <= params.roll_tolerance)) return false;
  const double height = plane.height();
  const double expected = params.camera_height.value_or(0.0);
  if (expected == 0.0) return height > params.distance_threshold;
  return std::abs(height - expected) <= params.height_tolerance;
}

bool throughPoints(const Candidates& c, std::uint32_t i, std::uint32_t j, std::uint32_t k,
                   GroundPlane& plane) {
  const double ax = double(c.x[j]) - c.x[i], ay = double(c.y[j]) - c.y[i];
  const double bx = double(c.x[k]) - c.x[i], by = double(c.y[k]) - c.y[i];
  const double area = ax * by - ay * bx;
  // Seen from above the triangle must not be a needle.
  if (!(std::abs(area) > 0.02 * std::max(ax * ax + ay * ay, bx * bx + by * by))) return false;
  const double az = double(c.z[j]) - c.z[i], bz = double(c.z[k]) - c.z[i];
  plane.slope_x = (az * by - bz * ay) / area;
  plane.slope_y = (bz * ax - az * bx) / area;
  plane.offset = c.z[i] - plane.slope_x * c.x[i] - plane.slope_y * c.y[i];
  return std::isfinite(plane.offset);
}

std::vector<Hypothesis> drawHypotheses(const Candidates& c, const GroundParams& params,
                                       double below_weight, GroundDiagnostics& diagnostics) {
  std::vector<Hypothesis> best;
  const auto n = static_cast<std::uint32_t>(c.size());
  const std::size_t small = std::min<std::size_t>(kSmall, n);
  const double steepest =
      std::hypot(std::tan(params.pitch_tolerance), std::tan(params.roll_tolerance));
  const auto couldBeOnePlane = [&](std::uint32_t i, std::uint32_t j) {
    const double apart = std::hypot(double(c.x[i]) - c.x[j], double(c.y[i]) - c.y[j]);
    return std::abs(double(c.z[i]) - c.z[j]) <= steepest * apart + c.band[i] + c.band[j];
  };
  Random random(params.seed, 1);
  int scored = 0;
  for (int draw = 0; draw < kMaxDraws && scored < kMaxScored; ++draw) {
    const std::uint32_t i = random.below(n);
    const std::uint32_t j = random.below(n);
    const std::uint32_t k = random.below(n);
    if (!couldBeOnePlane(i, j) || !couldBeOnePlane(i, k)) continue;
    Hypothesis hypothesis;
    if (!throughPoints(c, i, j, k, hypothesis.plane)) continue;
    if (!withinPriors(hypothesis.plane, params)) continue;
    hypothesis.score = scoreOf(c, small, hypothesis.plane, below_weight);
    ++scored;
    best.push_back(hypothesis);
  }
  diagnostics.hypotheses = static_cast<std::size_t>(scored);
  std::stable_sort(best.begin(), best.end(), byScore);
  if (best.size() > kFinalists) best.resize(kFinalists);
  return best;
}

/// Least squares on the points within a fraction of the band, weighted by 1 / band^2.
bool refit(const Candidates& c, double reference_band, double fraction_of_band, GroundPlane& plane,
           PlaneMoments& moments) {
  const double cosine = plane.cosine();
  // About the foot of the sensor, so that the sums stay small.
  PointSums around;
  for (std::size_t i = 0; i < c.size(); ++i) {
    const double x = c.x[i];
    const double y = c.y[i];
    const double z = c.z[i] - plane.offset;
    const double d = (z - plane.slope_x * x - plane.slope_y * y) * cosine;
    if (!(std::abs(d) <= fraction_of_band * c.band[i])) continue;
    const double relative = reference_band / c.band[i];
    around.add(x, y, z, relative * relative);
  }
  const PlaneMoments sums = around.moments({0.0, 0.0, plane.offset});
  const PlaneMoments::Fit fit = sums.fit();
  if (!fit.valid) return false;
  const Plane upwards = fit.plane.normal.z() < 0.0 ? fit.plane.flipped() : fit.plane;
  const Vector3& normal = upwards.normal;
  if (!(normal.z() > 0.1)) return false;
  plane = {-normal.x() / normal.z(), -normal.y() / normal.z(), -upwards.offset / normal.z()};
  moments = sums;
  return true;
}

std::size_t countInliers(const Candidates& c, const GroundPlane& plane) {
  return static_cast<std::size_t>(scoreOf(c, c.size(), plane, 0.0)) / 256;
}

}  // namespace

double GroundPlane::cosine() const {
  return 1.0 / std::sqrt(1.0 + slope_x * slope_x + slope_y * slope_y);
}

GroundFrame::GroundFrame(const GroundParams& params, const Vector3& upwards)
    : distance_threshold(params.distance_threshold), noise_per_depth_and_height(0.0) {
  const Vector3 up = upwards.normalized();
  const Vector3 optical = params.optical_axis.normalized();
  Vector3 forwards = optical - up.dot(optical) * up;
  depth_axis = optical;
  if (forwards.norm() < 0.05) {
    // Looking straight up or down, or an axis that was never set: any level direction will do.
    forwards = std::abs(up.x()) < 0.9 ? Vector3(Vector3::UnitX()) : Vector3(Vector3::UnitY());
    forwards -= up.dot(forwards) * up;
    depth_axis.setZero();
  }
  forwards.normalize();
  axes.row(0) = forwards;
  axes.row(1) = up.cross(forwards);
  axes.row(2) = up;
  if (params.noise) {
    noise_per_depth_and_height = params.noise_factor * params.noise->disparity_error /
                                 (params.noise->baseline * params.noise->focal_length);
  }
}

double GroundFrame::depth(const Vector3& p) const {
  return depth_axis.isZero(0.0) ? p.norm() : std::abs(depth_axis.dot(p));
}

GroundSample drawGroundSample(const PointsView& points, const Indices* indices,
                              const GroundParams& params, const GroundFrame& frame) {
  GroundSample sample;
  const std::size_t n = countOf(points, indices);
  const std::size_t wanted = static_cast<std::size_t>(params.sample_size);
  const std::size_t draws = std::min(n, wanted);
  Random random(params.seed, 0);
  for (auto* values : {&sample.x, &sample.y, &sample.z, &sample.depth}) values->reserve(draws);
  std::size_t first = 0;
  for (std::size_t i = 0; i < draws; ++i) {
    // One point out of each of `draws` equal runs: even, but in step with no row of the image.
    const std::size_t end = (i + 1) * n / draws;
    const std::size_t drawn =
        at(indices, first + random.below(static_cast<std::uint32_t>(end - first)));
    first = end;
    if (!points.isMeasured(drawn)) continue;
    const Vector3 p = points.point(drawn);
    const Vector3 q = frame.local(p);
    // Beyond this a float no longer resolves the ground.
    if (!(q.cwiseAbs().maxCoeff() < 1e5)) continue;
    sample.x.push_back(static_cast<float>(q.x()));
    sample.y.push_back(static_cast<float>(q.y()));
    sample.z.push_back(static_cast<float>(q.z()));
    sample.depth.push_back(static_cast<float>(frame.depth(p)));
  }
  return sample;
}

void dropUprights(GroundSample& sample, const GroundParams& params, const GroundFrame& frame) {
  // Columns coarse enough for the sparse sample; what a slope may climb within one is no wall.
  const double side = 2.0 * params.wall_cell;
  const double steepest = std::tan(params.max_slope) + std::hypot(std::tan(params.pitch_tolerance),
                                                                  std::tan(params.roll_tolerance));
  const double climb = side * steepest + 2.0 * frame.distance_threshold;
  CellTable columns;
  std::vector<std::int32_t> column_of(sample.size(), -1);
  std::vector<float> lowest;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    CellKey column;
    if (!cellOf({sample.x[i] / side, sample.y[i] / side, 0.0}, column)) continue;
    column_of[i] = columns.insert(column);
    if (static_cast<std::size_t>(column_of[i]) == lowest.size()) lowest.push_back(sample.z[i]);
    lowest[column_of[i]] = std::min(lowest[column_of[i]], sample.z[i]);
  }
  std::vector<std::int32_t> low(lowest.size(), 0);
  std::vector<std::int32_t> high(lowest.size(), 0);
  for (std::size_t i = 0; i < sample.size(); ++i) {
    if (column_of[i] < 0) continue;
    const double over = double(sample.z[i]) - lowest[column_of[i]];
    if (over <= climb) {
      ++low[column_of[i]];
    } else if (over <= climb + params.wall_height) {
      ++high[column_of[i]];
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    if (column_of[i] < 0 || 4 * high[column_of[i]] >= low[column_of[i]]) continue;
    sample.x[kept] = sample.x[i];
    sample.y[kept] = sample.y[i];
    sample.z[kept] = sample.z[i];
    sample.depth[kept] = sample.depth[i];
    ++kept;
  }
  for (auto* values : {&sample.x, &sample.y, &sample.z, &sample.depth}) values->resize(kept);
}

GroundStatus estimateGround(const GroundSample& sample, const GroundParams& params,
                            const GroundFrame& frame, double needed, GroundEstimate& estimate,
                            GroundDiagnostics& diagnostics) {
  const double camera_height = params.camera_height.value_or(0.0);
  const bool known_height = camera_height > 0.0;
  const double slack =
      std::hypot(std::tan(params.pitch_tolerance), std::tan(params.roll_tolerance));
  // Height of a point below the sensor stands in for the camera's, which is only known roughly.
  Candidates all;
  Candidates candidates;
  all.reserve(sample.size());
  candidates.reserve(sample.size());
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const double height = known_height ? camera_height : std::max(0.0, -double(sample.z[i]));
    const double band = frame.band(sample.depth[i], height);
    all.add(sample, i, band);
    const double reach = slack * std::hypot(sample.x[i], sample.y[i]) + band;
    const double off = known_height
                           ? std::abs(sample.z[i] + camera_height) - params.height_tolerance
                           : double(sample.z[i]);
    if (off <= reach) candidates.add(sample, i, band);
  }
  if (static_cast<double>(candidates.size()) < std::max(3.0, needed)) return GroundStatus::NoPlane;

  // With a known height points below (stairs down, an edge) only break ties.
  const double below_weight = known_height ? 0.25 : 1.0;
  Random shuffle(params.seed, 2);
  for (std::size_t i = 0; i < std::min(kSmall, candidates.size()); ++i) {
    const std::size_t j = i + shuffle.below(static_cast<std::uint32_t>(candidates.size() - i));
    for (auto* values : {&candidates.x, &candidates.y, &candidates.z, &candidates.band}) {
      std::swap((*values)[i], (*values)[j]);
    }
  }
  std::vector<Hypothesis> finalists = drawHypotheses(candidates, params, below_weight, diagnostics);
  if (finalists.empty()) return GroundStatus::NoPlane;

  for (Hypothesis& hypothesis : finalists) {
    hypothesis.score = scoreOf(all, all.size(), hypothesis.plane, below_weight);
  }
  std::stable_sort(finalists.begin(), finalists.end(), byScore);
  for (const Hypothesis& hypothesis : finalists) {
    GroundPlane plane = hypothesis.plane;
    PlaneMoments moments;
    bool good = true;
    for (int round = 0; round < kRefits && good; ++round) {
      // The last look is a narrow one: what stands on the ground lies on one side of it.
      const double fraction = round + 1 < kRefits ? 1.0 : kNarrowFraction;
      good = refit(candidates, frame.distance_threshold, fraction, plane, moments);
    }
    if (!good || !withinPriors(plane, params)) continue;
    if (static_cast<double>(countInliers(candidates, plane)) < needed) continue;
    estimate.plane = plane;
    estimate.moments = moments;
    return GroundStatus::Found;
  }
  return GroundStatus::TooLittleSupport;
}

}  // namespace planar_mapping::detail
