// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/window/x_display.h"

#include <GL/glx.h>
#include <dlfcn.h>

#include <cstdlib>
#include <mutex>

// Apart from the other sources: the X headers define macros such as None and Bool.
namespace planar_mapping::visualization {
namespace {

/// An X server starts anew when its last client leaves, and refuses connections meanwhile: that of
/// VTK, which calls abort() then. So the connection that found it usable is held.
void hold(Display* display) {
  static std::mutex mutex;
  static Display* held = nullptr;
  const std::lock_guard<std::mutex> lock(mutex);
  if (held != nullptr) XCloseDisplay(held);
  held = display;
}

}  // namespace

std::string xServerProblem() {
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0') return "DISPLAY is not set";
  Display* display = XOpenDisplay(nullptr);
  if (display == nullptr) return std::string("no X server answers at DISPLAY=") + name;
  bool is_usable = false;
  void* library = dlopen("libGL.so.1", RTLD_NOW | RTLD_LOCAL);
  if (library != nullptr) {
    const auto query_extension =
        reinterpret_cast<decltype(&glXQueryExtension)>(dlsym(library, "glXQueryExtension"));
    const auto choose_config =
        reinterpret_cast<decltype(&glXChooseFBConfig)>(dlsym(library, "glXChooseFBConfig"));
    constexpr int kWanted[] = {GLX_DRAWABLE_TYPE,
                               GLX_WINDOW_BIT,
                               GLX_RENDER_TYPE,
                               GLX_RGBA_BIT,
                               GLX_RED_SIZE,
                               1,
                               GLX_GREEN_SIZE,
                               1,
                               GLX_BLUE_SIZE,
                               1,
                               0};
    if (query_extension != nullptr && choose_config != nullptr &&
        query_extension(display, nullptr, nullptr) == True) {
      int count = 0;
      GLXFBConfig* configs = choose_config(display, DefaultScreen(display), kWanted, &count);
      is_usable = configs != nullptr && count > 0;
      if (configs != nullptr) XFree(configs);
    }
    // The library stays open: closing Mesa's driver and opening it again is not safe.
  }
  if (is_usable) {
    hold(display);
    return {};
  }
  XCloseDisplay(display);
  return std::string("the X server at DISPLAY=") + name + " has no OpenGL (GLX)";
}

}  // namespace planar_mapping::visualization
