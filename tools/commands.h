// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/map/planar_map.h"

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
  kNotFound = 8,
  kInterrupted = 130,
};

/// A wrong use of the command line that CLI11 cannot see: exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One function per sub-command, in command_<name>.cpp or with those it has much in common with:
// command_config.cpp, command_merge.cpp, command_network.cpp. It adds the sub-command to the
// program; its callback does the work and throws one of our errors, or sets the exit code if it is
// not kDone.
using AddCommand = void(CLI::App& app, int& exit_code);
AddCommand addRunCommand, addFrontendCommand, addKeysCommand, addValidateCommand, addConfigCommand,
    addStagesCommand, addInfoCommand, addQueryCommand, addConvertCommand, addReportCommand,
    addMergeCommand, addCompareCommand, addViewCommand, addSnapshotCommand, addSimulateCommand,
    addEvaluateCommand, addAtlasCommand, addLocalizeCommand;

/// plan, submap, links and join of `planar_map atlas`, and its solve of a folder of a survey.
void addSurveyCommands(CLI::App& atlas);
void solveSurvey(const std::string& folder, bool allow_missing, bool json);
/// All jobs of a plan, one after the other.
int runSurvey(const std::string& plan, const std::string& output, int threads, bool quiet);

/// A program that was built or installed beside this one.
struct Companion {
  std::string name;
  std::string advice;  ///< how to get it
};
/// Becomes the viewer, so that its exit code is ours and planar_map itself needs no VTK.
/// \throws RenderError if there is none
[[noreturn]] void becomeViewer(const std::vector<std::string>& arguments);
/// Starts a program and waits for it. \return its exit code. \throws RenderError if there is none
int runCompanion(const Companion& program, const std::vector<std::string>& arguments);

/// Results that cannot be written: exit code 1.
class WriteError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Calls \p write. \throws UsageError for a file that must not be overwritten, WriteError for one
/// that cannot be written
template <typename Write>
void writeResults(const Write& write) {
  try {
    write();
  } catch (const io::FileExistsError& error) {
    throw UsageError(error.what());
  } catch (const IoError& error) {
    throw WriteError(error.what());
  }
}

inline nlohmann::ordered_json toJson(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

/// \throws UsageError if there is a file and it must not be overwritten
inline void requireNew(const std::string& path, bool force) {
  std::error_code ignored;
  if (!force && std::filesystem::exists(path, ignored))
    throw UsageError("'" + path + "' exists; --force overwrites it");
}

/// CLI::Range of floating-point numbers, but NaN is in none.
inline CLI::Validator numberIn(double low, double high) {
  const CLI::Range range(low, high);
  return CLI::Validator(
      [range, low](std::string& text) {
        double value = low;
        CLI::detail::lexical_cast(text, value);
        return std::isnan(value) ? "Value " + text + " is not a number" : range(text);
      },
      range.get_description());
}

/// An option whose default is shown by --help and whose value is checked.
template <typename Value>
CLI::Option* addChecked(CLI::App& command, const char* names, Value& value,
                        const CLI::Validator& check, const char* text) {
  return command.add_option(names, value, text)->capture_default_str()->check(check);
}

/// For clouds in millimetres and the like.
inline void addScaleOption(CLI::App& command, double& scale) {
  addChecked(command, "--scale", scale, numberIn(1e-6, 1e6),
             "Metres a unit of the clouds and their VIEWPOINT, 0.001 for millimetres");
}

/// Exactly N finite numbers with commas between them. \throws UsageError naming the option
template <std::size_t N>
std::array<double, N> numbersOf(const std::string& option, const std::string& text) {
  std::array<double, N> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    while (at != end && *at == ' ') ++at;
    const std::from_chars_result read = std::from_chars(at, end, numbers[i]);
    const bool last = i + 1 == N;
    if (read.ec != std::errc() || !std::isfinite(numbers[i]) ||
        (last ? read.ptr != end : read.ptr == end || *read.ptr != ',')) {
      throw UsageError(option + " is '" + text + "', but must be " + std::to_string(N) +
                       " finite numbers with commas between them");
    }
    at = read.ptr + 1;
  }
  return numbers;
}

}  // namespace planar_mapping::tools
