// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/stereo_sensor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

/// Random numbers of unit variance that change smoothly over the image.
class SmoothField {
 public:
  SmoothField(int width, int height, double cell, Random& random) : cell_(cell) {
    columns_ = static_cast<std::size_t>(width / cell) + 2;
    const std::size_t rows = static_cast<std::size_t>(height / cell) + 2;
    knots_.resize(columns_ * rows);
    for (double& knot : knots_) knot = random.normal();
  }
  double at(int column, int row) const {
    const double u = column / cell_;
    const double v = row / cell_;
    const auto iu = static_cast<std::size_t>(u);
    const auto iv = static_cast<std::size_t>(v);
    const double au = u - static_cast<double>(iu);
    const double av = v - static_cast<double>(iv);
    const double* knot = knots_.data() + iv * columns_ + iu;
    const double w[4] = {(1 - au) * (1 - av), au * (1 - av), (1 - au) * av, au * av};
    const double sum =
        w[0] * knot[0] + w[1] * knot[1] + w[2] * knot[columns_] + w[3] * knot[columns_ + 1];
    // Between knots the mean of four has less variance than a knot has.
    return sum / std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2] + w[3] * w[3]);
  }

 private:
  double cell_;
  std::size_t columns_;
  std::vector<double> knots_;
};

/// Exact disparities; 0 where there is no surface, or one too far or too oblique to match.
std::vector<float> trueDisparity(const Rendering& view, const StereoSensorParams& params) {
  std::vector<float> disparity(view.size(), 0.0f);
  for (std::size_t i = 0; i < view.size(); ++i) {
    if (view.object[i] < 0 || view.incidence[i] < params.smallest_incidence) continue;
    const double d = params.baseline * view.camera.fx / view.depth[i];
    if (d >= params.smallest_disparity_px) disparity[i] = static_cast<float>(d);
  }
  return disparity;
}

/// Takes away what the right camera does not see: hidden behind something nearer in the same row,
/// or outside its image.
void removeHidden(std::vector<float>& disparity, int width, int height, double edge_px) {
  std::vector<float> nearest(static_cast<std::size_t>(width));
  for (int row = 0; row < height; ++row) {
    float* line =
        disparity.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
    std::fill(nearest.begin(), nearest.end(), 0.0f);
    const auto column_right = [line](int column) {
      return static_cast<int>(std::lround(static_cast<double>(column) - line[column]));
    };
    for (int column = 0; column < width; ++column) {
      const int right = column_right(column);
      if (line[column] > 0.0f && right >= 0)
        nearest[static_cast<std::size_t>(right)] =
            std::max(nearest[static_cast<std::size_t>(right)], line[column]);
    }
    for (int column = 0; column < width; ++column) {
      if (line[column] <= 0.0f) continue;
      const int right = column_right(column);
      if (right < 0 || nearest[static_cast<std::size_t>(right)] > line[column] + edge_px)
        line[column] = 0.0f;
    }
  }
}

/// Exact disparities of what the sensor can match, 0 elsewhere.
std::vector<float> matchableDisparity(const Rendering& view, const StereoSensorParams& params) {
  const bool ideal = params.edge_px == std::numeric_limits<double>::max();
  std::vector<float> disparity = trueDisparity(view, params);
  if (!ideal) removeHidden(disparity, view.camera.width, view.camera.height, params.edge_px);
  return disparity;
}

/// Lowest and highest disparity among the pixels around one; those without count as none.
std::pair<float, float> rangeAround(const std::vector<float>& disparity, int width, int height,
                                    int column, int row) {
  float low = std::numeric_limits<float>::max();
  float high = 0.0f;
  for (int r = std::max(0, row - 1); r <= std::min(height - 1, row + 1); ++r)
    for (int c = std::max(0, column - 1); c <= std::min(width - 1, column + 1); ++c) {
      const float d = disparity[static_cast<std::size_t>(r) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(c)];
      if (d <= 0.0f) continue;
      low = std::min(low, d);
      high = std::max(high, d);
    }
  return {low, high};
}

/// Squares of the image that are matched with another place of their row, each at one disparity
/// anywhere between the smallest and the largest there is.
void mismatch(std::vector<float>& measured, int width, const StereoSensorParams& params,
              Random& random) {
  const float largest = *std::max_element(measured.begin(), measured.end());
  const auto low = static_cast<float>(params.smallest_disparity_px);
  if (largest <= low) return;
  const auto side = static_cast<std::size_t>(params.wrong_patch_px);
  const auto columns = static_cast<std::size_t>(width);
  const std::size_t rows = measured.size() / columns;
  for (std::size_t top = 0; top < rows; top += side)
    for (std::size_t left = 0; left < columns; left += side) {
      const bool wrong = random.uniform() < params.wrong_fraction;
      const auto d = static_cast<float>(random.uniform(low, largest));
      if (!wrong) continue;
      for (std::size_t row = top; row < std::min(top + side, rows); ++row)
        for (std::size_t column = left; column < std::min(left + side, columns); ++column) {
          float& value = measured[row * columns + column];
          if (value > 0.0f) value = d;
        }
    }
}

}  // namespace

