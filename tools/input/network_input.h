// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <memory>

#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame_source.h"

namespace planar_mapping::tools {

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

}  // namespace planar_mapping::tools
