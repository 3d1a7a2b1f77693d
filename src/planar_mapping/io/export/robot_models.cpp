// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Boxes to collide with and to see: SDFormat, URDF, MoveIt.
#include <map>

#include "planar_mapping/io/export/exported_map.h"

namespace planar_mapping::io {
namespace {

/// A name that is unique in the file and sorts by number.
std::string nameOf(std::size_t i) {
  const std::string number = std::to_string(i);
  return "cuboid_" + std::string(number.size() < 6 ? 6 - number.size() : 0, '0') + number;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

/// Collision and visual elements of each cuboid: its pose in the words of the format, its size
/// between the given ones, and how it looks.
template <typename Look>
void appendBoxes(std::string& out, const ExportedMap& map, const char* const words[4],
                 Look&& appendLook) {
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    const std::string box =
        concatenated(words[0], listOf(c.center), words[1], listOf(rollPitchYaw(c.orientation)),
                     words[2], listOf(c.size), words[3]);
    const std::string name = nameOf(i);
    append(out, "<collision name=\"", name, "\">", box, "</collision>\n<visual name=\"", name,
           "\">", box);
    appendLook(out, c);
    out += "</visual>\n";
  }
}

std::string xmlHead(const ExportedMap& map) {
  return "<?xml version=\"1.0\"?>\n" + originNote(map, "<!-- ", " -->\n");
}

std::string sdfOf(const ExportedMap& map, const std::string& name) {
  constexpr const char* kWords[] = {"<pose>", " ", "</pose><geometry><box><size>",
                                    "</size></box></geometry>"};
  // Gravity of a simulator points along -z.
  const Vector3 upright = rollPitchYaw(turning(map.up, Vector3::UnitZ()));
  std::string out = concatenated(xmlHead(map), "<sdf version=\"1.7\">\n<model name=\"",
                                 escaped(name), "\">\n<static>true</static>\n<pose>0 0 0 ",
                                 listOf(upright), "</pose>\n<link name=\"link\">\n");
  appendBoxes(out, map, kWords, [](std::string& look, const Cuboid& cuboid) {
    const Colour colour = colourOf(cuboid);
    append(look, "<material><ambient>", rgbaOf(colour), "</ambient><diffuse>", rgbaOf(colour),
           "</diffuse></material>");
    if (colour.alpha < 1.0) look += "<transparency>0.7</transparency>";
  });
  return out + "</link>\n</model>\n</sdf>\n";
}

}  // namespace

Contents writeSdf(const ExportedMap& map, const std::string& path) {
  return {sdfOf(map, stemOf(path))};
}

Contents writeModelFolder(const ExportedMap& map, const std::string& path) {
  const std::string name = stemOf(path);
  const std::string config =
      "<?xml version=\"1.0\"?>\n<model>\n<name>" + escaped(name) +
      "</name>\n<version>1.0</version>\n<sdf version=\"1.7\">model.sdf</sdf>\n<description>A map "
      "of planar_mapping" +
      originNote(map, ", ", "") + ".</description>\n</model>\n";
  return {sdfOf(map, name), config};
}

Contents writeUrdf(const ExportedMap& map, const std::string& path) {
  constexpr const char* kWords[] = {"<origin xyz=\"", "\" rpy=\"", "\"/><geometry><box size=\"",
                                    "\"/></geometry>"};
  std::string out = xmlHead(map) + "<robot name=\"" + escaped(stemOf(path)) + "\">\n";
  std::map<std::string, Colour> materials;
  for (const Cuboid& c : map.cuboids) materials.emplace(groupOf(c), colourOf(c));
  for (const auto& [name, colour] : materials)
    append(out, "<material name=\"", name, "\"><color rgba=\"", rgbaOf(colour),
           "\"/></material>\n");
  out += "<link name=\"" + escaped(map.options.frame_id) + "\">\n";
  appendBoxes(out, map, kWords, [](std::string& look, const Cuboid& cuboid) {
    look += "<material name=\"" + groupOf(cuboid) + "\"/>";
  });
  return {out + "</link>\n</robot>\n"};
}

Contents writeScene(const ExportedMap& map, const std::string& path) {
  std::string out = stemOf(path) + '\n';
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    // Object pose, number of shapes, shape, its pose, its colour, number of subframes.
    append(out, "* ", nameOf(i), "\n0 0 0\n0 0 0 1\n1\nbox\n", listOf(c.size), '\n',
           listOf(c.center), '\n', listOf(c.orientation), '\n', rgbaOf(colourOf(c)), "\n0\n");
  }
  return {out + ".\n"};
}

}  // namespace planar_mapping::io
