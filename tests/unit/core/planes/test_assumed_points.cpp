// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/assumed/assumed_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

constexpr int kColumns = 80;
constexpr int kRows = 60;
constexpr float kDepth = 2.0f;

/// An upright wall across the optical axis that is measured in bands of 8 pixels at some borders.
struct Wall {
  PinholeCamera camera{100.0, 100.0, 39.5, 29.5, kColumns, kRows};
  std::vector<float> xyz = std::vector<float>(3 * kColumns * kRows, NAN);
  std::vector<std::uint8_t> gray = std::vector<std::uint8_t>(kColumns * kRows, 200);
  std::vector<PlaneSegment> planes;
  Indices ground;

  /// \param right  depth of what is measured on the right, another plane if it is not the wall's
  explicit Wall(float right = kDepth) {
    planes.resize(right != kDepth ? 2 : 1);
    for (PlaneSegment& segment : planes) segment.plane = Plane{-Vector3::UnitZ(), kDepth};
    planes.back().plane.offset = double{right};
    for (int i = 0; i < kColumns * kRows; ++i) {
      gray[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(200 + i * 7 % 3);  // noise
      const int column = i % kColumns;
      if (column >= 8 && column < kColumns - 8) continue;
      measure(i, column < 8 ? kDepth : right);
      (column < 8 ? planes.front() : planes.back()).inliers.push_back(i);
    }
  }
  void measure(int i, float depth) {
    const Vector3 point = double{depth} * camera.rayOf(i % kColumns, i / kColumns);
    for (int k = 0; k < 3; ++k)
      xyz[static_cast<std::size_t>(3 * i + k)] = static_cast<float>(point[k]);
  }
  void forget() {
    std::fill(xyz.begin(), xyz.end(), NAN);
    planes.clear();
  }
  /// Nothing is measured above a row.
  void forgetAbove(int row) {
    std::fill_n(xyz.begin(), 3 * row * kColumns, NAN);
    Indices& inliers = planes[0].inliers;
    const auto is_gone = [&](int i) { return i < row * kColumns; };
    inliers.erase(std::remove_if(inliers.begin(), inliers.end(), is_gone), inliers.end());
  }
  AssumedPoints assumed() {
    Indices all(kColumns * kRows);
    std::iota(all.begin(), all.end(), 0);
    return assumePoints(PointsView(xyz.data(), kColumns, kRows, 3), all, ground, camera,
                        evenTiles(gray.data(), kColumns, kRows), -Vector3::UnitY(),
                        MultiPlaneParams(), planes);
  }
};

TEST(AssumedPoints, AWallOfOneColourBetweenItsEndsIsThePlane) {
  const AssumedPoints assumed = Wall().assumed();
  ASSERT_EQ(assumed.of_plane.size(), 1u);
  EXPECT_EQ(assumed.of_plane[0].size(), std::size_t{(kColumns - 16) * kRows});
  for (std::size_t i = 0; i < assumed.xyz.size(); i += 3)
    EXPECT_NEAR(assumed.xyz[i + 2], kDepth, 1e-4f);
  EXPECT_LT(assumed.probability, 1.0);
}

/// Of a floor 0.3 m below the camera the part just before it is measured.
TEST(AssumedPoints, AWallEndsAtTheGround) {
  constexpr double kFloor = 0.3;
  const auto lowest = [](const AssumedPoints& assumed) {
    float y = -INFINITY;
    for (std::size_t i = 0; i < assumed.xyz.size(); i += 3) y = std::max(y, assumed.xyz[i + 1]);
    return y;
  };
  Wall wall;
  for (int i = (kRows - 8) * kColumns; i < kRows * kColumns; ++i) {
    if (i % kColumns < 8 || i % kColumns >= kColumns - 8) continue;
    wall.measure(i, static_cast<float>(kFloor / wall.camera.rayOf(i % kColumns, i / kColumns).y()));
    wall.ground.push_back(i);
  }
  Wall without = wall;
  without.ground.clear();
  EXPECT_GT(lowest(without.assumed()), kFloor + 0.1);
  const AssumedPoints assumed = wall.assumed();
  EXPECT_GT(lowest(assumed), kFloor - 0.05);
  EXPECT_LT(lowest(assumed), kFloor + 0.06);
}

/// A floor 0.5 m below the camera, measured but for a hole, on the far side of which an object
/// of the same colour, too small for a plane, may stand.
AssumedPoints assumedOnAFloor(bool with_object) {
  constexpr double kFloor = 0.5;
  Wall wall;
  wall.forget();
  PlaneSegment floor;
  floor.plane = Plane{-Vector3::UnitY(), kFloor};
  for (int i = 32 * kColumns; i < kRows * kColumns; ++i) {
    const int column = i % kColumns, row = i / kColumns;
    const double depth = kFloor / wall.camera.rayOf(column, row).y();
    const bool is_between = column >= 16 && column < kColumns - 16;
    if (is_between && row >= 40 && row < 52) continue;
    const bool is_object = with_object && is_between && row < 40;
    wall.measure(i, is_object ? kDepth : static_cast<float>(depth));
    if (!is_object) floor.inliers.push_back(i);
  }
  wall.planes.push_back(floor);
  AssumedPoints assumed = wall.assumed();
  assumed.of_plane.resize(1);
  return assumed;
}

/// What stands on a floor hides it: where the hole of a floor goes up on it is not seen.
TEST(AssumedPoints, AFloorContinuesWhereItAloneEndsTheHole) {
  EXPECT_EQ(assumedOnAFloor(false).of_plane[0].size(), std::size_t{(kColumns - 32) * 12});
  EXPECT_TRUE(assumedOnAFloor(true).of_plane[0].empty());
}

/// A corner of a room: the wall on the right comes nearer, and is measured above the hole.
TEST(AssumedPoints, AWallEndsAtTheWallBesideIt) {
  Wall wall;
  PlaneSegment side;
  side.plane = Plane{-Vector3::UnitX(), 0.4};
  for (int i = 0; i < 12 * kColumns; ++i) {
    const double x = wall.camera.rayOf(i % kColumns, i / kColumns).x();
    if (i % kColumns < 8 || i % kColumns >= kColumns - 8 || 0.4 / x >= kDepth || x <= 0.0) continue;
    wall.measure(i, static_cast<float>(0.4 / x));
    side.inliers.push_back(i);
  }
  ASSERT_GT(side.inliers.size(), 64u);
  Wall without = wall;
  const auto widest = [](const AssumedPoints& assumed) {
    float x = -INFINITY;
    for (std::size_t i = 0; i < assumed.xyz.size(); i += 3) x = std::max(x, assumed.xyz[i]);
    return x;
  };
  EXPECT_GT(widest(without.assumed()), 0.5f);
  wall.planes.push_back(side);
  const AssumedPoints assumed = wall.assumed();
  EXPECT_FALSE(assumed.empty());
  EXPECT_LT(widest(assumed), 0.5f);  // half a tile is 4 cm
}

/// Whatever is above: wall, or a ceiling of the same colour.
TEST(AssumedPoints, AWallIsNoHigherThanWhatIsMeasuredOfIt) {
  constexpr int kTop = 24;
  Wall wall;
  wall.forgetAbove(kTop);
  const AssumedPoints assumed = wall.assumed();
  EXPECT_EQ(assumed.of_plane[0].size(), std::size_t{(kColumns - 16) * (kRows - kTop)});
  for (std::size_t i = 0; i < assumed.xyz.size(); i += 3) {
    const Vector3 point(assumed.xyz[i], assumed.xyz[i + 1], assumed.xyz[i + 2]);
    ASSERT_GT(wall.camera.project(point).y(), kTop - 0.5);
  }
}

/// A corner of a room: what is measured of the wall beyond another hole says nothing of this one.
TEST(AssumedPoints, EachHoleHasItsOwnEnds) {
  Wall wall;
  for (int i = 0; i < kColumns * kRows; ++i) {
    if (i % kColumns >= kColumns / 2) wall.gray[static_cast<std::size_t>(i)] -= 20;
  }
  EXPECT_TRUE(wall.assumed().empty());
}

TEST(AssumedPoints, BetweenTwoPlanesNothingIs) {
  EXPECT_TRUE(Wall(3.0f).assumed().empty());
}

/// A picture or a base board has too few points to be found as part of the plane it lies on.
TEST(AssumedPoints, WhatLiesOnAPlaneIsAnEndOfIt) {
  Wall wall(kDepth - 0.03f);
  wall.planes.resize(1);
  EXPECT_EQ(wall.assumed().of_plane[0].size(), std::size_t{(kColumns - 16) * kRows});
}

TEST(AssumedPoints, PicturesAndABaseBoardMakeAPlane) {
  Wall wall;
  wall.forget();
  for (int i = 0; i < kColumns * kRows; ++i) {
    const int column = i % kColumns;
    const int row = i / kColumns;
    const bool is_picture = row >= 12 && row < 24 && (column < 12 || column >= kColumns - 12);
    if (is_picture || row >= kRows - 8) wall.measure(i, kDepth);
  }
  const AssumedPoints assumed = wall.assumed();
  ASSERT_EQ(wall.planes.size(), 1u);
  EXPECT_NEAR(wall.planes[0].plane.offset, double{kDepth}, 1e-3);
  EXPECT_GT(wall.planes[0].inliers.size(), 500u);
  EXPECT_EQ(wall.planes[0].inliers.size(),
            static_cast<std::size_t>(wall.planes[0].moments.weight()));
  // As high as the pictures.
  EXPECT_EQ(assumed.of_plane[0].size(), std::size_t{kColumns * 40 - 2 * 12 * 12});
}

TEST(AssumedPoints, ABaseBoardAloneIsNone) {
  Wall wall;
  wall.forget();
  for (int i = (kRows - 8) * kColumns; i < kRows * kColumns; ++i) wall.measure(i, kDepth);
  EXPECT_TRUE(wall.assumed().empty());
  EXPECT_TRUE(wall.planes.empty());
}

/// A door that is open: what is measured behind it is seen through it.
TEST(AssumedPoints, WhatIsSeenThroughIsNone) {
  Wall wall;
  for (int i = (kRows - 12) * kColumns; i < kRows * kColumns; ++i) {
    if (i % kColumns >= 8 && i % kColumns < kColumns - 8) wall.measure(i, 2.0f * kDepth);
  }
  EXPECT_TRUE(wall.assumed().empty());
}

TEST(AssumedPoints, WhatHasAnEdgeAroundItIsAnotherThing) {
  Wall wall;
  for (int row = 16; row < 44; ++row) {
    for (int column = 24; column < 56; ++column)
      wall.gray[static_cast<std::size_t>(row * kColumns + column)] = 150;
  }
  const std::vector<float> xyz = wall.assumed().xyz;
  EXPECT_FALSE(xyz.empty());
  for (std::size_t i = 0; i < xyz.size(); i += 3) {
    const Vector2 pixel = wall.camera.project(Vector3(xyz[i], xyz[i + 1], xyz[i + 2]));
    const bool inside =
        pixel.x() > 24.0 && pixel.x() < 55.0 && pixel.y() > 16.0 && pixel.y() < 43.0;
    ASSERT_FALSE(inside) << pixel.transpose();
  }
}

TEST(AssumedPoints, TextureWithoutAMatchIsNoWall) {
  Wall wall;
  for (int i = 0; i < kColumns * kRows; ++i) {
    if (i / kColumns < kRows / 2) continue;
    wall.gray[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i * 131 % 5 * 40 + 20);
  }
  const std::vector<float> xyz = wall.assumed().xyz;
  EXPECT_FALSE(xyz.empty());
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    ASSERT_LT(wall.camera.project(Vector3(xyz[i], xyz[i + 1], xyz[i + 2])).y(), kRows / 2);
}

/// Matching carries the depth of what is beside an even part of the image into it.
TEST(AssumedPoints, WhatIsMeasuredOfEvenTilesBesideAHoleIsCarriedThere) {
  Wall wall;
  const auto carriedOf = [&] {
    return carriedPoints(PointsView(wall.xyz.data(), kColumns, kRows, 3), wall.camera,
                         evenTiles(wall.gray.data(), kColumns, kRows));
  };
  const Indices carried = carriedOf();  // the tile of each band of two that is next to the hole
  EXPECT_EQ(carried.size(), std::size_t{2 * kEvenTileSide * kRows});
  EXPECT_TRUE(std::is_sorted(carried.begin(), carried.end()));
  for (const int i : carried) {
    const int column = i % kColumns;
    EXPECT_TRUE((column >= 4 && column < 8) || (column >= kColumns - 8 && column < kColumns - 4))
        << i;
  }
  // Texture is evidence.
  for (int i = 0; i < kColumns * kRows; ++i) {
    const int column = i % kColumns;
    if (column < 8 || column >= kColumns - 8)
      wall.gray[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i * 37 % 200);
  }
  EXPECT_TRUE(carriedOf().empty());
  // Nor is anything carried where all is measured.
  for (int i = 0; i < kColumns * kRows; ++i) {
    wall.gray[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(200 + i * 7 % 3);
    wall.measure(i, kDepth);
  }
  EXPECT_TRUE(carriedOf().empty());
}

TEST(AssumedPoints, SizesMustAgree) {
  Wall wall;
  const PointsView cloud(wall.xyz.data(), kColumns, kRows, 3);
  EXPECT_THROW(assumePoints(cloud, {}, {}, wall.camera, {}, Vector3::Zero(), MultiPlaneParams(),
                            wall.planes),
               InputError);
  EXPECT_THROW(carriedPoints(cloud, wall.camera, {}), InputError);
  EXPECT_TRUE(evenTiles(wall.gray.data(), 3, 3).empty());
}

}  // namespace
}  // namespace planar_mapping
