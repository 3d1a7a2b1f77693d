// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// One page for any browser, with three.js and the map inside.
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/export/exported_map.h"
#include "planar_mapping/io/export/page_assets.h"

namespace planar_mapping::io {

#ifndef PLANAR_MAPPING_HAS_THREE

Contents writePage(const ExportedMap&, const std::string& path) {
  throw ParameterError("'" + path +
                       "' needs three.js, which this program was built without (libjs-three)");
}

#else

namespace {

/// Text that needs no escapes in HTML, in JSON or in quotes, whatever the bytes are.
std::string base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// 52 bytes, which page.js reads.
void appendCuboid(std::string& out, const Cuboid& cuboid) {
  appendFloats(out, cuboid.center);
  for (int i = 0; i < 4; ++i)  // x, y, z, w
    appendBytes(out, static_cast<float>(cuboid.orientation.coeffs()[i]));
  appendFloats(out, cuboid.size);
  appendBytes(out, cuboid.probability);
  appendBytes(out, cuboid.plane_id);
  const Colour colour = colourOf(cuboid);
  for (const int part : {colour.red, colour.green, colour.blue, 0}) out += static_cast<char>(part);
}

std::string recordsOf(const std::vector<Cuboid>& cuboids) {
  std::string records;
  for (const Cuboid& cuboid : cuboids) appendCuboid(records, cuboid);
  return base64(records);
}

/// Runs of equal cells: 0 free, 1 occupied, 2 unknown, then how many there are, in two bytes.
std::string runsOf(const Plan& plan) {
  constexpr std::size_t kLongest = 65535;
  std::string runs;
  for (std::size_t i = 0; i < plan.values.size();) {
    const std::int8_t value = plan.values[i];
    std::size_t end = i;
    while (end < plan.values.size() && plan.values[end] == value && end - i < kLongest) ++end;
    runs += static_cast<char>(value == Plan::kFree ? 0 : value == Plan::kOccupied ? 1 : 2);
    appendBytes(runs, static_cast<std::uint16_t>(end - i));
    i = end;
  }
  return base64(runs);
}

/// JSON knows no other numbers.
double finite(double value) {
  return std::isfinite(value) ? value : 0.0;
}

std::string planesOf(const ExportedMap& map) {
  std::string json;
  for (const MapPlane& plane : map.plan.planes)
    append(json, json.empty() ? "" : ",", "{\"id\":", plane.id, ",\"frames\":", plane.frames,
           ",\"rms\":", finite(plane.rms()), ",\"normal\":[", listOf(plane.plane.normal, ","),
           "]}");
  return json;
}

/// "plans":[...],"storey":... of the storey on which the path ends; without any where cells would
/// be too many.
std::string plansOf(const ExportedMap& map) {
  std::string json;
  std::size_t shown = 0;
  try {
    const std::vector<Plan> plans =
        planar_mapping::plansOf(map.plan, map.options.robot, map.options.cell);
    shown = static_cast<std::size_t>(&storeyOfPath(map, plans) - plans.data());
    for (const Plan& plan : plans)
      append(json, json.empty() ? "" : ",", "{\"floor\":", finite(plan.floor),
             ",\"cell\":", plan.cell, ",\"origin\":[", plan.origin.x(), ',', plan.origin.y(),
             "],\"width\":", plan.width, ",\"height\":", plan.height, ",\"note\":\"",
             base64(plan.note), "\",\"runs\":\"", runsOf(plan), "\"}");
  } catch (const ParameterError& error) {
    map.notes.push_back(std::string("the page has no plan: ") + error.what());
  }
  return concatenated("\"plans\":[", json, "],\"storey\":", shown);
}

std::string dataOf(const ExportedMap& map, const std::string& title) {
  std::string path;
  for (const Vector3& place : map.plan.path) appendFloats(path, place);
  const RunRecord& run = map.options.run;
  return concatenated("{\"title\":\"", base64(title), "\",\"frames\":", map.frames,
                      ",\"sides\":", map.plan.knows_sides ? "true" : "false",
                      ",\"resolution\":", map.resolution, ",\"origin\":[", listOf(map.origin, ","),
                      "],\"turn\":[", listOf(turning(map.up, Vector3::UnitZ()), ","),
                      "],\"occupied\":\"", recordsOf(map.cuboids), "\",\"unknown\":\"",
                      recordsOf(map.unknown), "\",\"path\":\"", base64(path), "\",\"planes\":[",
                      planesOf(map), "],", plansOf(map), ",\"run\":{\"metrics\":\"",
                      base64(run.metrics), "\",\"frames\":\"", base64(run.frames), "\",\"log\":\"",
                      base64(run.log), "\"}}");
}

}  // namespace

Contents writePage(const ExportedMap& map, const std::string& path) {
  const std::string title = map.options.run.title.empty() ? stemOf(path) : map.options.run.title;
  std::string page(pageAsset(PageAsset::Html));
  append(page, "<script id=\"data\" type=\"application/json\">", dataOf(map, title),
         "</script>\n<script>\n// three.js and its OrbitControls, MIT licence.\n",
         pageAsset(PageAsset::Licence));
  for (const PageAsset script : {PageAsset::Three, PageAsset::Controls, PageAsset::Script})
    append(page, pageAsset(script), script == PageAsset::Script ? "" : "\n</script>\n<script>\n");
  return {page + "</script>\n</body>\n</html>\n"};
}

#endif

}  // namespace planar_mapping::io
