// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/map_export.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/io/map_file.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

std::vector<Cuboid> someCuboids() {
  Random random(2);
  std::vector<Cuboid> cuboids;
  for (int i = 0; i < 20; ++i) {
    Cuboid c;
    c.center = Vector3(random.normal(), random.normal(), random.normal());
    c.orientation =
        Quaternion(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
    c.size = Vector3(random.uniform(0.1, 2.0), random.uniform(0.1, 2.0), random.uniform(0.1, 2.0));
    c.plane_id = i % 4 - 1;
    c.probability = static_cast<float>(random.uniform());
    cuboids.push_back(c);
  }
  // Roll and yaw about the same axis.
  cuboids[0].orientation = Quaternion(Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY()));
  return cuboids;
}

double volumeOf(const std::vector<Cuboid>& cuboids) {
  double volume = 0.0;
  for (const Cuboid& c : cuboids) volume += c.volume();
  return volume;
}

/// Six times the volume under a triangle, seen from the origin; positive if wound outwards.
double sixfold(const Vector3& a, const Vector3& b, const Vector3& c) {
  return a.dot(b.cross(c));
}

TEST(MapExport, CsvReadsBackAsTheSameValues) {
  const std::vector<Cuboid> cuboids = someCuboids();
  std::istringstream in(io::cuboidsToCsv(cuboids));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "cx,cy,cz,sx,sy,sz,qx,qy,qz,qw,plane_id,probability,state");
  for (const Cuboid& c : cuboids) {
    ASSERT_TRUE(std::getline(in, line));
    std::istringstream fields(line);
    std::vector<std::string> parts;
    for (std::string part; std::getline(fields, part, ',');) parts.push_back(part);
    ASSERT_EQ(parts.size(), 13u);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(std::stod(parts[k]), c.center[static_cast<int>(k)]);
      EXPECT_EQ(std::stod(parts[3 + k]), c.size[static_cast<int>(k)]);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(std::stod(parts[6 + k]), c.orientation.coeffs()[static_cast<int>(k)]);
    }
    EXPECT_EQ(std::stoi(parts[10]), c.plane_id);
    EXPECT_EQ(std::stof(parts[11]), c.probability);
    EXPECT_EQ(parts[12], "occupied");
  }
  EXPECT_FALSE(std::getline(in, line));
}

TEST(MapExport, PlyIsAClosedMeshOfTheSameVolume) {
  const std::vector<Cuboid> cuboids = someCuboids();
  std::istringstream in(io::cuboidsToPly(cuboids));
  std::string line;
  std::size_t vertices = 0, faces = 0;
  while (std::getline(in, line) && line != "end_header") {
    if (line.rfind("element vertex ", 0) == 0) vertices = std::stoul(line.substr(15));
    if (line.rfind("element face ", 0) == 0) faces = std::stoul(line.substr(13));
  }
  ASSERT_EQ(vertices, 8 * cuboids.size());
  ASSERT_EQ(faces, 12 * cuboids.size());
  std::vector<Vector3> points(vertices);
  for (std::size_t i = 0; i < vertices; ++i) {
    int r = -1, g = -1, b = -1;
    in >> points[i].x() >> points[i].y() >> points[i].z() >> r >> g >> b;
    for (const int part : {r, g, b}) EXPECT_TRUE(part >= 0 && part <= 255);
    EXPECT_EQ(r == 150 && g == 150 && b == 152, cuboids[i / 8].plane_id < 0);
  }
  double volume = 0.0;
  for (std::size_t i = 0; i < faces; ++i) {
    std::size_t n = 0, a = 0, b = 0, c = 0;
    in >> n >> a >> b >> c;
    ASSERT_EQ(n, 3u);
    volume += sixfold(points.at(a), points.at(b), points.at(c)) / 6.0;
  }
  EXPECT_TRUE(static_cast<bool>(in));
  EXPECT_NEAR(volume, volumeOf(cuboids), 1e-9);
}

