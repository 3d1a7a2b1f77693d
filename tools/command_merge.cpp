// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <string>
#include <vector>

#include "command_help.h"
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

void merge(const Arguments& arguments) {
  requireNew(arguments.output, arguments.force);
  const std::vector<Pose> poses = posesOf(arguments);
  PlanarMap merged;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const PlanarMap map = io::loadMap(arguments.maps[i]);
    if (i == 0) merged = PlanarMap(map.params());
    try {
      merged.merge(map, Eigen::Translation3d(-merged.params().origin) * poses[i] *
                            Eigen::Translation3d(map.params().origin));
    } catch (const InputError& error) {
      throw IoError(arguments.maps[i], error.what());
    }
  }
  io::saveMap(merged, arguments.output,
              arguments.force ? io::Overwrite::Allow : io::Overwrite::Refuse);
}

}  // namespace

void addMergeCommand(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("merge", "Several maps to one");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("maps", arguments->maps, "Maps (*.pmap) of the same resolution and profile")
      ->required();
  command->add_option("-o,--output", arguments->output, "Map to write (*.pmap)")->required();
  command->add_option("--poses", arguments->poses,
                      "Where each map lies (TUM: timestamp tx ty tz qx qy qz qw), a line a map");
  command->add_flag("--force", arguments->force, "Overwrite a file that exists");
  command->callback([arguments, &exit_code]() {
    merge(*arguments);
    exit_code = kDone;
  });
}

}  // namespace planar_mapping::tools
