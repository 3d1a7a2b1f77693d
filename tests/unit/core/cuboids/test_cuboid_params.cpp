// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/cuboids/cuboid_approximation.h"

namespace planar_mapping {
namespace {

TEST(CuboidParams, ParametersOutOfRangeAreNamed) {
  const auto refused = [](auto change) {
    CuboidApproximationParams params;
    change(params);
    EXPECT_THROW(params.validate(), ParameterError);
  };
  EXPECT_NO_THROW(CuboidApproximationParams().validate());
  refused([](auto& p) { p.resolution = 0; });
  refused([](auto& p) { p.resolution = std::nan(""); });
  refused([](auto& p) { p.thickness = -1; });
  refused([](auto& p) { p.density_threshold = 0; });
  refused([](auto& p) { p.density_threshold = 1.1; });
  refused([](auto& p) { p.min_width = -0.1; });
  refused([](auto& p) { p.min_height = std::nan(""); });
  refused([](auto& p) { p.min_points_per_cell = 0; });
  refused([](auto& p) { p.hole_size = -1; });
  refused([](auto& p) { p.absorption = 0.6; });
  refused([](auto& p) { p.up.setZero(); });
  refused([](auto& p) { p.up.x() = std::nan(""); });
  refused([](auto& p) { p.threads = -1; });
}

}  // namespace
}  // namespace planar_mapping
