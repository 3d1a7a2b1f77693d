// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

namespace planar_mapping::tools {

/// The exit codes scripts rely on (docs: command line).
enum ExitCode : int {
  kDone = 0,
  kInternalFailure = 1,
  kUsage = 2,
  kBadConfiguration = 3,
  kInputUnreadable = 4,
  kDegraded = 5,
  kOverThreshold = 6,
  kNoRenderer = 7,
  kInterrupted = 130,
};

/// A wrong use of the command line that CLI11 cannot see: exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One function per sub-command, each in command_<name>.cpp. It adds the sub-command to the program;
// its callback does the work, throws one of our errors, or sets the exit code.
void addRunCommand(CLI::App& app, int& exit_code);
void addFrontendCommand(CLI::App& app, int& exit_code);
void addKeysCommand(CLI::App& app, int& exit_code);
void addValidateCommand(CLI::App& app, int& exit_code);
void addConfigCommand(CLI::App& app, int& exit_code);
void addStagesCommand(CLI::App& app, int& exit_code);
void addInfoCommand(CLI::App& app, int& exit_code);
void addQueryCommand(CLI::App& app, int& exit_code);
void addConvertCommand(CLI::App& app, int& exit_code);
void addMergeCommand(CLI::App& app, int& exit_code);
void addCompareCommand(CLI::App& app, int& exit_code);
void addViewCommand(CLI::App& app, int& exit_code);
void addSnapshotCommand(CLI::App& app, int& exit_code);
void addSimulateCommand(CLI::App& app, int& exit_code);
void addEvaluateCommand(CLI::App& app, int& exit_code);

}  // namespace planar_mapping::tools
