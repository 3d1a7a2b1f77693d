// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "hostile_map_file.h"
#include "map_scene.h"
#include "noisy_sequence.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/map_query.h"

namespace planar_mapping {
namespace {

using namespace test;

Vector3 somewhere(Random& random) {
  return {random.uniform(-3.0, 3.0), random.uniform(-2.0, 8.0), random.uniform(-1.0, 3.5)};
}

void expectSameAnswers(const PlanarMap& live, const PlanarMap& finished) {
  EXPECT_EQ(numbersOf(finished.cuboids(), false), numbersOf(live.cuboids(), false));
  EXPECT_EQ(finished.unknownCells(), live.unknownCells());
  EXPECT_EQ(numbersOf(finished.unknownCuboids()), numbersOf(live.unknownCuboids()));
  Vector3 low, high, live_low, live_high;
  ASSERT_TRUE(finished.bounds(low, high));
  ASSERT_TRUE(live.bounds(live_low, live_high));
  EXPECT_EQ(low, live_low);
  EXPECT_EQ(high, live_high);
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    const Vector3 p = somewhere(random);
    EXPECT_EQ(finished.stateAt(p), live.stateAt(p));
    EXPECT_EQ(finished.occupancyAt(p), finished.isOccupied(p) ? 1.0 : live.occupancyAt(p));
    EXPECT_EQ(finished.cuboidsAt(p, 0.1), live.cuboidsAt(p, 0.1));
    const Vector3 to = p + 0.3 * Vector3(random.uniform(), random.uniform(), random.uniform());
    const BoxState box = stateOfBox(live, p, to), again = stateOfBox(finished, p, to);
    EXPECT_EQ(again.state, box.state);
    EXPECT_EQ(again.cuboids, box.cuboids);
    const Vector3 along = somewhere(random) - p;
    const auto hit = castRay(live, p, along, 5.0), hit_again = castRay(finished, p, along, 5.0);
    ASSERT_EQ(hit_again.has_value(), hit.has_value());
    if (!hit) continue;
    EXPECT_EQ(hit_again->distance, hit->distance);
    EXPECT_EQ(hit_again->state, hit->state);
    EXPECT_EQ(hit_again->cuboid, hit->cuboid);
  }
}

TEST(FinishedMap, AnswersAsTheLiveMapDoes) {
  for (const Profile profile : {Profile::Compact, Profile::Paper}) {
    const PlanarMap live = test::mapOfFrames(3, profile);
    expectSameAnswers(live, live.finished());
    expectSameAnswers(live, load(live.finished().serialize()));
  }
  for (const double resolution : {0.05, 0.1, 0.3}) {
    const PlanarMap live = noisyMap(resolution);
    expectSameAnswers(live, live.finished());
  }
}

TEST(FinishedMap, HasCuboidsOfAllKinds) {
  std::size_t rectangles = 0, boxes = 0, boxes_on_planes = 0;
  const PlanarMap finished = noisyMap(0.1).finished();
  for (const Cuboid& c : finished.cuboids()) {
    const bool is_straight =
        (c.orientation.toRotationMatrix().cwiseAbs().rowwise().maxCoeff().array() > 1.0 - 1e-12)
            .all();
    (c.plane_id < 0 ? boxes : is_straight ? boxes_on_planes : rectangles) += 1;
    EXPECT_EQ(c.state, CellState::Occupied);
  }
  EXPECT_GT(rectangles, 5u);
  EXPECT_GT(boxes, 5u);
  EXPECT_GT(boxes_on_planes, 0u);
}

TEST(FinishedMap, IsTheSameAfterLoadingAndCopying) {
  const PlanarMap finished = noisyMap(0.1).finished();
  const Bytes file = finished.serialize();
  PlanarMap loaded = load(file);
  ASSERT_TRUE(loaded.isFinished());
  const PlanarMap copy = loaded;
  loaded = PlanarMap();
  EXPECT_FALSE(loaded.isFinished());
  for (const PlanarMap& map : {copy, copy.finished()}) {
    ASSERT_TRUE(map.isFinished());
    EXPECT_EQ(map.serialize(), file);
    expectSameAnswers(finished, map);
  }
}

TEST(FinishedMap, KeepsTheParametersThatQueriesDependOn) {
  PlanarMapParams params;
  params.approximation.resolution = 0.002;
  params.unknown_resolution = 0.004;
  params.max_range = 10.0 / 3.0;
  params.association_angle = 4.98473281764 * (3.14159265358979323846 / 180.0);
  const PlanarMapParams kept = load(PlanarMap(params).finished().serialize()).params();
  EXPECT_EQ(kept.approximation.resolution, params.approximation.resolution);
  EXPECT_EQ(kept.unknown_resolution, params.unknown_resolution);
  EXPECT_EQ(kept.max_range, params.max_range);
  EXPECT_EQ(kept.association_angle, PlanarMapParams().association_angle);
}

TEST(FinishedMap, OfAnEmptyMapIsEmpty) {
  const PlanarMap empty = PlanarMap().finished();
  EXPECT_TRUE(empty.isFinished());
  EXPECT_TRUE(empty.empty());
  EXPECT_TRUE(load(empty.serialize()).empty());
}

TEST(FinishedMap, TakesLessThanTheFullMap) {
  for (const double resolution : {0.1, 0.5}) {
    const PlanarMap full = noisyMap(resolution);
    EXPECT_LT(full.finished().serialize().size(), full.serialize().size());
    EXPECT_LT(full.finished().memoryBytes(), full.memoryBytes());
  }
}

TEST(FinishedMap, HasNoPlanesAndNoTrajectory) {
  const PlanarMap finished = test::mapOfFrames(2).finished();
  EXPECT_TRUE(finished.planes().empty());
  EXPECT_TRUE(finished.trajectory().empty());
  EXPECT_EQ(finished.frames(), 0u);
  EXPECT_EQ(finished.cuboidCount(), finished.cuboids().size());
  EXPECT_EQ(finished.cuboidCountAtMost(), finished.cuboids().size());
}

TEST(FinishedMap, RefusesToGrow) {
  PlanarMap live = test::mapOfFrames(1);
  PlanarMap finished = live.finished();
  const Bytes file = finished.serialize();
  const test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.0}));
  EXPECT_THROW(finished.insert(view.frame()), InputError);
  EXPECT_THROW(finished.merge(live), InputError);
  EXPECT_THROW(live.merge(finished), InputError);
  EXPECT_THROW(finished.clear(), InputError);
  EXPECT_EQ(finished.serialize(), file);
  try {
    finished.insert(view.frame());
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("finished"), std::string::npos);
  }
}

}  // namespace
}  // namespace planar_mapping
