// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/detail/cell_probability.h"

#include <algorithm>
#include <string>

#include "grid/labelled_cells.h"
#include "planar_mapping/core/base/error.h"
#include "base/point_indices.h"
#include "grid/spread_outwards.h"

namespace planar_mapping {
namespace {

/// Means of the cells with features; -1 = none yet.
class CellMeans {
 public:
  explicit CellMeans(std::size_t cells) : sum_(cells, 0.0), count_(cells, 0) {}
  void add(std::size_t cell, double probability) {
    sum_[cell] += probability;
    ++count_[cell];
  }
  std::vector<double> values() const {
    std::vector<double> means(sum_.size(), -1.0);
    for (std::size_t i = 0; i < means.size(); ++i) {
      if (count_[i] > 0) means[i] = std::clamp(sum_[i] / count_[i], 0.0, 1.0);
    }
    return means;
  }

 private:
  std::vector<double> sum_;
  std::vector<std::int32_t> count_;
};

}  // namespace

std::vector<float> cellProbabilities(const CellMask& mask, const std::vector<CellFeature>& features,
                                     double dense_support) {
  requireInRange("dense_support", dense_support, 0.0, 1.0);
  if (mask.width < 0 || mask.height < 0 ||
      mask.cells.size() != static_cast<std::size_t>(mask.width) * mask.height) {
    throw InputError("mask: " + std::to_string(mask.cells.size()) + " cells for " +
                     std::to_string(mask.width) + " x " + std::to_string(mask.height));
  }
  CellMeans means(mask.cells.size());
  for (const CellFeature& feature : features) {
    requireInRange("probability", feature.probability, 0.0, 1.0);
    const std::int64_t a = std::int64_t(feature.a) - mask.a0;
    const std::int64_t b = std::int64_t(feature.b) - mask.b0;
    if (a < 0 || b < 0 || a >= mask.width || b >= mask.height) continue;
    const std::size_t cell = static_cast<std::size_t>(b) * mask.width + a;
    if (mask.cells[cell]) means.add(cell, feature.probability);
  }
  std::vector<double> values = means.values();
  detail::spreadOutwards(values, [&](std::size_t cell, const auto& visit) {
    const auto a = static_cast<std::int32_t>(cell % mask.width);
    const auto b = static_cast<std::int32_t>(cell / mask.width);
    for (std::int32_t db = -1; db <= 1; ++db) {
      for (std::int32_t da = -1; da <= 1; ++da) {
        if ((da != 0 || db != 0) && mask.at(a + da, b + db)) {
          visit(static_cast<std::size_t>(b + db) * mask.width + (a + da));
        }
      }
    }
  });
  std::vector<float> result(values.size(), 0.0f);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (mask.cells[i]) result[i] = static_cast<float>(values[i] < 0.0 ? dense_support : values[i]);
  }
  return result;
}

double denseSupportProbability(const PointsView& points, const Indices* indices, double resolution,
                               const OccupancyParams& params, const Vector3& sensor) {
  const std::vector<std::int32_t> groups = gridGroups(points, indices, nullptr, resolution);
  const std::vector<float> beliefs = featureProbabilities(points, indices, groups, params, sensor);
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < beliefs.size(); ++k) {
    if (!points.isFinite(detail::at(indices, k))) continue;
    sum += beliefs[k];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

std::vector<float> spreadToPoints(const PointsView& points, const Indices* indices,
                                  const std::vector<std::int32_t>* labels, double resolution,
                                  const std::vector<float>& features) {
  detail::LabelledCells cells;
  const std::vector<std::int32_t> cell_of =
      detail::numberCells(points, indices, labels, resolution, cells);
  if (features.size() != cell_of.size()) {
    throw InputError("features: " + std::to_string(features.size()) + " beliefs for " +
                     std::to_string(cell_of.size()) + " points");
  }
  CellMeans means(cells.cells().size());
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (features[k] < 0.0f) continue;
    requireInRange("features", features[k], 0.0, 1.0);
    if (cell_of[k] >= 0) means.add(static_cast<std::size_t>(cell_of[k]), features[k]);
  }
  std::vector<double> values = means.values();
  detail::spreadOutwards(values, [&](std::size_t cell, const auto& visit) {
    const detail::LabelledCell center = cells.cells()[cell];
    for (int step = 0; step < 27; ++step) {
      if (step == 13) continue;
      const detail::LabelledCell beside{center.label, center.x + step % 3 - 1,
                                        center.y + step / 3 % 3 - 1, center.z + step / 9 - 1};
      const std::int32_t other = cells.find(beside);
      if (other >= 0) visit(static_cast<std::size_t>(other));
    }
  });
  std::vector<float> result(features.size(), 0.0f);
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (!points.isFinite(detail::at(indices, k))) continue;
    if (features[k] >= 0.0f) {
      result[k] = features[k];
    } else {
      result[k] = cell_of[k] < 0 ? -1.0f : static_cast<float>(values[cell_of[k]]);
    }
  }
  return result;
}

}  // namespace planar_mapping
