// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/detail/spelling.h"

#include <gtest/gtest.h>

namespace planar_mapping::detail {
namespace {

TEST(DidYouMean, FindsTheNearestWord) {
  const std::vector<std::string> words = {"distance_threshold_m", "min_inliers", "method"};
  EXPECT_EQ("; did you mean 'distance_threshold_m'?", didYouMean("distance_treshold_m", words));
  EXPECT_EQ("; did you mean 'distance_threshold_m'?", didYouMean("distance_threshold", words));
  EXPECT_EQ("; did you mean 'min_inliers'?", didYouMean("mni_inliers", words));
  EXPECT_EQ("; did you mean 'method'?", didYouMean("methods", words));
}

TEST(DidYouMean, SaysNothingWhereNothingIsNear) {
  const std::vector<std::string> words = {"min_inliers", "method"};
  EXPECT_EQ("", didYouMean("resolution", words));
  EXPECT_EQ("", didYouMean("", words));
  EXPECT_EQ("", didYouMean("method", {}));
  EXPECT_EQ("", didYouMean(std::string(100000, 'm'), words));
}

}  // namespace
}  // namespace planar_mapping::detail
