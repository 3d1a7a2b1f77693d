// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/plan/floor_plan.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "planar_mapping/geometry/turning.h"

namespace planar_mapping {
namespace {

constexpr double kUpright = 10.0 * kRadiansPerDegree;  ///< walls lean by less
constexpr double kParallel = 5.0 * kRadiansPerDegree;  ///< the two faces of a wall
constexpr double kMaxThickness = 0.5;                  ///< of a wall, metres
constexpr double kMaxOpening = 3.0;                    ///< a wider gap is between two walls, metres

/// A face of a wall: pieces along it.
struct Face {
  Vector2 normal, along;
  double offset = 0.0;     ///< of its plane along the normal
  double thickness = 0.0;  ///< of its cuboids
  std::vector<std::pair<double, double>> pieces;

  WallRectangle rectangle(double from, double to, double depth) const {
    WallRectangle wall;
    wall.along = along;
    wall.length = to - from;
    wall.thickness = depth;
    wall.center = 0.5 * (from + to) * along + (offset - 0.5 * depth) * normal;
    return wall;
  }
};

std::vector<Face> facesOf(const PlanSource& source, double low, double high) {
  const Quaternion turn = turning(source.up, Vector3::UnitZ());
  std::map<std::int32_t, Face> faces;
  for (const Cuboid& cuboid : source.occupied) {
    if (cuboid.plane_id < 0) continue;
    const Vector3 normal = turn * (cuboid.orientation * Vector3::UnitZ());
    const Vector3 center = turn * cuboid.center;
    const double half = halfAlong(cuboid, source.up);
    if (std::abs(normal.z()) > std::sin(kUpright) || center.z() + half < low ||
        center.z() - half > high)
      continue;
    Face& face = faces[cuboid.plane_id];
    if (face.pieces.empty()) {
      face.normal = normal.head<2>().normalized();
      face.along = Vector2(-face.normal.y(), face.normal.x());
      face.offset = face.normal.dot(center.head<2>()) + 0.5 * cuboid.size.z();
      face.thickness = cuboid.size.z();
    }
    const Vector3 along = turn.conjugate() * Vector3(face.along.x(), face.along.y(), 0.0);
    const double reach = halfAlong(cuboid, along);
    const double middle = face.along.dot(center.head<2>());
    face.pieces.emplace_back(middle - reach, middle + reach);
  }
  std::vector<Face> list;
  for (auto& [id, face] : faces) {
    std::sort(face.pieces.begin(), face.pieces.end());
    std::vector<std::pair<double, double>> joined;
    for (const auto& piece : face.pieces) {
      if (!joined.empty() && piece.first <= joined.back().second + source.resolution) {
        joined.back().second = std::max(joined.back().second, piece.second);
      } else {
        joined.push_back(piece);
      }
    }
    face.pieces = std::move(joined);
    list.push_back(face);
  }
  return list;
}

}  // namespace

std::vector<WallRectangle> wallsOf(const PlanSource& source, const Plan& plan,
                                   const RobotModel& robot) {
  const std::vector<Face> faces =
      facesOf(source, plan.floor + robot.max_step, plan.floor + robot.height);
  std::vector<std::vector<char>> is_drawn;
  for (const Face& face : faces) is_drawn.emplace_back(face.pieces.size(), 0);
  std::vector<WallRectangle> walls;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Face& face = faces[i];
    double depth_before = face.thickness;
    for (std::size_t k = 0; k < face.pieces.size(); ++k) {
      auto [from, to] = face.pieces[k];
      double depth = face.thickness;
      // The other face of the wall looks the other way, behind this one.
      for (std::size_t j = i + 1; j < faces.size(); ++j) {
        const double between = face.offset + faces[j].offset;
        if (face.normal.dot(faces[j].normal) > -std::cos(kParallel) || between <= 0.0 ||
            between > kMaxThickness)
          continue;
        for (std::size_t m = 0; m < faces[j].pieces.size(); ++m) {
          const auto [other_from, other_to] = faces[j].pieces[m];
          if (std::min(to, -other_from) <= std::max(from, -other_to)) continue;
          depth = between;
          from = std::min(from, -other_to);
          to = std::max(to, -other_from);
          is_drawn[j][m] = 1;
        }
      }
      if (is_drawn[i][k] == 0) walls.push_back(face.rectangle(from, to, depth));
      if (k > 0 && from - face.pieces[k - 1].second <= kMaxOpening) {
        WallRectangle gap =
            face.rectangle(face.pieces[k - 1].second, from, std::max(depth, depth_before));
        gap.is_opening = true;
        if (is_drawn[i][k] == 0 && plan.isStandable(gap.center.x(), gap.center.y()))
          walls.push_back(gap);
      }
      depth_before = depth;
    }
  }
  return walls;
}

}  // namespace planar_mapping
