// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A robot of 0.5 m x 0.4 m x 0.6 m drives along a path. Is each pose free? Asked three times: of
// the cuboids of a map (FCL), of the same map as an octree (FCL and OctoMap), and of its grid as
// nav2 does (footprint on an OccupancyGrid).
//
//   path_check [MAP.pmap [X0,Y0,X1,Y1,...]]    without a file: a room it makes; heights from z = 0
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/math/bv/OBB.h>
#include <fcl/narrowphase/collision.h>
#include <octomap/OcTree.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "planar_mapping/io/export/map_export.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/planes/multi_plane.h"

using namespace planar_mapping;

namespace {

const Vector3 kRobot(0.5, 0.4, 0.6);  // length, width, height, metres
constexpr double kClearance = 0.15;   // over the ground

/// A camera 1 m over the floor looks along x at walls and two boxes turned by 30 degrees.
PlanarMap mapOfRoom() {
  std::vector<float> xyz;
  const auto face = [&](const Vector3& from, const Vector3& u, const Vector3& v) {
    const double step_u = 0.02 / u.norm(), step_v = 0.02 / v.norm();
    for (double a = 0.5 * step_u; a < 1.0; a += step_u) {
      for (double b = 0.5 * step_v; b < 1.0; b += step_v) {
        for (const double part : Vector3(from + a * u + b * v)) {
          xyz.push_back(static_cast<float>(part));
        }
      }
    }
  };
  const Vector3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  face({0, -3, -1}, 8 * x, 6 * y);  // floor
  face({8, -3, -1}, 6 * y, 2 * z);  // walls
  face({0, 3, -1}, 8 * x, 2 * z);
  face({0, -3, -1}, 8 * x, 2 * z);
  const Vector3 u(std::cos(0.52), std::sin(0.52), 0), v(-u.y(), u.x(), 0);
  for (const Vector3& corner : {Vector3(3, -1.8, -1), Vector3(5, 0.3, -1)}) {
    face(corner, u, z);
    face(corner, v, z);
  }
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  frame.T_world_sensor.translation().z() = 1.0;
  const auto found = findPlanes(frame.points, nullptr, MultiPlaneParams());
  frame.planes = &found.planes;
  PlanarMap map;
  map.insert(frame);
  return map;
}

/// The robot every 2 cm along the path, turned the way it drives.
std::vector<Pose> posesAlong(const std::vector<Vector2>& path) {
  std::vector<Pose> poses;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vector2 way = path[i] - path[i - 1];
    for (double done = 0.0; done < way.norm(); done += 0.02) {
      const Vector2 at = path[i - 1] + done * way.normalized();
      Pose pose = Pose::Identity();
      pose.translation() << at, kClearance + 0.5 * kRobot.z();
      pose.linear() =
          Eigen::AngleAxisd(std::atan2(way.y(), way.x()), Vector3::UnitZ()).toRotationMatrix();
      poses.push_back(pose);
    }
  }
  return poses;
}

fcl::Transform3d fclOf(const Vector3& position, const Quaternion& turn) {
  fcl::Transform3d T = fcl::Transform3d::Identity();
  T.linear() = turn.toRotationMatrix();
  T.translation() = position;
  return T;
}

/// A box in the world; FCL's oriented bounding box is exactly that, with half lengths.
fcl::OBBd boxOf(const Vector3& position, const Quaternion& turn, const Vector3& size) {
  return fcl::OBBd(turn.toRotationMatrix(), position, 0.5 * size);
}

/// The cuboids in a tree of FCL. Whether two boxes meet needs no general collision check.
class CuboidWorld {
 public:
  explicit CuboidWorld(const PlanarMap& map) {
    for (const Cuboid& c : map.cuboids()) {
      boxes_.push_back(boxOf(c.center, c.orientation, c.size));
      objects_.push_back(std::make_unique<fcl::CollisionObjectd>(
          std::make_shared<fcl::Boxd>(c.size), fclOf(c.center, c.orientation)));
    }
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      objects_[i]->setUserData(&boxes_[i]);
      manager_.registerObject(objects_[i].get());
    }
    manager_.setup();
  }
  /// \param robot its user data is its OBB
  bool meets(fcl::CollisionObjectd& robot) {
    bool hit = false;
    manager_.collide(&robot, &hit,
                     [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* out) {
                       const auto* box_a = static_cast<const fcl::OBBd*>(a->getUserData());
                       const auto* box_b = static_cast<const fcl::OBBd*>(b->getUserData());
                       return *static_cast<bool*>(out) = box_a->overlap(*box_b);
                     });
    return hit;
  }
  std::size_t size() const { return objects_.size(); }

 private:
  std::vector<fcl::OBBd> boxes_;
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
  fcl::DynamicAABBTreeCollisionManagerd manager_;
};

