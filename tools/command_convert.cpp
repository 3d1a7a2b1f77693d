// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <string>

#include "command_help.h"
#include "commands.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/map_export.h"
#include "planar_mapping/io/map_file.h"

namespace planar_mapping::tools {

void addConvertCommand(CLI::App& app, int& exit_code) {
  struct Arguments {
    std::string map;
    std::string output;
    bool unknown = false;
    bool finished = false;
    bool force = false;
  };
  auto* command = app.add_subcommand("convert", "A map as a file for other programs");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("map", arguments->map, "Map (*.pmap)")->required();
  command
      ->add_option("output", arguments->output,
                   "File to write; its extension chooses the format: " + io::exportExtensions())
      ->required();
  command->add_flag("--unknown", arguments->unknown, "Unknown space as well (pmap, json: always)");
  command->add_flag("--finished", arguments->finished,
                    "Leave out what only further frames need (pmap: far fewer bytes)");
  command->add_flag("--force", arguments->force, "Overwrite a file that exists");
  command->callback([arguments, &exit_code]() {
    PlanarMap map = io::loadMap(arguments->map);
    if (arguments->finished) map = map.finished();
    requireNew(arguments->output, arguments->force);
    try {
      io::exportMap(
          map, arguments->output,
          arguments->unknown ? io::ExportedSpace::OccupiedAndUnknown : io::ExportedSpace::Occupied,
          arguments->force ? io::Overwrite::Allow : io::Overwrite::Refuse);
    } catch (const ParameterError& error) {  // of the extension
      throw UsageError(error.what());
    }
    exit_code = kDone;
  });
}

}  // namespace planar_mapping::tools
