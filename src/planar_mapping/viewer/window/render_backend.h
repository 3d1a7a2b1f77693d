// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkOutputWindow.h>
#include <vtkRenderWindow.h>
#include <vtkSmartPointer.h>

#include <memory>
#include <string>
#include <vector>

#include "planar_mapping/viewer/window/image.h"

namespace planar_mapping::visualization {

constexpr int kSamplesPerPixel = 4;

/// What was rendered last.
Image imageOf(vtkRenderWindow* window);

/// Renders in a window off screen.
/// \throws RenderError if nothing here can draw, or VTK reports an error
Image renderOffscreen(int width, int height, const std::vector<vtkRenderer*>& renderers);
/// \throws RenderError for a picture of one colour
void requireDrawn(const Image& image);

/// A VTK window that draws without a screen, and what it needs to live.
class OffscreenWindow {
 public:
  virtual ~OffscreenWindow() = default;
  virtual vtkRenderWindow* window() = 0;
  virtual std::string name() const = 0;

  /// EGL without a surface, else the X server.
  /// \throws RenderError with what to install where neither is there
  static std::unique_ptr<OffscreenWindow> create(int width, int height);
};

class MessageWindow;

/// Keeps VTK from printing; its messages are collected instead.
class CapturedMessages {
 public:
  CapturedMessages();
  ~CapturedMessages();
  CapturedMessages(const CapturedMessages&) = delete;
  CapturedMessages& operator=(const CapturedMessages&) = delete;
  /// The first error since construction, one line, empty if there was none.
  std::string firstError() const;

 private:
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkSmartPointer<MessageWindow> messages_;
};

}  // namespace planar_mapping::visualization