TEST(MapExport, ObjIsAClosedMeshOfTheSameVolume) {
  const std::vector<Cuboid> cuboids = someCuboids();
  std::istringstream in(io::cuboidsToObj(cuboids));
  std::vector<Vector3> points;
  double volume = 0.0;
  std::size_t objects = 0;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    std::string kind;
    fields >> kind;
    objects += kind == "o" ? 1 : 0;
    if (kind == "v") {
      Vector3 p;
      fields >> p.x() >> p.y() >> p.z();
      points.push_back(p);
    }
    if (kind != "f") continue;
    std::array<std::size_t, 4> f{};
    for (std::size_t& k : f) fields >> k;
    ASSERT_TRUE(static_cast<bool>(fields));
    const auto at = [&](std::size_t k) { return points.at(f[k] - 1); };
    volume += (sixfold(at(0), at(1), at(2)) + sixfold(at(0), at(2), at(3))) / 6.0;
  }
  EXPECT_EQ(objects, cuboids.size());
  EXPECT_NEAR(volume, volumeOf(cuboids), 1e-9);
}

TEST(MapExport, SdfPosesAreThoseOfTheCuboids) {
  const std::vector<Cuboid> cuboids = someCuboids();
  const std::string text = io::cuboidsToSdf(cuboids);
  std::size_t at = 0;
  for (const Cuboid& c : cuboids) {
    for (int times = 0; times < 2; ++times) {  // to collide with, to see
      at = text.find("<pose>", at);
      ASSERT_NE(at, std::string::npos);
      std::istringstream pose(text.substr(at += 6, 300));
      Vector3 p, rpy, size;
      pose >> p.x() >> p.y() >> p.z() >> rpy.x() >> rpy.y() >> rpy.z();
      const Matrix3 turn = (Eigen::AngleAxisd(rpy.z(), Vector3::UnitZ()) *
                            Eigen::AngleAxisd(rpy.y(), Vector3::UnitY()) *
                            Eigen::AngleAxisd(rpy.x(), Vector3::UnitX()))
                               .toRotationMatrix();
      EXPECT_EQ(p, c.center);
      EXPECT_LT((turn - c.orientation.toRotationMatrix()).cwiseAbs().maxCoeff(), 1e-7);
      std::istringstream box(text.substr(text.find("<size>", at) + 6, 200));
      box >> size.x() >> size.y() >> size.z();
      EXPECT_EQ(size, c.size);
    }
  }
  EXPECT_EQ(text.find("<pose>", at), std::string::npos);
}

TEST(MapExport, ExtensionChoosesTheFormat) {
  const TemporaryDirectory directory;
  PlanarMap map;
  map.insert(test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.0})).frame());
  const auto size = [&](const std::string& name, io::ExportedSpace space) {
    io::exportMap(map, directory / name, space, io::Overwrite::Allow);
    return std::filesystem::file_size(directory / name);
  };
  for (const char* name : {"m.csv", "m.ply", "m.obj", "m.sdf"}) {
    const auto occupied = size(name, io::ExportedSpace::Occupied);
    EXPECT_GT(occupied, 100u) << name;
    EXPECT_GT(size(name, io::ExportedSpace::OccupiedAndUnknown), occupied) << name;
  }
  EXPECT_GT(size("m.json", io::ExportedSpace::Occupied), 100u);
  io::exportMap(map, directory / "m.pmap");
  EXPECT_EQ(io::loadMap(directory / "m.pmap").serialize(), map.serialize());
  EXPECT_THROW(io::exportMap(map, directory / "m.pmap"), Error);  // is there already
  io::exportMap(map.finished(), directory / "finished.pmap");
  EXPECT_TRUE(io::loadMap(directory / "finished.pmap").isFinished());
  EXPECT_THROW(io::exportMap(map, directory / "m.stl"), ParameterError);
  EXPECT_FALSE(std::filesystem::exists(directory / "m.stl"));
}

}  // namespace
}  // namespace planar_mapping
