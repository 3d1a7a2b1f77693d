// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/viewer/window/image.h"

class vtkContext2D;

namespace planar_mapping::visualization {

/// Shapes and text on VTK's 2-D context. Coordinates are pixels from the top left corner.
class Canvas {
 public:
  Canvas(vtkContext2D& context, int height) : context_(context), height_(height) {}

  vtkContext2D& context() { return context_; }
  /// VTK's y for a y from the top.
  double flipped(double y) const { return height_ - y; }
  void fill(const std::vector<Vector2>& convex, Color color);
  /// A polyline; dashes continue over its corners.
  void line(const std::vector<Vector2>& path, double width, Color color, bool dashed = false);
  /// Text with its left (-1), middle (0) or right (1) at x, vertically centred.
  void text(const std::string& words, const Vector2& at, double pixels, int align, Color color);
  /// Width and height.
  Vector2 textSize(const std::string& words, double pixels);

 private:
  vtkContext2D& context_;
  std::vector<float> flipped(const std::vector<Vector2>& path) const;
  void setPen(int line_type, double width, Color color);

  int height_;
};

/// Draws what \p paint draws on a page off screen.
/// \throws RenderError if nothing here can draw
Image drawPage(int width, int height, Color background, const std::function<void(Canvas&)>& paint);

}  // namespace planar_mapping::visualization
