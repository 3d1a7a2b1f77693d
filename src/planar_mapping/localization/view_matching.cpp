// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/view_matching.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

constexpr float kRatio = 0.85F;         // of distances, best over second best
constexpr double kGuidedRadius = 8.0;   // pixels around where a feature is expected
constexpr float kGuidedCosine = 0.75F;  // of descriptors that may be of one place
constexpr double kSizeRatio = 1.5;      // SIFT describes a place alike up to this
constexpr double kHiddenSigmas = 3.0;
constexpr double kHiddenFraction = 0.05;  // of the depth: pose and slope within a cell

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Eigen::Map<const Rows> rowsOf(const cv::Mat& descriptors) {
  return {descriptors.ptr<float>(), descriptors.rows, descriptors.cols};
}

struct Nearest {
  Eigen::Index best = -1;
  float most = -1.0F;
  float second = -1.0F;

  void offer(Eigen::Index i, float cosine) {
    if (cosine > most) {
      second = most;
      most = cosine;
      best = i;
    } else if (cosine > second) {
      second = cosine;
    }
  }
  bool isDistinct() const { return 2.0F - 2.0F * most < kRatio * kRatio * (2.0F - 2.0F * second); }
};

void addMutual(std::size_t number, const View& before, const View& now,
               std::vector<FeaturePair>& pairs) {
  if (before.features.empty() || now.features.empty()) return;
  const Rows cosines = rowsOf(before.descriptors) * rowsOf(now.descriptors).transpose();
  std::vector<Nearest> rows(before.features.size());
  std::vector<Nearest> columns(now.features.size());
  for (Eigen::Index i = 0; i < cosines.rows(); ++i) {
    for (Eigen::Index j = 0; j < cosines.cols(); ++j) {
      rows[static_cast<std::size_t>(i)].offer(j, cosines(i, j));
      columns[static_cast<std::size_t>(j)].offer(i, cosines(i, j));
    }
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Nearest& nearest = rows[i];
    if (nearest.best < 0 || !nearest.isDistinct()) continue;
    const auto j = static_cast<std::size_t>(nearest.best);
    if (columns[j].best != static_cast<Eigen::Index>(i)) continue;
    if (before.features[i].hasDepth() && now.features[j].hasDepth())
      pairs.push_back({number, i, j});
  }
}

/// Features of a view by their places.
class FeatureGrid {
 public:
  explicit FeatureGrid(const View& view)
      : view_(view), across_(static_cast<int>(view.width / kGuidedRadius) + 1) {
    const int down = static_cast<int>(view.height / kGuidedRadius) + 1;
    cells_.resize(static_cast<std::size_t>(across_ * down));
    for (std::size_t i = 0; i < view.features.size(); ++i) {
      const FeatureSighting& seen = view.features[i].seen;
      cells_[cellOf(static_cast<int>(seen.column / kGuidedRadius),
                    static_cast<int>(seen.row / kGuidedRadius))]
          .push_back(i);
    }
  }

  template <typename Call>
  void near(const FeatureSighting& place, const Call& call) const {
    const int x = static_cast<int>(place.column / kGuidedRadius);
    const int y = static_cast<int>(place.row / kGuidedRadius);
    const int down = static_cast<int>(cells_.size()) / across_;
    for (int v = std::max(0, y - 1); v <= std::min(down - 1, y + 1); ++v) {
      for (int u = std::max(0, x - 1); u <= std::min(across_ - 1, x + 1); ++u) {
        for (const std::size_t i : cells_[cellOf(u, v)]) {
          const FeatureSighting& seen = view_.features[i].seen;
          if (std::hypot(seen.column - place.column, seen.row - place.row) <= kGuidedRadius)
            call(i);
        }
      }
    }
  }

 private:
  std::size_t cellOf(int column, int row) const {
    return static_cast<std::size_t>(row * across_ + column);
  }

  const View& view_;
  int across_;
  std::vector<std::vector<std::size_t>> cells_;
};

/// Whether the view measures something nearer at a place.
bool isHidden(const View& view, const FeatureSighting& place) {
  const ViewCells& cells = view.coarse;
  const int x =
      std::clamp(static_cast<int>(std::lround(cells.placeOf(place.column))), 0, cells.across - 1);
  const int y =
      std::clamp(static_cast<int>(std::lround(cells.placeOf(place.row))), 0, cells.down - 1);
  const ViewCell& cell = cells.at(x, y);
  if (!cell.hasDepth()) return false;
  return std::abs(double{cell.inverse_depth} - place.inverse_depth) >
         kHiddenSigmas * double{cell.sigma} + kHiddenFraction * place.inverse_depth;
}

}  // namespace

bool isExpected(const View& before, const ViewFeature& feature, const View& now,
                const Pose& T_now_view, FeatureSighting& place) {
  if (!feature.hasDepth()) return false;
  const Vector3 point = T_now_view * backProject(before.camera, feature.seen);
  if (point.z() <= 0.0) return false;
  place = project(now.camera, point);
  if (!now.contains(place) || isHidden(now, place)) return false;
  const double scale = place.inverse_depth / feature.seen.inverse_depth;
  return scale < kSizeRatio && scale > 1.0 / kSizeRatio;
}

std::vector<FeaturePair> matchFeatures(const LocalMap& map, const View& now) {
  std::vector<FeaturePair> pairs;
  for (std::size_t k = 0; k < map.size(); ++k) addMutual(k, *map[k].view, now, pairs);
  return pairs;
}

GuidedPairs guidedPairs(const LocalMap& map, const View& now, const Pose& T_now_map) {
  GuidedPairs guided;
  const FeatureGrid grid(now);
  for (std::size_t k = 0; k < map.size(); ++k) {
    const View& before = *map[k].view;
    const Pose T_now_view = T_now_map * map[k].T_map_view;
    for (std::size_t i = 0; i < before.features.size(); ++i) {
      const ViewFeature& feature = before.features[i];
      FeatureSighting place;
      if (!isExpected(before, feature, now, T_now_view, place)) continue;
      guided.expected.push_back({k, i, 0});
      const auto row = rowsOf(before.descriptors).row(static_cast<Eigen::Index>(i));
      float most = kGuidedCosine;
      std::size_t best = now.features.size();
      grid.near(place, [&](std::size_t j) {
        const float cosine = row.dot(rowsOf(now.descriptors).row(static_cast<Eigen::Index>(j)));
        if (cosine <= most || !now.features[j].hasDepth()) return;
        most = cosine;
        best = j;
      });
      if (best < now.features.size()) guided.pairs.push_back({k, i, best});
    }
  }
  return guided;
}

FeatureMatch mapSide(const PlacedView& placed, const ViewFeature& feature) {
  const Matrix3 R = placed.T_map_view.linear();
  FeatureMatch match;
  match.before = placed.T_map_view * backProject(placed.view->camera, feature.seen);
  match.covariance =
      R * positionCovariance(placed.view->camera, feature.seen, feature.variance) * R.transpose();
  return match;
}

std::vector<FeatureMatch> featureMatches(const LocalMap& map, const View& now,
                                         const std::vector<FeaturePair>& pairs) {
  std::vector<FeatureMatch> matches;
  matches.reserve(pairs.size());
  for (const FeaturePair& pair : pairs) {
    const PlacedView& placed = map[pair.view];
    const ViewFeature& seen = now.features[pair.now];
    FeatureMatch match = mapSide(placed, placed.view->features[pair.before]);
    match.now = seen.seen;
    match.now_variance = seen.variance;
    matches.push_back(match);
  }
  return matches;
}

}  // namespace planar_mapping::detail
