// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame_source.h"

// What the commands that read frames have in common.
namespace planar_mapping::tools {

struct FrameArguments {
  std::string configuration;
  std::vector<std::string> inputs;
  std::string poses;
  std::string calibration;
  std::vector<std::string> assignments;
  std::string up;  ///< empty = of the configuration
  std::int64_t seed = -1;
  bool force = false;
  bool quiet = false;
  bool json = false;
  std::string progress = "auto";

  /// Is there a person at a terminal who wants to see progress?
  bool wantsBar() const;
};

void addInputOption(CLI::App& command, std::vector<std::string>& inputs, std::string& poses,
                    std::string& calibration, const std::string& without = "");
void addFrameOptions(CLI::App& command, FrameArguments& arguments);

/// The configuration with the command line's assignments, then \p assignments, inputs and poses.
Configuration loadFor(const FrameArguments& arguments, const std::string& profile,
                      std::vector<std::string> assignments);

/// Sorts words of the command line into inputs and the configuration. \throws UsageError of two
void takeWords(const std::string& command, const std::vector<std::string>& words,
               FrameArguments& arguments);

/// `--frames`; empty = as the configuration has it. \throws UsageError
void selectFrames(const std::string& selection, Configuration& configuration);

/// Takes the ready configuration for an input, and says what the input is and what was chosen.
void chooseConfiguration(const io::Sequence& sequence, FrameArguments& arguments);

/// `run --listen`: frames from a front-end on another machine.
struct ListenArguments {
  std::string endpoint;  ///< empty = frames from files
  double timeout = 30.0;
  double max_message_mb = 64.0;
  std::string keys;  ///< file; empty = without encryption
  bool insecure = false;
};

void addListenOptions(CLI::App& command, ListenArguments& arguments);

/// Starts to listen and says where, on stderr.
/// \throws UsageError for options that contradict each other or a build without the module;
///         InputError if it cannot listen there
std::unique_ptr<FrameSource> listenForFrontEnd(const ListenArguments& arguments,
                                               const Configuration& configuration,
                                               const std::atomic<bool>& stop);

/// Set by the first SIGINT or SIGTERM, so that the frame in work is finished and saved however
/// long that takes; a second one ends the program at once with kInterrupted, and what was saved
/// before stays whole. Also silences PCL, and makes a full disk an error of write().
std::atomic<bool>& stopOnSignal();

/// Seconds until the last of \p all is done, if those to come take as long as those since the first
/// call; empty where nothing tells. As few done as in the first call begin anew, the next scene.
/// \param done  of \p all; 0 of all = unknown
std::optional<double> secondsLeft(std::size_t done, std::size_t all);

/// "frame 3 of 7" on stderr, over and over.
void countFrames(std::size_t done, std::size_t all);

/// One line on stderr that is drawn over and over. \param all  0 = unknown
void drawBar(std::size_t done, std::size_t all, const std::string& text);

}  // namespace planar_mapping::tools
