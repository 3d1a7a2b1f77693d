// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "features/feature_refinement.h"

#include <cmath>
#include <cstddef>

namespace planar_mapping::detail {
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

}  // namespace planar_mapping::detail
