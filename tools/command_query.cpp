// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "commands.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/map/map_query.h"

namespace planar_mapping::tools {
namespace {

using Json = nlohmann::ordered_json;

struct QueryArguments {
  std::string map;
  std::vector<std::string> points, boxes, rays;
  std::string cloud;
  double range = 100.0;
  bool through_unknown = false;
  bool json = false;
};

/// Ids of the planes that some cuboids lie on, in their order.
Json planesOf(const PlanarMap& map, const Indices& cuboids) {
  Json planes = Json::array();
  for (const int i : cuboids) {
    const std::int32_t id = map.cuboids()[static_cast<std::size_t>(i)].plane_id;
    if (id >= 0 && std::find(planes.begin(), planes.end(), id) == planes.end())
      planes.push_back(id);
  }
  return planes;
}

Json answerPoint(const PlanarMap& map, const std::string& text) {
  const std::array<double, 3> p = numbersOf<3>("--point", text);
  const Vector3 point(p[0], p[1], p[2]);
  const Indices cuboids = map.cuboidsAt(point);
  return {{"point", toJson(point)},
          {"state", toString(map.stateAt(point))},
          {"probability", map.occupancyAt(point)},
          {"cuboids", cuboids},
          {"planes", planesOf(map, cuboids)}};
}

Json answerBox(const PlanarMap& map, const std::string& text) {
  const std::array<double, 6> b = numbersOf<6>("--box", text);
  const Vector3 low(b[0], b[1], b[2]), high(b[3], b[4], b[5]);
  const BoxState box = stateOfBox(map, low, high);
  return {{"low", toJson(low)},
          {"high", toJson(high)},
          {"state", toString(box.state)},
          {"cuboids", box.cuboids},
          {"planes", planesOf(map, box.cuboids)}};
}

Json answerRay(const PlanarMap& map, const std::string& text, const QueryArguments& arguments) {
  const std::array<double, 6> r = numbersOf<6>("--ray", text);
  const Vector3 origin(r[0], r[1], r[2]), direction(r[3], r[4], r[5]);
  const std::optional<RayHit> hit =
      castRay(map, origin, direction, arguments.range,
              arguments.through_unknown ? UnknownSpaceIs::Transparent : UnknownSpaceIs::AnObstacle);
  Json answer = {{"origin", toJson(origin)}, {"direction", toJson(direction)}};
  const auto passed = [&] {  // a ray that unknown space stops met none
    return arguments.through_unknown ? stateAlong(map, origin, direction, arguments.range)
                                     : CellState::Free;
  };
  answer["state"] = toString(hit ? hit->state : passed());
  if (!hit) return answer;
  answer["distance_m"] = hit->distance;
  answer["point"] = toJson(hit->point);
  const Indices cuboids = hit->cuboid >= 0 ? Indices{hit->cuboid} : Indices{};
  answer["cuboids"] = cuboids;
  answer["planes"] = planesOf(map, cuboids);
  return answer;
}

/// A line a point, x,y,z,state,probability, or how many there are of each state.
void answerCloud(const PlanarMap& map, const io::CloudData& cloud, const QueryArguments& arguments,
                 Json& answers) {
  const PointsView points = cloud.view();
  std::array<std::size_t, 3> count{};
  if (!arguments.json) std::cout << "x,y,z,state,probability\n";
  for (std::size_t i = 0; i < points.size; ++i) {
    if (!points.isFinite(i)) continue;
    const Vector3 point = cloud.T_world_sensor * points.point(i) - map.params().origin;
    const CellState state = map.stateAt(point);
    ++count[static_cast<std::size_t>(state)];
    if (arguments.json) continue;
    std::cout << point.x() << ',' << point.y() << ',' << point.z() << ',' << toString(state) << ','
              << map.occupancyAt(point) << '\n';
  }
  if (!arguments.json) return;
  answers["cloud"] = {{"free", count[0]}, {"occupied", count[1]}, {"unknown", count[2]}};
}

void printLine(std::ostream& out, const std::string& kind, const std::string& question,
               const Json& answer) {
  out << kind << ' ' << question << ": " << answer["state"].get<std::string>();
  if (answer.contains("probability")) out << ", probability " << answer["probability"];
  if (answer.contains("distance_m")) out << ", after " << answer["distance_m"] << " m";
  for (const char* list : {"cuboids", "planes"}) {
    if (!answer.contains(list) || answer[list].empty()) continue;
    out << ", " << list;
    for (const Json& number : answer[list]) out << ' ' << number;
  }
  out << '\n';
}

/// The side of tiles, metres. \throws IoError
double sideOfTiles(const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "tiles.json").string();
  try {
    return Json::parse(io::readWholeText(path)).at("side_m");
  } catch (const Json::exception&) {
    throw IoError(path, "is damaged");
  }
}

/// The map; of one in tiles only those that points and boxes lie in.
PlanarMap mapFor(const QueryArguments& arguments) {
  const std::vector<io::MapTile> tiles = io::mapTilesOf(arguments.map);
  if (tiles.empty() || !arguments.rays.empty() || !arguments.cloud.empty())
    return io::loadMap(arguments.map);
  const double side = sideOfTiles(arguments.map);
  std::vector<Eigen::AlignedBox2d> asked;
  for (const std::string& text : arguments.points) {
    const std::array<double, 3> p = numbersOf<3>("--point", text);
    asked.emplace_back(Eigen::Vector2d(p[0], p[1]));
  }
  for (const std::string& text : arguments.boxes) {
    const std::array<double, 6> b = numbersOf<6>("--box", text);
    asked.emplace_back(Eigen::Vector2d(b[0], b[1]), Eigen::Vector2d(b[3], b[4]));
  }
  std::vector<io::MapTile> wanted;
  for (const io::MapTile& tile : tiles) {
    const Eigen::AlignedBox2d area(side * Eigen::Vector2d(tile.x, tile.y),
                                   side * Eigen::Vector2d(tile.x + 1, tile.y + 1));
    if (std::any_of(asked.begin(), asked.end(),
                    [&](const Eigen::AlignedBox2d& box) { return area.intersects(box); }))
      wanted.push_back(tile);
  }
  if (wanted.empty()) wanted.push_back(tiles.front());  // nothing is known there
  return io::loadTiles(wanted);
}

void answer(const QueryArguments& arguments) {
  if (arguments.points.empty() && arguments.boxes.empty() && arguments.rays.empty() &&
      arguments.cloud.empty()) {
    throw UsageError("query needs a question: --point, --box, --ray or --points");
  }
  const PlanarMap map = mapFor(arguments);
  io::CloudData cloud;
  if (!arguments.cloud.empty())
    cloud = io::readCloudFile(arguments.cloud, io::CloudChannels::none());
  Json answers;
  std::ostringstream lines;  // printed when all questions are known to be sound
  const auto note = [&](const char* kind, const std::string& question, const Json& found) {
    if (!arguments.json) return printLine(lines, kind, question, found);
    answers[kind].push_back(found);
  };
  for (const std::string& text : arguments.points) note("point", text, answerPoint(map, text));
  for (const std::string& text : arguments.boxes) note("box", text, answerBox(map, text));
  for (const std::string& text : arguments.rays) note("ray", text, answerRay(map, text, arguments));
  std::cout << lines.str();
  if (!arguments.cloud.empty()) answerCloud(map, cloud, arguments, answers);
  if (arguments.json) std::cout << answers.dump(2) << '\n';
}

}  // namespace

