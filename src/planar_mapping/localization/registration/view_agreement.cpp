// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/view_agreement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/summed_area.h"

namespace planar_mapping {
namespace {

constexpr int kColumns = 160;  ///< cells, about

/// Means over squares of side 2 radius + 1, cut off at the border.
std::vector<float> boxMeans(const std::vector<float>& values, int width, int height, int radius) {
  const detail::SummedArea<double> sums(values, width, height, 0.0);
  std::vector<float> means(values.size());
  for (int r = 0; r < height; ++r) {
    const int top = std::max(r - radius, 0);
    const int bottom = std::min(r + radius + 1, height);
    for (int c = 0; c < width; ++c) {
      const int left = std::max(c - radius, 0);
      const int right = std::min(c + radius + 1, width);
      const double sum = sums.over(left, top, right, bottom);
      means[static_cast<std::size_t>(r) * width + c] =
          static_cast<float>(sum / ((right - left) * (bottom - top)));
    }
  }
  return means;
}

/// Gray values freed of mean and contrast around them; noise alone stays small.
std::vector<float> tonesOf(const std::vector<float>& gray, int width, int height) {
  constexpr int kRadius = 4;
  constexpr float kNoise = 4.0f;  // gray levels
  const std::vector<float> means = boxMeans(gray, width, height, kRadius);
  std::vector<float> squares(gray.size());
  for (std::size_t i = 0; i < gray.size(); ++i) squares[i] = gray[i] * gray[i];
  const std::vector<float> mean_squares = boxMeans(squares, width, height, kRadius);
  std::vector<float> tones(gray.size());
  for (std::size_t i = 0; i < gray.size(); ++i) {
    const float variance = std::max(0.0f, mean_squares[i] - means[i] * means[i]);
    tones[i] = (gray[i] - means[i]) / std::sqrt(variance + kNoise * kNoise);
  }
  return tones;
}

/// Extremes of the depths around each cell that has one.
void spreadDepths(ViewCells& view) {
  const int width = view.camera.width;
  const int height = view.camera.height;
  const std::vector<float> nearest = view.nearest;
  const std::vector<float> farthest = view.farthest;
  for (int r = 0; r < height; ++r) {
    for (int c = 0; c < width; ++c) {
      const std::size_t i = static_cast<std::size_t>(r) * width + c;
      if (!(nearest[i] > 0.0f)) continue;
      for (int y = std::max(r - 1, 0); y <= std::min(r + 1, height - 1); ++y) {
        for (int x = std::max(c - 1, 0); x <= std::min(c + 1, width - 1); ++x) {
          const std::size_t k = static_cast<std::size_t>(y) * width + x;
          if (!(nearest[k] > 0.0f)) continue;
          view.nearest[i] = std::min(view.nearest[i], nearest[k]);
          view.farthest[i] = std::max(view.farthest[i], farthest[k]);
        }
      }
    }
  }
}

/// \param max_turn  by noise, of one normal, radians
Matrix3 facingOf(const ViewCells& view, const FeatureCamera& noise, double max_turn) {
  constexpr int kMinStep = 2;  // cells
  const int width = view.camera.width;
  const int height = view.camera.height;
  const int max_step = std::max(kMinStep, std::min(width, height) / 3);
  Matrix3 sum = Matrix3::Zero();
  int count = 0;
  for (int r = 0; r < height; r += 2) {
    for (int c = 0; c < width; c += 2) {
      const Eigen::Vector3f& p = view.points[static_cast<std::size_t>(r) * width + c];
      if (p.z() <= 0.0f) continue;
      const double apart = M_SQRT2 * noise.depthError(p.z()) / max_turn;  // metres
      const int step = std::clamp(static_cast<int>(std::ceil(apart * view.camera.fx / p.z())),
                                  kMinStep, max_step);
      if (r + step >= height || c + step >= width) continue;
      const Eigen::Vector3f& right = view.points[static_cast<std::size_t>(r) * width + c + step];
      const Eigen::Vector3f& below = view.points[static_cast<std::size_t>(r + step) * width + c];
      if (right.z() <= 0.0f || below.z() <= 0.0f) continue;
      const Vector3 normal = (right - p).cross(below - p).cast<double>().normalized();
      if (!normal.allFinite()) continue;
      sum += normal * normal.transpose();
      ++count;
    }
  }
  return count > 0 ? Matrix3(sum / count) : Matrix3(Matrix3::Identity() / 3.0);
}

/// One way: the cells of \p from where \p to looked.
ViewAgreement oneWay(const ViewCells& from, const ViewCells& to, const Pose& T_to_from,
                     const FeatureCamera& noise, int step) {
  constexpr float kSigmas = 3.0f;
  constexpr float kSlack = 0.02f;          // metres,
  constexpr float kRelativeSlack = 0.01f;  // and of the depth: the motion is not exact either
  constexpr double kClearlyNearer = 0.75;  // of the depth of what agrees
  const Eigen::Matrix3f R = T_to_from.linear().cast<float>();
  const Eigen::Vector3f t = T_to_from.translation().cast<float>();
  const PinholeCamera& camera = to.camera;
  const auto fx = static_cast<float>(camera.fx);
  const auto fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx);
  const auto cy = static_cast<float>(camera.cy);
  const auto last_column = static_cast<float>(camera.width - 1);
  const auto last_row = static_cast<float>(camera.height - 1);
  const auto growth = static_cast<float>(noise.depth_error_growth);
  const auto constant = static_cast<float>(noise.depth_error);
  ViewAgreement result;
  double product = 0.0, squares_from = 0.0, squares_to = 0.0, misfit = 0.0;
  std::size_t in_the_middle = 0;
  double alike = 0.0, depth_alike = 0.0;
  std::vector<float> seen_through;  // depths
  for (int r = 0; r < from.camera.height; r += step) {
    for (int c = 0; c < from.camera.width; c += step) {
      const std::size_t i = static_cast<std::size_t>(r) * from.camera.width + c;
      const Eigen::Vector3f& p = from.points[i];
      if (!(p.z() > 0.0f)) continue;
      ++result.cells;
      const Eigen::Vector3f q = R * p + t;
      if (!(q.z() > 0.1f)) continue;
      const float x = fx * q.x() / q.z() + cx;
      const float y = fy * q.y() / q.z() + cy;
      if (!(x >= 0.0f && y >= 0.0f && x < last_column && y < last_row)) continue;
      const auto left = static_cast<std::size_t>(x);
      const auto top = static_cast<std::size_t>(y);
      const std::size_t k =
          static_cast<std::size_t>(y + 0.5f) * camera.width + static_cast<std::size_t>(x + 0.5f);
      if (!(to.nearest[k] > 0.0f)) continue;
      ++result.compared;
      const float z = q.z();
      const float sigma = 1.5f * (constant + growth * std::max(z, p.z()) * std::max(z, p.z()));
      const float tolerance = kSlack + kRelativeSlack * z + kSigmas * sigma;
      const float measured = to.points[k].z();
      if (measured > 0.0f) {
        misfit += std::min(1.0f, std::abs(z - measured) / tolerance);
        ++in_the_middle;
      }
      if (z < to.nearest[k] - tolerance) {
        ++result.through;
        seen_through.push_back(z);
      } else if (z <= to.farthest[k] + tolerance) {
        ++result.agreeing;
        const float a = x - static_cast<float>(left);
        const float b = y - static_cast<float>(top);
        const float* tone = to.tones.data() + top * camera.width + left;
        const float seen = (1.0f - b) * ((1.0f - a) * tone[0] + a * tone[1]) +
                           b * ((1.0f - a) * tone[camera.width] + a * tone[camera.width + 1]);
        product += from.tones[i] * seen;
        const float weight = std::max(0.0f, from.tones[i] * seen);
        alike += weight;
        depth_alike += weight * z;
        squares_from += from.tones[i] * from.tones[i];
        squares_to += seen * seen;
      }
    }
  }
  const double scale = std::sqrt(squares_from * squares_to);
  if (scale > 0.0) result.correlation = product / scale;
  if (alike > 0.0) {
    const double nearer = kClearlyNearer * depth_alike / alike;
    result.behind = static_cast<std::size_t>(std::count_if(seen_through.begin(), seen_through.end(),
                                                           [&](float z) { return z > nearer; }));
  }
  if (in_the_middle > 0) result.misfit = misfit / static_cast<double>(in_the_middle);
  if (result.agreeing > 0) result.texture = scale / static_cast<double>(result.agreeing);
  return result;
}

}  // namespace

