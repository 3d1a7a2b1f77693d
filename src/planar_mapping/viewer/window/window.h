// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/scene/view_options.h"
#include "planar_mapping/viewer/window/image.h"

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

  virtual ~Window() = default;

  /// Shows the window until the user closes it (q). Only for Screen::Display.
  virtual void run() = 0;
  /// Shows other content, whole unless the camera was moved; the picked cuboid is no longer marked.
  /// \throws InputError for content that cannot be drawn
  virtual void setContent(SceneContent content) = 0;
  /// While run() is at work, asks \p next every \p period seconds for new content; nothing = as it
  /// is. What it throws is shown over the picture.
  virtual void follow(std::function<std::optional<SceneContent>()> next, double period) = 0;
  /// A key as X names it ("h", "c", "1", "Escape"). \return false if it means nothing here
  virtual bool press(const std::string& key) = 0;
  /// Picks what is drawn at the pixel (from the top left corner); the cuboid's data is shown.
  /// \return index into the content's cuboids, -1 for none
  virtual int pick(double x, double y) = 0;

  virtual const ViewOptions& options() const = 0;
  virtual CameraView camera() const = 0;
  /// The text over the picture: help, data of the picked cuboid, or the last message.
  virtual std::string overlayText() const = 0;
  /// What the window shows now.
  virtual Image image() = 0;
  /// Where the screenshot key writes: the first free name of PREFIX_001.png, PREFIX_002.png ...
  virtual void setScreenshotPrefix(const std::string& prefix) = 0;
  /// Sends a key (as a person presses it) or a click through the window's own event handling.
  virtual void sendKey(const std::string& key) = 0;
  virtual void sendClick(int x, int y) = 0;
  /// The period of follow() is over once.
  virtual void sendTimer() = 0;

  static std::string keyHelp();
};

/// \throws RenderError if the screen cannot be opened; nothing has been drawn then
/// \throws InputError, ParameterError for content or options that cannot be drawn
PLANAR_MAPPING_EXPORT std::unique_ptr<Window> openWindow(
    SceneContent content, const ViewOptions& options,
    Window::Screen screen = Window::Screen::Display, const std::string& title = "planar_mapping");

}  // namespace planar_mapping
