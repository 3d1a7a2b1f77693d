// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/pose_evidence.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

constexpr double kAgreeSigmas = 3.0;
constexpr double kNever = -20.0;         // log odds
constexpr double kAgreeFraction = 0.01;  // of the depth

/// One way between two views.
struct CellComparison {
  double cells = 0.0;      ///< with depth
  double seen = 0.0;       ///< of these, inside the other view
  DepthComparison depths;  ///< of these
  double gray_products = 0.0;
  double gray_squares_from = 0.0;
  double gray_squares_to = 0.0;

  void add(const CellComparison& o) {
    cells += o.cells;
    seen += o.seen;
    depths.add(o.depths);
    gray_products += o.gray_products;
    gray_squares_from += o.gray_squares_from;
    gray_squares_to += o.gray_squares_to;
  }
  double overlap() const { return cells > 0.0 ? seen / cells : 0.0; }
  double correlation() const {
    const double squares = gray_squares_from * gray_squares_to;
    return squares > 0.0 ? gray_products / std::sqrt(squares) : 0.0;
  }
};

CellComparison compare(const View& from, const View& to, const Pose& T_to_from) {
  CellComparison sum;
  const ViewCells& cells = to.coarse;
  const Matrix3 R = T_to_from.linear();
  const Vector3 t = T_to_from.translation();
  for (int row = 0; row < from.coarse.down; ++row) {
    for (int column = row % 2; column < from.coarse.across; column += 2) {
      const ViewCell& cell = from.coarse.at(column, row);
      if (!cell.hasDepth()) continue;
      sum.cells += 1.0;
      const Vector3 q = R * cell.point.cast<double>() + t;
      if (q.z() <= 0.0) continue;
      const FeatureSighting place = project(to.camera, q);
      if (!to.contains(place)) continue;
      sum.seen += 1.0;
      const int x = std::clamp(static_cast<int>(std::lround(cells.placeOf(place.column))), 0,
                               cells.across - 1);
      const int y =
          std::clamp(static_cast<int>(std::lround(cells.placeOf(place.row))), 0, cells.down - 1);
      const DepthComparison::Depth depth =
          sum.depths.look(x, y, cells.across, cells.down, place.inverse_depth, [&](int u, int v) {
            const ViewCell& there = cells.at(u, v);
            const double sigma =
                std::sqrt(double{there.sigma * there.sigma + cell.sigma * cell.sigma});
            return std::pair(double{there.inverse_depth},
                             kAgreeSigmas * sigma + kAgreeFraction * place.inverse_depth);
          });
      if (depth != DepthComparison::Depth::Differs) {
        const ViewCell& there = cells.at(x, y);
        sum.gray_products += double{cell.gray} * double{there.gray};
        sum.gray_squares_from += double{cell.gray} * double{cell.gray};
        sum.gray_squares_to += double{there.gray} * double{there.gray};
      }
    }
  }
  return sum;
}

/// What features and surfaces have in common.
double overlapLogOdds(double seen_again, double seen_through) {
  constexpr double kUsual = 0.05;   // of right poses is seen through
  constexpr double kLeast = 0.005;  // less says nothing more
  return 7.07 * seen_again - 1.57 * std::log(std::max(seen_through, kLeast) / kUsual);
}

}  // namespace

std::size_t offPlane(const std::vector<FeatureMatch>& matches,
                     const std::vector<std::uint8_t>& is_inlier, Random& random) {
  std::vector<const FeatureMatch*> points;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (is_inlier[i] != 0) points.push_back(&matches[i]);
  }
  if (points.size() < 3) return 0;
  constexpr int kDraws = 50;
  constexpr double kSigmas = 3.0;
  const auto any = [&]() -> const Vector3& {
    return points[random.below(static_cast<std::uint32_t>(points.size()))]->before;
  };
  std::ptrdiff_t most = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vector3 first = any();
    const Vector3 along = any() - first;
    const Vector3 normal = along.cross(any() - first).normalized();
    if (!normal.allFinite() || normal.isZero()) continue;
    const auto on = std::count_if(points.begin(), points.end(), [&](const FeatureMatch* match) {
      const double distance = normal.dot(match->before - first);
      return distance * distance <= kSigmas * kSigmas * normal.dot(match->covariance * normal);
    });
    most = std::max(most, on);
  }
  return points.size() - static_cast<std::size_t>(most);
}

void weighCells(const LocalMap& map, const View& now, const Pose& T_now_map,
                PoseEvidence& evidence) {
  CellComparison forward, back;
  evidence.overlap = 0.0;
  for (const PlacedView& placed : map) {
    const Pose T = T_now_map * placed.T_map_view;
    const CellComparison there = compare(*placed.view, now, T);
    const CellComparison returned = compare(now, *placed.view, T.inverse());
    forward.add(there);
    back.add(returned);
    evidence.overlap = std::max(evidence.overlap, std::min(there.overlap(), returned.overlap()));
  }
  evidence.agreement = std::min(forward.depths.agreement(), back.depths.agreement());
  evidence.seen_through = std::max(forward.depths.seenThrough(), back.depths.seenThrough());
  evidence.correlation = std::min(forward.correlation(), back.correlation());
}

double featureLogOdds(std::size_t off_plane, double seen_again, double seen_through) {
  return -4.76 + 0.79 * std::min(3.0, std::log1p(static_cast<double>(off_plane))) +
         overlapLogOdds(seen_again, seen_through);
}

double logOdds(const PoseEvidence& evidence, bool by_features) {
  // Surfaces of any room agree in a few places.
  constexpr double kMinOverlap = 0.3;
  constexpr double kMinCorrelation = 0.3;
  // Three sigmas of images that have nothing in common: of 2,400 cells about a tenth are
  // independent of each other.
  constexpr double kChanceCorrelation = 0.2;
  if (evidence.correlation < (by_features ? kChanceCorrelation : kMinCorrelation)) return kNever;
  if (!by_features && evidence.overlap < kMinOverlap) return kNever;
  constexpr double kCorrelationWeight = 2.05;
  const double gray = kCorrelationWeight * evidence.correlation;
  constexpr double kBySurfaces = -2.0;   // where nothing else is known
  constexpr double kMostThrough = 0.15;  // more says nothing more: something large has moved
  const double seen_through = std::min(evidence.seen_through, kMostThrough);
  const double rest = by_features
                          ? featureLogOdds(evidence.off_plane, evidence.seenAgain(), seen_through)
                          : kBySurfaces + overlapLogOdds(evidence.seenAgain(), seen_through);
  return rest + gray;
}

}  // namespace planar_mapping::detail
