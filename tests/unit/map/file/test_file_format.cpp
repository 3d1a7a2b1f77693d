// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/map/planar_map.h"
#include "pmap_reader.h"

namespace planar_mapping {
namespace {

using test::Bytes;
using test::PmapReader;
using test::ReadPlane;

class FileFormat : public testing::TestWithParam<Profile> {};

TEST_P(FileFormat, IsReadByAReaderWrittenFromItsDescription) {
  PlanarMapParams params;
  params.approximation.profile = GetParam();
  params.max_range = 8.0;
  params.association_gap = 1.0 / 3.0;  // no decimal
  PlanarMap map(params);
  Random random(9);
  for (int i = 0; i < 3; ++i) {
    const test::View view = test::look(test::Scene(), test::lookFrom({0.1 * i, 0.0, 1.0}), 0.5 * i);
    std::vector<float> belief(view.xyz.size() / 3);
    for (float& p : belief) p = static_cast<float>(random.uniform(0.5, 1.0));
    FrameObservation frame = view.frame();
    frame.probability = &belief;
    map.insert(frame);
  }
  const Bytes file = map.serialize();
  const PmapReader read(file);
  EXPECT_EQ(read.in.end(), read.in.bytes.size());
  EXPECT_EQ(read.is_compact, GetParam() == Profile::Compact);
  EXPECT_TRUE(read.has_unknown);
  EXPECT_EQ(read.min_points_per_cell, 1);
  const double s = read.values[0];
  EXPECT_EQ(s, 0.1);
  EXPECT_EQ(read.values[13], 1.0 / 3.0);
  EXPECT_EQ(read.values[15], 8.0);

  ASSERT_EQ(read.poses.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const double x = 0.1 * static_cast<double>(i);
    const auto& p = read.poses[i];
    EXPECT_EQ(p[0], 0.5 * static_cast<double>(i));
    EXPECT_LT((Vector3(p[1], p[2], p[3]) - Vector3(x, 0.0, 1.0)).norm(), 2.2e-4);
    EXPECT_EQ(Vector3(map.trajectory()[i].second.translation()), Vector3(p[1], p[2], p[3]));
    const Quaternion turn(Matrix3(test::lookFrom({x, 0.0, 1.0}).linear()));
    EXPECT_NEAR(std::abs(turn.dot(Quaternion(p[7], p[4], p[5], p[6]).normalized())), 1.0, 1e-7);
  }

  ASSERT_EQ(read.planes.size(), map.planes().size());
  EXPECT_GE(read.next_plane_id, static_cast<std::int64_t>(map.planes().size()));
  for (std::size_t k = 0; k < read.planes.size(); ++k) {
    const ReadPlane& plane = read.planes[k];
    const MapPlane& own = map.planes()[k];
    EXPECT_EQ(plane.id, own.id);
    EXPECT_EQ(plane.frames, own.frames);
    EXPECT_LT((plane.n - own.plane.normal).norm(), 1e-12);
    EXPECT_NEAR(plane.n.dot(plane.origin) + own.plane.offset, 0.0, 1e-12);
    EXPECT_EQ(plane.weight, own.moments.weight());
    EXPECT_LT((plane.mean - own.moments.mean()).norm(), 1e-9);
    EXPECT_NEAR(std::sqrt(plane.residual), own.rms(), 1e-6 + 0.05 * own.rms());
    EXPECT_GT(plane.cells.size(), 0u);
    for (const auto& [c, value] : plane.cells) {
      const Vector3 centre = plane.origin + (c[0] + 0.5) * s * plane.u +
                             (c[1] + 0.5) * s * plane.v - 0.5 * s * plane.n;
      EXPECT_FALSE(map.cuboidsAt(centre, s).empty());
    }
  }

  EXPECT_GT(read.cells.size(), 0u);
  for (const auto& [c, value] : read.cells) {
    EXPECT_FALSE(map.cuboidsAt(s * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5), s).empty());
  }
  // Beliefs are what the cuboids' come from.
  std::set<double> beliefs(read.beliefs.begin(), read.beliefs.end());
  for (const ReadPlane& plane : read.planes) {
    beliefs.insert(plane.beliefs.begin(), plane.beliefs.end());
  }
  EXPECT_GT(beliefs.size(), 3u);
  for (const Cuboid& cuboid : map.cuboids()) {
    EXPECT_GE(cuboid.probability, *beliefs.begin() - 1e-6);
    EXPECT_LE(cuboid.probability, *beliefs.rbegin() + 1e-6);
  }
  ASSERT_EQ(read.region_frames.size(), 1u);
  EXPECT_LE(read.region_frames[0], 2);