ViewCells viewCellsOf(const std::uint8_t* gray, const PointsView& cloud,
                      const PinholeCamera& camera, const FeatureCamera& noise) {
  if (static_cast<int>(cloud.width) != camera.width ||
      static_cast<int>(cloud.height) != camera.height) {
    throw InputError("the cloud of a view has another size than its camera");
  }
  constexpr double kMaxTurn = 0.3;  // radians: squared, well below what openAxes() calls open
  const int side = std::max(1, camera.width / kColumns);
  ViewCells view;
  view.camera = camera;
  view.camera.width = camera.width / side;
  view.camera.height = camera.height / side;
  view.camera.fx /= side;
  view.camera.fy /= side;
  view.camera.cx = (camera.cx + 0.5) / side - 0.5;
  view.camera.cy = (camera.cy + 0.5) / side - 0.5;
  const std::size_t count = static_cast<std::size_t>(view.camera.width) * view.camera.height;
  view.points.assign(count, Eigen::Vector3f::Zero());
  view.nearest.assign(count, 0.0f);
  view.farthest.assign(count, 0.0f);
  std::vector<float> means(count, 0.0f);
  for (int r = 0; r < view.camera.height; ++r) {
    for (int c = 0; c < view.camera.width; ++c) {
      const std::size_t i = static_cast<std::size_t>(r) * view.camera.width + c;
      float sum = 0.0f;
      for (int y = r * side; y < (r + 1) * side; ++y) {
        for (int x = c * side; x < (c + 1) * side; ++x) {
          const std::size_t pixel = static_cast<std::size_t>(y) * camera.width + x;
          if (gray != nullptr) sum += gray[pixel];
          const float depth = cloud[pixel][2];
          if (!(std::isfinite(depth) && depth > 0.0f)) continue;
          view.farthest[i] = std::max(view.farthest[i], depth);
          view.nearest[i] = view.nearest[i] > 0.0f ? std::min(view.nearest[i], depth) : depth;
        }
      }
      means[i] = sum / static_cast<float>(side * side);
      const float* middle =
          cloud[static_cast<std::size_t>(r * side + side / 2) * camera.width + c * side + side / 2];
      if (std::isfinite(middle[2]) && middle[2] > 0.0f) {
        view.points[i] = Eigen::Vector3f(middle[0], middle[1], middle[2]);
      }
    }
  }
  spreadDepths(view);
  view.tones = tonesOf(means, view.camera.width, view.camera.height);
  view.facing = facingOf(view, noise, kMaxTurn);
  view.facing_nearby = facingOf(view, noise, INFINITY);
  return view;
}

