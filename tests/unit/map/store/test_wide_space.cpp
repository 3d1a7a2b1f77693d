// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Wide free space costs what is stored of it, not what it would be cell by cell.
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <iostream>
#include <string>

#include "map_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/integration/moved_space.h"
#include "planar_mapping/map/planar_map.h"
#include "wide_map.h"

namespace planar_mapping {
namespace {

using detail::Int3;
using detail::SpaceRegion;
using detail::UnknownSpace;

/// Processor time.
template <typename Function>
double secondsOf(Function&& function) {
  const std::clock_t start = std::clock();
  function();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

PlanarMap readMap(const std::vector<std::uint8_t>& bytes) {
  return PlanarMap::deserialize(bytes.data(), bytes.size());
}

Pose turnedBy(double yaw, const Vector3& translation) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3(0.1, -0.2, 1.0).normalized()).toRotationMatrix();
  pose.translation() = translation;
  return pose;
}

/// A wall at 80 m, seen by a depth camera.
std::vector<std::uint8_t> wallAtEightyMetres(double yaw, double timestamp) {
  test::Scene scene;
  scene.boxes = {{{-500.0, 80.0, -500.0}, {500.0, 81.0, 500.0}, false, true}};
  scene.camera = {500.0, 500.0, 319.5, 239.5, 640, 480};
  PlanarMapParams params;
  params.approximation.resolution = 0.1;
  PlanarMap map(params);
  map.insert(test::look(scene, test::lookFrom({0.0, 0.0, 1.0}, yaw, 0.0), timestamp).frame());
  return map.serialize();
}

double freeVolume(const PlanarMap& map) {
  double volume = 0.0;
  for (const Cuboid& box : map.freeCuboids()) volume += box.volume();
  return volume;
}

/// Least of five runs.
void expectQuickMerge(const std::vector<std::uint8_t>& first,
                      const std::vector<std::uint8_t>& second) {
  double reading = 1e9, merging = 1e9;
  for (int i = 0; i < 5; ++i) {
    PlanarMap a, b;
    reading = std::min(reading, secondsOf([&]() {
                         a = readMap(first);
                         b = readMap(second);
                       }));
    merging = std::min(merging, secondsOf([&]() { a.merge(b); }));
  }
  std::cout << "reading " << 1e3 * reading << " ms, merging " << 1e3 * merging << " ms\n";
#ifndef PLANAR_MAPPING_SANITIZED
  EXPECT_LT(merging, 3.0 * reading);
#endif
}

TEST(WideSpace, MergingTwoMapsCostsAtMostThreeTimesReadingBoth) {
  expectQuickMerge(test::wideMap(55), test::wideMap(55, 1, 1.0));
  expectQuickMerge(test::wideMap(55, 2), test::wideMap(55, 2, 1.0));
  expectQuickMerge(wallAtEightyMetres(0.0, 0.0), wallAtEightyMetres(0.1, 1.0));
}

TEST(WideSpace, AMapThatIsTurnedCostsWhatItsSurfacesAre) {
  PlanarMap map = readMap(wallAtEightyMetres(0.0, 0.0));
  const PlanarMap other = readMap(wallAtEightyMetres(0.0, 1.0));
  const double volume = freeVolume(map);
  const double seconds = secondsOf([&]() { map.merge(other, turnedBy(0.3, {0.33, -7.12, 0.2})); });
  EXPECT_GT(freeVolume(map), 1.2 * volume);
#ifndef PLANAR_MAPPING_SANITIZED
  EXPECT_LT(seconds, 3.0);
#endif
}

TEST(WideSpace, AMapOfThreeKilobytesIsListedInSeconds) {
  for (const std::int32_t step : {1, 2}) {
    const std::vector<std::uint8_t> bytes = test::wideMap(55, step);
    EXPECT_LT(bytes.size(), 3000U);
    const PlanarMap map = readMap(bytes);
    std::vector<Cuboid> boxes;
    const double seconds = secondsOf([&]() { boxes = map.freeCuboids(); });
    EXPECT_EQ(boxes.size(), step == 1 ? 1U : 55U * 55U * 55U);
    double volume = 0.0;
    for (const Cuboid& box : boxes) volume += box.volume();
    EXPECT_NEAR(volume, std::pow(3.2, 3.0) * 55.0 * 55.0 * 55.0, 1e-3);
#ifndef PLANAR_MAPPING_SANITIZED
    EXPECT_LT(seconds, 2.0);
#endif
  }
}

TEST(WideSpace, WhatIsCutIsTakenCellByCell) {
  const PlanarMap map = readMap(test::wideMap(4));
  const Vector3 low(1.0, 1.1, -5.0), high(5.0, 12.0, 3.3);
  double volume = 0.0;
  for (const Cuboid& box : map.spaceCuboids(CellState::Free, low, high)) volume += box.volume();
  EXPECT_NEAR(volume, 4.0 * 10.9 * 3.3, 1e-6);
}

TEST(WideSpace, BeyondItsBudgetItIsRefused) {
  PlanarMap map = readMap(test::wideMap(27, 2));
  const PlanarMap other = readMap(test::wideMap(27, 2, 1.0));
  const std::vector<std::uint8_t> before = map.serialize();
  try {
    map.merge(other, turnedBy(0.5, {0.0, 0.0, 0.0}));
    ADD_FAILURE() << "was merged";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("would have to be resampled"), std::string::npos);
  }
  EXPECT_EQ(map.serialize(), before);

