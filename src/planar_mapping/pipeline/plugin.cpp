// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/plugin.h"

#include <dlfcn.h>

#include <filesystem>

#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

constexpr const char* kInterfaceSymbol = "planar_mapping_plugin_interface";
constexpr const char* kStagesSymbol = "planar_mapping_plugin_stages";

std::string lastLoaderError() {
  const char* text = dlerror();
  return text != nullptr ? text : "unknown reason";
}

}  // namespace

void loadPlugin(const std::string& path, StageTable& table) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    throw IoError(path,
                  "there is no such shared library; a plugin lies beside the configuration file or "
                  "is named by its absolute path");
  const std::string file = std::filesystem::absolute(path).string();  // not one of the search path
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) throw IoError(path, "cannot be loaded as a plugin: " + lastLoaderError());
  auto* version = reinterpret_cast<int (*)()>(dlsym(library, kInterfaceSymbol));
  auto* stages = reinterpret_cast<void (*)(StageTable*)>(dlsym(library, kStagesSymbol));
  if (version == nullptr || stages == nullptr) {
    dlclose(library);
    throw IoError(path,
                  "is a shared library but no plugin of planar_mapping; it has to contain "
                  "PLANAR_MAPPING_STAGES(table) { ... }");
  }
  if (version() != kPluginInterface) {
    const int found = version();
    dlclose(library);
    throw IoError(path, "was built for plugin interface " + std::to_string(found) + ", this is " +
                            std::to_string(kPluginInterface) + "; build the plugin again");
  }
  // Added to a table of its own first, so that a plugin with a taken name leaves nothing behind.
  StageTable added;
  stages(&added);
  for (const StageEntry& entry : added.entries()) {
    if (table.find(entry.name) != nullptr)
      throw IoError(path, "brings a stage '" + entry.name + "', a name that is already taken");
  }
  for (const StageEntry& entry : added.entries()) table.add(entry);
}

}  // namespace planar_mapping
