// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <charconv>
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
  std::string earlier;  ///< "J" or "A:B"
  std::optional<std::int64_t> component;
  double tile = 0.0;  ///< metres
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
              << detail::counted(made.sequences.size(), "sequence") << ", "
              << detail::counted(made.searches.size(), "job") << " for links\n";
}

void tell(const SurveyReport& report, bool as_json) {
  std::cout << (as_json ? report.json : report.line) << '\n';
}

SurveyJobs jobsOf(const SurveyArguments& arguments) {
  return {io::readWholeText(arguments.plan), arguments.plan, arguments.output};
}

/// "J" or "A:B".
SurveySearch searchOf(const SurveyArguments& arguments) {
  SurveySearch search;
  search.piece = arguments.piece;
  const std::string& text = arguments.earlier;
  const char* const end = text.data() + text.size();
  std::from_chars_result read = std::from_chars(text.data(), end, search.first);
  search.last = search.first + 1;
  if (read.ec == std::errc() && read.ptr != end && *read.ptr == ':')
    read = std::from_chars(read.ptr + 1, end, search.last);
  if (read.ec != std::errc() || read.ptr != end)
    throw UsageError("'" + text + "' is no piece J and no pieces A:B, A to B - 1");
  return search;
}

void join(SurveyArguments& given) {
  const SurveyJobs jobs(given.plan);
  if (given.tile <= 0.0)
    return tell(jobs.join(given.output, given.component, given.threads), given.json);
  for (const SurveyReport& report :
       jobs.joinTiles(given.output, given.tile, given.component, given.threads))
    tell(report, given.json);
}

}  // namespace

void solveSurvey(const std::string& folder, bool allow_missing, bool json) {
  tell(SurveyJobs(folder).solve(allow_missing), json);
}

int runSurvey(const std::string& plan, const std::string& output, int threads, bool quiet) {
  const SurveyJobs jobs(io::readWholeText(plan), plan, output);
  const std::size_t all = jobs.plan().pieces.size() + jobs.plan().searches.size() + 2;
  std::size_t done = 0;
  const auto wasStopped = [&](const SurveyReport& report) {
    ++done;
    if (!quiet)
      std::cerr << "planar_map: job " << done << " of " << all << ": " << report.line << '\n';
    if (!stopOnSignal()) return false;
    std::cerr << "planar_map: interrupted; the same command goes on\n";
    return true;
  };
  for (std::size_t piece = 0; piece < jobs.plan().pieces.size(); ++piece)
    if (wasStopped(jobs.submap(piece, threads))) return kInterrupted;
  for (const SurveySearch& search : jobs.plan().searches)
    if (wasStopped(jobs.links(search))) return kInterrupted;
  if (wasStopped(jobs.solve())) return kInterrupted;
  const std::string map = output + "/map.pmap";
  wasStopped(jobs.join(map, std::nullopt, threads));
  if (!quiet) std::cout << map << '\n';
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
           "Earlier pieces that one job looks for places in");

  auto* mapping = add("submap", "Job: maps a piece", [](SurveyArguments& given) {
    tell(jobsOf(given).submap(given.piece, given.threads), given.json);
  });
  addPlan(mapping);
  addFolder(mapping);
  addThreads(mapping);

  auto* linking =
      add("links", "Job: finds the places of a piece in earlier ones", [](SurveyArguments& given) {
        const SurveySearch search = searchOf(given);
        tell(jobsOf(given).links(search, given.allow_missing), given.json);
      });
  addPlan(linking);
  linking->add_option("earlier", arguments->earlier, "Earlier piece J, or A:B, pieces A to B - 1")
      ->required();
  linking->add_flag("--allow-missing", arguments->allow_missing,
                    "Leave pieces out that were not mapped");
  addFolder(linking);

  auto* joining = add("join", "Job: one map of a survey that was solved", join);
  joining->add_option("folder", arguments->plan, "Folder of the survey")->required();
  joining
      ->add_option("-o,--output", arguments->output,
                   "Map to write (*.pmap), or with --tile the folder of the tiles")
      ->required();
  addChecked(*joining, "--tile", arguments->tile, numberIn(0.0, 1e6),
             "Side of tiles map_X_Y.pmap, metres, rounded up to whole cubes of 32 cells; 0 = one "
             "map");
  joining->add_option("--component", arguments->component,
                      "Number of a component (info); default: that of the first submap");
  addJobOptions(joining);
  addThreads(joining);
}

}  // namespace planar_mapping::tools
