// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <csignal>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>

#include "commands.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/export/map_export.h"
#include "planar_mapping/io/map_file.h"
#include "robot_options.h"

namespace planar_mapping::tools {
namespace {

struct ConvertArguments {
  std::string map;
  std::string output;
  bool finished = false;
  bool surface = false;
  bool force = false;
  io::ExportOptions options;
};

std::string formatTable() {
  std::string text = "Formats, by the extension of the output:\n";
  for (const io::ExportFormat& format : io::exportFormats()) {
    std::string name = format.extension == "/" ? "NAME/" : format.extension;
    name.resize(8, ' ');
    text += "  " + name + format.readers + '\n';
  }
  return text;
}

/// Says which options are of other formats.
void noteUnusedOptions(const CLI::App& command, const std::string& extension) {
  const std::pair<const char*, std::string> kFormats[] = {
      {"--cell", ".bt .ot .pgm .svg .dxf .html"},
      {"--robot-height", ".pgm .svg .dxf .html"},
      {"--robot-radius", ".pgm .svg .dxf .html"},
      {"--max-step", ".pgm .svg .dxf .html"},
      {"--max-slope", ".pgm .svg .dxf .html"},
      {"--camera-height", ".pgm .svg .dxf .html"},
      {"--distance", ".pgm"},
      {"--surface", ".pcd"},
      {"--spacing", ".pcd"},
      {"--frame-id", ".json .csv .urdf .pgm .svg"}};
  for (const auto& [option, formats] : kFormats) {
    if (command.count(option) > 0 && (formats + " ").find(extension + " ") == std::string::npos)
      std::cerr << "planar_map: " << option << " is ignored: it is for " << formats << '\n';
  }
}

void convert(ConvertArguments arguments) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error like a full disk
  io::ExportOptions& options = arguments.options;
  if (arguments.surface) options.points = io::ExportedPoints::Surface;
  if (arguments.force) options.overwrite = io::Overwrite::Allow;
  try {
    for (const std::string& file : io::exportedFiles(arguments.output, options.distance))
      requireNew(file, arguments.force);
    PlanarMap map = io::loadMap(arguments.map);
    if (arguments.finished) map = map.finished();
    writeResults([&]() {
      for (const std::string& note : io::exportMap(map, arguments.output, options))
        std::cerr << "planar_map: " << note << '\n';
    });
    if (const Vector3& origin = map.params().origin; !origin.isZero(0.0))
      std::cerr << "planar_map: coordinates in " << arguments.output
                << " are those of the map; add (" << std::setprecision(15) << origin.x() << ", "
                << origin.y() << ", " << origin.z() << ") m for those of the world\n";
  } catch (const ParameterError& error) {  // of the extension or an option
    throw UsageError(error.what());
  }
}

/// A file of a run, empty if there is none.
std::string recordIn(const std::filesystem::path& folder, const char* name) {
  const std::filesystem::path file = folder / name;
  if (std::filesystem::exists(file)) return io::readWholeText(file.string());
  std::cerr << "planar_map: the report lacks " << name << ": " << folder.string() << " has none\n";
  return "";
}

void report(ConvertArguments arguments) {
  const std::filesystem::path folder(arguments.map);
  if (std::filesystem::path(arguments.output).extension() != ".html")
    throw UsageError(arguments.output + ": a report is a page, *.html");
  if (!std::filesystem::is_directory(folder))
    throw IoError(arguments.map,
                  "is no result folder of a run; planar_map convert makes a page of a map alone");
  // Not what a path ends with: a slash or a dot.
  const std::string name = std::filesystem::weakly_canonical(folder).filename().string();
  arguments.options.run = {"run " + name, recordIn(folder, "metrics.json"),
                           recordIn(folder, "frames.csv"), recordIn(folder, "run.log")};
  convert(arguments);
}

}  // namespace

void addConvertCommand(CLI::App& app, int&) {
  auto* command = app.add_subcommand("convert", "A map as a file for other programs");
  const auto arguments = std::make_shared<ConvertArguments>();
  io::ExportOptions& options = arguments->options;
  command->add_option("map", arguments->map, "Map (*.pmap), or the result folder of a run")
      ->required();
  command
      ->add_option("output", arguments->output,
                   "File to write; its extension chooses the format (see below)")
      ->required();
  command->add_flag("--unknown", options.unknown,
                    "Unknown space as boxes too (pmap, json, bt, ot, pgm, html: always told)");
  command->add_flag("--finished", arguments->finished,
                    "Leave out what only further frames need (pmap: far fewer bytes)");
  command
      ->add_option("--cell", options.cell,
                   "bt, ot, pgm, svg, dxf, html: side of a cell, m [the map's resolution]")
      ->check(numberIn(1e-4, 1e6));
  addRobotOptions(*command, options.robot);
  command->add_flag("--distance", options.distance,
                    "pgm: also the distance to the nearest obstacle, m, as NAME.npy");
  command->add_flag("--surface", arguments->surface,
                    "pcd: points on the faces instead of the centres of cuboids");
  command
      ->add_option("--spacing", options.spacing,
                   "pcd: between points on a face, m [half the map's resolution]")
      ->check(numberIn(1e-4, 1e6));
  command
      ->add_option("--frame-id", options.frame_id, "json, csv, urdf, pgm: name of the map's frame")
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "Overwrite files that exist");
  command->footer(formatTable());
  command->callback([arguments, command]() {
    noteUnusedOptions(*command, std::filesystem::path(arguments->output).extension().string());
    convert(*arguments);
  });
}

void addReportCommand(CLI::App& app, int&) {
  auto* command = app.add_subcommand(
      "report", "A page for browsers: map in 3-D, plan, path, figures and warnings of a run");
  const auto arguments = std::make_shared<ConvertArguments>();
  command->add_option("run", arguments->map, "Result folder of a run")->required();
  command->add_option("-o,--output", arguments->output, "Page to write (*.html)")->required();
  command
      ->add_option("--cell", arguments->options.cell,
                   "Side of a cell of the plan, m [the map's resolution]")
      ->check(numberIn(1e-4, 1e6));
  addRobotOptions(*command, arguments->options.robot);
  command->add_flag("--force", arguments->force, "Overwrite a file that exists");
  command->callback([arguments]() { report(*arguments); });
}

}  // namespace planar_mapping::tools
