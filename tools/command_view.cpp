// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "commands.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::tools {
namespace {

namespace fs = std::filesystem;

std::string pathOf(const Companion& program) {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  const fs::path path = self.parent_path() / program.name;
  if (!error && access(path.c_str(), X_OK) == 0) return path.string();
  throw RenderError(program.name + " is not beside " + self.string() + "; " + program.advice);
}

std::vector<char*> argumentsOf(const std::string& path, const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  argv.push_back(const_cast<char*>(path.c_str()));
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  return argv;
}

/// A command that becomes planar_map_viewer.
CLI::App* addPassThrough(CLI::App& app, const std::string& name, const std::string& summary) {
  auto* command = app.add_subcommand(name, summary);
  command->prefix_command();  // everything behind it is the viewer's
  command->set_help_flag();
  return command;
}

}  // namespace

void addViewCommand(CLI::App& app, int&) {
  auto* command = addPassThrough(
      app, "view", "Look at a map (and clouds) in a window; --follow shows it as it grows");
  command->callback([command]() { becomeViewer(command->remaining()); });
}

void addSnapshotCommand(CLI::App& app, int&) {
  auto* command = addPassThrough(app, "snapshot", "Draw a map into a PNG file, without a display");
  command->callback([command]() {
    std::vector<std::string> arguments;
    bool has_output = false;
    for (const std::string& argument : command->remaining()) {
      const bool is_output = argument == "-o" || argument == "--output";
      const bool is_help = argument == "-h" || argument == "--help";
      has_output = has_output || is_output || is_help || argument == "--snapshot" ||
                   argument.compare(0, 11, "--snapshot=") == 0;
      arguments.push_back(is_output ? "--snapshot" : argument);
    }
    if (!has_output) throw UsageError("snapshot needs the picture's name: -o FILE.png");
    becomeViewer(arguments);
  });
}

void becomeViewer(const std::vector<std::string>& arguments) {
  const std::string path =
      pathOf({"planar_map_viewer",
              "build with PLANAR_MAPPING_BUILD_VIEWER=ON (it needs libvtk9-dev) or install it"});
  execv(path.c_str(), argumentsOf(path, arguments).data());
  throw RenderError(path + ": cannot be started: " + std::strerror(errno));
}

int runCompanion(const Companion& program, const std::vector<std::string>& arguments) {
  const std::string path = pathOf(program);
  pid_t process = 0;
  const int problem = ::posix_spawn(&process, path.c_str(), nullptr, nullptr,
                                    argumentsOf(path, arguments).data(), environ);
  if (problem != 0) throw RenderError(path + ": cannot be started: " + std::strerror(problem));
  int status = 0;
  while (::waitpid(process, &status, 0) < 0) {
    if (errno != EINTR) throw RenderError(path + ": is lost: " + std::strerror(errno));
  }
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  throw RenderError(path + ": died of signal " + std::to_string(WTERMSIG(status)));
}

}  // namespace planar_mapping::tools
