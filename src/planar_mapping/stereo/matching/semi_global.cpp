// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/matching/semi_global.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/stereo/matching/path_kernels.h"

namespace planar_mapping::detail {
namespace {

constexpr int kBands = 4;          // of rows, each by itself: any number of threads gives the same
constexpr int kWarmUp = 12;        // rows above a band from which its path from above comes
constexpr int kLargestCost = 110;  // of a window; with the penalties it stays below a byte
constexpr int kLargestSmall = 40;
constexpr int kLargestLarge = 100;

/// A row of gradients or gray values, and the smallest and largest within half a pixel.
struct Row {
  std::vector<Byte> value, low, high;

  explicit Row(int width)
      : value(static_cast<std::size_t>(width)), low(value.size()), high(value.size()) {}
  RowView view() const { return {value.data(), low.data(), high.data()}; }
};

/// Semi-global matching along three paths (from the left, the right and above) on bytes, in half
/// the time of OpenCV's. Costs are differences of horizontal gradients, so that the exposure of
/// the two cameras may differ; half a pixel of sampling costs nothing (Birchfield and Tomasi, PAMI
/// 1998). The right image's disparities are searched for as well, and must agree.
class Matching {
 public:
  Matching(const cv::Mat& left, const cv::Mat& right, const DisparityRange& range,
           const StereoMatcherParams& params)
      : left_(left),
        right_(right),
        params_(params),
        low_(range.low),
        count_((range.count + kPathLanes - 1) / kPathLanes * kPathLanes) {
    constexpr int kLargestSum = 65535;
    const int area = params.block_size * params.block_size;
    largest_ = std::min(2 * params.prefilter_cap, kLargestSum / area);
    while ((largest_ * area >> shift_) > kLargestCost) ++shift_;
    const auto penalty = [&](double value, int largest) {
      return static_cast<Byte>(
          std::clamp(static_cast<int>(std::lround(value * area)) >> shift_, 1, largest));
    };
    penalties_ = {penalty(params.smoothness_small, kLargestSmall),
                  penalty(params.smoothness_large, kLargestLarge)};
  }

  void matchRows(int first, int last, cv::Mat& out) const {
    const int width = left_.cols;
    const int half = params_.block_size / 2;
    const auto slab = static_cast<std::size_t>(width) * static_cast<std::size_t>(count_);
    const auto padded = static_cast<std::size_t>(width) * static_cast<std::size_t>(count_ + 2);
    const auto places = static_cast<std::size_t>(width + count_);
    std::vector<Byte> ring(slab * static_cast<std::size_t>(params_.block_size), 0);
    std::vector<Word> sums(slab, 0), total(slab), window(static_cast<std::size_t>(count_));
    std::vector<Byte> costs(slab), above(padded, kNever), fresh_above(padded, kNever);
    std::vector<Byte> above_least(static_cast<std::size_t>(width), 0);
    std::vector<Byte> path(2 * static_cast<std::size_t>(count_ + 2));
    std::vector<Word> right_cost(places), right_disparity(places);
    std::vector<Choice> choices(static_cast<std::size_t>(width));
    Rows rows{Row(width), Row(width), Row(static_cast<int>(places)), Row(static_cast<int>(places)),
              std::vector<Byte>(static_cast<std::size_t>(width))};
    for (std::size_t i = 0; i < padded; ++i) {
      const std::size_t d = i % static_cast<std::size_t>(count_ + 2);
      if (d > 0 && d <= static_cast<std::size_t>(count_)) above[i] = 0;
    }
    // Costs that are no rivals are larger by this factor, in units of 2^-16.
    const auto rival_factor = static_cast<std::uint64_t>(
        65536.0 * 100.0 / (100.0 - std::min(params_.uniqueness_percent, 99.0)));
    const int begin = std::max(0, first - kWarmUp);
    for (int row = begin - half; row < last + half; ++row) {
      prepare(std::clamp(row, 0, left_.rows - 1), rows);
      const int slot = (row - begin + half) % params_.block_size;
      addCosts(rows.left_slope.view(), rows.left_gray.view(), rows.right_slope.view(),
               rows.right_gray.view(), width, count_, static_cast<Byte>(largest_),
               ring.data() + slab * static_cast<std::size_t>(slot), sums.data());
      const int center = row - half;
      if (center < begin) continue;
      passForward(sums.data(), width, count_, half, shift_, penalties_, window.data(), path.data(),
                  costs.data(), above.data(), fresh_above.data(), above_least.data(), total.data());
      std::swap(above, fresh_above);
      if (center < first) continue;
      std::fill(right_cost.begin(), right_cost.end(), Word{65535});
      passBackward(costs.data(), width, count_, penalties_, rival_factor, path.data(), total.data(),
                   choices.data());
      lookFromRight(total.data(), width, count_, right_cost.data(), right_disparity.data());
      choose(choices, right_disparity, out.ptr<std::int16_t>(center));
    }
  }

