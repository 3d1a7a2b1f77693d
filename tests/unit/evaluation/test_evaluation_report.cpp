// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "evaluation/metrics/evaluation_report.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/localization/trajectory_error.h"

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
  EXPECT_EQ(4 + 3 * figureColumns().size(), columns);
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

TEST(EvaluationReport, MarkdownHasARowForEachMethod) {
  const std::string text = toMarkdown({}, {result("RA", 0, 10), result("PG", 0, 9)});
  EXPECT_NE(std::string::npos, text.find("| PG | 9 |"));
  EXPECT_NE(std::string::npos, text.find("| RA | 10 |"));
}

Pose poseAt(double x, double y, double z, double yaw = 0.0) {
  Pose pose = Pose::Identity();
  pose.translation() << x, y, z;
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix();
  return pose;
}

const std::vector<Pose> kBend = {poseAt(0, 0, 0), poseAt(1, 0, 0), poseAt(2, 0, 0), poseAt(2, 1, 0),
                                 poseAt(2, 2, 1)};

TEST(TrajectoryError, EqualTrajectoriesHaveNone) {
  const TrajectoryError error = trajectoryError(kBend, kBend);
  EXPECT_EQ(error.poses, 5u);
  EXPECT_NEAR(error.path_length, 3.0 + std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(error.absolute_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.relative_translation_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.end_translation, 0.0, 1e-12);
  EXPECT_NEAR(error.endDriftPercent(), 0.0, 1e-12);
}

TEST(TrajectoryError, DoesNotDependOnTheWorldOfTheEstimate) {
  Pose T = poseAt(5, -3, 2, 0.7);
  T.linear() = T.linear() * Eigen::AngleAxisd(0.4, Vector3::UnitX()).toRotationMatrix();
  std::vector<Pose> moved;
  for (const Pose& pose : kBend) moved.push_back(T * pose);
  const TrajectoryError error = trajectoryError(moved, kBend);
  EXPECT_NEAR(error.absolute_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.relative_rotation_rms, 0.0, 1e-7);
  EXPECT_NEAR(error.end_translation, 0.0, 1e-12);
  EXPECT_TRUE((error.T_reference_estimate * T).isApprox(Pose::Identity(), 1e-12));
}

TEST(TrajectoryError, ScaleIsNotCorrected) {
  // A square of side 2 estimated with side 2.2: corners are off by 0.1 * sqrt(2) about the centre.
  const std::vector<Pose> square = {poseAt(0, 0, 0), poseAt(2, 0, 0), poseAt(2, 2, 0),
                                    poseAt(0, 2, 0)};
  const std::vector<Pose> larger = {poseAt(0, 0, 0), poseAt(2.2, 0, 0), poseAt(2.2, 2.2, 0),
                                    poseAt(0, 2.2, 0)};
  const TrajectoryError error = trajectoryError(larger, square);
  EXPECT_NEAR(error.absolute_rms, 0.1 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(error.absolute_max, 0.1 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(error.relative_translation_rms, 0.2, 1e-12);
  EXPECT_NEAR(error.end_translation, 0.2, 1e-12);
  EXPECT_NEAR(error.endDriftPercent(), 100.0 * 0.2 / 6.0, 1e-12);
}

TEST(TrajectoryError, OneWrongTurnShowsInRotationOnce) {
  // After the second pose the estimate looks 0.1 rad too far left and goes on straight ahead.
  std::vector<Pose> estimate = kBend;
  const Pose turn = kBend[1] * poseAt(0, 0, 0, 0.1) * kBend[1].inverse();
  for (std::size_t i = 1; i < estimate.size(); ++i) estimate[i] = turn * kBend[i];
  const TrajectoryError error = trajectoryError(estimate, kBend);
  EXPECT_NEAR(error.relative_rotation_rms, 0.1 / std::sqrt(4.0), 1e-12);
  EXPECT_NEAR(error.relative_translation_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.end_rotation, 0.1, 1e-12);
  // The chord of 0.1 rad over the sqrt(1 + 4) m between the second and the last position, seen
  // from above.
  EXPECT_NEAR(error.end_translation, 2.0 * std::sin(0.05) * std::sqrt(5.0), 1e-12);
}

TEST(TrajectoryError, StraightPathIsLaidOnByItsFirstPose) {
  std::vector<Pose> straight;
  std::vector<Pose> estimate;
  for (int i = 0; i < 11; ++i) {
    straight.push_back(poseAt(0.1 * i, 0, 0));
    estimate.push_back(poseAt(7.0, 0.1 * i * 1.02, 1.0, M_PI / 2.0));
  }
  const TrajectoryError error = trajectoryError(estimate, straight);
  EXPECT_NEAR(error.end_translation, 0.02, 1e-12);
  EXPECT_NEAR(error.endDriftPercent(), 2.0, 1e-9);
  EXPECT_NEAR(error.absolute_max, 0.02, 1e-12);
}

TEST(TrajectoryError, CameraAtRestHasNoDriftInPercent) {
  const std::vector<Pose> still(4, poseAt(1, 2, 3));
  const TrajectoryError error = trajectoryError(still, still);
  EXPECT_EQ(error.path_length, 0.0);
  EXPECT_EQ(error.endDriftPercent(), 0.0);
}

TEST(TrajectoryError, FewPosesGiveNumbersToo) {
  EXPECT_EQ(trajectoryError({}, {}).poses, 0u);
  const TrajectoryError one = trajectoryError({poseAt(1, 0, 0)}, {poseAt(0, 0, 0)});
  EXPECT_EQ(one.poses, 1u);
  EXPECT_NEAR(one.absolute_rms, 0.0, 1e-12);
}

TEST(TrajectoryError, RefusesWhatCannotBeCompared) {
  EXPECT_THROW(trajectoryError({poseAt(0, 0, 0)}, {}), InputError);
  std::vector<Pose> bad = kBend;
  bad[2].translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(trajectoryError(bad, kBend), InputError);
  EXPECT_THROW(trajectoryError(kBend, bad), InputError);
}

TEST(TrajectoryError, StaysExactFarFromTheOrigin) {
  std::vector<Pose> far;
  for (const Pose& pose : kBend) far.push_back(poseAt(1e6, 1e6, 0) * pose);
  EXPECT_NEAR(trajectoryError(far, kBend).absolute_rms, 0.0, 1e-6);
}

}  // namespace
}  // namespace planar_mapping::evaluation