ViewAgreement agreementOf(const ViewCells& now, const ViewCells& before, const Pose& T_before_now,
                          const FeatureCamera& noise, int step) {
  const ViewAgreement there = oneWay(now, before, T_before_now, noise, step);
  const ViewAgreement back = oneWay(before, now, T_before_now.inverse(), noise, step);
  ViewAgreement worse =
      there.fraction(there.agreeing) < back.fraction(back.agreeing) ? there : back;
  const auto larger = [&](std::size_t ViewAgreement::*count) {
    const double fraction = std::max(there.fraction(there.*count), back.fraction(back.*count));
    return static_cast<std::size_t>(fraction * static_cast<double>(worse.compared));
  };
  worse.through = larger(&ViewAgreement::through);
  worse.behind = larger(&ViewAgreement::behind);
  worse.misfit = std::max(there.misfit, back.misfit);
  worse.correlation = std::min(there.correlation, back.correlation);
  worse.texture = std::min(there.texture, back.texture);
  return worse;
}

std::vector<Vector3> openAxes(const Matrix3& facing) {
  constexpr double kOpen = 0.15;  // of the normals
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(facing);
  if (axes.eigenvalues()[1] < kOpen) {
    // One wall is all there is: along its rows and columns, as things repeat that way.
    const Vector3 normal = axes.eigenvectors().col(2);
    const Vector3 across = (Vector3::UnitX() - normal * normal.x()).normalized();
    return {across, normal.cross(across)};
  }
  if (axes.eigenvalues()[0] < kOpen) return {axes.eigenvectors().col(0)};
  return {};
}

double shiftOfACell(const ViewCells& view) {
  double depth = 0.0;
  int count = 0;
  for (const Eigen::Vector3f& p : view.points) {
    depth += p.z();
    count += p.z() > 0.0f ? 1 : 0;
  }
  return count == 0 ? 1.0 : depth / count / view.camera.fx;
}

}  // namespace planar_mapping