 private:
  /// Gradients of a row; those of the right image reversed and continued beyond both ends.
  struct Rows {
    Row left_slope, left_gray, right_slope, right_gray;
    std::vector<Byte> line;
  };

  void prepare(int row, Rows& rows) const {
    const int width = left_.cols;
    const auto filter = [&](const cv::Mat& image, Byte* out) {
      const int above = std::max(row - 1, 0);
      const int below = std::min(row + 1, image.rows - 1);
      filterRow(image.ptr(above), image.ptr(row), image.ptr(below), width, params_.prefilter_cap,
                out);
    };
    const int last = width - 1 - low_;  // column of the first place
    const auto reverse = [&](const Byte* line, Row& out) {
      const int places = static_cast<int>(out.value.size());
      const int before = std::clamp(last - width + 1, 0, places);
      const int inside = std::clamp(last + 1, before, places);
      Byte* at = out.value.data();
      std::fill(at, at + before, line[width - 1]);
      for (int k = before; k < inside; ++k) at[k] = line[last - k];
      std::fill(at + inside, at + places, line[0]);
    };
    filter(left_, rows.left_slope.value.data());
    std::copy_n(left_.ptr(row), width, rows.left_gray.value.data());
    filter(right_, rows.line.data());
    reverse(rows.line.data(), rows.right_slope);
    reverse(right_.ptr(row), rows.right_gray);
    for (Row* one : {&rows.left_slope, &rows.left_gray, &rows.right_slope, &rows.right_gray})
      boundRow(one->value.data(), static_cast<int>(one->value.size()), one->low.data(),
               one->high.data());
  }

  void choose(const std::vector<Choice>& choices, const std::vector<Word>& right_disparity,
              std::int16_t* out) const {
    const int width = left_.cols;
    const int none = (low_ - 1) * kDisparityScale;
    for (int x = 0; x < width; ++x) {
      const Choice& choice = choices[static_cast<std::size_t>(x)];
      out[x] = static_cast<std::int16_t>(none);
      if (choice.disparity < 0) continue;
      const int whole = low_ + choice.disparity;
      if (x - whole < 0 || x - whole >= width) continue;
      // Of the two places it lies between.
      const int beside =
          std::clamp(choice.disparity + (choice.fraction < 0 ? -1 : 1), 0, count_ - 1);
      const auto agrees = [&](int disparity) {
        const auto place = static_cast<std::size_t>(width - 1 - x + disparity);
        return std::abs(right_disparity[place] - choice.disparity) <= params_.left_right_tolerance;
      };
      if (params_.left_right_tolerance >= 0.0 && !agrees(choice.disparity) && !agrees(beside)) {
        continue;
      }
      out[x] = static_cast<std::int16_t>(whole * kDisparityScale + choice.fraction);
    }
  }

