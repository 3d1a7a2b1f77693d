// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// CSV and MoveIt's .scene, read strictly by the descriptions of their formats.
#include <sstream>

#include "export_scene.h"

namespace planar_mapping {
namespace {

std::vector<std::string> linesOf(const std::string& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Exactly so many numbers with single blanks between them.
std::vector<double> numbersOf(const std::string& line, std::size_t count, char separator = ' ') {
  std::vector<double> numbers;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, separator);) {
    std::size_t used = 0;
    numbers.push_back(std::stod(part, &used));
    EXPECT_EQ(used, part.size()) << line;
  }
  EXPECT_EQ(numbers.size(), count) << line;
  numbers.resize(count);
  return numbers;
}

TEST(Csv, ReadsBackAsTheSameValues) {
  io::ExportedMap map = test::manyExported();
  map.up = -Vector3::UnitY();
  map.options.frame_id = "odom";
  const test::Exported file(io::writeCsv, map, "m.csv");
  const std::vector<std::string> lines = linesOf(file.path());
  ASSERT_EQ(lines.size(), map.cuboids.size() + 1);
  EXPECT_EQ(lines[0],
            "cuboid_id,frame_id,state,probability,plane_id,center_x_m,center_y_m,center_z_m,"
            "size_x_m,size_y_m,size_z_m,qx,qy,qz,qw,up_x,up_y,up_z,origin_x_m,origin_y_m,"
            "origin_z_m");
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    const std::string head = std::to_string(i) + ",odom," + toString(c.state) + ',';
    ASSERT_EQ(lines[i + 1].substr(0, head.size()), head);
    const std::vector<double> n = numbersOf(lines[i + 1].substr(head.size()), 18, ',');
    ASSERT_EQ(static_cast<float>(n[0]), c.probability);
    ASSERT_EQ(n[1], c.plane_id);
    ASSERT_EQ(Vector3(n[2], n[3], n[4]), c.center);
    ASSERT_EQ(Vector3(n[5], n[6], n[7]), c.size);
    ASSERT_EQ(Vector4(n[8], n[9], n[10], n[11]), Vector4(c.orientation.coeffs()));
    ASSERT_EQ(Vector3(n[12], n[13], n[14]), map.up);
    ASSERT_EQ(Vector3(n[15], n[16], n[17]), map.origin);
  }
}

/// As moveit::planning_scene::PlanningScene::loadGeometryFromStream() reads it: name, then for each
/// object "* id", its pose, its shapes with pose and colour, its subframes; "." at the end.
TEST(MoveItScene, ReadsBackAsTheSameBoxes) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writeScene, map, "office.scene");
  const std::vector<std::string> lines = linesOf(file.path());
  ASSERT_EQ(lines.size(), 10 * map.cuboids.size() + 2);
  EXPECT_EQ(lines.front(), "office");
  EXPECT_EQ(lines.back(), ".");
  std::map<std::string, int> names;
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    const std::string* line = &lines[1 + 10 * i];
    ASSERT_EQ(line[0].substr(0, 2), "* ");
    ASSERT_EQ(names[line[0]]++, 0) << line[0];
    // A blank in this line tells the new format from the old one.
    ASSERT_EQ(numbersOf(line[1], 3), std::vector<double>(3, 0.0));
    ASSERT_EQ(numbersOf(line[2], 4), (std::vector<double>{0.0, 0.0, 0.0, 1.0}));
    ASSERT_EQ(line[3], "1");
    ASSERT_EQ(line[4], "box");
    const std::vector<double> size = numbersOf(line[5], 3), center = numbersOf(line[6], 3);
    const std::vector<double> xyzw = numbersOf(line[7], 4), rgba = numbersOf(line[8], 4);
    ASSERT_EQ(Vector3(size[0], size[1], size[2]), c.size);
    ASSERT_EQ(Vector3(center[0], center[1], center[2]), c.center);
    ASSERT_EQ(Vector4(xyzw[0], xyzw[1], xyzw[2], xyzw[3]), Vector4(c.orientation.coeffs()));
    for (const double part : rgba) ASSERT_TRUE(part >= 0.0 && part <= 1.0);
    ASSERT_EQ(rgba[3] < 1.0, c.state == CellState::Unknown);
    ASSERT_EQ(line[9], "0");
  }
}

}  // namespace
}  // namespace planar_mapping
