// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/detail/gather_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

namespace planar_mapping::detail {
namespace {

/// Point i is (i, i + 1/4, i + 1/2).
struct Cloud {
  std::size_t stride;
  std::unique_ptr<float[]> data;

  Cloud(std::size_t points, std::size_t floats)
      : stride(floats), data(new float[(points - 1) * floats + 3]) {
    std::fill_n(data.get(), (points - 1) * floats + 3, -1.0F);
    for (std::size_t i = 0; i < points; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        data[i * floats + axis] = static_cast<float>(i) + 0.25F * static_cast<float>(axis);
      }
    }
  }
};

void expectPoints(const std::vector<int>& expected, const std::vector<float>& x,
                  const std::vector<float>& y, const std::vector<float>& z) {
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const auto value = static_cast<float>(expected[k]);
    ASSERT_EQ(x[k], value) << k;
    ASSERT_EQ(y[k], value + 0.25F) << k;
    ASSERT_EQ(z[k], value + 0.5F) << k;
  }
}

void expectGathered(std::size_t stride, const std::vector<int>& indices) {
  const Cloud cloud(100, stride);
  std::vector<float> x(indices.size()), y(x), z(x);
  gatherPoints(cloud.data.get(), stride, indices.data(), indices.size(), x.data(), y.data(),
               z.data());
  expectPoints(indices, x, y, z);
}

TEST(GatherPoints, ReadsAnyIndicesAtAnyStride) {
  std::vector<int> neighbours(100);
  std::iota(neighbours.begin(), neighbours.end(), 0);
  const std::vector<int> to_the_end(neighbours.begin() + 84, neighbours.end());
  const std::vector<int> backwards(neighbours.rbegin(), neighbours.rend());
  // From the first to the last as far apart as neighbours are, but none.
  std::vector<int> swapped(neighbours.begin(), neighbours.begin() + 16);
  std::swap(swapped[5], swapped[9]);
  std::vector<int> repeated(neighbours.begin(), neighbours.begin() + 16);
  repeated[7] = 6;
  const std::vector<int> few = {3, 99, 0};
  const std::vector<int> gaps = {0, 2, 3, 7, 8, 9, 20, 95, 96, 97, 98, 99};
  for (const std::size_t stride : {3, 4, 5, 8}) {
    for (const auto& indices : {neighbours, to_the_end, backwards, swapped, repeated, few, gaps}) {
      expectGathered(stride, indices);
    }
  }
}

TEST(GatherPoints, ReadsAllPointsAtAnyStride) {
  for (const std::size_t stride : {3, 4, 5, 8}) {
    for (const std::size_t n : {1, 3, 4, 19}) {
      const Cloud cloud(n, stride);
      std::vector<float> x(n), y(x), z(x);
      gatherPoints(cloud.data.get(), stride, nullptr, n, x.data(), y.data(), z.data());
      std::vector<int> all(n);
      std::iota(all.begin(), all.end(), 0);
      expectPoints(all, x, y, z);
    }
  }
}

}  // namespace
}  // namespace planar_mapping::detail
