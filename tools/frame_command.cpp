// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "frame_command.h"

#include <pcl/console/print.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/ready_configuration.h"
#include "planar_mapping/pipeline/sequence_source.h"

namespace planar_mapping::tools {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<bool> on_terminal{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler writes it");

/// The first signal asks, the second one, of either kind, does not.
extern "C" void requestStop(int /*number*/) {
  if (stop_requested.exchange(true)) std::_Exit(kInterrupted);
  constexpr char kText[] =
      "\nplanar_map: stopping: the frame in work is finished, and what was done is saved; a second "
      "Ctrl-C stops at once\n";
  const std::size_t from = on_terminal ? 0 : 1;  // below the bar, or a line of its own
  const ssize_t ignored = ::write(STDERR_FILENO, kText + from, sizeof kText - 1 - from);
  static_cast<void>(ignored);
}

UsageError secondConfiguration(const std::string& command, const std::string& first,
                               const std::string& second) {
  return UsageError(command + " takes one configuration, not '" + first + "' and '" + second + "'");
}

}  // namespace

bool FrameArguments::wantsBar() const {
  return progress == "auto" && !quiet && isatty(STDERR_FILENO) == 1;
}

void addInputOption(CLI::App& command, std::vector<std::string>& inputs, std::string& poses,
                    std::string& calibration, const std::string& without) {
  command
      .add_option("-i,--input", inputs,
                  "PCD, PLY or .bin files, a directory of them, or a folder: ours, KITTI, TUM "
                  "RGB-D, ICL-NUIM, EuRoC, Middlebury, 3DMatch, ScanNet" +
                      without)
      ->allow_extra_args(true);
  command.add_option("--poses", poses,
                     "Trajectory (TUM: timestamp tx ty tz qx qy qz qw; KITTI: 12 numbers), a line "
                     "a frame or matched by time");
  command.add_option("--calib", calibration, "Calibration (calib.yaml) in place of the folder's");
}

void addFrameOptions(CLI::App& command, FrameArguments& arguments) {
  command.add_option("--set", arguments.assignments, "stage.key=value, repeatable")
      ->allow_extra_args(false);
  command
      .add_option("--up", arguments.up,
                  "Axis of the world that is upwards, for all stages; auto = found")
      ->check(CLI::IsMember({"auto", "x", "y", "z", "-x", "-y", "-z"}));
  command.add_option("--seed", arguments.seed, "Seed of everything random")
      ->check(CLI::Range(std::int64_t{0}, RunSettings::kLargestSeed));
  command.add_flag("--force", arguments.force, "Overwrite earlier results");
  addChecked(command, "--progress", arguments.progress, CLI::IsMember({"auto", "none", "jsonl"}),
             "auto, none or jsonl, on stderr");
  command.add_flag("-q,--quiet", arguments.quiet, "Say nothing but warnings and errors");
}

Configuration loadFor(const FrameArguments& arguments, const std::string& profile,
                      std::vector<std::string> assignments) {
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments = arguments.assignments;
  // The options are short for assignments, and win over them.
  if (!arguments.up.empty()) assignments.push_back("up=" + arguments.up);
  if (arguments.seed >= 0) assignments.push_back("seed=" + std::to_string(arguments.seed));
  overrides.assignments.insert(overrides.assignments.end(), assignments.begin(), assignments.end());
  if (!profile.empty()) overrides.profile = profile;
  Configuration configuration = loadConfiguration(arguments.configuration, table, overrides);
  if (!arguments.inputs.empty()) {
    configuration.inputs = arguments.inputs;
    configuration.poses.clear();
    configuration.calibration.clear();
  }
  if (!arguments.poses.empty()) configuration.poses = arguments.poses;
  if (!arguments.calibration.empty()) configuration.calibration = arguments.calibration;
  return configuration;
}

void takeWords(const std::string& command, const std::vector<std::string>& words,
               FrameArguments& arguments) {
  for (const std::string& word : words) {
    const std::string extension = std::filesystem::path(word).extension().string();
    if (extension != ".yaml" && extension != ".yml") {
      arguments.inputs.push_back(word);
    } else if (arguments.configuration.empty()) {
      arguments.configuration = word;
    } else {
      throw secondConfiguration(command, arguments.configuration, word);
    }
  }
}

void selectFrames(const std::string& selection, Configuration& configuration) {
  if (selection.empty()) return;
  try {
    configuration.frames = parseFrameSelection(selection);
  } catch (const InputError& error) {
    throw UsageError(std::string("--frames: ") + error.what());
  }
}

void chooseConfiguration(const io::Sequence& sequence, FrameArguments& arguments) {
  const ReadyConfiguration ready = readyConfigurationFor(sequence);
  arguments.configuration = planar_mapping::findConfiguration(ready.name);
  arguments.assignments.insert(arguments.assignments.begin(), ready.assignments.begin(),
                               ready.assignments.end());
  if (arguments.quiet) return;
  std::string sentence;
  for (const std::string& note : describe(sequence))
    sentence += (sentence.empty() ? arguments.inputs.front() + ": " : "; ") + note;
  std::cerr << "planar_map: " << sentence << "; configuration " << arguments.configuration;
  for (const std::string& assignment : ready.assignments) std::cerr << " --set " << assignment;
  std::cerr << (ready.why.empty() ? "" : " (" + ready.why + ")") << '\n';
}

std::atomic<bool>& stopOnSignal() {
  // Everything there is to say goes through our own errors.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  on_terminal = isatty(STDERR_FILENO) == 1;
  struct sigaction action = {};
  action.sa_handler = requestStop;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);
  return stop_requested;
}

std::optional<double> secondsLeft(std::size_t done, std::size_t all) {
  using Clock = std::chrono::steady_clock;
  static Clock::time_point first_time = Clock::now();
  static std::size_t first_done = done;
  if (done <= first_done) {
    first_time = Clock::now();
    first_done = done;
    return std::nullopt;
  }
  if (all < done) return std::nullopt;
  const std::chrono::duration<double> elapsed = Clock::now() - first_time;
  return elapsed.count() * static_cast<double>(all - done) / static_cast<double>(done - first_done);
}

void countFrames(std::size_t done, std::size_t all) {
  std::cerr << "\rframe " << done << " of " << all << (done == all ? "\n" : "") << std::flush;
}

void drawBar(std::size_t done, std::size_t all, const std::string& text) {
  constexpr std::size_t kWidth = 30;
  std::string left;
  if (const std::optional<double> seconds = secondsLeft(done, all); seconds && done < all) {
    const auto whole = static_cast<long>(std::lround(*seconds));
    const std::string rest = std::to_string(whole % 60);
    left = ", " + std::to_string(whole / 60) + (rest.size() < 2 ? ":0" : ":") + rest + " left";
  }
  const std::size_t filled = all > 0 ? kWidth * done / all : 0;
  std::cerr << "\r[" << std::string(filled, '#') << std::string(kWidth - filled, '.') << "] "
            << done << (all > 0 ? "/" + std::to_string(all) : std::string()) << "  " << text << left
            << "   " << (done == all ? "\n" : "") << std::flush;
}

}  // namespace planar_mapping::tools
