// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <csignal>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frame_command.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/survey/survey_jobs.h"

namespace planar_mapping::tools {
namespace {

struct SurveyArguments : FrameArguments {
  std::vector<std::string> words;  ///< configuration and inputs of a plan
  std::string frames;
  SurveyParams params;
  std::string plan;
  std::string output;
  std::size_t piece = 0;
  std::optional<std::int64_t> component;
  std::optional<std::size_t> tile;
  int threads = 1;
  bool allow_missing = false;
};

void plan(SurveyArguments& arguments) {
  requireNew(arguments.output, arguments.force);
  takeWords("plan", arguments.words, arguments);
  if (arguments.inputs.empty()) throw UsageError("plan needs at least one sequence");
  if (arguments.configuration.empty())
    chooseConfiguration(io::Sequence({arguments.inputs.front()}), arguments);
  Configuration configuration = loadFor(arguments, "", {});
  selectFrames(arguments.frames, configuration);
  const SurveyPlan made = planSurvey(arguments.inputs, std::move(configuration), arguments.params);
  writeResults([&]() {
    io::writeFileAtomically(arguments.output, toJson(made),
                            arguments.force ? io::Overwrite::Allow : io::Overwrite::Refuse);
  });
  if (!arguments.quiet)
    std::cout << arguments.output << ": " << detail::counted(made.pieces.size(), "piece") << " of "
              << detail::counted(made.sequences.size(), "sequence") << '\n';
}

void tell(const SurveyReport& report, bool as_json) {
  std::cout << (as_json ? report.json : report.line) << '\n';
}

SurveyJobs jobsOf(const SurveyArguments& arguments) {
  return {io::readWholeText(arguments.plan), arguments.plan, arguments.output};
}

void tile(SurveyArguments& given) {
  const SurveyJobs jobs(given.plan);
  const std::size_t first = given.tile.value_or(0);
  const std::size_t last = given.tile ? first + 1 : jobs.tileCount();
  for (std::size_t number = first; number < last; ++number)
    tell(jobs.tile(number, given.threads), given.json);
}

}  // namespace

void solveSurvey(const std::string& folder, bool allow_missing, bool json) {
  tell(SurveyJobs(folder).solve(allow_missing), json);
}

int runSurvey(const std::string& plan, const std::string& output, int threads, bool quiet) {
  const SurveyJobs jobs(io::readWholeText(plan), plan, output);
  const std::size_t pieces = jobs.plan().pieces.size();
  const bool is_tiled = jobs.plan().params.tile > 0.0;
  std::size_t all = 2 * pieces + (is_tiled ? 1 : 2);
  std::size_t done = 0;
  const auto wasStopped = [&](const SurveyReport& report) {
    ++done;
    if (!quiet)
      std::cerr << "planar_map: job " << done << " of " << all << ": " << report.line << '\n';
    if (!stopOnSignal()) return false;
    std::cerr << "planar_map: interrupted; the same command goes on\n";
    return true;
  };
  for (std::size_t piece = 0; piece < pieces; ++piece)
    if (wasStopped(jobs.submap(piece, threads))) return kInterrupted;
  if (wasStopped(jobs.places())) return kInterrupted;
  for (std::size_t piece = 1; piece < pieces; ++piece)
    if (wasStopped(jobs.links(piece))) return kInterrupted;
  if (wasStopped(jobs.solve())) return kInterrupted;
  std::string result = output;
  if (is_tiled) {
    all += jobs.tileCount();
    for (std::size_t number = 0; done < all; ++number)
      if (wasStopped(jobs.tile(number, threads))) return kInterrupted;
  } else {
    result += "/map.pmap";
    wasStopped(jobs.join(result, std::nullopt, threads));
  }
  if (!quiet) std::cout << result << '\n';
  return kDone;
}

void addSurveyCommands(CLI::App& atlas) {
  const auto arguments = std::make_shared<SurveyArguments>();
  const auto add = [&](const char* name, const char* text, void (*act)(SurveyArguments&)) {
    CLI::App* command = atlas.add_subcommand(name, text);
    command->callback([arguments, act]() {
      stopOnSignal();
      std::signal(SIGTERM, SIG_DFL);  // a job that is stopped leaves nothing: it is done again
      std::signal(SIGINT, SIG_DFL);
      act(*arguments);
    });
    return command;
  };
  const auto addJobOptions = [&](CLI::App* command) {
    command->add_flag("--json", arguments->json, "For machines");
  };
  const auto addPlan = [&](CLI::App* command) {
    command->add_option("plan", arguments->plan, "Plan (planar_map atlas plan)")->required();
    command->add_option("piece", arguments->piece, "Number of a piece, from 0")->required();
  };
  const auto addFolder = [&](CLI::App* command) {
    command->add_option("-o,--output", arguments->output, "Folder that all jobs of the plan share")
        ->required();
    addJobOptions(command);
  };
  const auto addThreads = [&](CLI::App* command) {
    command->add_option("-j,--threads", arguments->threads, "Threads, 0 = all cores")
        ->capture_default_str()
        ->check(CLI::Range(0, 1024));
  };

  auto* planning = add("plan", "Cuts sequences into jobs for many machines", plan);
  planning
      ->add_option("input", arguments->words,
                   "Sequences, each a folder as of run, and a configuration (*.yaml); without one "
                   "that which suits the first sequence")
      ->required();
  planning->add_option("-o,--output", arguments->output, "Plan to write (*.json)")->required();
  addFrameOptions(*planning, *arguments);
  planning->add_option("--frames", arguments->frames, "A:B:STEP, frames A to B - 1 of each");
  const auto addCount = [&](const char* name, int& value, const char* text) {
    addChecked(*planning, name, value, CLI::Range(1, 1000000), text);
  };
  addCount("--piece-frames", arguments->params.piece_frames, "Frames of a sequence for one job");
  addCount("--submap-frames", arguments->params.submaps.frames,
           "Frames after which a submap is closed");
  addCount("--link-pieces", arguments->params.link_pieces,
           "Earlier pieces that look alike and are searched for places of a piece");
  addChecked(*planning, "--tile", arguments->params.tile, numberIn(0.0, 1e6),
             "For a map larger than memory: it comes in tiles of this side, metres, rounded up to "
             "whole cubes of 32 cells; 0 = one map");

  auto* mapping = add("submap", "Job: maps a piece", [](SurveyArguments& given) {
    tell(jobsOf(given).submap(given.piece, given.threads), given.json);
  });
  addPlan(mapping);
  addFolder(mapping);
  addThreads(mapping);

  const auto addMissing = [&](CLI::App* command) {
    command->add_flag("--allow-missing", arguments->allow_missing,
                      "Leave pieces out that were not mapped");
    addJobOptions(command);
  };
  const auto addSurvey = [&](CLI::App* command) {
    command->add_option("folder", arguments->plan, "Folder of the survey")->required();
  };
  auto* looking = add("places", "Job: which pieces look alike, once all are mapped",
                      [](SurveyArguments& given) {
                        tell(SurveyJobs(given.plan).places(given.allow_missing), given.json);
                      });
  addSurvey(looking);
  addMissing(looking);

  auto* linking = add("links", "Job: finds the places of a piece in earlier ones that look alike",
                      [](SurveyArguments& given) {
                        tell(jobsOf(given).links(given.piece, given.allow_missing), given.json);
                      });
  addPlan(linking);
  linking->add_flag("--allow-missing", arguments->allow_missing,
                    "Leave pieces out that were not mapped");
  addFolder(linking);

  auto* tiling = add("tile", "Job: a tile of the map of a survey that was solved", tile);
  addSurvey(tiling);
  tiling->add_option("number", arguments->tile, "Number of a tile, from 0; default: all of them");
  addJobOptions(tiling);
  addThreads(tiling);

  auto* joining =
      add("join", "Job: one map of a survey that was solved", [](SurveyArguments& given) {
        tell(SurveyJobs(given.plan).join(given.output, given.component, given.threads), given.json);
      });
  addSurvey(joining);
  joining->add_option("-o,--output", arguments->output, "Map to write (*.pmap)")->required();
  joining->add_option("--component", arguments->component,
                      "Number of a component (info); default: that of the first submap");
  addJobOptions(joining);
  addThreads(joining);
}

}  // namespace planar_mapping::tools