void StereoSensorParams::validate() const {
  constexpr double kMost = std::numeric_limits<double>::max();
  requirePositive("baseline", baseline, "m");
  requireInRange("noise_px", noise_px, 0.0, 100.0, "px");
  requireInRange("correlated_fraction", correlated_fraction, 0.0, 1.0);
  requireInRange("correlation_px", correlation_px, 1.0, 1000.0, "px");
  requireInRange("disparity_step_px", disparity_step_px, 0.0, 100.0, "px");
  requirePositive("smallest_disparity_px", smallest_disparity_px, "px");
  requireInRange("edge_px", edge_px, 1e-6, kMost, "px");
  requireInRange("flying_fraction", flying_fraction, 0.0, 1.0);
  requireInRange("edge_hole_fraction", edge_hole_fraction, 0.0, 1.0 - flying_fraction);
  requireInRange("hole_fraction", hole_fraction, 0.0, 1.0);
  requireInRange("smallest_incidence", smallest_incidence, 0.0, 1.0);
  requireInRange("wrong_fraction", wrong_fraction, 0.0, 1.0);
  requireInRange("wrong_patch_px", wrong_patch_px, 1, 1000, "px");
}

StereoSensorParams StereoSensorParams::perfect() {
  StereoSensorParams params;
  params.noise_px = 0.0;
  params.disparity_step_px = 0.0;
  params.smallest_disparity_px = 1e-6;
  params.edge_px = std::numeric_limits<double>::max();
  params.flying_fraction = 0.0;
  params.edge_hole_fraction = 0.0;
  params.hole_fraction = 0.0;
  params.smallest_incidence = 0.0;
  return params;
}

std::vector<float> measureDisparity(const Rendering& rendering, const StereoSensorParams& params,
                                    Random& random) {
  params.validate();
  const int width = rendering.camera.width;
  const int height = rendering.camera.height;
  const std::vector<float> exact = matchableDisparity(rendering, params);
  const SmoothField shared(width, height, params.correlation_px, random);
  const double common_part = params.noise_px * std::sqrt(params.correlated_fraction);
  const double own_part = params.noise_px * std::sqrt(1.0 - params.correlated_fraction);
  std::vector<float> measured(exact.size(), 0.0f);
  std::size_t i = 0;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column, ++i) {
      // Drawn for every pixel alike: a hole here must not change the noise over there.
      const double draw = random.uniform();
      const double blend = random.uniform();
      const double own = own_part > 0.0 ? random.normal() : 0.0;
      if (exact[i] <= 0.0f || rendering.texture[i] < params.hole_fraction) continue;
      double d = exact[i];
      const auto [low, high] = rangeAround(exact, width, height, column, row);
      if (high - low > params.edge_px) {
        if (draw < params.edge_hole_fraction) continue;
        if (draw < params.edge_hole_fraction + params.flying_fraction)
          d = low + blend * (high - low);
      }
      d += common_part * shared.at(column, row) + own_part * own;
      if (params.disparity_step_px > 0.0)
        d = params.disparity_step_px * std::round(d / params.disparity_step_px);
      if (d >= params.smallest_disparity_px) measured[i] = static_cast<float>(d);
    }
  if (params.wrong_fraction > 0.0) mismatch(measured, width, params, random);
  return measured;
}

Rendering matchablePart(Rendering view, const StereoSensorParams& params) {
  params.validate();
  const std::vector<float> disparity = matchableDisparity(view, params);
  for (std::size_t i = 0; i < disparity.size(); ++i) {
    if (disparity[i] <= 0.0f) view.object[i] = -1;
  }
  return view;
}

std::vector<float> pointsOf(const std::vector<float>& disparity, const PinholeCamera& camera,
                            double baseline) {
  std::vector<float> xyz(3 * disparity.size(), std::numeric_limits<float>::quiet_NaN());
  std::size_t i = 0;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column, ++i) {
      if (disparity[i] <= 0.0f) continue;
      const double z = baseline * camera.fx / disparity[i];
      const Vector3 point = z * camera.rayOf(column, row);
      for (std::size_t k = 0; k < 3; ++k)
        xyz[3 * i + k] = static_cast<float>(point[static_cast<int>(k)]);
    }
  return xyz;
}

}  // namespace planar_mapping::evaluation
