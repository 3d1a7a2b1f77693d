// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/atlas/atlas_rows.h"
#include "planar_mapping/atlas/keyframe_cells.h"
#include "planar_mapping/atlas/place_finder.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/pose_evidence.h"

namespace planar_mapping {
namespace {

constexpr float kRatio = 0.9F;        // of distances, best over second best
constexpr double kSearchRadius = 12;  // pixels around where a feature is expected
// Features are found in a reduced image.
constexpr double kPixelError = 1.0;
constexpr std::size_t kMinInliers = 12;
// A link needs odds of 20 : 1, see featureLogOdds().
constexpr double kMinLogOdds = 3.0;
// Errors that features share.
constexpr double kSharedDepthError = 0.01;  // of the median depth
constexpr double kSharedTurn = 0.005;       // radians

/// Descriptors as rows of whole numbers, whose products floats hold exactly.
using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Rows rowsOf(const Keyframe& key) {
  const std::size_t bytes = key.descriptor_bytes;
  Rows rows(static_cast<Eigen::Index>(key.sightings.size()), static_cast<Eigen::Index>(2 * bytes));
  for (std::size_t i = 0; i < key.sightings.size(); ++i) {
    for (std::size_t k = 0; k < bytes; ++k) {
      const std::uint8_t both = key.descriptors[i * bytes + k];
      const auto row = static_cast<Eigen::Index>(i);
      rows(row, static_cast<Eigen::Index>(2 * k)) = static_cast<float>(both & 15U);
      rows(row, static_cast<Eigen::Index>(2 * k + 1)) = static_cast<float>(both >> 4U);
    }
  }
  return rows;
}

/// Squared distances between all rows of one and of the other.
Rows distancesBetween(const Rows& a, const Rows& b) {
  Rows distances = -2.0F * (a * b.transpose());
  distances.colwise() += a.rowwise().squaredNorm();
  distances.rowwise() += b.rowwise().squaredNorm().transpose();
  return distances;
}

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// The best of each other, clearly better than the second best.
Pairs mutualMatches(const Rows& distances) {
  Pairs pairs;
  for (Eigen::Index i = 0; i < distances.rows(); ++i) {
    Eigen::Index best = 0;
    const float least = distances.row(i).minCoeff(&best);
    float second = -1.0F;
    for (Eigen::Index j = 0; j < distances.cols(); ++j) {
      if (j != best && (second < 0.0F || distances(i, j) < second)) second = distances(i, j);
    }
    if (second >= 0.0F && least >= kRatio * kRatio * second) continue;
    if (distances.col(best).minCoeff() < least) continue;
    pairs.emplace_back(i, best);
  }
  return pairs;
}

FeatureCamera checkedCamera(FeatureCamera camera) {
  camera.pixel_error = std::max(camera.pixel_error, kPixelError);
  return camera;
}

std::vector<FeatureMatch> featureMatches(const Keyframe& a, const Keyframe& b, const Pairs& pairs) {
  const FeatureCamera camera = checkedCamera(a.camera);
  std::vector<FeatureMatch> matches;
  matches.reserve(pairs.size());
  for (const auto& [i, j] : pairs) {
    const FeatureSighting& before = a.sightings[i];
    matches.push_back(
        {backProject(camera, before), positionCovariance(camera, before), b.sightings[j]});
  }
  return matches;
}

/// Each feature of one with the most alike near where the other should see it.
Pairs guidedMatches(const Keyframe& a, const Keyframe& b, const Rows& distances, const Pose& T_b_a,
                    std::size_t& expected) {
  Pairs pairs;
  expected = 0;
  for (std::size_t i = 0; i < a.sightings.size(); ++i) {
    const Vector3 point = T_b_a * backProject(a.camera, a.sightings[i]);
    if (point.z() <= 0.0) continue;
    const FeatureSighting seen = project(b.camera, point);
    if (seen.column < 0.0 || seen.row < 0.0 || seen.column >= b.width || seen.row >= b.height)
      continue;
    ++expected;
    const auto row = static_cast<Eigen::Index>(i);
    std::size_t best = b.sightings.size();
    for (std::size_t j = 0; j < b.sightings.size(); ++j) {
      const double off =
          std::hypot(b.sightings[j].column - seen.column, b.sightings[j].row - seen.row);
      if (off > kSearchRadius) continue;
      if (best == b.sightings.size() || distances(row, static_cast<Eigen::Index>(j)) <
                                            distances(row, static_cast<Eigen::Index>(best)))
        best = j;
    }
    // Not where it resembles another feature of that image far more.
    if (best == b.sightings.size()) continue;
    constexpr float kSlack = 1.2F;
    if (distances(row, static_cast<Eigen::Index>(best)) >
        kSlack * kSlack * distances.row(row).minCoeff())
      continue;
    pairs.emplace_back(i, best);
  }
  return pairs;
}

/// Depths of one keyframe beside what the other measured there.
detail::DepthComparison depthsBeside(const Keyframe& a, const Keyframe& b, const Pose& T_b_a) {
  constexpr double kSigmas = 3.0;
  constexpr double kRelative = 0.03;  // of the depth: pose, slope within a cell
  const detail::KeyframeCells from(a);
  const detail::KeyframeCells to(b);
  detail::DepthComparison result;
  for (int row = 0; row < from.down(); row += 2) {
    for (int column = 0; column < from.across(); column += 2) {
      const FeatureSighting sighting = from.middle(column, row);
      if (sighting.inverse_depth <= 0.0) continue;
      const Vector3 point = T_b_a * backProject(a.camera, sighting);
      if (point.z() <= 0.0) continue;
      const FeatureSighting seen = project(b.camera, point);
      if (!to.contains(seen.column, seen.row)) continue;
      const double z = point.z();
      const double sigma = std::hypot(b.camera.depthError(z), a.camera.depthError(z)) / (z * z);
      const double tolerance = kSigmas * sigma + kRelative / z;
      result.look(to.columnOf(seen.column), to.rowOf(seen.row), to.across(), to.down(),
                  seen.inverse_depth,
                  [&](int u, int v) { return std::pair(to.depth(u, v), tolerance); });
    }
  }
  return result;
}

double medianDepth(const Keyframe& key) {
  std::vector<double> depths;
  for (const FeatureSighting& sighting : key.sightings)
    depths.push_back(1.0 / sighting.inverse_depth);
  return depths.empty() ? 0.0 : detail::ranked(depths, depths.size() / 2);
}

}  // namespace

std::optional<Link> PlaceFinder::verify(const Keyframe& a, const Keyframe& b) {
  if (a.sightings.size() < kMinInliers || b.sightings.size() < kMinInliers) return std::nullopt;
  if (a.descriptor_bytes != b.descriptor_bytes) return std::nullopt;
  const Rows distances = distancesBetween(rowsOf(a), rowsOf(b));
  const FeatureCamera camera = checkedCamera(b.camera);
  MotionParams params;
  params.min_matches = static_cast<int>(kMinInliers);
  params.min_inliers = static_cast<int>(kMinInliers) / 2;
  // Only errors that features share limit how far away a link may see.
  params.max_translation_error = 0.1 * std::max(1.0, medianDepth(b));
  Random random(Random::kDefaultSeed);
  const MotionEstimate first =
      estimateMotion(featureMatches(a, b, mutualMatches(distances)), camera, params, random);
  if (!first.found()) return std::nullopt;

  std::size_t expected = 0;
  const Pairs pairs = guidedMatches(a, b, distances, first.T_now_before, expected);
  const std::vector<FeatureMatch> matches = featureMatches(a, b, pairs);
  params.min_inliers = static_cast<int>(kMinInliers);
  const MotionEstimate motion =
      estimateMotion(matches, camera, params, random, &first.T_now_before);
  if (!motion.found()) return std::nullopt;

  const Pose& T_b_a = motion.T_now_before;
  const detail::DepthComparison forward = depthsBeside(a, b, T_b_a);
  const detail::DepthComparison back = depthsBeside(b, a, T_b_a.inverse());
  Link link = detail::linkBetween(LinkKind::Loop, a, b);
  link.evidence.inliers = motion.inliers;
  link.evidence.matches = matches.size();
  link.evidence.off_plane = detail::offPlane(matches, motion.is_inlier, random);
  link.evidence.agreement = std::min(forward.agreement(), back.agreement());
  link.evidence.seen_through = std::max(forward.seenThrough(), back.seenThrough());
  // The weight of agreement is a guess.
  link.evidence.log_odds =
      detail::featureLogOdds(link.evidence.off_plane,
                             static_cast<double>(motion.inliers) / static_cast<double>(expected),
                             link.evidence.seen_through) +
      2.05 * (link.evidence.agreement - 0.5);
  if (link.evidence.log_odds < kMinLogOdds) return std::nullopt;

  link.T_to_from = b.T_submap_keyframe * T_b_a * a.T_submap_keyframe.inverse();
  const double shared_shift = kSharedDepthError * medianDepth(b);
  link.covariance = turnedCovariance(
      b.T_submap_keyframe, detail::withShared(motion.covariance, shared_shift, kSharedTurn));
  return link;
}

}  // namespace planar_mapping