  std::size_t not_occupied = 0;
  for (const auto& [c, value] : read.space_cells) {
    const Vector3 centre = s * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
    if (value == 1) {
      EXPECT_FALSE(map.isUnknown(centre));
    } else {
      EXPECT_FALSE(map.isFree(centre));
      not_occupied += map.isUnknown(centre);
    }
  }
  EXPECT_EQ(not_occupied, map.unknownCells());
}

INSTANTIATE_TEST_SUITE_P(Profiles, FileFormat, testing::Values(Profile::Compact, Profile::Paper));

TEST(FileFormat, DescribesTheEmptyMap) {
  const Bytes file = PlanarMap().serialize();
  EXPECT_LT(file.size(), 20u);
  const PmapReader read(file);
  EXPECT_TRUE(read.poses.empty());
  EXPECT_TRUE(read.planes.empty());
  EXPECT_TRUE(read.cells.empty());
  EXPECT_TRUE(read.space_cells.empty());
  EXPECT_EQ(read.in.end(), read.in.bytes.size());
}

TEST(FileFormat, AnglesGivenInDegreesTakeNoMoreBytes) {
  PlanarMapParams in_degrees;
  in_degrees.association_angle = 4.98473281764 * (3.14159265358979323846 / 180.0);
  ASSERT_NE(in_degrees.association_angle, PlanarMapParams().association_angle);
  EXPECT_EQ(PlanarMap(in_degrees).serialize(), PlanarMap().serialize());
  PlanarMapParams steepest;
  steepest.association_angle = 0.5 * 3.14159265358979323846;
  EXPECT_NO_THROW(PlanarMap(PlanarMap(steepest).params()));
}

/// Files written in version 2, of three frames each.
class Version2 : public testing::TestWithParam<const char*> {};

TEST_P(Version2, IsReadAndSavedAsVersion4) {
  const std::string path =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/tests/data/version2_" + GetParam() + ".pmap";
  std::ifstream stream(path, std::ios::binary);
  const Bytes file((std::istreambuf_iterator<char>(stream)), {});
  ASSERT_GT(file.size(), 4000u) << path;
  ASSERT_EQ(file[8], 2);
  const PlanarMap map = PlanarMap::deserialize(file.data(), file.size());
  EXPECT_EQ(map.frames(), 3u);
  EXPECT_EQ(map.planes().size(), 10u);
  EXPECT_EQ(map.params().approximation.resolution, 0.25);
  EXPECT_NEAR(static_cast<double>(map.unknownCells()), 34430.0, 40.0);
  EXPECT_EQ(map.trajectory()[2].first, 1.0);
  EXPECT_LT((Vector3(map.trajectory()[2].second.translation()) - Vector3(0.3, 0.0, 1.0)).norm(),
            3e-4);
  EXPECT_TRUE(map.isOccupied({0.0, 5.02, 1.4}));
  EXPECT_TRUE(map.isFree({0.0, 3.0, 1.6}));
  EXPECT_TRUE(map.isUnknown({0.0, 6.0, 1.2}));
  const Bytes saved = map.serialize();
  EXPECT_EQ(saved[4], 4);
  EXPECT_LT(saved.size() * 4, file.size());
  const PlanarMap again = PlanarMap::deserialize(saved.data(), saved.size());
  EXPECT_EQ(again.serialize(), saved);
  EXPECT_EQ(again.cuboids().size(), map.cuboids().size());
  for (std::size_t cut = 0; cut < file.size(); cut += 37) {
    EXPECT_ANY_THROW(PlanarMap::deserialize(file.data(), cut));
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, Version2, testing::Values("compact", "paper"));

}  // namespace
}  // namespace planar_mapping
