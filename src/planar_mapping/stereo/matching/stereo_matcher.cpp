// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/matching/stereo_matcher.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/stereo/cv_image.h"
#include "planar_mapping/stereo/matching/semi_global.h"
#include "planar_mapping/stereo/matching/subpixel.h"
#include "planar_mapping/stereo/opencv_threads.h"

namespace planar_mapping {
namespace {

constexpr int kSmallestSide = 16;
constexpr int kLargestDisparity = 2000;  // 16 of them fit OpenCV's 16 bits
constexpr int kMinAlike = 3;             // of ten pixels, around one or of a region

void requireOdd(const char* name, int value, int low, int high) {
  requireInRange(name, value, low, high, "px");
  if (value % 2 == 0) throw ParameterError(name, value, "odd", "px");
}

/// Difference of neighbours along rows, which is what matching lives on.
cv::Mat contrastOf(const cv::Mat& gray) {
  cv::Mat contrast(gray.size(), CV_8U);
  for (int row = 0; row < gray.rows; ++row) {
    const std::uint8_t* values = gray.ptr(row);
    std::uint8_t* out = contrast.ptr(row);
    out[0] = 0;
    for (int column = 1; column < gray.cols; ++column) {
      const int difference = int{values[column]} - int{values[column - 1]};
      out[column] = static_cast<std::uint8_t>(std::abs(difference));
    }
  }
  return contrast;
}

void removePlain(const cv::Mat& contrast, const StereoMatcherParams& params, cv::Mat& disparity) {
  if (params.min_texture <= 0.0) return;
  cv::Mat sums;  // of whole numbers, so that no order of adding shows
  cv::boxFilter(contrast, sums, CV_32S, cv::Size(params.texture_window, params.texture_window),
                cv::Point(-1, -1), false, cv::BORDER_REFLECT);
  const auto least = static_cast<std::int32_t>(
      std::ceil(params.min_texture * params.texture_window * params.texture_window));
  for (int row = 0; row < disparity.rows; ++row) {
    const auto* sum = sums.ptr<std::int32_t>(row);
    auto* values = disparity.ptr<float>(row);
    for (int column = 0; column < disparity.cols; ++column) {
      if (sum[column] < least) values[column] = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

/// Removes what nothing tells: pixels whose surroundings do not look alike in both images. Of those
/// between both bounds the ones stay that are among pixels that do.
void removeUnlike(const std::vector<float>& agreement, const StereoMatcherParams& params,
                  cv::Mat& disparity) {
  if (params.min_agreement <= 0.0) return;
  constexpr double kWeak = 0.5;  // of the least agreement
  const auto least = static_cast<float>(params.min_agreement);
  cv::Mat known(disparity.size(), CV_8U);
  cv::Mat alike(disparity.size(), CV_8U);
  const auto total = disparity.total();
  const auto* values = disparity.ptr<float>();
  for (std::size_t i = 0; i < total; ++i) {
    known.data[i] = std::isnan(values[i]) ? 0 : 1;
    alike.data[i] = agreement[i] >= least ? known.data[i] : std::uint8_t{0};
  }
  const cv::Size window(params.texture_window, params.texture_window);
  cv::Mat known_around;
  cv::Mat alike_around;
  const auto sum = [&](const cv::Mat& marks, cv::Mat& sums) {
    cv::boxFilter(marks, sums, CV_32S, window, cv::Point(-1, -1), false, cv::BORDER_REFLECT);
  };
  sum(known, known_around);
  sum(alike, alike_around);
  for (std::size_t i = 0; i < total; ++i) {
    if (alike.data[i] != 0) continue;
    const bool is_among =
        10 * alike_around.ptr<std::int32_t>()[i] >= kMinAlike * known_around.ptr<std::int32_t>()[i];
    if (!is_among || !(agreement[i] >= kWeak * least))
      disparity.ptr<float>()[i] = std::numeric_limits<float>::quiet_NaN();
  }
}

/// Removes connected regions of few pixels.
void removeSpeckles(const StereoMatcherParams& params, cv::Mat& disparity) {
  if (params.speckle_size <= 0) return;
  constexpr float kFixedPoint = 16.0f;
  constexpr std::int16_t kNone = std::numeric_limits<std::int16_t>::min();
  cv::Mat fixed(disparity.size(), CV_16S);
  auto* out = fixed.ptr<std::int16_t>();
  auto* values = disparity.ptr<float>();
  const auto total = disparity.total();
  for (std::size_t i = 0; i < total; ++i) {
    out[i] = std::isnan(values[i]) ? kNone : static_cast<std::int16_t>(kFixedPoint * values[i]);
  }
  cv::filterSpeckles(fixed, kNone, params.speckle_size, kFixedPoint * params.speckle_range);
  for (std::size_t i = 0; i < total; ++i) {
    if (out[i] == kNone) values[i] = std::numeric_limits<float>::quiet_NaN();
  }
}

/// Removes connected regions that are too small for things at their distance: a wrong match
/// takes as many pixels at any disparity; what is there takes the more the nearer it is. Plain
/// regions that hardly agree need more pixels than others: smooth shading with the smooth noise
/// of resampled images has few independent pixels, and suits one of hundreds of disparities.
/// \param contrast  difference of neighbours along rows
/// \param infinity  disparity of points infinitely far away, which are of any size
void removeRegions(const cv::Mat& contrast, double infinity, const std::optional<double>& baseline,
                   const std::vector<float>& agreement, const StereoMatcherParams& params,
                   cv::Mat& disparity) {
  constexpr double kClear = 1.5;   // of the least agreement
  constexpr double kPlain = 0.85;  // gray levels between neighbours, on average
  constexpr int kDoubtful = 4;     // times as many pixels
  const auto clear = static_cast<float>(kClear * params.min_agreement);
  const bool knows_size = params.speckle_side > 0.0 && baseline.has_value();
  const double min_area = params.speckle_side * params.speckle_side;
  if (!knows_size && !(params.min_agreement > 0.0)) return;
  const int columns = disparity.cols;
  const auto total = static_cast<int>(disparity.total());
  const auto range = static_cast<float>(params.speckle_range);
  auto* values = disparity.ptr<float>();
  std::vector<std::uint8_t> known(disparity.total(), 0);
  std::vector<int> region;
  for (int seed = 0; seed < total; ++seed) {
    if (known[static_cast<std::size_t>(seed)] != 0 || std::isnan(values[seed])) continue;
    region.assign(1, seed);
    known[static_cast<std::size_t>(seed)] = 1;
    double area = 0.0;
    std::int64_t clear_count = 0;
    std::int64_t contrast_sum = 0;
    for (std::size_t k = 0; k < region.size(); ++k) {
      const int at = region[k];
      if (agreement[static_cast<std::size_t>(at)] >= clear) ++clear_count;
      contrast_sum += contrast.data[at];
      if (knows_size) {
        const double side = *baseline / std::max(values[at] - infinity, 1e-3);  // of a pixel there
        area += side * side;
      }
      const auto join = [&](bool inside, int next) {
        if (!inside || known[static_cast<std::size_t>(next)] != 0) return;
        if (!(std::abs(values[next] - values[at]) <= range)) return;  // a hole, too
        known[static_cast<std::size_t>(next)] = 1;
        region.push_back(next);
      };
      const int column = at % columns;
      join(column > 0, at - 1);
      join(column < columns - 1, at + 1);
      join(at >= columns, at - columns);
      join(at < total - columns, at + columns);
    }
    const auto pixels = static_cast<std::int64_t>(region.size());
    const bool is_doubtful =
        params.min_agreement > 0.0 &&
        static_cast<double>(contrast_sum) < kPlain * static_cast<double>(pixels) &&
        10 * clear_count < kMinAlike * pixels;
    const bool is_small = is_doubtful && pixels < std::int64_t{params.speckle_size} * kDoubtful;
    if (!is_small && !(knows_size && area < min_area)) continue;
    for (const int at : region) values[at] = std::numeric_limits<float>::quiet_NaN();
  }
}

/// How the left camera would have exposed the right image: gray values v as gain * v + offset.
struct Exposure {
  double gain = 1.0;
  double offset = 0.0;
  double change = 0.0;  ///< of mean and spread of the gray values
};

/// Disparities of a pair as a coarse search on small images sees them, pixels of the large image.
struct CoarseDisparities {
  double low = 0.0;
  double high = 0.0;
  double density = 0.0;  ///< fraction with a disparity, of the pixels with contrast
  Exposure exposure;     ///< by the pixels with a disparity
};

/// Smaller by a power of two until a search over all disparities takes about 2 ms.
int reductionFor(const cv::Mat& image) {
  constexpr std::size_t kPixels = 30000;
  int factor = 1;
  while (image.total() / static_cast<std::size_t>(factor * factor) > kPixels &&
         std::min(image.cols, image.rows) / (2 * factor) >= 24) {
    factor *= 2;
  }
  return factor;
}

/// By mean and spread of the pixels that \p disparity says are the same.
Exposure exposureOfMatches(const cv::Mat& left, const cv::Mat& right, const cv::Mat& disparity) {
  std::vector<std::uint8_t> in_left;
  std::vector<std::uint8_t> in_right;
  for (int row = 0; row < disparity.rows; ++row) {
    for (int column = 0; column < disparity.cols; ++column) {
      const float value = disparity.ptr<float>(row)[column];
      const int other = std::isnan(value) ? -1 : column - static_cast<int>(std::lround(value));
      if (other < 0 || other >= right.cols) continue;
      in_left.push_back(left.ptr(row)[column]);
      in_right.push_back(right.ptr(row)[other]);
    }
  }
  Exposure exposure;
  if (in_left.empty()) return exposure;
  cv::Scalar mean_left, spread_left, mean, spread;
  cv::meanStdDev(in_left, mean_left, spread_left);
  cv::meanStdDev(in_right, mean, spread);
  if (!(spread_left[0] > 0.0) || !(spread[0] > 0.0)) return exposure;
  exposure.gain = spread_left[0] / spread[0];
  exposure.offset = mean_left[0] - exposure.gain * mean[0];
  exposure.change = std::abs(mean_left[0] - mean[0]) + std::abs(spread_left[0] - spread[0]);
  return exposure;
}

/// \param left, right  gray, of one size
/// \param infinity  disparity of infinity: nothing less is looked for
/// \param largest   nothing more is looked for; > infinity
CoarseDisparities searchCoarsely(const cv::Mat& left, const cv::Mat& right, double infinity,
                                 double largest) {
  const int factor = reductionFor(left);
  const cv::Size size(left.cols / factor, left.rows / factor);
  cv::Mat small_left;
  cv::Mat small_right;
  cv::resize(left, small_left, size, 0.0, 0.0, cv::INTER_AREA);
  cv::resize(right, small_right, size, 0.0, 0.0, cv::INTER_AREA);
  const double scale = static_cast<double>(left.cols) / size.width;

  detail::DisparityRange range;
  range.low = static_cast<int>(std::floor(infinity / scale));
  range.count = static_cast<int>(std::ceil(largest / scale)) - range.low + 1;
  StereoMatcherParams params;
  params.block_size = 3;
  params.uniqueness_percent = 10;
  params.left_right_tolerance = 1;
  params.speckle_size = 20;
  params.speckle_range = 2.0;
  const cv::Mat disparity = detail::matchSemiGlobally(small_left, small_right, range, params);

  cv::Mat contrast;  // along rows
  cv::absdiff(small_left.colRange(1, size.width), small_left.colRange(0, size.width - 1), contrast);
  const double plain = cv::mean(contrast)[0];
  std::vector<float> found;
  found.reserve(disparity.total());
  std::size_t textured = 0;
  std::size_t matched = 0;
  for (int row = 0; row < disparity.rows; ++row) {
    const float* values = disparity.ptr<float>(row);
    const std::uint8_t* steps = contrast.ptr(row);
    for (int column = 0; column < disparity.cols; ++column) {
      const bool is_found = !std::isnan(values[column]);
      if (is_found) found.push_back(values[column]);
      if (column + 1 == disparity.cols || steps[column] < plain) continue;
      ++textured;
      matched += is_found ? 1 : 0;
    }
  }
  CoarseDisparities coarse;
  if (found.empty()) return coarse;
  coarse.exposure = exposureOfMatches(small_left, small_right, disparity);
  coarse.density =
      static_cast<double>(matched) / static_cast<double>(std::max<std::size_t>(1, textured));
  // So few pixels at either end are more likely wrong than seen.
  const std::size_t outliers = found.size() / 400;
  coarse.low = detail::ranked(found, outliers) * scale;
  coarse.high = detail::ranked(found, found.size() - 1 - outliers) * scale;
  return coarse;
}

}  // namespace

void StereoMatcherParams::validate() const {
  requireInRange("paths", static_cast<int>(paths), 0, static_cast<int>(SmoothnessPaths::Eight));
  if (min_disparity)
    requireInRange("min_disparity", *min_disparity, -kLargestDisparity, kLargestDisparity, "px");
  if (disparities) requireInRange("disparities", *disparities, 1, kLargestDisparity, "px");
  requireInRange("near_distance", near_distance, 0.0, 1e6, "m");
  requirePositive("max_disparity_fraction", max_disparity_fraction);
  requireInRange("max_disparity_fraction", max_disparity_fraction, 0.0, 1.0);
  requireOdd("block_size", block_size, 1, 31);
  requireInRange("smoothness_small", smoothness_small, 0.0, 1000.0);
  requireInRange("smoothness_large", smoothness_large, smoothness_small, 1000.0);
  requireInRange("prefilter_cap", prefilter_cap, 1, 63);
  requireInRange("uniqueness_percent", uniqueness_percent, 0.0, 100.0);
  requireInRange("left_right_tolerance", left_right_tolerance, -1.0, kLargestDisparity, "px");
  requireInRange("speckle_size", speckle_size, 0, 1e9, "px");
  requireInRange("speckle_side", speckle_side, 0.0, 1e3, "m");
  requirePositive("speckle_range", speckle_range, "px");
  requireInRange("speckle_range", speckle_range, 0.0, kLargestDisparity, "px");
  requireInRange("min_texture", min_texture, 0.0, 255.0);
  requireInRange("min_agreement", min_agreement, 0.0, 1.0);
  requireOdd("texture_window", texture_window, 3, 255);
  requireOdd("refine_window", refine_window, 3, 31);
  requireInRange("threads", threads, 0, 4096);
}

StereoMatcher::StereoMatcher(const StereoMatcherParams& params) : params_(params) {
  params_.validate();
}

DisparityImage StereoMatcher::match(const io::Image& left, const io::Image& right,
                                    const io::Calibration& calibration,
                                    StereoReport* report) const {
  detail::requirePair(left, right);
  if (std::min(left.width, left.height) < kSmallestSide) {
    throw InputError("images of " + detail::sizeText(left.width, left.height) +
                     " pixels are too small for stereo; 16 x 16 is the least");
  }
  StereoReport unused;
  StereoReport& out = report != nullptr ? *report : unused;
  out = StereoReport();
  const detail::OpenCvThreads threads(params_.threads);
  detail::Stopwatch watch;
  const io::Image gray_left = io::toGray(left);
  const io::Image gray_right = io::toGray(right);
  const cv::Mat l = detail::matOf(gray_left);
  cv::Mat r = detail::matOf(gray_right);
  const cv::Mat contrast = contrastOf(l);
  out.contrast = cv::mean(contrast)[0];
  out.brightness = cv::mean(l)[0];

  const double infinity = calibration.camera.cx - calibration.cx_right;
  double largest = infinity + params_.max_disparity_fraction * left.width;
  if (params_.near_distance > 0.0 && calibration.baseline) {
    largest = std::min(
        largest, infinity + calibration.camera.fx * *calibration.baseline / params_.near_distance);
  }
  largest = std::clamp(largest, infinity + 16.0, infinity + kLargestDisparity);
  CoarseDisparities coarse = searchCoarsely(l, r, infinity, largest);
  // Cameras that expose apart: the costs are of gray values, and bear this much.
  constexpr double kAlike = 25.0;
  if (coarse.exposure.change > kAlike) {
    cv::Mat alike;
    r.convertTo(alike, CV_8U, coarse.exposure.gain, coarse.exposure.offset);
    r = alike;
    coarse = searchCoarsely(l, r, infinity, largest);
  }
  constexpr double kPoor = 0.6;      // of pixels with contrast; most good pairs have more
  constexpr double kClearly = 1.25;  // wrong order: 1.3 to 2.9 times as many the other way round
  if (coarse.density < kPoor) {
    const CoarseDisparities exchanged = searchCoarsely(r, l, infinity, largest);
    out.swapped = exchanged.density > kPoor && exchanged.density > kClearly * coarse.density;
  }
  // Of what was seen on the small images, with the margin of their own error.
  const double margin = 8.0 + 0.05 * (coarse.high - coarse.low);
  if (coarse.density == 0.0) {
    coarse.low = infinity;
    coarse.high = largest;
  }
  const double low = std::max(std::floor(infinity), std::floor(coarse.low - margin));
  detail::DisparityRange range;
  range.low = params_.min_disparity.value_or(static_cast<int>(low));
  range.count = params_.disparities.value_or(std::max(
      16, static_cast<int>(std::ceil(std::min(largest, coarse.high + margin))) - range.low + 1));
  range.count = (range.count + 15) / 16 * 16;
  out.min_disparity = range.low;
  out.disparities = range.count;
  out.range_ms = watch.lap();

  StereoMatcherParams matching = params_;
  matching.speckle_size = 0;  // after the other checks
  cv::Mat disparity = detail::matchSemiGlobally(l, r, range, matching);
  removePlain(contrast, params_, disparity);
  out.match_ms = watch.lap();
  std::vector<float> agreement(disparity.total());
  detail::refineDisparity(l.data, r.data, left.width, left.height, params_.refine_window,
                          params_.refine, params_.threads, disparity.ptr<float>(),
                          agreement.data());
  removeUnlike(agreement, params_, disparity);
  removeSpeckles(params_, disparity);
  removeRegions(contrast, infinity, calibration.baseline, agreement, params_, disparity);
  DisparityImage result;
  result.width = left.width;
  result.height = left.height;
  result.values.assign(disparity.ptr<float>(), disparity.ptr<float>() + disparity.total());
  out.refine_ms = watch.lap();
  out.density = result.density();
  return result;
}

}  // namespace planar_mapping
