// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ready_configurations.h"

#include <dlfcn.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "planar_mapping/pipeline/configuration.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

/// share/planar_mapping/config beside the folder of this library (of the program, if it is linked
/// statically) or up to three folders higher: lib/x86_64-linux-gnu and lib/python3/dist-packages
/// are below lib. Empty if there is none.
fs::path readyConfigurations() {
  constexpr int kMaxLevels = 4;
  Dl_info self{};
  if (::dladdr(reinterpret_cast<const void*>(&findConfiguration), &self) == 0) return {};
  std::error_code error;
  fs::path folder = fs::canonical(self.dli_fname, error).parent_path();
  for (int level = 0; level < kMaxLevels && folder.has_relative_path(); ++level) {
    folder = folder.parent_path();
    fs::path configurations = folder / "share" / "planar_mapping" / "config";
    if (fs::is_directory(configurations, error)) return configurations;
  }
  return {};
}

}  // namespace

std::string findConfiguration(const std::string& name) {
  std::error_code error;
  if (name.empty() || fs::path(name).has_parent_path() || fs::exists(name, error)) return name;
  const fs::path ready = readyConfigurations() / name;
  return ready.is_absolute() && fs::is_regular_file(ready, error) ? ready.string() : name;
}

namespace detail {

std::string listReadyConfigurations() {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(readyConfigurations(), error)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "; ready: " : ", ") + name;
  return list;
}

}  // namespace detail
}  // namespace planar_mapping
