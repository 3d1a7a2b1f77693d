// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/stereo_features.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

#include "planar_mapping/base/parallel.h"

namespace planar_mapping::detail {

std::optional<Vector3> pointAt(const PointsView& cloud, float column, float row) {
  constexpr double kSameSurface = 0.02;  // of the depth
  const int left = static_cast<int>(std::floor(column));
  const int top = static_cast<int>(std::floor(row));
  const auto inside = [&](int c, int r) {
    return c >= 0 && r >= 0 && c < static_cast<int>(cloud.width) &&
           r < static_cast<int>(cloud.height);
  };
  const auto indexOf = [&](int c, int r) {
    return static_cast<std::size_t>(r) * cloud.width + static_cast<std::size_t>(c);
  };
  bool all = true;
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0.0;
  for (int k = 0; k < 4; ++k) {
    const int c = left + k % 2;
    const int r = top + k / 2;
    if (!inside(c, r) || !cloud.isMeasured(indexOf(c, r))) {
      all = false;
      break;
    }
    const double depth = cloud.point(indexOf(c, r)).z();
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  if (all && farthest - nearest <= kSameSurface * nearest) {
    const double fx = double{column} - left;
    const double fy = double{row} - top;
    const auto point = [&](int c, int r) { return cloud.point(indexOf(left + c, top + r)); };
    return Vector3((1.0 - fy) * ((1.0 - fx) * point(0, 0) + fx * point(1, 0)) +
                   fy * ((1.0 - fx) * point(0, 1) + fx * point(1, 1)));
  }
  std::optional<Vector3> front;
  const int center_column = static_cast<int>(std::lround(column));
  const int center_row = static_cast<int>(std::lround(row));
  for (int r = center_row - 1; r <= center_row + 1; ++r) {
    for (int c = center_column - 1; c <= center_column + 1; ++c) {
      if (!inside(c, r) || !cloud.isMeasured(indexOf(c, r))) continue;
      const Vector3 point = cloud.point(indexOf(c, r));
      if (!front || point.z() < front->z()) front = point;
    }
  }
  return front;
}

namespace {

constexpr float kMinGradient = 2.0f;  // gray levels a pixel, root mean square of the window

/// Bilinear samples of a square about `center`. \return false at the border
bool sample(const cv::Mat& image, cv::Point2f center, int side, float* out) {
  const float half = 0.5f * static_cast<float>(side - 1);
  const float left = center.x - half;
  const float top = center.y - half;
  // Written so that NaN is outside.
  if (!(left >= 0.0f && top >= 0.0f &&
        left + static_cast<float>(side) < static_cast<float>(image.cols) &&
        top + static_cast<float>(side) < static_cast<float>(image.rows)))
    return false;
  const int column = static_cast<int>(left);
  const int row = static_cast<int>(top);
  const float fx = left - static_cast<float>(column);
  const float fy = top - static_cast<float>(row);
  const float w00 = (1.0f - fx) * (1.0f - fy);
  const float w01 = fx * (1.0f - fy);
  const float w10 = (1.0f - fx) * fy;
  const float w11 = fx * fy;
  for (int y = 0; y < side; ++y) {
    const std::uint8_t* a = image.ptr(row + y) + column;
    const std::uint8_t* b = image.ptr(row + y + 1) + column;
    for (int x = 0; x < side; ++x) {
      out[x] = w00 * static_cast<float>(a[x]) + w01 * static_cast<float>(a[x + 1]) +
               w10 * static_cast<float>(b[x]) + w11 * static_cast<float>(b[x + 1]);
    }
    out += side;
  }
  return true;
}

/// Frees values of their mean. \return root of the sum of their squares
float center(std::vector<float>& values) {
  float sum = 0.0f;
  for (const float value : values) sum += value;
  const float mean = sum / static_cast<float>(values.size());
  float squares = 0.0f;
  for (float& value : values) {
    value -= mean;
    squares += value * value;
  }
  return std::sqrt(squares);
}

}  // namespace

Patch::Patch(const cv::Mat& image, cv::Point2f center_of_patch, int window) : window_(window) {
  const int side = window + 2;
  const auto size = static_cast<std::size_t>(window) * static_cast<std::size_t>(window);
  std::vector<float> wide(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  if (!sample(image, center_of_patch, side, wide.data())) return;
  values_.resize(size);
  gradient_x_.resize(size);
  gradient_y_.resize(size);
  sampled_.resize(size);
  std::size_t i = 0;
  for (int y = 1; y <= window; ++y) {
    for (int x = 1; x <= window; ++x, ++i) {
      const float* at = wide.data() + y * side + x;
      values_[i] = *at;
      gradient_x_[i] = 0.5f * (at[1] - at[-1]);
      gradient_y_[i] = 0.5f * (at[side] - at[-side]);
    }
  }
  deviation_ = center(values_);
  center(gradient_x_);  // a change of brightness must not look like a shift
  center(gradient_y_);
  for (i = 0; i < size; ++i) {
    xx_ += gradient_x_[i] * gradient_x_[i];
    xy_ += gradient_x_[i] * gradient_y_[i];
    yy_ += gradient_y_[i] * gradient_y_[i];
  }
  usable_ = xx_ > kMinGradient * kMinGradient * static_cast<float>(size);
}

std::optional<cv::Point2f> Patch::findAlongRow(const cv::Mat& image, cv::Point2f start, float reach,
                                               float max_residual) const {
  return search(image, start, reach, max_residual, true);
}

std::optional<cv::Point2f> Patch::find(const cv::Mat& image, cv::Point2f start, float reach,
                                       float max_residual) const {
  const float trace = xx_ + yy_;
  const float determinant = xx_ * yy_ - xy_ * xy_;
  constexpr float kFlattest = 0.02f;  // smaller over larger eigenvalue: an edge slides along itself
  if (!(determinant > kFlattest * trace * trace)) return std::nullopt;
  return search(image, start, reach, max_residual, false);
}

std::optional<cv::Point2f> Patch::search(const cv::Mat& image, cv::Point2f start, float reach,
                                         float max_residual, bool along_row) const {
  constexpr int kSteps = 12;
  constexpr float kStill = 0.005f;  // pixels
  if (!usable_) return std::nullopt;
  cv::Point2f place = start;
  float residual = 0.0f;
  for (int step = 0; step < kSteps; ++step) {
    if (!sample(image, place, window_, sampled_.data())) return std::nullopt;
    const float deviation = center(sampled_);
    if (!(deviation > 0.0f)) return std::nullopt;
    const float gain = deviation_ / deviation;
    float bx = 0.0f;
    float by = 0.0f;
    residual = 0.0f;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const float difference = gain * sampled_[i] - values_[i];
      bx += gradient_x_[i] * difference;
      by += gradient_y_[i] * difference;
      residual += difference * difference;
    }
    cv::Point2f shift(0.0f, 0.0f);
    if (along_row) {
      shift.x = bx / xx_;
    } else {
      const float determinant = xx_ * yy_ - xy_ * xy_;
      shift.x = (yy_ * bx - xy_ * by) / determinant;
      shift.y = (xx_ * by - xy_ * bx) / determinant;
    }
    place -= shift;
    const cv::Point2f moved = place - start;
    if (!(moved.x * moved.x + moved.y * moved.y <= reach * reach)) return std::nullopt;
    if (shift.x * shift.x + shift.y * shift.y < kStill * kStill) break;
  }
  if (std::sqrt(residual) > max_residual * deviation_) return std::nullopt;
  return place;
}

namespace {

constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

}  // namespace

std::vector<int> matchAlongRows(const DetectedFeatures& left, const DetectedFeatures& right,
                                const RowSearch& search) {
  // The same place is often detected at several scales: no rival of itself.
  constexpr float kSamePlace = 2.0f;
  constexpr float kSameRows = 4.0f;  // what the usual tolerance leaves between two of them
  std::vector<std::size_t> by_row(right.size());
  std::iota(by_row.begin(), by_row.end(), std::size_t{0});
  std::stable_sort(by_row.begin(), by_row.end(), [&](std::size_t a, std::size_t b) {
    return right.places[a].row < right.places[b].row;
  });
  const auto tolerance = static_cast<float>(search.epipolar_tolerance);
  struct Owner {
    int left = -1;
    std::int32_t distance = kFar;
  };
  std::vector<Owner> owners(right.size());
  std::vector<int> matches(left.size(), -1);
  std::vector<std::pair<std::int32_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const Detection& place = left.places[i];
    const auto first =
        std::lower_bound(by_row.begin(), by_row.end(), place.row - tolerance,
                         [&](std::size_t j, float row) { return right.places[j].row < row; });
    candidates.clear();
    for (auto it = first; it != by_row.end(); ++it) {
      const Detection& other = right.places[*it];
      if (other.row > place.row + tolerance) break;
      const double disparity = double{place.column} - double{other.column};
      if (disparity < search.low || disparity > search.high) continue;
      const std::int32_t distance = left.descriptors.distance(i, right.descriptors, *it);
      candidates.emplace_back(distance, *it);
      Owner& owner = owners[*it];
      if (distance < owner.distance) owner = {static_cast<int>(i), distance};
    }
    if (candidates.empty()) continue;
    const auto best = *std::min_element(candidates.begin(), candidates.end());
    std::int32_t rival = kFar;
    for (const auto& candidate : candidates) {
      const Detection& rival_place = right.places[candidate.second];
      const Detection& best_place = right.places[best.second];
      const bool same = std::abs(rival_place.column - best_place.column) < kSamePlace &&
                        std::abs(rival_place.row - best_place.row) <= kSameRows;
      if (!same) rival = std::min(rival, candidate.first);
    }
    if (isDistinct(best.first, rival, search.ratio, left.descriptors.isBinary()))
      matches[i] = static_cast<int>(best.second);
  }
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i] >= 0 && owners[static_cast<std::size_t>(matches[i])].left != static_cast<int>(i))
      matches[i] = -1;
  }
  return matches;
}

std::vector<float> refineAlongRows(const cv::Mat& left, const cv::Mat& right,
                                   const std::vector<Detection>& places,
                                   const std::vector<float>& disparities, int window,
                                   float max_residual, int threads) {
  constexpr std::size_t kPlacesPerChunk = 64;
  constexpr float kReach = 3.0f;  // detections are this good, pixels
  std::vector<float> columns(places.size(), kNaN);
  const std::size_t chunks = (places.size() + kPlacesPerChunk - 1) / kPlacesPerChunk;
  parallelFor(chunks, threads, [&](std::size_t chunk) {
    const std::size_t last = std::min((chunk + 1) * kPlacesPerChunk, places.size());
    for (std::size_t i = chunk * kPlacesPerChunk; i < last; ++i) {
      const Detection& place = places[i];
      const Patch patch(left, {place.column, place.row}, window);
      const auto found = patch.findAlongRow(right, {place.column - disparities[i], place.row},
                                            kReach, max_residual);
      if (found) columns[i] = found->x;
    }
  });
  return columns;
}

}  // namespace planar_mapping::detail
