// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/console/print.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "network_input.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/runner.h"

namespace planar_mapping::tools {
namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler writes it");

/// The first signal asks to finish the frame and save; a second one ends the program at once.
extern "C" void requestStop(int number) {
  stop_requested = true;
  std::signal(number, SIG_DFL);
}

struct RunArguments {
  std::string configuration;
  std::vector<std::string> inputs;
  std::string output = "planar_map_output";
  std::string poses;
  std::vector<std::string> assignments;
  std::string profile;
  std::string frames;
  int threads = -1;
  std::int64_t seed = -1;
  bool resume = false;
  bool force = false;
  bool strict = false;
  bool quiet = false;
  bool verbose = false;
  bool json = false;
  std::string progress = "auto";
  ListenArguments listen;
};

Configuration configurationOf(const RunArguments& arguments) {
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments = arguments.assignments;
  // The options are short for assignments, and win over them.
  if (arguments.threads >= 0) {
    overrides.assignments.push_back("threads=" + std::to_string(arguments.threads));
  }
  if (arguments.seed >= 0) {
    overrides.assignments.push_back("seed=" + std::to_string(arguments.seed));
  }
  if (!arguments.profile.empty()) overrides.profile = arguments.profile;
  Configuration configuration = loadConfiguration(arguments.configuration, table, overrides);
  if (!arguments.inputs.empty()) {
    configuration.inputs = arguments.inputs;
    configuration.poses.clear();
  }
  if (!arguments.poses.empty()) configuration.poses = arguments.poses;
  if (!arguments.frames.empty()) {
    try {
      configuration.frames = parseFrameSelection(arguments.frames);
    } catch (const InputError& error) {
      throw UsageError(std::string("--frames: ") + error.what());
    }
  }
  return configuration;
}

/// One line that is drawn over and over, on a terminal only.
void drawBar(std::size_t done, std::size_t all, const FrameReport& report) {
  constexpr std::size_t kWidth = 30;
  const std::size_t filled = all > 0 ? kWidth * done / all : 0;
  std::cerr << "\r[" << std::string(filled, '#') << std::string(kWidth - filled, '.') << "] "
            << done << (all > 0 ? "/" + std::to_string(all) : std::string()) << "  " << report.planes << " planes, " << report.cuboids
            << " cuboids, " << static_cast<int>(report.frame_ms) << " ms   ";
  if (done == all) std::cerr << '\n';
  std::cerr.flush();
}

void writeJsonLine(std::size_t done, std::size_t all, const FrameReport& report) {
  const nlohmann::ordered_json line = {{"done", done},
                                       {"frames", all},
                                       {"source", report.source},
                                       {"planes", report.planes},
                                       {"cuboids", report.cuboids},
                                       {"frame_ms", report.frame_ms}};
  std::cerr << line.dump() << std::endl;
}

void printSummary(const RunResult& result) {
  const auto metrics = nlohmann::json::parse(result.metrics_json);
  std::cout << metrics["frames"] << " frames, " << metrics["points"]["valid"] << " points -> "
            << metrics["planes"] << " planes, " << metrics["cuboids"]["total"] << " cuboids ("
            << metrics["standard_cells"] << " cells of a standard grid)\n"
            << result.output << "/map.pmap\n";
}

/// The same from frames of a front-end elsewhere, which may go away.
RunResult runOnNetwork(const RunArguments& arguments, RunOptions options) {
  Configuration configuration = configurationOf(arguments);
  configuration.inputs.clear();
  configuration.poses.clear();
  const std::unique_ptr<FrameSource> source =
      listenForFrontEnd(arguments.listen, configuration, stop_requested);
  bool has_map = false;
  options.progress = [&has_map, progress = options.progress](std::size_t done, std::size_t all,
                                                             const FrameReport& report) {
    has_map = has_map || report.skip_reason.empty();
    if (progress) progress(done, all, report);
  };
  try {
    return runPipeline(std::move(configuration), *source, options);
  } catch (const InputError& error) {
    if (!has_map) throw;
    throw InputError(std::string(error.what()) + "; the map made so far is in " + options.output +
                     ", --resume continues it");
  }
}

int run(const RunArguments& arguments) {
  if (arguments.resume && arguments.force) {
    throw UsageError("--resume continues the map, --force overwrites it: give one of them");
  }
  // Everything there is to say goes through our own errors.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  std::signal(SIGINT, requestStop);
  std::signal(SIGTERM, requestStop);
  std::signal(SIGXFSZ, SIG_IGN);  // a full disk is an error of write(), not our death
  RunOptions options;
  options.output = arguments.output;
  options.overwrite = arguments.force;
  options.resume = arguments.resume;
  options.stop = &stop_requested;
  if (arguments.progress == "jsonl") {
    options.progress = writeJsonLine;
  } else if (arguments.progress == "auto" && !arguments.quiet && isatty(STDERR_FILENO) == 1) {
    options.progress = drawBar;
  }
  if (arguments.verbose) {
    options.log = [](const std::string& line) { std::cerr << line << '\n'; };
  }
  RunResult result;
  try {
    result = arguments.listen.endpoint.empty()
                 ? runPipeline(configurationOf(arguments), options)
                 : runOnNetwork(arguments, options);
  } catch (const OutputExistsError& error) {
    throw UsageError(error.what());
  }
  if (arguments.json) {
    std::cout << result.metrics_json;
  } else if (!arguments.quiet) {
    printSummary(result);
  }
  if (!arguments.verbose) {  // then they were in the log already
    for (const std::string& warning : result.warnings) {
      std::cerr << "planar_map: warning: " << warning << '\n';
    }
  }
  if (result.interrupted) {
    std::cerr << "planar_map: interrupted; what was done so far is in " << result.output
              << ", --resume continues it\n";
    return kInterrupted;
  }
  return arguments.strict && !result.warnings.empty() ? kDegraded : kDone;
}

}  // namespace

