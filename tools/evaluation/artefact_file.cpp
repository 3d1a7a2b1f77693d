// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "artefact_file.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Parts of at most s along each axis.
std::vector<Cuboid> partsOf(const Cuboid& cuboid, double s) {
  Eigen::Vector3i counts;
  for (int axis = 0; axis < 3; ++axis) {
    counts[axis] = std::max(1, static_cast<int>(std::ceil(cuboid.size[axis] / s - 1e-9)));
  }
  Cuboid part = cuboid;
  part.size = cuboid.size.cwiseQuotient(counts.cast<double>());
  const Quaternion turn = cuboid.orientation.normalized();
  std::vector<Cuboid> parts;
  for (int x = 0; x < counts.x(); ++x) {
    for (int y = 0; y < counts.y(); ++y) {
      for (int z = 0; z < counts.z(); ++z) {
        const Vector3 offset =
            (Vector3(x, y, z) + Vector3::Constant(0.5)).cwiseProduct(part.size) - 0.5 * cuboid.size;
        part.center = cuboid.center + turn * offset;
        parts.push_back(part);
      }
    }
  }
  return parts;
}

Json cuboidJson(const Cuboid& c) {
  // A tenth of a millimetre is enough for a picture.
  const auto rounded = [](double value) { return std::round(value * 1e4) / 1e4; };
  const Quaternion q = c.orientation.normalized();
  return {rounded(c.center.x()), rounded(c.center.y()), rounded(c.center.z()), rounded(c.size.x()),
          rounded(c.size.y()),   rounded(c.size.z()),   rounded(q.x()),        rounded(q.y()),
          rounded(q.z()),        rounded(q.w())};
}

Json panelJson(const MethodMap& map, const std::string& name, double s,
               const evaluation::SurfaceTruth& truth) {
  Json right = Json::array();
  Json wrong = Json::array();
  for (const Cuboid& cuboid : map.cuboids) {
    const std::vector<Cuboid> parts = partsOf(cuboid, s);
    const auto isRight = [&](const Cuboid& part) { return truth.isNear(part.center, s); };
    if (std::all_of(parts.begin(), parts.end(), isRight)) {
      right.push_back(cuboidJson(cuboid));
      continue;
    }
    for (const Cuboid& part : parts) (isRight(part) ? right : wrong).push_back(cuboidJson(part));
  }
  Json json;
  json["title"] = name + " (s = " + formatNumber(s) + " m): " + std::to_string(map.cuboids.size()) +
                  " cells; red: " + std::to_string(wrong.size()) + " standard cells wrong";
  json["right"] = std::move(right);
  json["wrong"] = std::move(wrong);
  return json;
}

/// From behind and above the first frame of the place, along the way.
Json viewJson(const Pose& T_world_sensor) {
  constexpr double kBack = 0.4;  // metres, like the next three
  constexpr double kAbove = 0.9;
  constexpr double kAhead = 3.0;
  constexpr double kFocalAbove = 0.6;
  constexpr double kAngle = 0.95;  // radians
  Vector3 forward = T_world_sensor.linear().col(2);
  forward.z() = 0.0;
  forward.normalize();
  const Vector3 position = T_world_sensor.translation() - kBack * forward + Vector3(0, 0, kAbove);
  const Vector3 focal =
      T_world_sensor.translation() + kAhead * forward + Vector3(0, 0, kFocalAbove);
  Json json;
  json["position"] = {position.x(), position.y(), position.z()};
  json["focal_point"] = {focal.x(), focal.y(), focal.z()};
  json["angle_rad"] = kAngle;
  return json;
}

}  // namespace

std::string artefactJson(const PlaceMaps& maps, const std::string& scene) {
  Json json;
  json["scene"] = scene;
  json["place"] = maps.place;
  json["cell_m"] = maps.cell;
  json["view"] = viewJson(maps.poses.front());
  json["panels"] = Json::array();
  for (const MethodMap& map : maps.maps) {
    const bool ours = map.method == "PG";
    if (!ours && map.method != "SG") continue;
    json["panels"].push_back(
        panelJson(map, ours ? "Planar map" : "Standard grid", maps.cell, *maps.truth));
  }
  return json.dump() + "\n";
}

}  // namespace planar_mapping::tools
