// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/matching/path_kernels.h"

#include <algorithm>
#include <cstddef>

#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr int kLanes = kPathLanes;
constexpr int kGrayDivisor = 4;  // costs are slopes and so much of gray values, as OpenCV has them

PLANAR_MAPPING_INLINE Byte difference(Byte value, Byte low, Byte high, Byte other, Byte other_low,
                                      Byte other_high) {
  const Byte outside = std::max(static_cast<Byte>(std::max(value, other_high) - other_high),
                                static_cast<Byte>(std::max(value, other_low) - value));
  const Byte other_outside = std::max(static_cast<Byte>(std::max(other, high) - high),
                                      static_cast<Byte>(std::max(other, low) - other));
  return std::min(outside, other_outside);
}

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

PLANAR_MAPPING_INLINE Word smallestOf(const Word* lanes) {
  constexpr int kHalf = kLanes / 2;
  Word least = 65535;
  for (int k = 0; k < kHalf; ++k) {
    const Word one = std::min(lanes[k], lanes[k + kHalf]);
    least = std::min(least, one);
  }
  return least;
}

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
  choice.fraction = static_cast<std::int16_t>((below - beyond) * kDisparityScale / (2 * slope));
  return choice;
}

}  // namespace

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
        const Byte both = static_cast<Byte>(by_slope + by_gray / kGrayDivisor);
        const Byte fresh = std::min(both, largest);
        sum[k] = static_cast<Word>(sum[k] + fresh - old[k]);
        old[k] = fresh;
      }
    }
  }
}

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

}  // namespace planar_mapping::detail
