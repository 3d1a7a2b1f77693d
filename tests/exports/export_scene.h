// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/io/export/exported_map.h"
#include "temporary_directory.h"

// What exports are tried on: turned cuboids of all kinds, and what a reader should find of them.
namespace planar_mapping::test {

/// Turned cuboids on planes and on none; the last tenth is unknown space.
inline std::vector<Cuboid> manyCuboids(std::size_t count, std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<Cuboid> cuboids(count);
  for (std::size_t i = 0; i < count; ++i) {
    Cuboid& c = cuboids[i];
    for (int k = 0; k < 3; ++k) {
      c.center[k] = random.uniform(-20.0, 20.0);
      c.size[k] = random.uniform(0.05, 2.0);
    }
    c.orientation =
        Quaternion(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
    c.plane_id = static_cast<int>(random.below(40)) - 1;
    c.probability = static_cast<float>(random.uniform(0.5, 1.0));
    if (i < count - count / 10) continue;
    c.state = CellState::Unknown;
    c.orientation = Quaternion::Identity();
    c.plane_id = -1;
    c.probability = 0.5f;
  }
  // Roll and yaw about the same axis.
  cuboids[0].orientation = Quaternion(Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY()));
  return cuboids;
}

/// With an origin of its own, as of a map in UTM: readers find its coordinates nevertheless.
inline io::ExportedMap manyExported(std::size_t count = 5000) {
  io::ExportedMap map;
  map.cuboids = manyCuboids(count);
  map.origin = {501000.0, 4500000.0, 0.5};
  return map;
}

/// The files of an export, in a directory of their own.
class Exported {
 public:
  using Write = io::Contents (*)(const io::ExportedMap&, const std::string&);
  Exported(Write write, const io::ExportedMap& map, const std::string& name)
      : path_(directory_ / name) {
    const io::Contents contents = write(map, path_);
    const std::vector<std::string> files = io::exportedFiles(path_);
    EXPECT_EQ(contents.size(), files.size());
    if (path_.back() == '/') std::filesystem::create_directories(path_);
    for (std::size_t i = 0; i < files.size(); ++i)
      std::ofstream(files[i], std::ios::binary) << contents.at(i);
  }
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return directory_ / name; }

 private:
  TemporaryDirectory directory_;
  std::string path_;
};

using Triangle = std::array<Vector3, 3>;

inline double volumeOf(const std::vector<Triangle>& triangles) {
  double volume = 0.0;  // positive where they are wound outwards
  for (const Triangle& t : triangles) volume += t[0].dot(t[1].cross(t[2])) / 6.0;
  return volume;
}
inline double volumeOf(const std::vector<Cuboid>& cuboids) {
  double volume = 0.0;
  for (const Cuboid& c : cuboids) volume += c.volume();
  return volume;
}

/// Every corner of every cuboid is met by its own triangles: 12 follow each other
/// for each cuboid, with the corners of that cuboid and outwards.
inline void expectTrianglesOf(const std::vector<Cuboid>& cuboids,
                              const std::vector<Triangle>& triangles, double tolerance) {
  ASSERT_EQ(triangles.size(), 12 * cuboids.size());
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const std::array<Vector3, 8> expected = corners(cuboids[i]);
    std::array<int, 8> met{};
    double volume = 0.0;
    for (std::size_t t = 12 * i; t < 12 * i + 12; ++t) {
      Triangle local = triangles[t];
      for (Vector3& p : local) {
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < 8; ++k) {
          if ((expected[k] - p).norm() < (expected[nearest] - p).norm()) nearest = k;
        }
        ASSERT_LT((expected[nearest] - p).norm(), tolerance) << "cuboid " << i;
        ++met[nearest];
        p -= cuboids[i].center;
      }
      volume += local[0].dot(local[1].cross(local[2])) / 6.0;
    }
    for (const int times : met) ASSERT_GE(times, 3) << "cuboid " << i;
    ASSERT_NEAR(volume, cuboids[i].volume(), 20.0 * tolerance) << "cuboid " << i;
  }
}

/// By the name of their mesh: the plane they lie on.
inline std::map<std::string, std::vector<Cuboid>> groupsOf(const std::vector<Cuboid>& cuboids) {
  std::map<std::string, std::vector<Cuboid>> groups;
  for (const Cuboid& c : cuboids) {
    const std::string plane = c.plane_id < 0 ? "no_plane" : "plane_" + std::to_string(c.plane_id);
    groups[c.state == CellState::Unknown ? "unknown" : plane].push_back(c);
  }
  return groups;
}

inline Cuboid box(const Vector3& low, const Vector3& high, CellState state = CellState::Occupied) {
  Cuboid cuboid;
  cuboid.center = 0.5 * (low + high);
  cuboid.size = high - low;
  cuboid.state = state;
  return cuboid;
}

/// Each cuboid of the map gets a plane of its own.
inline void numberPlanes(io::ExportedMap& map) {
  for (std::size_t i = 0; i < map.cuboids.size(); ++i)
    map.cuboids[i].plane_id = static_cast<std::int32_t>(i);
}

}  // namespace planar_mapping::test
