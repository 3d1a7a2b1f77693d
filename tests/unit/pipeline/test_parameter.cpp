// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/parameter.h"

#include <gtest/gtest.h>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace planar_mapping {
namespace {

TEST(Parameter, DegreesOfTheFileAreRadiansInCode) {
  double angle = 0.5235987755982988;  // 30 degrees
  ParameterTable table;
  table.number("tolerance_deg", angle, Range::between(0.0, 90.0), "an angle");
  EXPECT_EQ(30.0, std::get<double>(table.find("tolerance_deg")->get()));
  table.find("tolerance_deg")->set(45.0);
  EXPECT_NEAR(0.7853981633974483, angle, 1e-15);
  EXPECT_EQ("deg", table.find("tolerance_deg")->unit());
}

TEST(Parameter, WritingAndReadingADegreeChangesNoBit) {
  Random random(1);
  double angle = 0.0;
  ParameterTable table;
  table.number("a_deg", angle, Range::any(), "an angle");
  const Parameter& parameter = *table.find("a_deg");
  for (int i = 0; i < 10000; ++i) {
    parameter.set(random.uniform(0.0, 90.0));
    const double before = angle;
    parameter.set(parameter.get());
    ASSERT_EQ(before, angle);
  }
}

TEST(Parameter, RangesSayAndCheckTheSame) {
  EXPECT_EQ("> 0", Range::positive().text());
  EXPECT_FALSE(Range::positive().contains(0.0));
  EXPECT_EQ(">= 3", Range::atLeast(3).text());
  EXPECT_TRUE(Range::atLeast(3).contains(3.0));
  EXPECT_EQ("[0, 1]", Range::between(0, 1).text());
  EXPECT_EQ("(0, 1]", Range::above(0, 1).text());
  EXPECT_FALSE(Range::above(0, 1).contains(0.0));
  EXPECT_EQ("any number", Range::any().text());
  for (const Range& range : {Range::positive(), Range::between(0, 1), Range::any()})
    EXPECT_FALSE(range.contains(std::numeric_limits<double>::quiet_NaN()) && range.low_open);
}

TEST(Parameter, BasicOnesAreMarkedByName) {
  ParameterTable table;
  double first = 1.0, second = 2.0;
  table.number("first_m", first, Range::any(), "");
  table.number("second_m", second, Range::any(), "");
  table.basic({"second_m"});
  EXPECT_FALSE(table.find("first_m")->basic);
  EXPECT_TRUE(table.find("second_m")->basic);
  EXPECT_THROW(table.basic({"third_m"}), InputError);
}

TEST(Parameter, TextThatYamlCouldMisreadIsQuoted) {
  EXPECT_EQ("compact", toYaml(std::string("compact")));
  EXPECT_EQ("\"auto\"", toYaml(std::string("auto")));
  EXPECT_EQ("\"yes\"", toYaml(std::string("yes")));
  EXPECT_EQ("\"a: b\"", toYaml(std::string("a: b")));
  EXPECT_EQ("\"12\"", toYaml(std::string("12")));
  EXPECT_EQ("\"q\\\"\\\\\"", toYaml(std::string("q\"\\")));
  EXPECT_EQ("\"\"", toYaml(std::string()));
}

TEST(Parameter, NumbersAreShortAndExact) {
  EXPECT_EQ("0.1", formatNumber(0.1));
  EXPECT_EQ("0.30000000000000004", formatNumber(0.1 + 0.2));
  EXPECT_EQ("1e+300", formatNumber(1e300));
}

TEST(StageTable, RefusesNamesThatAreTakenOrNoWord) {
  StageTable table;
  registerBuiltinStages(table);
  EXPECT_THROW(table.add({"voxel_grid", "", StageKind::Any, nullptr}), std::runtime_error);
  EXPECT_THROW(table.add({"Voxel", "", StageKind::Any, nullptr}), std::runtime_error);
  EXPECT_THROW(table.add({"", "", StageKind::Any, nullptr}), std::runtime_error);
}

}  // namespace
}  // namespace planar_mapping
