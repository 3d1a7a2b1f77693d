// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/map/map_query.h"

namespace planar_mapping::tools {
namespace {

struct MergeArguments {
  std::vector<std::string> maps;
  std::string output;
  std::string poses;
  bool force = false;
};

/// T_world_map of each map.
std::vector<Pose> posesOf(const MergeArguments& arguments) {
  std::vector<Pose> poses(arguments.maps.size(), Pose::Identity());
  if (arguments.poses.empty()) return poses;
  const std::vector<io::StampedPose> lines = io::readTumPoses(arguments.poses);
  if (lines.size() != poses.size())
    throw IoError(arguments.poses, "has " + std::to_string(lines.size()) +
                                       " poses, but there are " + std::to_string(poses.size()) +
                                       " maps");
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = lines[i].pose;
  return poses;
}

struct NamedMap {
  std::string path;
  const PlanarMap* map = nullptr;
};

/// Of one recording, from the same start.
bool beginAlike(const PlanarMap& a, const PlanarMap& b) {
  if (a.trajectory().empty() || b.trajectory().empty()) return false;
  const auto& [time_a, pose_a] = a.trajectory().front();
  const auto& [time_b, pose_b] = b.trajectory().front();
  return time_a == time_b && pose_a.matrix() == pose_b.matrix();
}

/// A sentence on stderr for each map that need not lie where its coordinates say, beside the first.
/// \param remedy  ends the sentence
void warnOfFrames(const std::vector<NamedMap>& maps, const std::string& remedy) {
  const NamedMap& first = maps.front();
  for (const NamedMap& other : maps) {
    const bool own = first.map->params().frame == MapFrame::Start ||
                     other.map->params().frame == MapFrame::Start;
    if (&other == &first || !own || beginAlike(*first.map, *other.map)) continue;
    std::cerr << "planar_map: warning: poses were found, not given, so that each map has "
                 "coordinates of its own: where "
              << other.path << " lies to " << first.path << " is not known" << remedy << '\n';
  }
}

struct PlacedMap {
  std::string path;
  PlanarMap map;
  Pose pose;

