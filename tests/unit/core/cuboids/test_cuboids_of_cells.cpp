// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/cuboids/cuboid_approximation.h"
#include "planar_mapping/cuboids/raster/plane_raster.h"

namespace planar_mapping {
namespace {

constexpr double kSide = 0.1;

NonPlanarCell cellAt(std::int32_t x, std::int32_t y, std::int32_t z, float weight = 5.0f) {
  NonPlanarCell cell;
  cell.x = x;
  cell.y = y;
  cell.z = z;
  cell.mean = kSide * Vector3(x + 0.5, y + 0.5, z + 0.5);
  cell.weight = weight;
  return cell;
}

CuboidApproximationParams paramsFor(Profile profile) {
  CuboidApproximationParams params;
  params.profile = profile;
  params.resolution = kSide;
  return params;
}

std::vector<NonPlanarCell> randomCells(std::uint64_t seed, std::int32_t side, double density) {
  Random random(seed);
  std::vector<NonPlanarCell> cells;
  for (std::int32_t z = 0; z < side; ++z) {
    for (std::int32_t y = 0; y < side; ++y) {
      for (std::int32_t x = 0; x < side; ++x) {
        if (random.uniform() < density) cells.push_back(cellAt(x - 3, y - 4, z + 2));
      }
    }
  }
  return cells;
}

std::vector<Cuboid> boxesOf(const std::vector<NonPlanarCell>& cells,
                            const CuboidApproximationParams& params) {
  return coverWithBoxes(cells, {}, {}, {}, params).boxes;
}

TEST(CuboidsOfCells, CompactMakesOneBoxOfABlock) {
  std::vector<NonPlanarCell> cells;
  for (int i = 0; i < 24; ++i) cells.push_back(cellAt(i % 4, i / 4 % 3, i / 12));
  const std::vector<Cuboid> boxes = boxesOf(cells, paramsFor(Profile::Compact));
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_TRUE(boxes[0].size.isApprox(Vector3(0.4, 0.3, 0.2)));
  EXPECT_TRUE(boxes[0].center.isApprox(Vector3(0.2, 0.15, 0.1)));
  EXPECT_EQ(boxes[0].plane_id, -1);
}

TEST(CuboidsOfCells, CompactWithoutToleranceCoversExactlyTheOccupiedCells) {
  for (std::uint64_t seed = 1; seed < 12; ++seed) {
    const std::vector<NonPlanarCell> cells =
        randomCells(seed, 9, 0.1 * static_cast<double>(seed % 9 + 1));
    CuboidApproximationParams params = paramsFor(Profile::Compact);
    params.absorption = 0.0;  // no tolerance
    const std::vector<Cuboid> boxes = boxesOf(cells, params);
    EXPECT_LE(boxes.size(), cells.size());
    std::set<std::array<int, 3>> occupied, covered;
    for (const NonPlanarCell& cell : cells) occupied.insert({cell.x, cell.y, cell.z});
    for (int x = -5; x < 9; ++x) {
      for (int y = -6; y < 8; ++y) {
        for (int z = 0; z < 13; ++z) {
          const Vector3 center = kSide * Vector3(x + 0.5, y + 0.5, z + 0.5);
          if (std::any_of(boxes.begin(), boxes.end(),
                          [&](const Cuboid& box) { return contains(box, center); })) {
            covered.insert({x, y, z});
          }
        }
      }
    }
    EXPECT_EQ(covered, occupied);
  }
}

TEST(CuboidsOfCells, CompactStaysWithinHalfACell) {
  for (std::uint64_t seed = 1; seed < 12; ++seed) {
    std::vector<NonPlanarCell> cells =
        randomCells(seed, 9, 0.1 * static_cast<double>(seed % 9 + 1));
    Random random(seed);
    for (NonPlanarCell& cell : cells)
      cell.octants = static_cast<std::uint8_t>(1 + random.below(255));
    CuboidApproximationParams params = paramsFor(Profile::Compact);
    const std::vector<Cuboid> boxes = boxesOf(cells, params);
    std::vector<Vector3> middles;  // of the eighths that hold points
    for (const NonPlanarCell& cell : cells) {
      for (int k = 0; k < 8; ++k) {
        if ((cell.octants >> k & 1) == 0) continue;
        middles.push_back(kSide * Vector3(cell.x + 0.25 + 0.5 * (k & 1),
                                          cell.y + 0.25 + 0.5 * (k >> 1 & 1),
                                          cell.z + 0.25 + 0.5 * (k >> 2 & 1)));
      }
    }
    // All of an eighth is within half a cell of a box if its middle is within a quarter.
    for (const Vector3& p : middles) {
      EXPECT_TRUE(std::any_of(boxes.begin(), boxes.end(), [&](const Cuboid& box) {
        return contains(box, p, 0.25 * kSide + 1e-9);
      }));
    }
    // No box holds a place farther than half a cell from all eighths.
    for (const Cuboid& box : boxes) {
      for (int i = 0; i < 20; ++i) {
        const Vector3 p = box.center + box.size.cwiseProduct(Vector3(random.uniform() - 0.5,
                                                                     random.uniform() - 0.5,
                                                                     random.uniform() - 0.5));
        EXPECT_TRUE(std::any_of(middles.begin(), middles.end(), [&](const Vector3& m) {
          return (m - p).cwiseAbs().maxCoeff() <= 0.75 * kSide + 1e-9;
        }));
      }
    }
    params.absorption = 0.0;
    EXPECT_LE(boxes.size(), boxesOf(cells, params).size());
  }
}

TEST(CuboidsOfCells, OrderOfTheCellsDoesNotMatter) {
  std::vector<NonPlanarCell> cells = randomCells(4, 8, 0.5);
  const auto before = cuboidsOfCells(cells, paramsFor(Profile::Paper), Vector3::Zero());
  std::reverse(cells.begin(), cells.end());
  const auto after = cuboidsOfCells(cells, paramsFor(Profile::Paper), Vector3::Zero());
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_TRUE(before[i].center.isApprox(after[i].center));
    EXPECT_TRUE(before[i].size.isApprox(after[i].size));
  }
}

TEST(CuboidsOfCells, FringeIsLeftToTheNeighbourThatHoldsIt) {
  // All points of the second layer lie in its lower half, within half a cell of the first.
  std::vector<NonPlanarCell> cells;
  for (int x = 0; x < 5; ++x) {
    cells.push_back(cellAt(x, 0, 0, 9.0f));
    cells.push_back(cellAt(x, 0, 1, 2.0f));
    cells.back().octants = 0x0F;
    if (x > 2) cells.pop_back();
  }
  CuboidApproximationParams params = paramsFor(Profile::Compact);
  const std::vector<Cuboid> boxes = boxesOf(cells, params);
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_TRUE(boxes[0].size.isApprox(Vector3(0.5, 0.1, 0.15)));
  params.absorption = 0.0;
  EXPECT_EQ(boxesOf(cells, params).size(), 2u);
}

TEST(CuboidsOfCells, CellsThatNeedNothingMayStillBeUsed) {
  std::vector<NonPlanarCell> cells = {cellAt(0, 0, 0), cellAt(1, 0, 0), cellAt(2, 0, 0),
                                      cellAt(9, 9, 9)};
  cells[1].octants = 0;
  cells[3].octants = 0;
  const std::vector<Cuboid> boxes = boxesOf(cells, paramsFor(Profile::Compact));
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_TRUE(boxes[0].size.isApprox(Vector3(0.3, 0.1, 0.1)));
}

TEST(CuboidsOfCells, SparseCellsAreNoise) {
  CuboidApproximationParams params = paramsFor(Profile::Compact);
  params.min_points_per_cell = 3;
  const std::vector<NonPlanarCell> cells = {cellAt(0, 0, 0, 2.0f), cellAt(5, 0, 0, 3.0f)};
  const std::vector<Cuboid> boxes = boxesOf(cells, params);
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_TRUE(boxes[0].center.isApprox(Vector3(0.55, 0.05, 0.05)));
}

TEST(CuboidsOfCells, BoxHasTheMeanBeliefOfItsCells) {
  std::vector<NonPlanarCell> cells = {cellAt(0, 0, 0), cellAt(1, 0, 0)};
  cells[0].probability = 0.25f;
  cells[1].probability = 0.75f;
  const auto boxes = boxesOf(cells, paramsFor(Profile::Compact));
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_FLOAT_EQ(boxes[0].probability, 0.5f);
}

TEST(CuboidsOfCells, PaperCoversTheMeansAndStaysBehindTheFront) {
  // A curved surface seen from the origin: a quarter of a cylinder around the y axis.
  std::vector<NonPlanarCell> cells;
  std::set<std::array<int, 3>> seen;
  for (int i = 0; i <= 90; ++i) {
    for (int y = 0; y < 10; ++y) {
      const double angle = i * M_PI / 180.0;
      const Vector3 p(1.5 * std::sin(angle), 0.1 * y + 0.05, 3.0 - 1.5 * std::cos(angle));
      const std::array<int, 3> key = {static_cast<int>(std::floor(p.x() / kSide)), y,
                                      static_cast<int>(std::floor(p.z() / kSide))};
      if (!seen.insert(key).second) continue;
      cells.push_back(cellAt(key[0], key[1], key[2]));
    }
  }
  const auto leaves = cuboidsOfCells(cells, paramsFor(Profile::Paper), Vector3::Zero());
  EXPECT_LT(leaves.size(), cells.size());
  for (const NonPlanarCell& cell : cells) {
    EXPECT_TRUE(std::any_of(leaves.begin(), leaves.end(),
                            [&](const Cuboid& leaf) { return contains(leaf, cell.mean, 1e-9); }));
  }
  // Two cells in front of the surface there is nothing.
  for (const NonPlanarCell& cell : cells) {
    const Vector3 outwards = Vector3(cell.mean.x(), 0, cell.mean.z() - 3.0).normalized();
    const Vector3 front = cell.mean + 2.5 * kSide * outwards;
    EXPECT_TRUE(std::none_of(leaves.begin(), leaves.end(),
                             [&](const Cuboid& leaf) { return contains(leaf, front); }));
  }
}

TEST(CuboidsOfCells, CornersOfTheNumberRangeAreSafe) {
  constexpr std::int32_t lowest = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t highest = std::numeric_limits<std::int32_t>::max();
  const std::vector<NonPlanarCell> cells = {
      cellAt(lowest, lowest, lowest), cellAt(highest, highest, highest), cellAt(0, highest, lowest),
      cellAt(highest - 1, highest, highest)};
  EXPECT_EQ(boxesOf(cells, paramsFor(Profile::Compact)).size(), 3u);
  EXPECT_FALSE(cuboidsOfCells(cells, paramsFor(Profile::Paper), Vector3::Zero()).empty());
}

TEST(CuboidsOfCells, NothingGivesNothing) {
  EXPECT_TRUE(boxesOf({}, paramsFor(Profile::Compact)).empty());
  EXPECT_TRUE(cuboidsOfCells({}, paramsFor(Profile::Paper), Vector3::Zero()).empty());
}

/// The others: Parameters.PlanarCuboidApproximation of tests/contract.
TEST(CuboidParams, ParametersOutOfRangeAreRefused) {
  const auto refused = [](auto change) {
    CuboidApproximationParams params;
    change(params);
    EXPECT_THROW(params.validate(), ParameterError);
  };
  EXPECT_NO_THROW(CuboidApproximationParams().validate());
  refused([](auto& p) { p.density_threshold = 0; });
  refused([](auto& p) { p.density_threshold = 1.1; });
  refused([](auto& p) { p.min_width = -0.1; });
  refused([](auto& p) { p.min_height = std::nan(""); });
}

void expectRightHanded(const PlaneFrame& frame) {
  EXPECT_NEAR(frame.u.norm(), 1.0, 1e-12);
  EXPECT_NEAR(frame.n.norm(), 1.0, 1e-12);
  EXPECT_NEAR((frame.n.cross(frame.u) - frame.v).norm(), 0.0, 1e-12);
}

TEST(PlaneFrame, WallHasHorizontalUAndUpwardV) {
  // The wall x = 2, seen from the origin.
  const PlaneFrame frame = makePlaneFrame(planeFromCoefficients(-1, 0, 0, 2), Vector3::Zero());
  expectRightHanded(frame);
  EXPECT_TRUE(frame.n.isApprox(Vector3(-1, 0, 0)));
  EXPECT_TRUE(frame.u.isApprox(Vector3(0, -1, 0)));
  EXPECT_TRUE(frame.v.isApprox(Vector3(0, 0, 1)));
  EXPECT_TRUE(frame.origin.isApprox(Vector3(2, 0, 0)));
}

TEST(PlaneFrame, OriginIsTheFootOfTheNearPoint) {
  Random random(1);
  for (int run = 0; run < 50; ++run) {
    const Vector3 normal(random.normal(), random.normal(), random.normal());
    const Plane plane = planeFromCoefficients(normal.x(), normal.y(), normal.z(), random.normal());
    const Vector3 near(random.normal(), random.normal(), random.normal());
    const PlaneFrame frame = makePlaneFrame(plane, near);
    expectRightHanded(frame);
    EXPECT_NEAR(plane.signedDistance(frame.origin), 0.0, 1e-12);
    EXPECT_NEAR((near - frame.origin).cross(frame.n).norm(), 0.0, 1e-12);
    EXPECT_NEAR(frame.u.z(), 0.0, 1e-12);
    const Vector3 p(random.normal(), random.normal(), random.normal());
    EXPECT_NEAR((frame.fromPlane(frame.toPlane(p)) - p).norm(), 0.0, 1e-12);
    EXPECT_NEAR(frame.toPlane(p).z(), plane.signedDistance(p), 1e-12);
  }
}

TEST(PlaneFrame, HorizontalPlaneGetsTheSameDirectionEveryTime) {
  const PlaneFrame table = makePlaneFrame(planeFromCoefficients(0, 0, 1, -0.7), Vector3(3, 4, 5));
  expectRightHanded(table);
  EXPECT_TRUE(table.u.isApprox(Vector3::UnitX()));
  EXPECT_TRUE(table.origin.isApprox(Vector3(3, 4, 0.7)));
}

TEST(PlaneFrame, UpMayBeAnyDirectionOfAnyLength) {
  const PlaneFrame frame =
      makePlaneFrame(planeFromCoefficients(0, 0, -1, 2), Vector3::Zero(), Vector3(0, -7, 0));
  expectRightHanded(frame);
  EXPECT_NEAR(frame.u.y(), 0.0, 1e-12);
  EXPECT_TRUE(frame.v.isApprox(Vector3(0, -1, 0)));
}

TEST(PlaneFrame, RefusesWhatIsNoPlane) {
  Plane plane;
  plane.normal.setZero();
  EXPECT_THROW(makePlaneFrame(plane, Vector3::Zero()), InputError);
  plane = Plane();
  plane.offset = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(makePlaneFrame(plane, Vector3::Zero()), InputError);
  EXPECT_THROW(makePlaneFrame(Plane(), Vector3(0, std::numeric_limits<double>::infinity(), 0)),
               InputError);
  EXPECT_THROW(makePlaneFrame(Plane(), Vector3::Zero(), Vector3::Zero()), ParameterError);
}

TEST(PlaneFrame, TurnsFlatPlanesAlongTheDirectionGiven) {
  const Vector3 along(1.0, 2.0, 0.0);
  const Plane floor{Vector3(0.01, -0.02, 1.0).normalized(), 0.3};
  const PlaneFrame turned = makePlaneFrame(floor, Vector3::Zero(), Vector3::UnitZ(), along);
  EXPECT_NEAR(turned.u.dot(floor.normal), 0.0, 1e-12);
  EXPECT_GT(turned.u.dot(along.normalized()), 0.999);
  EXPECT_NEAR((turned.n.cross(turned.u) - turned.v).norm(), 0.0, 1e-12);
  // A slope keeps its horizontal, whatever is asked.
  const Plane slope{Vector3(0.0, -1.0, 1.0).normalized(), 0.3};
  const PlaneFrame kept = makePlaneFrame(slope, Vector3::Zero(), Vector3::UnitZ(), along);
  EXPECT_NEAR(std::abs(kept.u.x()), 1.0, 1e-12);
}

TEST(DominantDirection, FollowsTheSteepPlaneWithTheMostWeight) {
  const std::vector<Plane> planes{
      {Vector3::UnitZ(), 0.0}, {Vector3::UnitX(), 1.0}, {Vector3(0.6, 0.8, 0.1).normalized(), 2.0}};
  const Vector3 direction = dominantDirection(planes, {900.0, 10.0, 20.0});
  EXPECT_NEAR(direction.dot(planes[2].normal), 0.0, 1e-12);
  EXPECT_NEAR(direction.z(), 0.0, 1e-12);
  EXPECT_NEAR(direction.norm(), 1.0, 1e-12);
  EXPECT_EQ(dominantDirection({planes[0]}, {900.0}), Vector3::Zero());
  EXPECT_THROW(dominantDirection(planes, {1.0}), InputError);
}

}  // namespace
}  // namespace planar_mapping
