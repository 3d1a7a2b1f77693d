// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Meshes and points, read by Open3D.
#include <nlohmann/json.hpp>
#include <sstream>

#include "export_scene.h"
#include "run_program.h"

namespace planar_mapping {
namespace {

Vector3 vectorOf(const nlohmann::json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

TEST(Open3d, ReadsMeshesAndPoints) {
  const std::string python = PLANAR_MAPPING_OPEN3D_PYTHON;
  if (python.empty()) GTEST_SKIP() << "no python3 with open3d (python3-open3d)";
  const io::ExportedMap map = test::manyExported();
  const test::Exported ply(io::writePly, map, "m.ply"), obj(io::writeObj, map, "m.obj"),
      stl(io::writeStl, map, "m.stl"), glb(io::writeGlb, map, "m.glb"),
      pcd(io::writePoints, map, "m.pcd");
  const std::string script =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/tests/exports/read_with_open3d.py";
  const ProgramResult result =
      runProgram({python, script, ply.path(), obj.path(), stl.path(), glb.path(), pcd.path()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  Vector3 low = Vector3::Constant(INFINITY), high = -low;
  for (const Cuboid& cuboid : map.cuboids) {
    for (const Vector3& corner : corners(cuboid)) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  std::istringstream lines(result.out);
  const auto next = [&] {
    std::string line;
    // Open3D prints warnings among them.
    while (std::getline(lines, line) && line.rfind("{", 0) != 0) continue;
    return nlohmann::json::parse(line);
  };
  for (const char* format : {"ply", "obj", "stl", "glb"}) {
    const nlohmann::json found = next();
    EXPECT_EQ(found["triangles"], 12 * map.cuboids.size()) << format;
    if (format == std::string("glb")) continue;  // its nodes place it, Open3D's reader differs
    EXPECT_LT((vectorOf(found["low"]) - low).norm(), 1e-5) << format;
    EXPECT_LT((vectorOf(found["high"]) - high).norm(), 1e-5) << format;
    EXPECT_TRUE(found["coloured"] || format == std::string("stl")) << format;
  }
  const nlohmann::json points = next();
  EXPECT_EQ(points["points"], map.cuboids.size());
  EXPECT_LT((vectorOf(points["first"]) - map.cuboids[0].center).norm(), 1e-5);
}

}  // namespace
}  // namespace planar_mapping