  EXPECT_GT(freeVolume(readMap(test::cutMap(20))), 0.9 * std::pow(64.0, 2.0) * 3.2);
  EXPECT_THROW(readMap(test::cutMap(200)).freeCuboids(), InputError);
}

/// Regions that are alike, blocks that are and cells.
UnknownSpace someSpace(Unseen unseen) {
  UnknownSpace space(unseen);
  Random random(4);
  for (std::int32_t x = -2; x < 4; ++x) {
    for (std::int32_t y = -2; y < 3; ++y) {
      for (std::int32_t z = -1; z < 2; ++z) {
        std::vector<UnknownSpace::PlacedBlock> blocks;
        const std::size_t kind = random.below(5);
        for (std::int32_t i = 0; i < 512; ++i) {
          const Int3 at{8 * x + (i & 7), 8 * y + (i >> 3 & 7), 8 * z + (i >> 6)};
          std::uint64_t free = kind < 3 ? ~std::uint64_t{0} : 0;
          if (kind == 3 && random.below(10) == 0)
            free = (std::uint64_t{random.next()} << 32U) | random.next();
          const bool hides = unseen == Unseen::Free && kind == 2;
          if (kind < 4) blocks.push_back({at, {hides ? 0 : free, hides ? free : 0}});
        }
        space.add(blocks);
      }
    }
  }
  return space;
}

TEST(WideSpace, MovedSpaceIsWhatEachOfItsCellsWasByItsMiddle) {
  for (const Unseen unseen : {Unseen::Unknown, Unseen::Free}) {
    const UnknownSpace space = someSpace(unseen);
    for (const Pose& T : {turnedBy(0.0, {0.8, -1.2, 0.4}), turnedBy(0.0, {0.31, -1.27, 0.44}),
                          turnedBy(0.7, {1.31, -0.27, 2.44}), turnedBy(1.5, {-9.0, 3.0, 0.0})}) {
      const UnknownSpace moved = detail::movedSpace(space, 0.1, T);
      const Pose back = T.inverse();
      std::size_t unknown = 0, different = 0;
      detail::forEachPlace({-64, -64, -32}, {96, 64, 48}, [&](const Int3& cell) {
        const Vector3 middle = 0.1 * Vector3(cell.x + 0.5, cell.y + 0.5, cell.z + 0.5);
        const Vector3 from = (back * middle) / 0.1;
        // On the border between two cells rounding decides.
        if ((from - from.array().round().matrix()).cwiseAbs().minCoeff() < 1e-6) return;
        const bool is_unknown = moved.isUnknown(cell);
        unknown += is_unknown ? 1 : 0;
        different += is_unknown != space.isUnknown(detail::toInt3(from.array().floor())) ? 1 : 0;
      });
      EXPECT_EQ(different, 0U);
      EXPECT_GT(unknown, 100000U);
    }
  }
}

TEST(WideSpace, AddingIsThatOfCells) {
  const UnknownSpace a = someSpace(Unseen::Free);
  const UnknownSpace b = detail::movedSpace(a, 0.1, turnedBy(0.7, {1.31, -0.27, 2.44}));
  UnknownSpace by_regions = a, by_blocks = a;
  by_regions.add(b);
  std::vector<UnknownSpace::PlacedBlock> blocks;
  b.forEachBlock([&](const Int3& at, const UnknownSpace::Block& cells) {
    blocks.push_back({at, cells});
  });
  by_blocks.add(blocks);
  std::vector<std::uint64_t> words[2];
  for (const UnknownSpace* space : {&by_regions, &by_blocks}) {
    space->forEachBlock([&](const Int3& at, const UnknownSpace::Block& cells) {
      auto& list = words[space == &by_blocks ? 1 : 0];
      list.insert(list.end(), {detail::packKey(at), cells.free, cells.unknown});
    });
  }
  EXPECT_EQ(words[0], words[1]);
  EXPECT_GT(words[0].size(), 10000U);
}

}  // namespace
}  // namespace planar_mapping
