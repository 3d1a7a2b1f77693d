// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "map_text.h"

#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::detail {
namespace {

std::string list(std::initializer_list<double> values) {
  std::string out = "[";
  for (const double value : values) out += (out.size() > 1 ? ", " : "") + formatNumber(value);
  return out + "]";
}

std::string lineOf(const Cuboid& cuboid) {
  const Vector3& c = cuboid.center;
  const Vector3& s = cuboid.size;
  const Quaternion& q = cuboid.orientation;
  return "    {\"center\": " + list({c.x(), c.y(), c.z()}) +
         ", \"size\": " + list({s.x(), s.y(), s.z()}) +
         ", \"quaternion\": " + list({q.x(), q.y(), q.z(), q.w()}) +
         ", \"plane_id\": " + std::to_string(cuboid.plane_id) +
         ", \"probability\": " + formatNumber(static_cast<double>(cuboid.probability)) +
         ", \"state\": \"" + toString(cuboid.state) + "\"}";
}

}  // namespace

std::string mapToJson(const PlanarMap& map) {
  std::string json =
      "{\n  \"format\": \"planar_mapping map\",\n  \"version\": 1,\n"
      "  \"resolution_m\": " +
      formatNumber(map.params().approximation.resolution) + ",\n  \"planes\": [";
  bool first = true;
  for (const MapPlane& plane : map.planes()) {
    const Vector3& n = plane.plane.normal;
    json += first ? "\n" : ",\n";
    first = false;
    json += "    {\"id\": " + std::to_string(plane.id) +
            ", \"coefficients\": " + list({n.x(), n.y(), n.z(), plane.plane.offset}) +
            ", \"frames\": " + std::to_string(plane.frames) + "}";
  }
  json += first ? "],\n  \"cuboids\": [" : "\n  ],\n  \"cuboids\": [";
  first = true;
  for (const Cuboid& cuboid : map.cuboids()) {
    json += first ? "\n" : ",\n";
    first = false;
    json += lineOf(cuboid);
  }
  return json + (first ? "]\n}\n" : "\n  ]\n}\n");
}

}  // namespace planar_mapping::detail