void addRunCommand(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("run", "Make a map: the pipeline, input to map");
  const auto arguments = std::make_shared<RunArguments>();
  command->add_option("config", arguments->configuration, "Configuration file (*.yaml)")
      ->required();
  command
      ->add_option("-i,--input", arguments->inputs,
                   "PCD or PLY files, a directory of them, or a sequence folder")
      ->allow_extra_args(true);
  command->add_option("-o,--output", arguments->output, "Directory for the results")
      ->capture_default_str();
  command->add_option("--poses", arguments->poses,
                      "Trajectory (TUM: timestamp tx ty tz qx qy qz qw), a line a frame");
  addListenOptions(*command, arguments->listen);
  command->add_option("--set", arguments->assignments, "stage.key=value, repeatable")
      ->allow_extra_args(false);
  command->add_option("--profile", arguments->profile, "paper or compact")
      ->check(CLI::IsMember({"paper", "compact"}));
  command->add_option("--frames", arguments->frames, "A:B:STEP, frames A to B - 1");
  command->add_option("-j,--threads", arguments->threads, "Threads, 0 = all cores")
      ->check(CLI::Range(0, 1024));
  command->add_option("--seed", arguments->seed, "Seed of everything random, >= 0")
      ->check(CLI::NonNegativeNumber);
  auto* resume = command->add_flag("--resume", arguments->resume, "Continue an interrupted run");
  auto* force = command->add_flag("--force", arguments->force, "Overwrite earlier results");
  resume->excludes(force);
  command->add_flag("--strict", arguments->strict, "Exit code 5 if the result is degraded");
  command->add_option("--progress", arguments->progress, "auto, none or jsonl, on stderr")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "none", "jsonl"}));
  command->add_flag("-q,--quiet", arguments->quiet, "Say nothing but warnings and errors");
  command->add_flag("-v,--verbose", arguments->verbose, "Show run.log as it comes about");
  command->add_flag("--json", arguments->json, "Print metrics.json instead of a summary");
  command->callback([arguments, &exit_code]() { exit_code = run(*arguments); });
}

}  // namespace planar_mapping::tools
