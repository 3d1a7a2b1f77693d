// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/pcl_config.h>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "evaluation/baselines/octree_grid.h"
#include "evaluation/runs/evaluation_run.h"
#include "frame_command.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/pipeline/output.h"

namespace planar_mapping::tools {
namespace {

std::string processorName() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(": ");
    if (line.compare(0, 10, "model name") == 0 && colon != std::string::npos)
      return line.substr(colon + 2);
  }
  return "unknown";
}

std::string compilerName() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

/// What figures depend on beside the input: versions of ours, the compiler and the libraries, and
/// the machine.
std::vector<std::pair<std::string, std::string>> machineFacts() {
  return {{"version", "planar_mapping " PLANAR_MAPPING_VERSION},
          {"compiler", compilerName()},
          {"processor", processorName()},
          {"cores", std::to_string(std::thread::hardware_concurrency())},
          {"octomap", evaluation::makeOctreeGrid(1.0) ? PLANAR_MAPPING_OCTOMAP_VERSION
                                                      : "not built in: OG is left out"},
          {"pcl", PCL_VERSION_PRETTY}};
}

struct EvaluateArguments : FrameArguments {
  std::string output;
  std::vector<double> cells = {0.05, 0.1, 0.2, 0.3, 0.4, 0.5};
  std::vector<std::string> scenes = {"corridor", "outdoor"};
  double yaw_deg = 0.0;
  PlaceOptions places;
  std::vector<std::string> variants;
  bool ablation = false;
  bool regimes = false;
  bool no_figures = false;
  int threads = 1;
};

Configuration load(const EvaluateArguments& arguments, const std::string& profile,
                   std::vector<std::string> assignments) {
  assignments.emplace_back("threads=1");
  return loadFor(arguments, profile, std::move(assignments));
}

/// "stage.resolution_m=s" for each stage that has a cell size.
std::vector<std::string> withCell(const Configuration& configuration, double cell) {
  std::vector<std::string> assignments;
  for (const ConfiguredStage& stage : configuration.stages) {
    for (const Parameter& parameter : stage.parameters.parameters()) {
      if (parameter.name != "resolution_m") continue;
      assignments.push_back(stage.name + ".resolution_m=" + formatNumber(cell));
    }
  }
  return assignments;
}

/// "NAME:stage.key=value,stage.key=value", on the compact profile. \throws UsageError
Variant parseVariant(const std::string& text) {
  const std::size_t colon = text.find(':');
  Variant variant{text.substr(0, colon), {}};
  if (colon == std::string::npos || variant.name.empty())
    throw UsageError("--variant: '" + text + "' is not NAME:stage.key=value,...");
  std::istringstream assignments(text.substr(colon + 1));
  for (std::string one; std::getline(assignments, one, ',');) variant.assignments.push_back(one);
  if (variant.assignments.empty())
    throw UsageError("--variant: '" + text + "' changes nothing; give NAME:stage.key=value,...");
  return variant;
}

PlanarMethod methodOf(const EvaluateArguments& arguments, const Variant& variant) {
  return {variant.name, [&arguments, variant](double cell) {
            std::vector<std::string> assignments = variant.assignments;
            const Configuration any = load(arguments, variant.profile, assignments);
            for (std::string& one : withCell(any, cell)) assignments.push_back(std::move(one));
            return load(arguments, variant.profile, assignments);
          }};
}

void showProgress(const EvaluationProgress& progress) {
  drawBar(progress.done, progress.all,
          progress.scene + ", place " + std::to_string(progress.place));
}

void writeJsonLine(const EvaluationProgress& progress) {
  const nlohmann::ordered_json line = {{"done", progress.done},
                                       {"maps", progress.all},
                                       {"scene", progress.scene},
                                       {"place", progress.place}};
  std::cerr << line.dump() << std::endl;
}

/// What is evaluated: scenes to simulate, or the one input there is.
struct Input {
  std::string name;
  std::function<std::unique_ptr<PlaceSource>()> open;
};

std::string sceneName(const std::string& scene, double yaw_deg) {
  return yaw_deg == 0.0 ? scene : scene + " turned " + formatNumber(yaw_deg) + " degrees";
}

