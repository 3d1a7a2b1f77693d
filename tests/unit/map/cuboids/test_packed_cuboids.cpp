// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a map remembers of its cuboids is packed, and comes back bit by bit.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "store/key_map.h"
#include "cuboids/packed_boxes.h"
#include "cuboids/packed_cover.h"
#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::detail {
namespace {

std::int32_t whole(Random& random, std::int32_t low, std::int32_t high) {
  return static_cast<std::int32_t>(std::floor(random.uniform(low, high + 1.0)));
}

float anyProbability(Random& random) {
  const double draw = random.uniform(0.0, 1.0);
  if (draw < 0.4) return 1.0f;
  if (draw < 0.7) return static_cast<float>(whole(random, 1, 17)) / 17;
  return static_cast<float>(random.uniform(0.0, 1.0));
}

PatchCover anyCover(Random& random) {
  PatchCover cover;
  cover.plane = whole(random, 0, 5000);
  cover.key = packKey(whole(random, -9000, 9000), whole(random, -3, 3));
  cover.revision = static_cast<std::uint32_t>(whole(random, 0, 100000));
  cover.frame_revision = static_cast<std::uint32_t>(whole(random, 0, 300));
  cover.spread = static_cast<std::uint8_t>(whole(random, 0, 255));
  for (int i = whole(random, 0, 30); i > 0; --i) {
    cover.rectangles.push_back({{whole(random, -500, 2000), whole(random, -300, 300),
                                 whole(random, 1, 256), whole(random, 1, 200)},
                                anyProbability(random)});
  }
  for (int i = whole(random, 0, 40); i > 0; --i) {
    cover.loose.push_back(
        {whole(random, -500, 2000), whole(random, -300, 300), anyProbability(random)});
  }
  for (int i = whole(random, 0, 6); i > 0; --i) {
    cover.regions.push_back(
        packKey(Int3{whole(random, -9, 9), whole(random, -9, 9), whole(random, -16384, 2)}));
  }
  return cover;
}

void expectSame(const PatchCover& a, const PatchCover& b) {
  EXPECT_EQ(a.plane, b.plane);
  EXPECT_EQ(a.key, b.key);
  EXPECT_EQ(a.revision, b.revision);
  EXPECT_EQ(a.frame_revision, b.frame_revision);
  EXPECT_EQ(a.spread, b.spread);
  EXPECT_EQ(a.regions, b.regions);
  ASSERT_EQ(a.rectangles.size(), b.rectangles.size());
  for (std::size_t i = 0; i < a.rectangles.size(); ++i) {
    EXPECT_EQ(a.rectangles[i].place.a, b.rectangles[i].place.a);
    EXPECT_EQ(a.rectangles[i].place.b, b.rectangles[i].place.b);
    EXPECT_EQ(a.rectangles[i].place.width, b.rectangles[i].place.width);
    EXPECT_EQ(a.rectangles[i].place.height, b.rectangles[i].place.height);
    EXPECT_EQ(a.rectangles[i].probability, b.rectangles[i].probability);
  }
  ASSERT_EQ(a.loose.size(), b.loose.size());
  for (std::size_t i = 0; i < a.loose.size(); ++i) {
    EXPECT_EQ(a.loose[i].a, b.loose[i].a);
    EXPECT_EQ(a.loose[i].b, b.loose[i].b);
    EXPECT_EQ(a.loose[i].probability, b.loose[i].probability);
  }
}

TEST(PackedCover, ComesBackAsItWas) {
  Random random(11);
  for (int i = 0; i < 500; ++i) {
    const PatchCover cover = anyCover(random);
    std::vector<std::uint8_t> bytes = packCover(cover);
    const PackedCover packed({bytes.data(), bytes.size(), 0});
    expectSame(cover, packed.unpacked());
    EXPECT_EQ(packed.head().plane, cover.plane);
    EXPECT_EQ(packed.head().key, cover.key);
    EXPECT_EQ(packed.regions(), cover.regions);
    EXPECT_EQ(packed.count(), cover.rectangles.size());
    std::size_t left = cover.rectangles.size();
    for (std::size_t r = 0; r < cover.rectangles.size(); r += 3) {
      PackedCover::setReplaced(bytes.data(), bytes.size(), r, true);
      --left;
    }
    for (std::size_t r = 0; r < cover.rectangles.size(); ++r) {
      EXPECT_EQ(packed.isReplaced(r), r % 3 == 0);
    }
    EXPECT_EQ(packed.count(), left);
    expectSame(cover, packed.unpacked());
  }
}

bool isSame(const Cuboid& a, const Cuboid& b) {
  const auto same = [](const auto& x, const auto& y) {
    return std::memcmp(x.data(), y.data(), sizeof(double) * static_cast<std::size_t>(x.size())) ==
           0;
  };
  return same(a.center, b.center) && same(a.size, b.size) &&
         same(a.orientation.coeffs(), b.orientation.coeffs()) && a.plane_id == b.plane_id &&
         a.probability == b.probability && a.state == b.state;
}

/// A box as regions make them, with its axes renamed in any way there is.
Cuboid latticeBox(Random& random, double cell) {
  const double half = 0.5 * cell;
  Cuboid box;
  for (int i = 0; i < 3; ++i) {
    const std::int32_t low = whole(random, -5000, 5000), size = whole(random, 1, 60);
    box.center[i] = half * (static_cast<double>(low) + 0.5 * size);
    box.size[i] = half * size;
  }
  box.probability = anyProbability(random);
  box.plane_id = whole(random, -1, 400);
  if (random.uniform(0.0, 1.0) < 0.5) return box;
  const int u = whole(random, 0, 2), v = (u + whole(random, 1, 2)) % 3;
  Matrix3 axes = Matrix3::Zero();
  axes(u, 0) = random.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
  axes(v, 1) = random.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
  axes.col(2) = axes.col(0).cross(axes.col(1));
  box.orientation = Quaternion(axes);
  return box;
}

TEST(PackedBoxes, ComeBackAsTheyWere) {
  Random random(5);
  for (const double cell : {0.1, 0.05, 0.3, 1.0 / 3.0, 100.0}) {
    std::vector<Cuboid> boxes;
    for (int i = 0; i < 300; ++i) boxes.push_back(latticeBox(random, cell));
    for (int i = 0; i < 20; ++i) {  // and such as are on no lattice
      Cuboid odd = latticeBox(random, cell);
      odd.center += Vector3(1e-3, 2e-17, -5.0);
      odd.orientation = Quaternion(Eigen::AngleAxisd(0.1 * i, Vector3(0.0, 0.6, 0.8)));
      boxes.insert(boxes.begin() + whole(random, 0, 300), odd);
    }
    boxes.back().center.x() = 1e300;
    boxes.front().size.y() = std::nan("");
    const PackedBoxes packed(boxes, cell);
    ASSERT_EQ(packed.size(), boxes.size());
    std::vector<Cuboid> back(1);
    packed.appendTo(back, cell);
    ASSERT_EQ(back.size(), boxes.size() + 1);
    for (std::size_t i = 0; i < boxes.size(); ++i) EXPECT_TRUE(isSame(boxes[i], back[i + 1])) << i;
  }
}

TEST(PackedBoxes, TakeAQuarterOfWhatTheyAre) {
  Random random(6);
  std::vector<Cuboid> boxes;
  for (int i = 0; i < 200; ++i) boxes.push_back(latticeBox(random, 0.1));
  EXPECT_LT(PackedBoxes(boxes, 0.1).memoryBytes(), boxes.size() * sizeof(Cuboid) / 4);
}

}  // namespace
}  // namespace planar_mapping::detail
