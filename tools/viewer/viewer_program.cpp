// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "viewer_program.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::tools {
namespace {

namespace fs = std::filesystem;

std::string viewerPath() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  const fs::path viewer = self.parent_path() / "planar_map_viewer";
  if (!error && access(viewer.c_str(), X_OK) == 0) return viewer.string();
  throw RenderError("planar_map_viewer is not beside " + self.string() +
                    "; build with PLANAR_MAPPING_BUILD_VIEWER=ON (it needs libvtk9-dev) or install "
                    "it");
}

std::vector<char*> argumentsOf(const std::string& path, const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  argv.push_back(const_cast<char*>(path.c_str()));
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  return argv;
}

}  // namespace

void becomeViewer(const std::vector<std::string>& arguments) {
  const std::string path = viewerPath();
  execv(path.c_str(), argumentsOf(path, arguments).data());
  throw RenderError(path + ": cannot be started: " + std::strerror(errno));
}

int runViewer(const std::vector<std::string>& arguments) {
  const std::string path = viewerPath();
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