std::vector<Input> inputsOf(const EvaluateArguments& arguments,
                            const Configuration& configuration) {
  const ConfigurationLoader loader = [&arguments]() { return load(arguments, "compact", {}); };
  if (!configuration.inputs.empty()) {
    std::filesystem::path path(configuration.inputs.front());
    if (path.filename().empty()) path = path.parent_path();
    return {{path.filename().string(),
             [&arguments, loader]() { return recordedPlaces(arguments.places, loader); }}};
  }
  std::vector<Input> inputs;
  for (const std::string& scene : arguments.scenes) {
    evaluation::SimulationParams params;
    params.scene = scene;
    params.yaw = arguments.yaw_deg * kRadiansPerDegree;
    if (arguments.seed >= 0) params.seed = static_cast<std::uint64_t>(arguments.seed);
    inputs.push_back({sceneName(scene, arguments.yaw_deg), [&arguments, params, loader]() {
                        return simulatedPlaces(params, arguments.places, loader);
                      }});
  }
  return inputs;
}

evaluation::ReportHeader headerOf(const EvaluateArguments& arguments,
                                  const Configuration& configuration) {
  evaluation::ReportHeader header;
  header.facts = machineFacts();
  const auto add = [&header](const std::string& name, const std::string& value) {
    header.facts.emplace_back(name, value);
  };
  add("threads", std::to_string(arguments.threads) +
                     (arguments.threads > 1 ? " (places beside each other: times are not of a "
                                              "quiet machine)"
                                            : ""));
  add("seed", std::to_string(configuration.settings.seed));
  add("configuration", std::filesystem::path(arguments.configuration).filename().string());
  std::string settings;
  for (const std::string& one : arguments.assignments)
    settings += (settings.empty() ? "" : " ") + one;
  if (!settings.empty()) add("settings", settings);
  add("places", std::to_string(arguments.places.places));
  add("frames_per_place", std::to_string(arguments.places.frames_per_place));
  add("checked_points", "every " + std::to_string(arguments.places.check_step) +
                            "th obstacle point" +
                            (configuration.inputs.empty() ? "" : ", held back from all methods"));
  return header;
}

/// evaluation.* and, of another set of methods, ablation.*
void write(const OutputDirectory& directory, const std::string& stem,
           const evaluation::ReportHeader& header,
           const std::vector<evaluation::PlaceResult>& results) {
  directory.write(stem + ".json", evaluation::toJson(header, results));
  directory.write(stem + ".csv", evaluation::toCsv(header, results));
  directory.write(stem + ".md", evaluation::toMarkdown(header, results));
}

/// matplotlib draws. \throws RenderError if it cannot
void drawFigures(const std::string& directory, bool quiet) {
  std::vector<std::string> arguments = {directory, "--force"};
  if (quiet) arguments.emplace_back("--quiet");
  if (runCompanion({"planar_map_charts", "install the package of planar_map"}, arguments) != kDone)
    throw RenderError("the figures are not drawn (see above); the tables are in " + directory);
}

std::vector<std::string> outputNames(bool ablation, bool figures) {
  std::vector<std::string> names = {"evaluation.json", "evaluation.csv", "evaluation.md"};
  const auto add = [&names](std::initializer_list<const char*> more) {
    names.insert(names.end(), more.begin(), more.end());
  };
  if (ablation) add({"ablation.json", "ablation.csv", "ablation.md"});
  if (figures)
    add({"fig12_combination_efficiency.png", "fig13_mapping_error.png",
         "fig14_memory_file_time.png", "cells_at_equal_error.png"});
  return names;
}

void checkArguments(const EvaluateArguments& arguments) {
  for (const double cell : arguments.cells) {
    if (!(cell > 0.0 && cell <= 100.0))
      throw UsageError("--cells: " + formatNumber(cell) + " is not in (0, 100] m");
  }
  for (const std::string& scene : arguments.scenes) {
    const auto& known = evaluation::sceneNames();
    if (std::find(known.begin(), known.end(), scene) == known.end()) {
      std::string names;
      for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
      throw UsageError("--scenes: there is no scene '" + scene + "'; there are " + names);
    }
  }
}

