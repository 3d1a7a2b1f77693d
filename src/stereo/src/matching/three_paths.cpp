// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "matching/three_paths.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "planar_mapping/core/base/detail/parallel.h"
#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping::detail {
namespace {

using Byte = std::uint8_t;
using Word = std::uint16_t;

constexpr int kFixedPoint = 16;
constexpr int kBands = 4;          // of rows, each by itself: any number of threads gives the same
constexpr int kWarmUp = 12;        // rows above a band from which its path from above comes
constexpr int kLargestCost = 110;  // of a window; with the penalties it stays below a byte
constexpr int kLargestSmall = 40;
constexpr int kLargestLarge = 100;
constexpr Byte kNever = 200;   // cost beyond both ends of the range
constexpr int kGrayShare = 4;  // costs are slopes and so much of gray values, as OpenCV has them
constexpr int kLanes = 32;     // disparities at once; whole blocks of them leave no rest

struct RowView {
  const Byte *value, *low, *high;
};

/// A row of gradients or gray values, and the smallest and largest within half a pixel.
struct Row {
  std::vector<Byte> value, low, high;

  explicit Row(int width)
      : value(static_cast<std::size_t>(width)), low(value.size()), high(value.size()) {}
  RowView view() const { return {value.data(), low.data(), high.data()}; }
};

PLANAR_MAPPING_MULTIVERSION
void filterRow(const Byte* above, const Byte* own, const Byte* below, int width, int cap,
               Byte* out) {
  out[0] = out[width - 1] = static_cast<Byte>(cap);
  for (int x = 1; x < width - 1; ++x) {
    const int slope =
        2 * (own[x + 1] - own[x - 1]) + above[x + 1] - above[x - 1] + below[x + 1] - below[x - 1];
    out[x] = static_cast<Byte>(std::min(std::max(slope, -cap), cap) + cap);
  }
}

/// \pre two columns at least
PLANAR_MAPPING_MULTIVERSION
void boundRow(const Byte* value, int width, Byte* __restrict low, Byte* __restrict high) {
  const auto bound = [&](int x, int before, int after) {
    const int own = value[x];
    const int earlier = (own + value[before]) / 2;
    const int later = (own + value[after]) / 2;
    low[x] = static_cast<Byte>(std::min(own, std::min(earlier, later)));
    high[x] = static_cast<Byte>(std::max(own, std::max(earlier, later)));
  };
  bound(0, 0, 1);
  for (int x = 1; x < width - 1; ++x) bound(x, x - 1, x + 1);
  bound(width - 1, width - 2, width - 1);
}

/// By how much gray values or gradients differ, if half a pixel of sampling costs nothing.
PLANAR_MAPPING_INLINE Byte difference(Byte value, Byte low, Byte high, Byte other, Byte other_low,
                                      Byte other_high) {
  const Byte outside = std::max(static_cast<Byte>(std::max(value, other_high) - other_high),
                                static_cast<Byte>(std::max(value, other_low) - value));
  const Byte other_outside = std::max(static_cast<Byte>(std::max(other, high) - high),
                                      static_cast<Byte>(std::max(other, low) - other));
  return std::min(outside, other_outside);
}

/// Costs of a row of pixels go into the sums over the rows of a window, and those of the row that
/// leaves it out of them. The right row is reversed, so that disparities ascend along it.
PLANAR_MAPPING_MULTIVERSION
void addCosts(RowView l_slope, RowView l_gray, RowView r_slope, RowView r_gray, int width,
              int count, Byte largest, Byte* __restrict ring, Word* __restrict sums) {
  for (int x = 0; x < width; ++x) {
    const Byte slope = l_slope.value[x], slope_low = l_slope.low[x], slope_high = l_slope.high[x];
    const Byte gray = l_gray.value[x], gray_low = l_gray.low[x], gray_high = l_gray.high[x];
    for (int d = 0; d < count; d += kLanes) {
      const int at = width - 1 - x + d;
      Byte* __restrict old = ring + static_cast<std::ptrdiff_t>(x) * count + d;
      Word* __restrict sum = sums + static_cast<std::ptrdiff_t>(x) * count + d;
      for (int k = 0; k < kLanes; ++k) {
        const Byte by_slope = difference(slope, slope_low, slope_high, r_slope.value[at + k],
                                         r_slope.low[at + k], r_slope.high[at + k]);
        const Byte by_gray = difference(gray, gray_low, gray_high, r_gray.value[at + k],
                                        r_gray.low[at + k], r_gray.high[at + k]);
        const Byte both = static_cast<Byte>(by_slope + by_gray / kGrayShare);
        const Byte fresh = std::min(both, largest);
        sum[k] = static_cast<Word>(sum[k] + fresh - old[k]);
        old[k] = fresh;
      }
    }
  }
}

struct Penalties {
  Byte small, large;
};

/// One step of a path. \param before  of the pixel before, with kNever at [-1] and [count]
/// \return the smallest of \p out
PLANAR_MAPPING_INLINE Byte step(const Byte* cost, const Byte* before, Byte least, Penalties p,
                                int count, Byte* __restrict out) {
  const Byte jump = static_cast<Byte>(least + p.large);
  Byte smallest[kLanes];
  for (int k = 0; k < kLanes; ++k) smallest[k] = 255;
  for (int d = 0; d < count; d += kLanes) {
    for (int k = 0; k < kLanes; ++k) {
      const Byte beside =
          static_cast<Byte>(std::min(before[d + k - 1], before[d + k + 1]) + p.small);
      const Byte best = std::min(std::min(before[d + k], beside), jump);
      const Byte value = static_cast<Byte>(cost[d + k] + best - least);
      out[d + k] = value;
      smallest[k] = std::min(smallest[k], value);
    }
  }
  Byte result = 255;
  for (int k = 0; k < kLanes; ++k) result = std::min(result, smallest[k]);
  return result;
}

/// Costs of windows, and the paths from the left and from above, added up.
/// \param above, above_least  of the row above; replaced by those of this one
PLANAR_MAPPING_MULTIVERSION
void passForward(const Word* sums, int width, int count, int half, int shift, Penalties p,
                 Word* __restrict window, Byte* left, Byte* __restrict costs,
                 const Byte* __restrict above, Byte* __restrict fresh_above, Byte* above_least,
                 Word* __restrict total) {
  const int stride = count + 2;
  const auto sumsAt = [&](int x) {
    return sums + static_cast<std::ptrdiff_t>(std::min(std::max(x, 0), width - 1)) * count;
  };
  std::fill(window, window + count, Word{0});
  for (int x = -half; x < half; ++x) {
    const Word* add = sumsAt(x);
    for (int d = 0; d < count; ++d) window[d] = static_cast<Word>(window[d] + add[d]);
  }
  Byte* before = left;
  Byte* now = left + stride;
  std::fill(left, left + 2 * stride, Byte{0});
  before[0] = now[0] = before[stride - 1] = now[stride - 1] = kNever;
  Byte least = 0;
  for (int x = 0; x < width; ++x) {
    const Word* add = sumsAt(x + half);
    const Word* drop = sumsAt(x - half);
    Byte* cost = costs + static_cast<std::ptrdiff_t>(x) * count;
    for (int d = 0; d < count; d += kLanes) {
      for (int k = 0; k < kLanes; ++k) {
        const Word sum = static_cast<Word>(window[d + k] + add[d + k]);
        const Word scaled = static_cast<Word>(sum >> shift);
        cost[d + k] = static_cast<Byte>(scaled);
        window[d + k] = static_cast<Word>(sum - drop[d + k]);
      }
    }
    least = step(cost, before + 1, least, p, count, now + 1);
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * stride + 1;
    above_least[x] = step(cost, above + at, above_least[x], p, count, fresh_above + at);
    Word* __restrict sum = total + static_cast<std::ptrdiff_t>(x) * count;
    const Byte* from_above = fresh_above + at;
    for (int d = 0; d < count; d += kLanes) {
      for (int k = 0; k < kLanes; ++k)
        sum[d + k] = static_cast<Word>(now[d + k + 1] + from_above[d + k]);
    }
    std::swap(before, now);
  }
}

struct Choice {
  std::int16_t disparity = -1;  ///< -1 = none
  std::int16_t fraction = 0;    ///< of a pixel, in units of 1 / 16
};

/// Of lanes that were written as whole vectors: read in such pieces, too.
PLANAR_MAPPING_INLINE Word smallestOf(const Word* lanes) {
  constexpr int kHalf = kLanes / 2;
  Word least = 65535;
  for (int k = 0; k < kHalf; ++k) {
    const Word one = std::min(lanes[k], lanes[k + kHalf]);
    least = std::min(least, one);
  }
  return least;
}

/// The disparity of the smallest sum, if it has no rival.
PLANAR_MAPPING_INLINE Choice chooseFrom(const Word* sum, int count, Word smallest,
                                        std::uint64_t rival_factor) {
  const Word rival = static_cast<Word>(smallest * rival_factor >> 16u);
  Word rivals[kLanes];
  Word places[kLanes];  // of the smallest
  for (int k = 0; k < kLanes; ++k) rivals[k] = 0, places[k] = 65535;
  for (int d = 0; d < count; d += kLanes) {
    for (int k = 0; k < kLanes; ++k) {
      const Word value = sum[d + k];
      rivals[k] = static_cast<Word>(rivals[k] + (value <= rival ? 1 : 0));
      const Word place = value == smallest ? static_cast<Word>(d + k) : Word{65535};
      places[k] = std::min(places[k], place);
    }
  }
  const int best = smallestOf(places);
  int number = -1;  // without itself and its neighbours
  for (int k = 0; k < kLanes; ++k) number += rivals[k];
  const bool is_inside = best > 0 && best < count - 1;
  if (best > 0 && sum[best - 1] <= rival) --number;
  if (best < count - 1 && sum[best + 1] <= rival) --number;
  Choice choice;
  if (number > 0) return choice;
  choice.disparity = static_cast<std::int16_t>(best);
  if (!is_inside) return choice;
  // Differences fall and rise along straight lines.
  const int below = sum[best - 1] - smallest;
  const int beyond = sum[best + 1] - smallest;
  const int slope = std::max({below, beyond, 1});
  choice.fraction = static_cast<std::int16_t>((below - beyond) * kFixedPoint / (2 * slope));
  return choice;
}

/// The path from the right is added; the best disparity of each pixel.
PLANAR_MAPPING_MULTIVERSION
void passBackward(const Byte* costs, int width, int count, Penalties p, std::uint64_t rival_factor,
                  Byte* left, Word* __restrict total, Choice* out) {
  // Each pixel of a path waits for the one before; the choices of some pixels do not.
  constexpr int kPixels = 16;
  const int stride = count + 2;
  Byte* before = left;
  Byte* now = left + stride;
  std::fill(left, left + 2 * stride, Byte{0});
  before[0] = now[0] = before[stride - 1] = now[stride - 1] = kNever;
  Byte least = 0;
  Word smallest[kPixels];
  for (int end = width; end > 0; end -= kPixels) {
    const int begin = std::max(end - kPixels, 0);
    for (int x = end - 1; x >= begin; --x) {
      least = step(costs + static_cast<std::ptrdiff_t>(x) * count, before + 1, least, p, count,
                   now + 1);
      Word* __restrict sum = total + static_cast<std::ptrdiff_t>(x) * count;
      Word lowest[kLanes];
      for (int k = 0; k < kLanes; ++k) lowest[k] = 65535;
      for (int d = 0; d < count; d += kLanes) {
        for (int k = 0; k < kLanes; ++k) {
          const Word value = static_cast<Word>(sum[d + k] + now[d + k + 1]);
          sum[d + k] = value;
          lowest[k] = std::min(lowest[k], value);
        }
      }
      smallest[x - begin] = smallestOf(lowest);
      std::swap(before, now);
    }
    for (int x = begin; x < end; ++x)
      out[x] = chooseFrom(total + static_cast<std::ptrdiff_t>(x) * count, count,
                          smallest[x - begin], rival_factor);
  }
}

/// The best disparity of each pixel of the right image, reversed.
PLANAR_MAPPING_MULTIVERSION
void lookFromRight(const Word* total, int width, int count, Word* __restrict costs,
                   Word* __restrict disparities) {
  // Pixels by whole blocks: what the one before wrote is read as it was written.
  for (int phase = 0; phase < kLanes; ++phase) {
    for (int x = phase; x < width; x += kLanes) {
      const Word* sum = total + static_cast<std::ptrdiff_t>(x) * count;
      Word* __restrict cost = costs + (width - 1 - x);
      Word* __restrict disparity = disparities + (width - 1 - x);
      for (int d = 0; d < count; d += kLanes) {
        for (int k = 0; k < kLanes; ++k) {
          const Word value = sum[d + k];
          const Word known = cost[d + k];
          const Word other = disparity[d + k];
          disparity[d + k] = value < known ? static_cast<Word>(d + k) : other;
          cost[d + k] = std::min(value, known);
        }
      }
    }
  }
}

class Matching {
 public:
  Matching(const cv::Mat& left, const cv::Mat& right, const SemiGlobalParams& params)
      : left_(left),
        right_(right),
        params_(params),
        count_((params.disparities + kLanes - 1) / kLanes * kLanes) {
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

  void matchRows(int first, int last, cv::Mat& out) const;

 private:
  /// Gradients of a row; those of the right image reversed and continued beyond both ends.
  struct Rows {
    Row left_slope, left_gray, right_slope, right_gray;
    std::vector<Byte> line;
  };
  void prepare(int row, Rows& rows) const;
  void choose(const std::vector<Choice>& choices, const std::vector<Word>& right_disparity,
              std::int16_t* out) const;

  const cv::Mat& left_;
  const cv::Mat& right_;
  const SemiGlobalParams& params_;
  int count_;
  int largest_ = 0;
  int shift_ = 0;
  Penalties penalties_{};
};

void Matching::prepare(int row, Rows& rows) const {
  const int width = left_.cols;
  const auto filter = [&](const cv::Mat& image, Byte* out) {
    const int above = std::max(row - 1, 0);
    const int below = std::min(row + 1, image.rows - 1);
    filterRow(image.ptr(above), image.ptr(row), image.ptr(below), width, params_.prefilter_cap,
              out);
  };
  const int last = width - 1 - params_.min_disparity;  // column of the first place
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

void Matching::choose(const std::vector<Choice>& choices, const std::vector<Word>& right_disparity,
                      std::int16_t* out) const {
  const int width = left_.cols;
  const int none = (params_.min_disparity - 1) * kFixedPoint;
  for (int x = 0; x < width; ++x) {
    const Choice& choice = choices[static_cast<std::size_t>(x)];
    out[x] = static_cast<std::int16_t>(none);
    if (choice.disparity < 0) continue;
    const int whole = params_.min_disparity + choice.disparity;
    if (x - whole < 0 || x - whole >= width) continue;
    // Of the two places it lies between.
    const int beside = std::clamp(choice.disparity + (choice.fraction < 0 ? -1 : 1), 0, count_ - 1);
    const auto agrees = [&](int disparity) {
      const auto place = static_cast<std::size_t>(width - 1 - x + disparity);
      return std::abs(right_disparity[place] - choice.disparity) <= params_.left_right_tolerance;
    };
    if (params_.left_right_tolerance >= 0.0 && !agrees(choice.disparity) && !agrees(beside)) {
      continue;
    }
    out[x] = static_cast<std::int16_t>(whole * kFixedPoint + choice.fraction);
  }
}

void Matching::matchRows(int first, int last, cv::Mat& out) const {
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

}  // namespace

cv::Mat matchAlongThreePaths(const cv::Mat& left, const cv::Mat& right,
                             const SemiGlobalParams& params) {
  cv::Mat out(left.size(), CV_16S);
  const Matching matching(left, right, params);
  parallelFor(kBands, params.threads, [&](std::size_t band) {
    const auto at = [&](std::size_t b) { return static_cast<int>(b) * left.rows / kBands; };
    matching.matchRows(at(band), at(band + 1), out);
  });
  return out;
}

}  // namespace planar_mapping::detail
