// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Plans of storeys: grids for planners, walls for people.
#include <algorithm>
#include <cctype>

#include "planar_mapping/io/export/exported_map.h"
#include "planar_mapping/io/text_lines.h"
#include "planar_mapping/plan/floor_plan.h"

namespace planar_mapping::io {
namespace {

/// A word that YAML would read as something else is quoted.
std::string yamlOf(const std::string& name) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-' || c == '/' || c > 127;
  };
  if (name[0] != '-' && std::all_of(name.begin(), name.end(), is_plain)) return name;
  std::string quoted = "'";
  for (const char c : name) quoted.append(c == '\'' ? 2 : 1, c);
  return quoted + "'";
}

std::string textOf(const RobotModel& robot) {
  std::string text = concatenated(
      "robot ", robot.height, " m high, ", robot.radius, " m radius, steps to ", robot.max_step,
      " m, slopes to ", std::round(1e3 * robot.max_slope / kRadiansPerDegree) / 1e3, " degrees");
  if (!std::isnan(robot.camera_height))
    append(text, ", camera ", robot.camera_height, " m over the floor");
  return text;
}

/// Plans of all storeys, whose notes are for the user; of several first that on which the path
/// ends.
std::vector<Plan> plansFor(const ExportedMap& map) {
  std::vector<Plan> plans = plansOf(map.plan, map.options.robot, map.options.cell);
  for (std::size_t i = 0; i < plans.size(); ++i) {
    std::string note = plans.size() == 1 ? "plan" : concatenated("storey ", i);
    append(note, " at ", std::round(100.0 * plans[i].floor) / 100.0, " m for a ",
           textOf(map.options.robot), ": ", plans[i].note);
    map.notes.push_back(note);
  }
  if (plans.size() > 1) {
    const Plan last = storeyOfPath(map, plans);
    plans.insert(plans.begin(), last);
  }
  return plans;
}

std::size_t storeysIn(const std::vector<Plan>& plans) {
  return plans.size() > 1 ? plans.size() - 1 : 1;
}

std::string imageOf(const Plan& plan) {
  std::string pgm = concatenated("P5\n# planar_mapping, ", plan.cell, " m/pix\n", plan.width, ' ',
                                 plan.height, "\n255\n");
  pgm.reserve(pgm.size() + plan.values.size());
  for (std::uint32_t y = plan.height; y-- > 0;) {  // the first row has the largest y
    for (std::uint32_t x = 0; x < plan.width; ++x) {
      const std::int8_t value = plan.at(x, y);
      pgm += static_cast<char>(value == Plan::kOccupied ? 0 : value == Plan::kFree ? 254 : 205);
    }
  }
  return pgm;
}