int evaluate(const EvaluateArguments& arguments) {
  checkArguments(arguments);
  std::vector<Variant> ablation;
  if (arguments.ablation) ablation = ablationVariants();
  if (arguments.regimes)
    for (Variant& variant : regimeVariants()) ablation.push_back(std::move(variant));
  for (const std::string& text : arguments.variants) ablation.push_back(parseVariant(text));
  const bool ablated = !ablation.empty();

  // All mistakes come out before any work is done.
  const Configuration configuration = load(arguments, "compact", {});
  const std::vector<Input> inputs = inputsOf(arguments, configuration);
  MethodOptions methods;
  methods.cells = arguments.cells;
  for (const Variant& variant : ablation) methods.planar.push_back(methodOf(arguments, variant));
  methods.planar.push_back(methodOf(arguments, {"PG_paper", {}, "paper"}));
  methods.planar.push_back(methodOf(arguments, {"PG", {}}));
  if (arguments.regimes) methods.filtered_by = kFilteredCells;
  for (const PlanarMethod& method : methods.planar) method.load(arguments.cells.front());
  std::unique_ptr<OutputDirectory> directory;
  try {
    directory = std::make_unique<OutputDirectory>(
        arguments.output, outputNames(ablated, !arguments.no_figures), arguments.force);
  } catch (const OutputExistsError& error) {
    throw UsageError(error.what());
  }

  const std::atomic<bool>& stop_requested = stopOnSignal();
  EvaluationJob job;
  job.methods = std::move(methods);
  job.threads = arguments.threads;
  job.stop = &stop_requested;
  if (arguments.progress == "jsonl") {
    job.progress = writeJsonLine;
  } else if (arguments.wantsBar()) {
    job.progress = showProgress;
  }
  std::vector<evaluation::PlaceResult> results;
  for (const Input& input : inputs) {
    if (stop_requested) break;
    const std::unique_ptr<PlaceSource> source = input.open();
    auto of_input = evaluatePlaces(*source, input.name, job);
    std::move(of_input.begin(), of_input.end(), std::back_inserter(results));
  }
  evaluation::ReportHeader header = headerOf(arguments, configuration);
  header.interrupted = stop_requested;
  if (ablated) {
    write(*directory, "ablation", header, withoutMethods(results, {"SG", "OG", "RA", "PG_paper"}));
    std::vector<std::string> names;
    for (const Variant& variant : ablation) names.push_back(variant.name);
    for (const char* name :
         {"SG_filtered", "OG_filtered", "RA_filtered", "RA_density", "RA_density_filtered"})
      names.emplace_back(name);
    results = withoutMethods(results, names);
  }
  write(*directory, "evaluation", header, results);
  if (arguments.json) {
    std::cout << evaluation::toJson(header, results);
  } else if (!arguments.quiet) {
    std::cout << evaluation::toMarkdown(header, results);
  }
  if (header.interrupted) {
    std::cerr << "planar_map: interrupted; what was done so far is in " << directory->path()
              << '\n';
    return kInterrupted;
  }
  if (!arguments.no_figures) drawFigures(directory->path(), arguments.quiet || arguments.json);
  return kDone;
}

}  // namespace

void addEvaluateCommand(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "evaluate", "Standard grid, octree, rectangular cuboids and planar maps of the same input");
  const auto arguments = std::make_shared<EvaluateArguments>();
  command->add_option("config", arguments->configuration, "Configuration file (*.yaml)")
      ->required();
  addInputOption(*command, arguments->inputs, arguments->poses, arguments->calibration,
                 "; without, simulated scenes");
  command->add_option("-o,--output", arguments->output, "Directory for the results")->required();
  command->add_option("--cells", arguments->cells, "Cell sizes, metres, comma-separated")
      ->delimiter(',')
      ->option_text("S,... [0.05,0.1,0.2,0.3,0.4,0.5]");
  command
      ->add_option("--scenes", arguments->scenes,
                   "Simulated scenes, comma-separated, where there is no input")
      ->delimiter(',')
      ->option_text("NAME,... [corridor,outdoor]");
  addChecked(*command, "--yaw-deg", arguments->yaw_deg, numberIn(-360.0, 360.0),
             "Turns simulated scenes about z, degrees");
  addChecked(*command, "--places", arguments->places.places, CLI::Range(1, 100000),
             "Places along the path, >= 1, each mapped anew");
  addChecked(*command, "--frames-per-place", arguments->places.frames_per_place,
             CLI::Range(0, 1000000),
             "Consecutive frames that make a place; 0 = all frames are one place");
  addFrameOptions(*command, *arguments);
  command->add_flag("--ablation", arguments->ablation,
                    "Also maps without one idea each; writes ablation.*");
  command->add_flag("--regimes", arguments->regimes,
                    "Also exact and tolerant covers, with and without planes and filters, and the "
                    "other methods with our filters; in ablation.*");
  command
      ->add_option("--variant", arguments->variants,
                   "NAME:stage.key=value,... one more row of ablation.*, repeatable")
      ->allow_extra_args(false);
  command->add_flag("--no-figures", arguments->no_figures, "Tables only");
  addChecked(*command, "-j,--threads", arguments->threads, CLI::Range(1, 256),
             "Places beside each other");
  command->add_flag("--json", arguments->json, "Print evaluation.json instead of the tables");
  command->callback([arguments, &exit_code]() { exit_code = evaluate(*arguments); });
}

}  // namespace planar_mapping::tools
