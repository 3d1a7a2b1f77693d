// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping::tools {
namespace {

struct Arguments {
  std::vector<std::string> maps;
  std::string output;
  std::string poses;
  bool force = false;
};

/// T_world_map of each map.
std::vector<Pose> posesOf(const Arguments& arguments) {
  std::vector<Pose> poses(arguments.maps.size(), Pose::Identity());
  if (arguments.poses.empty()) return poses;
  const std::vector<io::StampedPose> lines = io::readTumPoses(arguments.poses);
  if (lines.size() != poses.size()) {
    throw IoError(arguments.poses, "has " + std::to_string(lines.size()) +
                                       " poses, but there are " + std::to_string(poses.size()) +
                                       " maps");
  }
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = lines[i].pose;
  return poses;
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

/// The same map in whatever order the files are named.
void merge(const Arguments& arguments) {
  requireNew(arguments.output, arguments.force);
  const std::vector<Pose> poses = posesOf(arguments);
  std::vector<PlacedMap> maps;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    maps.push_back({arguments.maps[i], io::loadMap(arguments.maps[i]), poses[i]});
  }
  if (arguments.poses.empty()) {
    std::vector<NamedMap> named;
    for (const PlacedMap& placed : maps) named.push_back({placed.path, &placed.map});
    warnOfFrames(named, "; --poses says it");
  }
  std::sort(maps.begin(), maps.end(),
            [](const PlacedMap& a, const PlacedMap& b) { return a.isBefore(b); });
  PlanarMap merged(maps.front().map.params());
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

/// Of one recording, from the same start.
bool beginAlike(const PlanarMap& a, const PlanarMap& b) {
  if (a.trajectory().empty() || b.trajectory().empty()) return false;
  const auto& [time_a, pose_a] = a.trajectory().front();
  const auto& [time_b, pose_b] = b.trajectory().front();
  return time_a == time_b && pose_a.matrix() == pose_b.matrix();
}

}  // namespace

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

void addMergeCommand(CLI::App& app, int&) {
  auto* command = app.add_subcommand("merge", "Several maps to one");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("maps", arguments->maps, "Maps (*.pmap) of the same resolution and profile")
      ->required();
  command->add_option("-o,--output", arguments->output, "Map to write (*.pmap)")->required();
  command->add_option("--poses", arguments->poses,
                      "Where each map lies (TUM: timestamp tx ty tz qx qy qz qw), a line a map");
  command->add_flag("--force", arguments->force, "Overwrite a file that exists");
  command->callback([arguments]() { merge(*arguments); });
}

}  // namespace planar_mapping::tools