/// Does a cell of the grid that the robot stands on say occupied?
bool meets(const Plan& grid, const Pose& robot) {
  const double step = 0.5 * grid.cell;
  for (double a = -0.5 * kRobot.x(); a <= 0.5 * kRobot.x(); a += step) {
    for (double b = -0.5 * kRobot.y(); b <= 0.5 * kRobot.y(); b += step) {
      const Vector3 p = robot * Vector3(a, b, 0.0);
      const double x = std::floor((p.x() - grid.origin.x()) / grid.cell);
      const double y = std::floor((p.y() - grid.origin.y()) / grid.cell);
      if (x < 0.0 || y < 0.0 || x >= grid.width || y >= grid.height) continue;
      if (grid.at(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) ==
          Plan::kOccupied) {
        return true;
      }
    }
  }
  return false;
}

struct Answers {
  std::vector<bool> hit;
  double microseconds = 0.0;  ///< a pose
};

Answers ask(const std::vector<Pose>& poses, const std::function<bool(const Pose&)>& meets) {
  constexpr int kTimes = 20;
  Answers answers;
  const auto start = std::chrono::steady_clock::now();
  for (int times = 0; times < kTimes; ++times) {
    answers.hit.clear();
    for (const Pose& pose : poses) answers.hit.push_back(meets(pose));
  }
  const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
  answers.microseconds = took.count() / (kTimes * static_cast<double>(poses.size()));
  return answers;
}

}  // namespace

int main(int argc, char** argv) try {
  const PlanarMap map = argc > 1 ? io::loadMap(argv[1]) : mapOfRoom();
  std::vector<Vector2> path = {{1.0, -2.0}, {2.4, 0.0}, {4.2, -1.2}, {5.2, 1.0}, {7.2, 2.0}};
  if (argc > 2) {
    path.clear();
    std::istringstream numbers(argv[2]);
    for (std::string x, y; std::getline(numbers, x, ',') && std::getline(numbers, y, ',');) {
      path.emplace_back(std::stod(x), std::stod(y));
    }
  }
  const std::vector<Pose> poses = posesAlong(path);

  CuboidWorld cuboids(map);
  const std::string file = (std::filesystem::temp_directory_path() /
                            ("path_check_" + std::to_string(::getpid()) + ".bt"))
                               .string();
  io::exportMap(map, file);
  const auto tree = std::make_shared<octomap::OcTree>(file);
  std::filesystem::remove(file);
  fcl::CollisionObjectd octree(
      std::make_shared<fcl::OcTreed>(std::shared_ptr<const octomap::OcTree>(tree)));
  RobotModel model;
  model.height = kRobot.z() + kClearance;
  model.max_step = kClearance;
  const Plan grid = plansOf(map, model).front();

  fcl::CollisionObjectd robot(std::make_shared<fcl::Boxd>(kRobot));
  fcl::OBBd robot_box;
  robot.setUserData(&robot_box);
  const auto place = [&](const Pose& pose) {
    const Quaternion turn(pose.linear());
    robot.setTransform(fclOf(pose.translation(), turn));
    robot.computeAABB();
    robot_box = boxOf(pose.translation(), turn, kRobot);
  };
  const Answers of_cuboids = ask(poses, [&](const Pose& pose) {
    place(pose);
    return cuboids.meets(robot);
  });
  const Answers of_octree = ask(poses, [&](const Pose& pose) {
    place(pose);
    fcl::CollisionResultd result;
    return fcl::collide(&robot, &octree, fcl::CollisionRequestd(), result) > 0;
  });
  const Answers of_grid = ask(poses, [&](const Pose& pose) { return meets(grid, pose); });

  std::size_t hits[3] = {0, 0, 0}, only_octree = 0, only_cuboids = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    hits[0] += of_cuboids.hit[i] ? 1 : 0;
    hits[1] += of_octree.hit[i] ? 1 : 0;
    hits[2] += of_grid.hit[i] ? 1 : 0;
    only_octree += of_octree.hit[i] && !of_cuboids.hit[i] ? 1 : 0;
    only_cuboids += of_cuboids.hit[i] && !of_octree.hit[i] ? 1 : 0;
  }
  std::printf("%zu poses\n%-10s %12s %10s %12s\n", poses.size(), "", "elements", "in contact",
              "us a pose");
  std::printf("%-10s %12zu %10zu %12.2f\n", "cuboids", cuboids.size(), hits[0],
              of_cuboids.microseconds);
  std::printf("%-10s %12zu %10zu %12.2f\n", "octree", tree->getNumLeafNodes(), hits[1],
              of_octree.microseconds);
  std::printf("%-10s %12zu %10zu %12.2f\n", "grid", grid.values.size(), hits[2],
              of_grid.microseconds);
  std::printf(
      "The octree takes %.0f times as long as the cuboids.\n"
      "%zu poses touch the octree alone, whose cells are thicker than the walls; %zu the "
      "cuboids alone.\n",
      of_octree.microseconds / of_cuboids.microseconds, only_octree, only_cuboids);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