  /// The map that began first comes first; of those without times the one that looks smaller.
  bool isBefore(const PlacedMap& other) const {
    const auto key = [](const PlacedMap& placed) {
      const Eigen::Matrix4d T = placed.pose.matrix();
      return std::make_pair(placed.map.frames() > 0 ? placed.map.trajectory().front().first : 0.0,
                            std::vector<double>(T.data(), T.data() + T.size()));
    };
    const auto mine = key(*this), others = key(other);
    if (mine.first != others.first) return mine.first < others.first;
    const std::vector<std::uint8_t> bytes = map.serialize(), other_bytes = other.map.serialize();
    return bytes != other_bytes ? bytes < other_bytes : mine.second < others.second;
  }
};

/// Parameters of the merged map, whose origin is next to where the first map was seen from.
PlanarMapParams paramsOf(const PlacedMap& first) {
  PlanarMapParams params = first.map.params();
  Vector3 start = Vector3::Zero();
  if (first.map.frames() > 0) start = first.map.trajectory().front().second.translation();
  params.origin += originNear(first.pose * Vector3(params.origin + start) - params.origin);
  return params;
}

/// The same map in whatever order the files are named.
void merge(const MergeArguments& arguments) {
  const std::filesystem::path output = arguments.output;
  if (output.has_extension() && output.extension() != ".pmap")
    throw UsageError(arguments.output +
                     ": a map is written as *.pmap; planar_map convert has other formats");
  requireNew(arguments.output, arguments.force);
  const std::vector<Pose> poses = posesOf(arguments);
  std::vector<PlacedMap> maps;
  for (std::size_t i = 0; i < poses.size(); ++i)
    maps.push_back({arguments.maps[i], io::loadMap(arguments.maps[i]), poses[i]});
  if (arguments.poses.empty()) {
    std::vector<NamedMap> named;
    for (const PlacedMap& placed : maps) named.push_back({placed.path, &placed.map});
    warnOfFrames(named, "; --poses says it");
  }
  std::sort(maps.begin(), maps.end(),
            [](const PlacedMap& a, const PlacedMap& b) { return a.isBefore(b); });
  PlanarMap merged(paramsOf(maps.front()));
  for (const PlacedMap& placed : maps) {
    const bool is_first = &placed == &maps.front();
    try {
      if (is_first && !placed.map.isFinished() &&
          placed.pose.matrix() == Pose::Identity().matrix()) {
        merged = placed.map;
      } else {
        merged.merge(placed.map, Eigen::Translation3d(-merged.params().origin) * placed.pose *
                                     Eigen::Translation3d(placed.map.params().origin));
      }
    } catch (const InputError& error) {
      throw IoError(placed.path, std::string("does not fit to ") +
                                     (is_first ? "its pose" : maps.front().path) + ": " +
                                     error.what());
    }
  }
  writeResults([&]() {
    io::saveMap(merged, arguments.output,
                arguments.force ? io::Overwrite::Allow : io::Overwrite::Refuse);
  });
}

using Json = nlohmann::ordered_json;

/// A finished map knows of no frames and planes.
Json factsOf(const PlanarMap& map) {
  return {{"frames", map.isFinished() ? Json() : Json(map.frames())},
          {"resolution_m", map.params().approximation.resolution},
          {"planes", map.isFinished() ? Json() : Json(map.planes().size())},
          {"cuboids", map.cuboids().size()},
          {"unknown_cells", map.unknownCells()}};
}

void print(const Json& a, const Json& b, const MapDifference& difference) {
  for (const auto& item : a.items())
    std::cout << item.key() << ": " << item.value() << ' ' << b[item.key()] << '\n';
  std::cout << "occupied cells of " << difference.cell << " m: " << difference.in_both
            << " in both, " << difference.only_in_a << " only in the first, "
            << difference.only_in_b << " only in the second\ndifference: " << difference.fraction()
            << '\n';
}

}  // namespace

void addMergeCommand(CLI::App& app, int&) {
  auto* command = app.add_subcommand("merge", "Several maps to one");
  const auto arguments = std::make_shared<MergeArguments>();
  command->add_option("maps", arguments->maps, "Maps (*.pmap) of the same resolution and profile")
      ->required();
  command->add_option("-o,--output", arguments->output, "Map to write (*.pmap)")->required();
  command->add_option("--poses", arguments->poses,
                      "Where each map lies (TUM: timestamp tx ty tz qx qy qz qw), a line a map");
  command->add_flag("--force", arguments->force, "Overwrite a file that exists");
  command->callback([arguments]() { merge(*arguments); });
}

void addCompareCommand(CLI::App& app, int& exit_code) {
  struct Arguments {
    std::string first, second;
    double threshold = 0.0;
    bool json = false;
  };
  auto* command = app.add_subcommand("compare", "What differs between two maps");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("first", arguments->first, "Map (*.pmap)")->required();
  command->add_option("second", arguments->second, "Map (*.pmap)")->required();
  addChecked(*command, "--threshold", arguments->threshold, numberIn(0.0, 1.0),
             "Exit code 6 if a larger fraction of the occupied cells is in one map only");
  command->add_flag("--json", arguments->json, "For machines");
  command->callback([arguments, &exit_code]() {
    const PlanarMap first = io::loadMap(arguments->first);
    const PlanarMap second = io::loadMap(arguments->second);
    if (first.params().origin != second.params().origin)
      throw InputError(arguments->second + ": this map has another origin than " +
                       arguments->first + " (planar_map info shows both)");
    warnOfFrames({{arguments->first, &first}, {arguments->second, &second}}, "");
    const MapDifference difference = compareMaps(first, second);
    const Json a = factsOf(first), b = factsOf(second);
    if (arguments->json) {
      const Json answer = {{"first", a},
                           {"second", b},
                           {"cell_m", difference.cell},
                           {"in_both", difference.in_both},
                           {"only_in_first", difference.only_in_a},
                           {"only_in_second", difference.only_in_b},
                           {"difference", difference.fraction()}};
      std::cout << answer.dump(2) << '\n';
    } else {
      print(a, b, difference);
    }
    if (difference.fraction() > arguments->threshold) exit_code = kOverThreshold;
  });
}

}  // namespace planar_mapping::tools