std::string yamlFor(const Plan& plan, const ExportedMap& map, const std::string& image) {
  std::string yaml =
      concatenated("# planar_mapping, frame ", map.options.frame_id, ", floor at ", plan.floor,
                   " m along its up axis\n# ", textOf(map.options.robot), "\n# ", plan.note, '\n');
  if (!map.up.isApprox(Vector3::UnitZ()))
    append(yaml, "# The axes are those of the map turned by the quaternion x, y, z, w: ",
           listOf(turning(map.up, Vector3::UnitZ()), ", "), '\n');
  // Without the rounding of cell times count: -3.3, not -3.3000000000000003.
  const Vector2 origin = (1e9 * plan.origin).array().round() / 1e9;
  // 205 is read as unknown only with a threshold of 0.196, not with 0.25.
  append(yaml, originNote(map, "# ", ": the place of the map's own origin in the world\n"),
         "image: ", yamlOf(image), "\nmode: trinary\nresolution: ", plan.cell, "\norigin: [",
         origin.x(), ", ", origin.y(),
         ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
  return yaml;
}

/// Float32, a row of the plan after the other: the row of smallest y first.
std::string npyOf(const Plan& plan) {
  std::string header = concatenated("{'descr': '<f4', 'fortran_order': False, 'shape': (",
                                    plan.height, ", ", plan.width, "), }");
  header.resize((10 + header.size() + 1 + 63) / 64 * 64 - 11, ' ');
  header += '\n';
  std::string npy("\x93NUMPY\x01\x00", 8);
  appendBytes(npy, static_cast<std::uint16_t>(header.size()));
  npy += header;
  for (const float value : plan.distances()) appendBytes(npy, value);
  return npy;
}

std::string svgOf(const Plan& plan, const std::vector<WallRectangle>& walls,
                  const ExportedMap& map) {
  Eigen::AlignedBox2d box;
  for (std::uint32_t y = 0; y < plan.height; ++y)
    for (std::uint32_t x = 0; x < plan.width; ++x)
      if (plan.at(x, y) == Plan::kFree)
        box.extend(Eigen::Vector2d(plan.origin + plan.cell * Vector2(x + 0.5, y + 0.5)));
  for (const WallRectangle& wall : walls)
    for (int i = 0; i < 4; ++i) box.extend(Eigen::Vector2d(wall.corner(i)));
  if (box.isEmpty()) box.extend(Eigen::Vector2d(0.0, 0.0));
  constexpr double kMargin = 0.5;  // metres
  const Eigen::Vector2d low = box.min().array() - kMargin, size = box.sizes().array() + 2 * kMargin;
  const auto millimetres = [](double v) { return std::round(1e3 * v) / 1e3; };
  // Metres; y up as in the map.
  std::string svg = concatenated(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", millimetres(20.0 * size.x()),
      "mm\" height=\"", millimetres(20.0 * size.y()), "mm\" viewBox=\"0 0 ", millimetres(size.x()),
      ' ', millimetres(size.y()), "\">\n<title>Floor at ", millimetres(plan.floor),
      " m, scale 1:50, frame ", map.options.frame_id,
      "</title>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      "<g transform=\"translate(",
      millimetres(-low.x()), ' ', millimetres(low.y() + size.y()), ") scale(1 -1)\">\n");
  svg += "<path id=\"floor\" fill=\"#e8eef4\" d=\"";
  for (std::uint32_t y = 0; y < plan.height; ++y) {
    for (std::uint32_t x = 0; x < plan.width;) {
      std::uint32_t end = x;
      while (end < plan.width && plan.at(end, y) == Plan::kFree) ++end;
      if (end > x)
        append(svg, 'M', millimetres(plan.origin.x() + plan.cell * x), ' ',
               millimetres(plan.origin.y() + plan.cell * y), 'h',
               millimetres(plan.cell * (end - x)), 'v', millimetres(plan.cell), 'h',
               millimetres(-plan.cell * (end - x)), 'z');
      x = std::max(end, x + 1);
    }
  }
  svg += "\"/>\n";
  for (const WallRectangle& wall : walls) {
    append(svg, wall.is_opening ? "<polygon class=\"opening\" fill=\"none\" stroke=\"#4a7fb5\" "
                                  "stroke-width=\"0.02\" stroke-dasharray=\"0.1 0.05\" points=\""
                                : "<polygon class=\"wall\" fill=\"#26324a\" points=\"");
    for (int i = 0; i < 4; ++i)
      append(svg, i > 0 ? " " : "", millimetres(wall.corner(i).x()), ',',
             millimetres(wall.corner(i).y()));
    svg += "\"/>\n";
  }
  return svg + "</g>\n</svg>\n";
}

/// AutoCAD R12, which all readers know: closed polylines in two layers, metres.
std::string dxfOf(const std::vector<WallRectangle>& walls, double floor) {
  std::string dxf =
      "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n0\nENDSEC\n"
      "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n70\n2\n"
      "0\nLAYER\n2\nWALLS\n70\n0\n62\n7\n6\nCONTINUOUS\n"
      "0\nLAYER\n2\nOPENINGS\n70\n0\n62\n5\n6\nCONTINUOUS\n"
      "0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
  for (const WallRectangle& wall : walls) {
    const char* layer = wall.is_opening ? "OPENINGS" : "WALLS";
    append(dxf, "0\nPOLYLINE\n8\n", layer, "\n66\n1\n10\n0\n20\n0\n30\n", floor, "\n70\n1\n");
    for (int i = 0; i < 4; ++i)
      append(dxf, "0\nVERTEX\n8\n", layer, "\n10\n", wall.corner(i).x(), "\n20\n",
             wall.corner(i).y(), "\n30\n", floor, '\n');
    append(dxf, "0\nSEQEND\n8\n", layer, '\n');
  }
  return dxf + "0\nENDSEC\n0\nEOF\n";
}

}  // namespace

const Plan& storeyOfPath(const ExportedMap& map, const std::vector<Plan>& plans) {
  const std::vector<Vector3>& path = map.plan.path;
  return storeyBelow(plans, path.empty() ? plans.front().floor : map.plan.up.dot(path.back()));
}

Contents writePgm(const ExportedMap& map, const std::string& path) {
  Contents contents;
  const std::vector<Plan> plans = plansFor(map);
  const std::vector<std::string> files =
      exportedFiles(path, map.options.distance, storeysIn(plans));
  for (const Plan& plan : plans) {
    const std::string& image = files[contents.size()];
    contents.push_back(imageOf(plan));
    contents.push_back(yamlFor(plan, map, stemOf(image) + ".pgm"));
    if (map.options.distance) contents.push_back(npyOf(plan));
  }
  return contents;
}

Contents writeSvg(const ExportedMap& map, const std::string&) {
  Contents contents;
  for (const Plan& plan : plansFor(map))
    contents.push_back(svgOf(plan, wallsOf(map.plan, plan, map.options.robot), map));
  return contents;
}

Contents writeDxf(const ExportedMap& map, const std::string&) {
  Contents contents;
  for (const Plan& plan : plansFor(map))
    contents.push_back(dxfOf(wallsOf(map.plan, plan, map.options.robot), plan.floor));
  return contents;
}

}  // namespace planar_mapping::io
