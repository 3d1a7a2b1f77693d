// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "window/x_display.h"

#include <GL/glx.h>
#include <dlfcn.h>

#include <array>
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

XDisplayState probeXDisplay() {
  Display* display = XOpenDisplay(nullptr);
  if (display == nullptr) return XDisplayState::NoServer;
  XDisplayState state = XDisplayState::NoOpenGl;
  void* library = dlopen("libGL.so.1", RTLD_NOW | RTLD_LOCAL);
  if (library != nullptr) {
    const auto query_extension =
        reinterpret_cast<decltype(&glXQueryExtension)>(dlsym(library, "glXQueryExtension"));
    const auto choose_config =
        reinterpret_cast<decltype(&glXChooseFBConfig)>(dlsym(library, "glXChooseFBConfig"));
    std::array<int, 11> wanted = {GLX_DRAWABLE_TYPE,
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
      GLXFBConfig* configs = choose_config(display, DefaultScreen(display), wanted.data(), &count);
      if (configs != nullptr && count > 0) state = XDisplayState::Usable;
      if (configs != nullptr) XFree(configs);
    }
    // The library stays open: closing Mesa's driver and opening it again is not safe.
  }
  if (state == XDisplayState::Usable) {
    hold(display);
  } else {
    XCloseDisplay(display);
  }
  return state;
}

}  // namespace planar_mapping::visualization
