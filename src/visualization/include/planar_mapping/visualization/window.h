// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/visualization/camera.h"
#include "planar_mapping/visualization/image.h"
#include "planar_mapping/visualization/scene_content.h"
#include "planar_mapping/visualization/view_options.h"

namespace planar_mapping {

/// An interactive view of content: the window of planar_map_viewer.
///
/// Keys and mouse go through press() and pick(), which tests and other front ends call as well.
/// The keys are listed in keyHelp(). Not thread-safe.
class PLANAR_MAPPING_EXPORT Window {
 public:
  enum class Screen {
    Display,    ///< a window on the X server of DISPLAY
    Offscreen,  ///< no window: the same scene and interaction, drawn as snapshots are
  };

  /// \throws RenderError if the screen cannot be opened; nothing has been drawn then
  /// \throws InputError, ParameterError for content or options that cannot be drawn
  Window(SceneContent content, const ViewOptions& options, Screen screen = Screen::Display,
         const std::string& title = "planar_mapping");
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Shows the window until the user closes it (q). Only for Screen::Display.
  void run();
  /// Shows other content from the same place; the picked cuboid is no longer marked.
  /// \throws InputError for content that cannot be drawn
  void setContent(SceneContent content);
  /// While run() is at work, asks \p next every \p period seconds for new content; nothing = as it
  /// is. What it throws is shown over the picture.
  void follow(std::function<std::optional<SceneContent>()> next, double period);
  /// A key as X names it ("h", "c", "1", "Escape"). \return false if it means nothing here
  bool press(const std::string& key);
  /// Picks what is drawn at the pixel (from the top left corner); the cuboid's data is shown.
  /// \return index into the content's cuboids, -1 for none
  int pick(double x, double y);

  const ViewOptions& options() const;
  CameraView camera() const;
  /// The text over the picture: help, data of the picked cuboid, or the last message.
  std::string overlayText() const;
  /// What the window shows now.
  Image image();
  /// Where the screenshot key writes: the first free name of PREFIX_001.png, PREFIX_002.png ...
  void setScreenshotPrefix(const std::string& prefix);
  /// Sends a key (as a person presses it) or a click through the window's own event handling.
  void sendKey(const std::string& key);
  void sendClick(int x, int y);
  /// The period of follow() is over once.
  void sendTimer();

  static std::string keyHelp();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Opens a window on the content and returns when the user closes it.
/// \throws RenderError if there is no display; see Window
PLANAR_MAPPING_EXPORT void showWindow(SceneContent content,
                                      const ViewOptions& options = ViewOptions(),
                                      const std::string& title = "planar_mapping");

}  // namespace planar_mapping
