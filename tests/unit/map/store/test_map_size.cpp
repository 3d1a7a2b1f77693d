// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Bytes of the live map and of its file (issues 3 and 4), on scenes that any machine makes the
// same.
#include <gtest/gtest.h>

#include <vector>

#include "map_scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using namespace test;

PlanarMapParams paramsOf(bool unknown) {
  PlanarMapParams params;
  params.unknown_space = unknown;
  params.max_range = 8.0;
  return params;
}

/// Walls of 100 m x 2.4 m on both sides, floor and ceiling, 2.4 m apart.
Scene corridor() {
  Scene scene;
  scene.boxes = {{{-1.2, -2.0, 0.0}, {1.2, 104.0, 2.4}, true, true}};
  return scene;
}

TEST(MapSize, OfACorridorOfAHundredMetres) {
  PlanarMap map(paramsOf(false));
  for (int i = 0; i < 200; ++i)
    map.insert(look(corridor(), lookFrom({0.0, 0.5 * i, 1.2}), 0.1 * i).frame());
  EXPECT_GT(map.cuboids().size(), 3u);
  // A tile of 64 cells takes about 90 bytes, a frame's pose 64.
  const std::size_t tiles = 4 * 24 * 1060 / 64;
  EXPECT_LT(map.memoryBytes(), 3 * 90 * tiles / 2 + 2 * 64 * 200);
}

TEST(MapSize, GrowsByPosesAloneWhileTheCameraIsAtRest) {
  PlanarMap map(paramsOf(true));
  Scene scene;
  scene.camera = {80.0, 80.0, 63.5, 47.5, 128, 96};
  std::size_t file = 0;
  std::size_t memory = 0;
  for (int i = 0; i < 1000; ++i) {
    map.insert(look(scene, lookFrom({0.0, 0.0, 1.0}), 0.1 * i).frame());
    if (i == 9) file = map.serialize().size();
    if (i == 9) memory = map.memoryBytes();
  }
  EXPECT_EQ(map.frames(), 1000u);
  EXPECT_LT(static_cast<double>(map.memoryBytes()),
            1.05 * static_cast<double>(memory) + 2 * 64 * 1000);
  // Noise lets rays pass a few more cells before the walls.
  EXPECT_LT(static_cast<double>(map.serialize().size()), 1.12 * static_cast<double>(file));
}

TEST(MapSize, OfAPoseIsLessThanItsNumbers) {
  PlanarMapParams params = paramsOf(false);
  PlanarMap still(params), moving(params);
  Scene scene;
  scene.camera = {20.0, 20.0, 15.5, 11.5, 32, 24};
  Random random(4);
  const View empty = look(scene, lookFrom({0.0, 0.0, 1.0}));
  const Indices nothing;
  for (int i = 0; i < 500; ++i) {
    FrameObservation frame = empty.frame();
    frame.planes = nullptr;
    frame.indices = &nothing;
    frame.timestamp = 0.1 * i;
    still.insert(frame);
    // As a hand-held camera moves: by centimetres and degrees, shaken by millimetres.
    const Vector3 shaken(0.02 * i + 0.002 * random.uniform(-1.0, 1.0),
                         0.002 * random.uniform(-1.0, 1.0), 1.0);
    frame.T_world_sensor = lookFrom(shaken, 0.01 * i + 0.002 * random.uniform(-1.0, 1.0));
    moving.insert(frame);
  }
  EXPECT_LT(still.serialize().size(), 1000u);
  EXPECT_LT(moving.serialize().size(), 500u * 50u);
}

TEST(MapSize, OfARoomIsATenthOfOctoMaps) {
  // Five frames of a room; unknown space included. OctoMap takes 494 kB of the heap, 4,946 bytes of
  // a .bt (benchmarks/benchmark_map).
  Scene scene;
  scene.camera = {500.0, 500.0, 319.5, 239.5, 640, 480};
  PlanarMap map(paramsOf(true));
  for (int i = 0; i < 5; ++i) map.insert(look(scene, lookFrom({-0.4 + 0.2 * i, 0.0, 1.0})).frame());
  const std::size_t with_cuboids = (static_cast<void>(map.cuboids()), map.memoryBytes());
  EXPECT_LT(with_cuboids, 49400u);
  EXPECT_LT(map.finished().serialize().size(), 4946u);
  EXPECT_GT(map.unknownCells(), 10000u);  // within the bounds of the cuboids
}

TEST(MapSize, OfAnEmptyMapIsAKilobyte) {
  const PlanarMap empty;
  EXPECT_LE(empty.memoryBytes(), 1024u);
  EXPECT_LE(empty.finished().memoryBytes(), 1024u);
}

TEST(MapSize, OfARoomInCoarseCells) {
  PlanarMapParams params = paramsOf(true);
  params.approximation.resolution = 0.5;
  Scene scene;
  scene.camera = {250.0, 250.0, 159.5, 119.5, 320, 240};
  PlanarMap map(params);
  for (int i = 0; i < 10; ++i)
    map.insert(look(scene, lookFrom({-0.4 + 0.1 * i, 0.0, 1.0}, 0.05 * i), 0.1 * i).frame());
  ASSERT_GT(map.planes().size(), 5u);
  const PlanarMap unasked(map);
  EXPECT_LT(unasked.memoryBytes(), 7000u);
  ASSERT_EQ(unasked.cuboids().size(), 7u);
  EXPECT_LT(unasked.memoryBytes(), 10000u);
}

TEST(MapSize, OfUncertainCellsIsThatOfCertainOnes) {
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  PlanarMap certain(paramsOf(false)), uncertain(paramsOf(false));
  certain.insert(view.frame());
  Random random(8);
  std::vector<float> belief;
  for (std::size_t i = 0; i < view.xyz.size() / 3; ++i)
    belief.push_back(static_cast<float>(random.uniform(0.55, 1.0)));
  FrameObservation frame = view.frame();
  frame.probability = &belief;
  const FrameUpdate update = uncertain.insert(frame);
  ASSERT_GT(update.cells_added, 1000u);
  const std::size_t cells = update.cells_added;
  EXPECT_LT(uncertain.memoryBytes(), certain.memoryBytes() * 5 / 4);
  EXPECT_LT(uncertain.serialize().size(), certain.serialize().size() + cells);
}

TEST(MapSize, IsTheSameAfterLoading) {
  PlanarMap map(paramsOf(true));
  for (int i = 0; i < 4; ++i) map.insert(look(Scene(), lookFrom({0.1 * i, 0.0, 1.0})).frame());
  const std::vector<std::uint8_t> file = map.serialize();
  const PlanarMap loaded = PlanarMap::deserialize(file.data(), file.size());
  const double live = static_cast<double>(map.memoryBytes());
  EXPECT_LT(static_cast<double>(loaded.memoryBytes()), 1.3 * live);
}

}  // namespace
}  // namespace planar_mapping
