// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "frame_command.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/ready_configuration.h"
#include "planar_mapping/pipeline/runner.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/pipeline/watch_source.h"

namespace planar_mapping::tools {
namespace {

namespace fs = std::filesystem;

struct RunArguments : FrameArguments {
  RunOptions options;
  std::string profile;
  std::string frames;
  int threads = -1;
  double scale = 1.0;
  std::string origin;  ///< "x,y,z"; empty = of the configuration
  bool strict = false;
  bool verbose = false;
  std::vector<std::string> words;  ///< configuration, inputs, or both
  std::string watched;             ///< folder
  std::string plan;                ///< of a survey
  double idle = 0.0;
  ListenArguments listen;
};

WatchOptions watchOptionsOf(const RunArguments& arguments) {
  return {arguments.idle, &stopOnSignal()};
}

std::optional<Vector3> originOf(const RunArguments& arguments) {
  if (arguments.origin.empty()) return std::nullopt;
  return Vector3(numbersOf<3>("--origin", arguments.origin).data());
}

/// Sorts the words into configuration and inputs; the inputs choose a configuration where none is
/// given.
void findConfiguration(RunArguments& arguments) {
  // -i takes all words after it, a configuration too.
  std::vector<std::string> words = arguments.words;
  words.insert(words.end(), arguments.inputs.begin(), arguments.inputs.end());
  arguments.inputs.clear();
  takeWords("run", words, arguments);
  const bool watches = !arguments.watched.empty();
  const bool listens = !arguments.listen.endpoint.empty();
  if (!arguments.inputs.empty() && (watches || listens))
    throw UsageError(std::string("the frames come by ") + (watches ? "--watch" : "--listen") +
                     ": leave '" + arguments.inputs.front() + "' out");
  if (watches) arguments.inputs = {arguments.watched};
  if (!arguments.configuration.empty()) return;
  if (arguments.inputs.empty())
    throw UsageError(listens ? "--listen needs a configuration (*.yaml)"
                             : "run needs an input or a configuration (*.yaml); see planar_map run "
                               "--help");
  io::SequenceOptions options;
  options.poses_file = arguments.poses;
  options.calibration_file = arguments.calibration;
  options.scale = arguments.scale;
  options.sensor_origin = originOf(arguments);
  chooseConfiguration(watches ? waitForFrames(arguments.inputs, options, watchOptionsOf(arguments))
                              : io::Sequence(arguments.inputs, options),
                      arguments);
}

Configuration configurationOf(const RunArguments& arguments) {
  std::vector<std::string> assignments;
  if (arguments.threads >= 0) assignments = {"threads=" + std::to_string(arguments.threads)};
  if (arguments.scale != 1.0)
    assignments.push_back("scale=" + nlohmann::json(arguments.scale).dump());
  if (!arguments.origin.empty())
    assignments.push_back("sensor_origin_m=" + toJson(*originOf(arguments)).dump());
  Configuration configuration = loadFor(arguments, arguments.profile, assignments);
  selectFrames(arguments.frames, configuration);
  return configuration;
}

void showReport(std::size_t done, std::size_t all, const FrameReport& report) {
  drawBar(done, all,
          std::to_string(report.planes) + " planes, " + std::to_string(report.cuboids) +
              " cuboids, " + std::to_string(static_cast<int>(report.frame_ms)) + " ms");
}

void writeJsonLine(std::size_t done, std::size_t all, const FrameReport& report) {
  nlohmann::ordered_json line = {{"done", done},
                                 {"frames", all},
                                 {"source", report.source},
                                 {"planes", report.planes},
                                 {"cuboids", report.cuboids},
                                 {"frame_ms", report.frame_ms},
                                 {"seconds_left", nullptr}};
  if (const std::optional<double> left = secondsLeft(done, all)) line["seconds_left"] = *left;
  std::cerr << line.dump() << std::endl;
}

/// The same from frames of a front-end elsewhere, which may go away.
RunResult runOnNetwork(const RunArguments& arguments, RunOptions options) {
  Configuration configuration = configurationOf(arguments);
  configuration.inputs.clear();
  configuration.poses.clear();
  const std::unique_ptr<FrameSource> source =
      listenForFrontEnd(arguments.listen, configuration, *options.stop);
  bool has_map = false;
  options.progress = [&has_map, progress = options.progress](std::size_t done, std::size_t all,
                                                             const FrameReport& report) {
    has_map = has_map || report.skip_reason.empty();
    if (progress) progress(done, all, report);
  };
  try {
    RunResult result = runPipeline(std::move(configuration), *source, options);
    if (!result.interrupted) source->confirm();
    return result;
  } catch (const OutputError& error) {
    if (!has_map) throw;
    throw InputError(error.what());  // the front-end ends with the same exit code
  } catch (const InputError& error) {
    if (!has_map) throw;
    throw InputError(std::string(error.what()) + "; the map made so far is in " + options.output +
                     ", --resume finishes it");
  }
}

/// Frames as a recorder writes them.
RunResult runOnWatched(const RunArguments& arguments, RunOptions options) {
  Configuration configuration = configurationOf(arguments);
  WatchSource source(configuration, watchOptionsOf(arguments));
  constexpr double kAtOnce = 1e-3;  // a viewer follows; saving takes a tenth of the time at most
  options.checkpoint_s = std::min(options.checkpoint_s, kAtOnce);
  return runPipeline(std::move(configuration), source, options);
}

int run(RunArguments& arguments) {
  if (arguments.options.resume && arguments.force)
    throw UsageError("--resume finishes the run, --force overwrites it: give one of them");
  RunOptions& options = arguments.options;
  stopOnSignal();  // from now on
#if PLANAR_MAPPING_HAS_ATLAS
  if (!arguments.plan.empty())
    return runSurvey(arguments.plan, arguments.options.output, std::max(0, arguments.threads),
                     arguments.quiet);
#endif
  findConfiguration(arguments);
  options.overwrite = arguments.force;
  options.stop = &stopOnSignal();
  if (arguments.progress == "jsonl") {
    options.progress = writeJsonLine;
  } else if (arguments.wantsBar()) {
    options.progress = showReport;
  }
  if (arguments.verbose) {
    options.log = [](const std::string& line) { std::cerr << line << '\n'; };
  }
  RunResult result;
  try {
    result = !arguments.watched.empty() ? runOnWatched(arguments, options)
             : !arguments.listen.endpoint.empty()
                 ? runOnNetwork(arguments, options)
                 : runPipeline(configurationOf(arguments), options);
  } catch (const OutputExistsError& error) {
    throw UsageError(error.what());
  }
  if (arguments.json) {
    std::cout << result.metrics_json;
  } else if (!arguments.quiet && !result.summary.empty()) {
    std::cout << result.summary << '\n' << result.output << "/map.pmap\n";
  }
  if (!arguments.verbose) {  // then they were in the log already
    for (const std::string& warning : result.warnings)
      std::cerr << "planar_map: warning: " << warning << '\n';
  }
  if (result.was_finished)
    std::cerr << "planar_map: the run in " << result.output << " is finished; nothing was done\n";
  if (result.interrupted) {
    std::cerr << "planar_map: interrupted"
              << (result.saved ? "; what was done so far is in "
                               : " before anything new was done; what was saved before is in ")
              << result.output << ", --resume finishes it\n";
    return kInterrupted;
  }
  return arguments.strict && !result.warnings.empty() ? kDegraded : kDone;
}

}  // namespace

void addRunCommand(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("run", "Make a map: the pipeline, input to map");
  const auto arguments = std::make_shared<RunArguments>();
  arguments->options.output = "planar_map_output";
  command
      ->add_option("input", arguments->words,
                   "Configuration (*.yaml), and inputs as of -i; without a configuration a ready "
                   "one is chosen by the input")
      ->option_text("[CONFIG.yaml] [INPUT...]");
  addInputOption(*command, arguments->inputs, arguments->poses, arguments->calibration);
  command->add_option("-o,--output", arguments->options.output, "Directory for the results")
      ->capture_default_str();
  addListenOptions(*command, arguments->listen);
  auto* watch = command->add_option("--watch", arguments->watched,
                                    "Folder to map while a recorder writes it, in place of -i; "
                                    "map.pmap follows (planar_map view --follow)");
  watch->excludes("--input")->excludes("--listen");
  addChecked(*command, "--idle", arguments->idle, numberIn(0.0, 1e6),
             "Seconds without a new frame after which --watch ends; 0 = at a signal only")
      ->needs(watch);
  addFrameOptions(*command, *arguments);
  command->add_option("--profile", arguments->profile, "paper or compact")
      ->check(CLI::IsMember({"paper", "compact"}));
  addScaleOption(*command, arguments->scale);
  command
      ->add_option(
          "--origin", arguments->origin,
          "x,y,z where the sensor stood, metres, for clouds that are in the coordinates of "
          "the world")
      ->excludes("--poses");
  command->add_option("--frames", arguments->frames, "A:B:STEP, frames A to B - 1");
  command
      ->add_option("-j,--threads", arguments->threads,
                   "Threads, 0 = all cores, which is the default")
      ->check(CLI::Range(0, 1024));
  addChecked(*command, "--checkpoint", arguments->options.checkpoint_s, numberIn(0.0, 1e9),
             "Save every so many seconds, so that a crash leaves a map; 0 = each frame");
  auto* resume = command->add_flag(
      "--resume", arguments->options.resume,
      "Finish an interrupted run: its frames are processed again, and what it has saved stays "
      "until the map is as large");
  resume->excludes("--force");
  command->add_option("--atlas", arguments->options.atlas,
                      "File of an atlas to be made, or to go on in: submaps, loops, sessions");
  command
      ->add_option("--submap-frames", arguments->options.submap_frames,
                   "With --atlas: frames after which a submap is closed")
      ->check(CLI::Range(1, 1000000));
#if PLANAR_MAPPING_HAS_ATLAS
  command
      ->add_option(
          "--plan", arguments->plan,
          "Plan of a survey (planar_map atlas plan), in place of inputs: all its jobs here, "
          "one after the other; what was done before is not done again")
      ->excludes("input")
      ->excludes("--input")
      ->excludes("--atlas")
      ->excludes(resume);
#endif
  command->add_flag("--strict", arguments->strict, "Exit code 5 if the result is degraded");
  command->add_flag("-v,--verbose", arguments->verbose, "Show run.log as it comes about");
  command->add_flag("--json", arguments->json, "Print metrics.json instead of a summary");
  command->callback([arguments, &exit_code]() { exit_code = run(*arguments); });
}

}  // namespace planar_mapping::tools
