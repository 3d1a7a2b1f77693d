// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Its code runs when it is loaded, which the file named by PLUGIN_MARK then shows.
#include <cstdio>
#include <cstdlib>

namespace {

__attribute__((constructor)) void mark() {
  const char* path = std::getenv("PLUGIN_MARK");
  if (path == nullptr) return;
  if (std::FILE* file = std::fopen(path, "w")) std::fclose(file);
}

}  // namespace

extern "C" int planar_mapping_plugin_interface() {
  return 5;
}
extern "C" void planar_mapping_plugin_stages(void*) {}
