// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/evaluation_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace planar_mapping::evaluation {
namespace {

using Json = nlohmann::json;

PlaceResult result(const std::string& method, std::size_t place, double cells) {
  PlaceResult one;
  one.scene = "corridor";
  one.simulated = true;
  one.place = place;
  one.cell = 0.1;
  one.method = method;
  one.figures.cells = cells;
  one.figures.completeness = 0.9;
  return one;
}

std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  return fields;
}

TEST(Quantile, InterpolatesBetweenRanks) {
  EXPECT_FALSE(quantile({}, 0.5).has_value());
  EXPECT_DOUBLE_EQ(7.0, *quantile({7.0}, 0.25));
  EXPECT_DOUBLE_EQ(2.5, *quantile({4.0, 1.0, 3.0, 2.0}, 0.5));
  EXPECT_DOUBLE_EQ(1.75, *quantile({4.0, 1.0, 3.0, 2.0}, 0.25));  // rank 0.75
  EXPECT_DOUBLE_EQ(4.0, *quantile({4.0, 1.0, 3.0, 2.0}, 1.0));
}

TEST(EvaluationReport, RowsAreMediansAndQuartilesOverPlaces) {
  const auto rows = summarize({result("SG", 0, 100), result("RA", 0, 10), result("SG", 1, 300),
                               result("RA", 1, 20), result("SG", 2, 200), result("RA", 2, 60)});
  ASSERT_EQ(2u, rows.size());
  EXPECT_EQ("SG", rows[0].method);
  EXPECT_EQ(3u, rows[0].places);
  EXPECT_DOUBLE_EQ(200.0, *rows[0].median.cells);
  EXPECT_DOUBLE_EQ(150.0, *rows[0].lower.cells);
  EXPECT_DOUBLE_EQ(250.0, *rows[0].upper.cells);
  EXPECT_DOUBLE_EQ(20.0, *rows[1].median.cells);
}

TEST(EvaluationReport, FiguresThatAPlaceLacksAreLeftOutOfTheMedian) {
  PlaceResult without = result("SG", 1, 100);
  without.figures.completeness.reset();
  const auto rows = summarize({result("SG", 0, 100), without});
  EXPECT_DOUBLE_EQ(0.9, *rows[0].median.completeness);
  EXPECT_FALSE(rows[0].median.error_percent.has_value());
}

TEST(EvaluationReport, NamesWhereAPlanarMapIsBehindABaseline) {
  PlaceResult ra = result("RA", 0, 10);
  ra.figures.memory_bytes = 200;
  ra.figures.completeness = 0.904;
  PlaceResult og = result("OG", 0, 50);
  og.figures.completeness = 0.906;
  og.figures.memory_bytes = 9000;
  PlaceResult ours = result("PG", 0, 10);  // as many cells as RA is no loss
  ours.figures.memory_bytes = 201;
  const auto rows = summarize({og, ra, ours});
  EXPECT_TRUE(rows[0].losses.empty()) << "only planar maps are compared";
  EXPECT_EQ((std::vector<std::string>{"OG:completeness", "RA:memory"}), rows[2].losses);
}

TEST(EvaluationReport, MethodsOfOtherCellSizesAndScenesAreNotCompared) {
  PlaceResult other_cell = result("RA", 0, 1);
  other_cell.cell = 0.2;
  PlaceResult other_scene = result("SG", 0, 1);
  other_scene.scene = "outdoor";
  const auto rows = summarize({other_cell, other_scene, result("PG", 0, 10)});
  EXPECT_TRUE(rows[2].losses.empty());
}

TEST(EvaluationReport, JsonHasThePromisedMembersAndNullWhereThereIsNoTruth) {
  const ReportHeader header{{{"version", "1"}, {"seed", "7"}}, true};
  const Json json = Json::parse(toJson(header, {result("SG", 0, 100), result("SG", 1, 200)}));
  EXPECT_EQ("7", json["seed"]);
  EXPECT_TRUE(json["interrupted"]);
  ASSERT_EQ(1u, json["results"].size());
  const Json& row = json["results"][0];
  for (const char* name :
       {"cell_m", "method", "cells", "combination_efficiency", "error_percent", "completeness",
        "coverage", "memory_bytes", "file_bytes", "time_ms_per_frame"}) {
    EXPECT_TRUE(row.contains(name)) << name;
  }
  EXPECT_TRUE(row["error_percent"].is_null());
  EXPECT_EQ(150, row["cells"]);
  EXPECT_EQ((Json{125, 175}), row["spread"]["cells"]);
  EXPECT_EQ((Json{100, 200}), row["per_place"]["cells"]);
}

TEST(EvaluationReport, CsvRowsHaveAsManyFieldsAsTheHeading) {
  PlaceResult odd = result("SG", 0, 100);
  odd.scene = "a, \"b\"";
  std::istringstream csv(toCsv({{{"seed", "7"}}, false}, {odd, result("PG", 0, 3)}));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ("# seed: 7", line);
  std::getline(csv, line);
  const std::size_t columns = fieldsOf(line).size();
  EXPECT_EQ(4 + 3 * figureColumns().size() + 1, columns);
  EXPECT_EQ("scene,cell_m,method,places,cells", line.substr(0, 32));
  std::getline(csv, line);
  EXPECT_EQ("\"a, \"\"b\"\"\",0.1,SG,1,100", line.substr(0, 23));
  std::getline(csv, line);
  EXPECT_EQ("corridor,0.1,PG,1,3", line.substr(0, 19));
  EXPECT_EQ(columns - 1, static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')));
}

TEST(EvaluationReport, NothingEvaluatedIsAnEmptyTable) {
  EXPECT_TRUE(summarize({}).empty());
  EXPECT_TRUE(Json::parse(toJson({}, {}))["results"].empty());
  EXPECT_EQ("", toMarkdown({}, {}));
}

TEST(EvaluationReport, ValuesThatAreNotFiniteAreNull) {
  PlaceResult odd = result("SG", 0, 100);
  odd.figures.held_back_median_m = INFINITY;
  EXPECT_TRUE(Json::parse(toJson({}, {odd}))["results"][0]["held_back_median_m"].is_null());
}

TEST(EvaluationReport, MarkdownSaysNowhereWhereNothingIsBehind) {
  const std::string text = toMarkdown({}, {result("RA", 0, 10), result("PG", 0, 9)});
  EXPECT_NE(std::string::npos, text.find("| PG | 9 |"));
  EXPECT_NE(std::string::npos, text.find("| nowhere |"));
}

}  // namespace
}  // namespace planar_mapping::evaluation
