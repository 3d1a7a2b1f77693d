// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// .bt and .ot, read by OctoMap.
#include <octomap/OcTree.h>

#include <cmath>
#include <memory>

#include "evaluation/metrics/cuboid_geometry.h"
#include "export_scene.h"
#include "map_scene.h"
#include "planar_mapping/base/error.h"
#include "run_program.h"
#include "wide_map.h"

namespace planar_mapping {
namespace {

/// 'o'ccupied, 'f'ree or '?'.
char stateIn(const octomap::OcTree& tree, const Vector3& p) {
  const octomap::OcTreeNode* node = tree.search(p.x(), p.y(), p.z());
  return node == nullptr ? '?' : tree.isNodeOccupied(node) ? 'o' : 'f';
}

std::unique_ptr<octomap::OcTree> readOt(const std::string& path) {
  return std::unique_ptr<octomap::OcTree>(
      dynamic_cast<octomap::OcTree*>(octomap::AbstractOcTree::read(path)));
}

/// Two free boxes that share a face, with turned cuboids over and beside them.
io::ExportedMap scene(std::size_t count) {
  io::ExportedMap map = test::manyExported(count);
  map.cuboids.resize(count - count / 10);  // occupied alone
  for (const double x : {-10.0, 2.0}) {
    Cuboid box = test::cuboidAt({x + 6.0, 0.0, 0.0}, {12.0, 20.0, 30.0});
    box.state = CellState::Free;
    map.free.push_back(box);
  }
  return map;
}

/// What each cell must be, found without the tree: from points in it and from distances.
void expectStates(const io::ExportedMap& map, const octomap::OcTree& tree, std::size_t count) {
  Random random(5);
  const double cell = map.cell();
  std::map<char, std::size_t> seen;
  for (std::size_t i = 0; i < count; ++i) {
    Vector3 center;
    for (int k = 0; k < 3; ++k)
      center[k] = cell * (std::floor(random.uniform(-21.0, 21.0) / cell) + 0.5);
    bool some = false, touched = false;
    for (const Cuboid& cuboid : map.cuboids) {
      const double away = test::distanceTo(cuboid, center);
      some = some || away < 0.499 * cell;
      touched = touched || away < 0.8661 * cell;
    }
    bool free = false;
    for (const Cuboid& box : map.free) free = free || contains(box, center);
    const char state = stateIn(tree, center);
    ++seen[state];
    if (some) {
      ASSERT_EQ(state, 'o') << center.transpose();
    } else if (!touched) {
      ASSERT_EQ(state, free ? 'f' : '?') << center.transpose();
    }
  }
  for (const char state : {'o', 'f', '?'}) EXPECT_GT(seen[state], count / 100) << state;
}

TEST(OctoMapFile, BtHasOccupiedFreeAndUnknown) {
  const io::ExportedMap map = scene(500);
  const test::Exported file(io::writeOctree, map, "m.bt");
  octomap::OcTree tree(file.path());
  EXPECT_EQ(tree.getResolution(), 0.1);
  expectStates(map, tree, 20000);
}

TEST(OctoMapFile, HoldsFiveThousandCuboidsAtAnyCell) {
  io::ExportedMap map = scene(5000);
  for (const double cell : {0.4, 0.25}) {
    map.options.cell = cell;
    const test::Exported file(io::writeOctree, map, "m.bt");
    octomap::OcTree tree(file.path());
    EXPECT_EQ(tree.getResolution(), cell);
    if (cell == 0.25) expectStates(map, tree, 2000);
    EXPECT_GT(tree.getNumLeafNodes(), 10000u);
  }
}

TEST(OctoMapFile, OtKeepsTheProbabilities) {
  io::ExportedMap map = scene(1000);
  const test::Exported file(io::writeOctree, map, "m.ot");
  const auto tree = readOt(file.path());
  ASSERT_NE(tree, nullptr);
  expectStates(map, *tree, 5000);
  std::size_t compared = 0;
  for (const Cuboid& cuboid : map.cuboids) {
    // Of all that reach into the cell the most certain one counts.
    const octomap::OcTreeKey key = tree->coordToKey(octomap::point3d(octomap::point3d(
        static_cast<float>(cuboid.center.x()), static_cast<float>(cuboid.center.y()),
        static_cast<float>(cuboid.center.z()))));
    const octomap::point3d at = tree->keyToCoord(key);
    const Vector3 center(at.x(), at.y(), at.z());
    int near = 0;
    for (const Cuboid& other : map.cuboids) near += test::distanceTo(other, center) < 0.1 ? 1 : 0;
    if (near > 1) continue;
    const double limit = tree->getClampingThresMax();
    EXPECT_NEAR(tree->search(key)->getOccupancy(),
                std::min(static_cast<double>(cuboid.probability), limit), 1e-6);
    ++compared;
  }
  EXPECT_GT(compared, 100u);
  EXPECT_NEAR(tree->search(-9.95, -9.95, -14.95)->getOccupancy(), tree->getClampingThresMin(),
              1e-6);
}

TEST(OctoMapFile, WallOnTheLinesOfTheGridIsOneCellThick) {
  io::ExportedMap map;
  Cuboid wall = test::cuboidAt({0.05, 0.5, 1.0}, {0.1, 1.0, 2.0});
  map.cuboids = {wall};
  const test::Exported file(io::writeOctree, map, "m.bt");
  octomap::OcTree tree(file.path());
  tree.expand();
  EXPECT_EQ(tree.getNumLeafNodes(), 200u);
}

TEST(OctoMapFile, WideFreeSpaceIsWrittenAsPrunedNodes) {
  const TemporaryDirectory directory;
  for (const std::int32_t side : {1, 8, 55}) {
    const std::vector<std::uint8_t> bytes = test::wideMap(side);
    const PlanarMap map = PlanarMap::deserialize(bytes.data(), bytes.size());
    const std::string path = directory / (std::to_string(side) + ".bt");
    io::exportMap(map, path);
    octomap::OcTree tree(path);
    const double end = 3.2 * side;
    EXPECT_EQ(stateIn(tree, Vector3::Constant(0.05)), 'f');
    EXPECT_EQ(stateIn(tree, Vector3::Constant(end - 0.05)), 'f');
    EXPECT_EQ(stateIn(tree, Vector3::Constant(end + 0.05)), '?');
    EXPECT_LE(tree.getNumLeafNodes(), side < 55 ? 1U : 30000U);
  }
}

/// Another decoder of the format.
TEST(OctoMapFile, IsShownByBt2vrml) {
  const std::string program = PLANAR_MAPPING_BT2VRML;
  if (program.empty()) GTEST_SKIP() << "no bt2vrml (octomap-tools)";
  const test::Exported file(io::writeOctree, scene(100), "m.bt");
  octomap::OcTree tree(file.path());
  std::size_t occupied = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    occupied += tree.isNodeOccupied(*leaf) ? 1 : 0;
  const ProgramResult result = runProgram({program, file.path()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::ifstream vrml(file / "m.bt.wrl");
  std::size_t shapes = 0;
  for (std::string line; std::getline(vrml, line);)
    shapes += line.find("Transform {") != std::string::npos ? 1 : 0;
  EXPECT_EQ(shapes, occupied);
}

TEST(OctoMapFile, OfAMapSaysWhatTheMapSays) {
  const PlanarMap map = test::mapOfFrames(3);
  const TemporaryDirectory directory;
  io::exportMap(map, directory / "m.bt");
  octomap::OcTree tree(directory / "m.bt");
  std::map<char, std::size_t> seen;
  std::size_t free = 0, inside = 0;
  const Vector3 low(-0.5, 0.5, 0.5), high(0.5, 1.5, 1.5);
  for (const Cuboid& box : map.freeCuboids()) {
    EXPECT_EQ(box.state, CellState::Free);
    const Vector3 corner = box.center - 0.5 * box.size;
    for (double x = 0.05; x < box.size.x(); x += 0.1) {
      for (double y = 0.05; y < box.size.y(); y += 0.1) {
        for (double z = 0.05; z < box.size.z(); z += 0.1) {
          const Vector3 p = corner + Vector3(x, y, z);
          const char state = stateIn(tree, p);
          ++seen[state];
          const CellState expected = map.stateAt(p);
          ASSERT_TRUE(state != 'f' || expected == CellState::Free) << p.transpose();
          ASSERT_TRUE(state == 'o' || expected != CellState::Occupied) << p.transpose();
          ++free;
          const bool is_inside =
              (p.array() > low.array()).all() && (p.array() < high.array()).all();
          inside += is_inside ? 1 : 0;
        }
      }
    }
  }
  EXPECT_EQ(seen['?'], 0u);
  EXPECT_GT(seen['f'], free / 2);
  EXPECT_GT(free, 10000u);
  double volume = 0.0;
  for (const Cuboid& box : map.spaceCuboids(CellState::Free, low, high)) volume += box.volume();
  EXPECT_NEAR(volume, 1e-3 * static_cast<double>(inside), 1e-9);
  EXPECT_GT(inside, 100u);
  EXPECT_THROW(map.spaceCuboids(CellState::Occupied, low, high), ParameterError);
  for (const Cuboid& box : map.unknownCuboids())
    EXPECT_NE(stateIn(tree, box.center + Vector3(1e-3, 1e-3, 1e-3)), 'f');
  for (const Cuboid& cuboid : map.cuboids()) EXPECT_EQ(stateIn(tree, cuboid.center), 'o');
}

TEST(OctoMapFile, OfAMapWithOtherCellsIsOccupiedWhereTheMapIs) {
  const PlanarMap map = test::mapOfFrames(2);
  for (const double cell : {0.07, 0.2, 0.35}) {
    const TemporaryDirectory directory;
    io::ExportOptions options;
    options.cell = cell;
    io::exportMap(map, directory / "m.bt", options);
    octomap::OcTree tree(directory / "m.bt");
    std::size_t free = 0;
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
      if (tree.isNodeOccupied(*leaf)) continue;
      ++free;
      const octomap::point3d p = leaf.getCoordinate();
      ASSERT_EQ(map.stateAt({p.x(), p.y(), p.z()}), CellState::Free);
    }
    EXPECT_GT(free, 100u) << cell;
    for (const Cuboid& cuboid : map.cuboids()) ASSERT_EQ(stateIn(tree, cuboid.center), 'o');
  }
}

TEST(OctoMapFile, OfNothingIsAnEmptyTree) {
  const test::Exported file(io::writeOctree, io::ExportedMap(), "m.bt");
  octomap::OcTree tree(file.path());
  EXPECT_EQ(tree.size(), 0u);
}

TEST(OctoMapFile, FreeSpaceInPartOfACellIsUnknown) {
  io::ExportedMap map;
  Cuboid box;
  box.center = {0.53, 0.53, 0.53};
  box.size = {0.12, 0.12, 0.12};  // reaches into eight cells and fills none
  box.state = CellState::Free;
  map.free = {box};
  const test::Exported alone(io::writeOctree, map, "m.bt");
  EXPECT_EQ(octomap::OcTree(alone.path()).size(), 0u);
  Cuboid far = test::cuboidAt({-3.05, 0.05, 0.05}, {0.05, 0.05, 0.05});
  map.cuboids = {far};
  const test::Exported beside(io::writeOctree, map, "m.bt");
  octomap::OcTree tree(beside.path());
  EXPECT_EQ(tree.getNumLeafNodes(), 1u);
  EXPECT_EQ(stateIn(tree, far.center), 'o');
  EXPECT_EQ(stateIn(tree, box.center), '?');
}

}  // namespace
}  // namespace planar_mapping
