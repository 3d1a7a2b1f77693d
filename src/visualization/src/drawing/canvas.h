// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "planar_mapping/core/base/types.h"
#include "planar_mapping/visualization/image.h"

namespace planar_mapping::visualization {

/// Calls visit(column, row) for the pixels whose centre lies in the convex polygon.
template <typename Visit>
void visitConvex(const std::vector<Vector2>& polygon, int width, int height, const Visit& visit) {
  if (polygon.size() < 3) return;
  double top = INFINITY;
  double bottom = -INFINITY;
  for (const Vector2& p : polygon) {
    top = std::min(top, p.y());
    bottom = std::max(bottom, p.y());
  }
  const int first = std::max(0, static_cast<int>(std::ceil(std::max(top, -1.0) - 0.5)));
  const int last = static_cast<int>(std::floor(std::min(bottom, height + 1.0) - 0.5));
  for (int row = first; row <= std::min(last, height - 1); ++row) {
    const double y = row + 0.5;
    double left = INFINITY;
    double right = -INFINITY;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2& a = polygon[i];
      const Vector2& b = polygon[(i + 1) % polygon.size()];
      if ((a.y() < y && b.y() < y) || (a.y() > y && b.y() > y)) continue;
      const double x =
          a.y() == b.y() ? a.x() : a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, x);
      right = std::max(right, a.y() == b.y() ? b.x() : x);
    }
    const int from = static_cast<int>(std::ceil(std::clamp(left - 0.5, 0.0, 1.0 * width)));
    const int to = static_cast<int>(std::floor(std::clamp(right - 0.5, -1.0, width - 1.0)));
    for (int column = from; column <= to; ++column) visit(column, row);
  }
}

/// Convex hull, counter-clockwise for y upwards.
std::vector<Vector2> convexHull(std::vector<Vector2> points);

/// Smooth drawing without graphics: everything is drawn several times as large and averaged.
/// Coordinates are pixels of the finished picture from its top left corner.
class Canvas {
 public:
  Canvas(int width, int height, Color background);

  int scale() const { return scale_; }
  Image& large() { return large_; }
  /// A picture of the canvas's size, under what is drawn next.
  void draw(const Image& picture);
  void fill(const std::vector<Vector2>& convex, Color color);
  void line(const Vector2& a, const Vector2& b, double width, Color color);
  /// Dashes run on over the corners.
  void dashed(const std::vector<Vector2>& path, double width, double dash, double gap, Color color);
  /// Text with its left (-1), middle (0) or right (1) at x, vertically centred.
  void text(const std::string& words, const Vector2& at, double pixels, int align, Color color);
  double textWidth(const std::string& words, double pixels) const;
  Image finish() const;

 private:
  int width_;
  int height_;
  int scale_;
  Image large_;
};

}  // namespace planar_mapping::visualization
