// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "commands.h"
#include "viewer/viewer_program.h"

// Both commands become planar_map_viewer.
namespace planar_mapping::tools {
namespace {

CLI::App* addPassThrough(CLI::App& app, const std::string& name, const std::string& summary) {
  auto* command = app.add_subcommand(name, summary);
  command->prefix_command();  // everything behind it is the viewer's
  command->set_help_flag();
  return command;
}

}  // namespace

void addViewCommand(CLI::App& app, int&) {
  auto* command = addPassThrough(
      app, "view", "Look at a map (and clouds) in a window; --follow shows it as it grows");
  command->callback([command]() { becomeViewer(command->remaining()); });
}

void addSnapshotCommand(CLI::App& app, int&) {
  auto* command = addPassThrough(app, "snapshot", "Draw a map into a PNG file, without a display");
  command->callback([command]() {
    std::vector<std::string> arguments;
    bool has_output = false;
    for (const std::string& argument : command->remaining()) {
      const bool is_output = argument == "-o" || argument == "--output";
      const bool is_help = argument == "-h" || argument == "--help";
      has_output = has_output || is_output || is_help || argument == "--snapshot" ||
                   argument.compare(0, 11, "--snapshot=") == 0;
      arguments.push_back(is_output ? "--snapshot" : argument);
    }
    if (!has_output) throw UsageError("snapshot needs the picture's name: -o FILE.png");
    becomeViewer(arguments);
  });
}

}  // namespace planar_mapping::tools