void addQueryCommand(CLI::App& app, int&) {
  auto* command = app.add_subcommand("query", "Is it free, occupied or unknown there?");
  const auto arguments = std::make_shared<QueryArguments>();
  command->add_option("map", arguments->map, "Map (*.pmap), the result folder of a run, or tiles")
      ->required();
  command->add_option("--point", arguments->points, "x,y,z, metres; repeatable")
      ->allow_extra_args(false);
  command->add_option("--box", arguments->boxes, "Lower and upper corner: x,y,z,x,y,z; repeatable")
      ->allow_extra_args(false);
  command->add_option("--ray", arguments->rays, "Origin and direction: x,y,z,dx,dy,dz; repeatable")
      ->allow_extra_args(false);
  command->add_option("--points", arguments->cloud,
                      "PCD or PLY file, placed by its viewpoint: a line a point");
  command->add_option("--range", arguments->range, "How far rays go, metres")
      ->capture_default_str();
  command->add_flag("--through-unknown", arguments->through_unknown,
                    "Unknown space does not stop rays");
  command->add_flag("--json", arguments->json, "For machines; of --points only the counts");
  command->callback([arguments]() {
    try {
      answer(*arguments);
    } catch (const ParameterError& error) {  // of a question, not of a configuration
      throw UsageError(error.what());
    }
  });
}

}  // namespace planar_mapping::tools