  const cv::Mat& left_;
  const cv::Mat& right_;
  const StereoMatcherParams& params_;
  int low_;
  int count_;
  int largest_ = 0;
  int shift_ = 0;
  Penalties penalties_{};
};
/// \return disparities of the left image in units of 1 / 16 pixel; (low - 1) * 16 = none
cv::Mat matchAlongThreePaths(const cv::Mat& left, const cv::Mat& right, const DisparityRange& range,
                             const StereoMatcherParams& params) {
  cv::Mat out(left.size(), CV_16S);
  const Matching matching(left, right, range, params);
  parallelFor(kBands, params.threads, [&](std::size_t band) {
    const auto at = [&](std::size_t b) { return static_cast<int>(b) * left.rows / kBands; };
    matching.matchRows(at(band), at(band + 1), out);
  });
  return out;
}

/// Likewise.
cv::Mat matchWithOpenCv(const cv::Mat& left, const cv::Mat& right, const DisparityRange& range,
                        const StereoMatcherParams& params) {
  const int disparities = (range.count + 15) / 16 * 16;  // OpenCV wants whole sixteens
  const int beyond = range.low + disparities;
  const int pad_left = std::max(beyond, 0);
  const int pad_right = std::max(-range.low, 0);
  cv::Mat wide_left;
  cv::Mat wide_right;
  cv::copyMakeBorder(left, wide_left, 0, 0, pad_left, pad_right, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, wide_right, 0, 0, pad_left, pad_right, cv::BORDER_REPLICATE);

  const int area = params.block_size * params.block_size;
  const auto penalty = [area](double value) { return static_cast<int>(std::lround(value * area)); };
  const int tolerance =
      params.left_right_tolerance < 0.0
          ? -1
          : std::max(1, static_cast<int>(std::lround(params.left_right_tolerance)));
  const int small = penalty(params.smoothness_small);
  const cv::Ptr<cv::StereoSGBM> matcher = cv::StereoSGBM::create(
      range.low, disparities, params.block_size, small,
      std::max(penalty(params.smoothness_large), small + 1), tolerance, params.prefilter_cap,
      static_cast<int>(std::lround(params.uniqueness_percent)), 0, 0,
      params.paths == SmoothnessPaths::Five ? cv::StereoSGBM::MODE_SGBM : cv::StereoSGBM::MODE_HH);
  cv::Mat fixed;
  matcher->compute(wide_left, wide_right, fixed);
  return fixed.colRange(pad_left, pad_left + left.cols).clone();
}

}  // namespace

cv::Mat matchSemiGlobally(const cv::Mat& left, const cv::Mat& right, const DisparityRange& range,
                          const StereoMatcherParams& params) {
  cv::Mat fixed = params.paths == SmoothnessPaths::Three
                      ? matchAlongThreePaths(left, right, range, params)
                      : matchWithOpenCv(left, right, range, params);
  const int none = (range.low - 1) * kDisparityScale;
  for (int row = 0; row < fixed.rows; ++row) {
    auto* values = fixed.ptr<std::int16_t>(row);
    for (int column = 0; column < fixed.cols; ++column) {
      const int in_right = column * kDisparityScale - values[column];
      if (in_right < 0 || in_right > (left.cols - 1) * kDisparityScale)
        values[column] = static_cast<std::int16_t>(none);
    }
  }
  if (params.speckle_size > 0) {
    cv::filterSpeckles(fixed, none, params.speckle_size, params.speckle_range * kDisparityScale);
  }
  cv::Mat disparity(fixed.size(), CV_32F);
  for (int row = 0; row < fixed.rows; ++row) {
    const auto* values = fixed.ptr<std::int16_t>(row);
    float* out = disparity.ptr<float>(row);
    for (int column = 0; column < fixed.cols; ++column) {
      out[column] = values[column] <= none ? std::numeric_limits<float>::quiet_NaN()
                                           : static_cast<float>(values[column]) / kDisparityScale;
    }
  }
  return disparity;
}

}  // namespace planar_mapping::detail
