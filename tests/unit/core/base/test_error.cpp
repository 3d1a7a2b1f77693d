// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/error.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "planar_mapping/core/geometry/camera.h"

namespace planar_mapping {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <typename Call>
std::string messageOf(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Error, ParameterErrorNamesValueRangeAndUnit) {
  EXPECT_EQ(messageOf([] { requireInRange("angle", 7.5, 0, 3, "rad"); }),
            "angle = 7.5 rad is out of range, allowed: [0, 3] rad");
  EXPECT_EQ(messageOf([] { requireInRange("count", -1, 0, kInf); }),
            "count = -1 is out of range, allowed: >= 0");
  EXPECT_EQ(messageOf([] { requirePositive("length", 0, "m"); }),
            "length = 0 m is out of range, allowed: > 0 m");
}

TEST(Error, RangesIncludeTheirEnds) {
  EXPECT_NO_THROW(requireInRange("x", 0.0, 0.0, 1.0));
  EXPECT_NO_THROW(requireInRange("x", 1.0, 0.0, 1.0));
  EXPECT_THROW(requireInRange("x", 1.0000001, 0.0, 1.0), ParameterError);
}

TEST(Error, NanIsNeverInRange) {
  EXPECT_THROW(requireInRange("x", kNan, -kInf, kInf), ParameterError);
  EXPECT_THROW(requirePositive("x", kNan), ParameterError);
  EXPECT_THROW(requirePositive("x", kInf), ParameterError);
  EXPECT_NE(messageOf([] { requireInRange("x", kNan, 0, 1); }).find("nan"), std::string::npos);
}

TEST(Error, EveryTypeIsAnErrorAndARuntimeError) {
  EXPECT_THROW(throw ParameterError("p"), Error);
  EXPECT_THROW(throw InputError("i"), Error);
  EXPECT_THROW(throw IoError("f", "p"), Error);
  EXPECT_THROW(throw ConfigError({"a"}), Error);
  EXPECT_THROW(throw RenderError("r"), std::runtime_error);
}

TEST(Error, IoErrorStartsWithThePath) {
  const IoError error("/data/a.pcd", "is empty");
  EXPECT_STREQ(error.what(), "/data/a.pcd: is empty");
  EXPECT_EQ(error.path(), "/data/a.pcd");
}

TEST(Error, ConfigErrorListsEveryProblem) {
  const ConfigError error({"a.yaml:1:1: one", "a.yaml:2:1: two"});
  EXPECT_STREQ(error.what(), "a.yaml:1:1: one\na.yaml:2:1: two");
  EXPECT_EQ(error.problems().size(), 2u);
}

TEST(StereoNoise, RejectsWhatNoCameraHas) {
  EXPECT_NO_THROW(StereoNoise().validate());
  EXPECT_THROW((StereoNoise{0.0, 500, 0.5}.validate()), ParameterError);
  EXPECT_THROW((StereoNoise{0.12, -1, 0.5}.validate()), ParameterError);
  EXPECT_THROW((StereoNoise{0.12, 500, kNan}.validate()), ParameterError);
  EXPECT_THROW((StereoNoise{0.12, kInf, 0.5}.validate()), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
