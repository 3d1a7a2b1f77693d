// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/point_set_coder.h"

#include <algorithm>

namespace planar_mapping::detail {
namespace {

std::int32_t& coordinate(Int3& p, std::size_t axis) {
  return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

}  // namespace

void PointSetCoder::code(BitCoder& coder, std::vector<Int3>& points) {
  if (points.empty()) return;
  Box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(
        points.begin(), points.end(),
        [axis](Int3 a, Int3 b) { return coordinate(a, axis) < coordinate(b, axis); });
    const std::int32_t first = coordinate(*low, axis);
    box.low[axis] = static_cast<std::int32_t>(low_[axis].codeWithin(coder, first, -kLimit, kLimit));
    box.size[axis] = 1;
    if (points.size() == 1) continue;
    const auto wanted = static_cast<std::uint64_t>(coordinate(*high, axis) - first);
    const std::uint64_t more = size_[axis].code(coder, wanted);
    if (more > 2 * std::uint64_t{kLimit}) coder.fail("holds a number outside its range");
    box.size[axis] += static_cast<std::int32_t>(more);
  }
  halve(coder, points.data(), points.size(), box);
  std::sort(points.begin(), points.end(), isBefore);
}

void PointSetCoder::halve(BitCoder& coder, Int3* points, std::size_t n, const Box& box) {
  if (n == 0) return;
  const auto axis = static_cast<std::size_t>(std::max_element(box.size.begin(), box.size.end()) -
                                             box.size.begin());
  if (box.size[axis] == 1) {
    std::fill_n(points, n, Int3{box.low[0], box.low[1], box.low[2]});
    return;
  }
  Box lower = box;
  lower.size[axis] /= 2;
  Box upper = box;
  upper.low[axis] += lower.size[axis];
  upper.size[axis] -= lower.size[axis];
  const Int3* middle = std::partition(
      points, points + n, [&](Int3 p) { return coordinate(p, axis) < upper.low[axis]; });
  const std::size_t count = codeLower(coder, static_cast<std::size_t>(middle - points), n);
  halve(coder, points, count, lower);
  halve(coder, points + count, n - count, upper);
}

std::size_t PointSetCoder::codeLower(BitCoder& coder, std::size_t lower, std::size_t n) {
  if (n == 1) return single_.code(coder, lower == 1) ? 1 : 0;
  if (together_[std::min(n, kMostKinds) - 1].code(coder, lower == 0 || lower == n)) {
    return side_.code(coder, lower == n) ? n : 0;
  }
  std::size_t least = 1;
  std::size_t most = n - 1;
  for (std::size_t step = 0; least < most; ++step) {
    const std::size_t middle = (least + most + 1) / 2;
    if (bisected_[std::min(step, kMostKinds - 1)].code(coder, lower >= middle)) {
      least = middle;
    } else {
      most = middle - 1;
    }
  }
  return least;
}

void PointSetCoder::forget() {
  forgetAll(single_, side_);
  for (NumberModel& model : low_) model.forget();
  for (NumberModel& model : size_) model.forget();
  for (AdaptiveBit& bit : together_) bit.forget();
  for (AdaptiveBit& bit : bisected_) bit.forget();
}

}  // namespace planar_mapping::detail
