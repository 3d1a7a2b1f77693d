// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace planar_mapping::visualization {

/// The places that texts take in a picture, pixels from its lower left corner. A text that would
/// meet another is left out.
class Captions {
 public:
  /// \return whether the place was free; then it is taken
  bool take(double left, double bottom, double width, double height) {
    for (const Box& box : boxes_) {
      if (left < box.left + box.width && box.left < left + width &&
          bottom < box.bottom + box.height && box.bottom < bottom + height)
        return false;
    }
    boxes_.push_back({left, bottom, width, height});
    return true;
  }
  /// Of a text in letters so many pixels high, whose line begins at (x, y).
  bool takeText(const std::string& text, double x, double y, double pixels) {
    return take(x, y - 0.3 * pixels, widthOf(text, pixels), 1.3 * pixels);
  }
  bool takeCentered(const std::string& text, double x, double y, double pixels) {
    return takeText(text, x - 0.5 * widthOf(text, pixels), y - 0.5 * pixels, pixels);
  }
  /// No text of our fonts is wider.
  static double widthOf(const std::string& text, double pixels) {
    return 0.6 * pixels * static_cast<double>(text.size());
  }

 private:
  struct Box {
    double left, bottom, width, height;
  };
  std::vector<Box> boxes_;
};

}  // namespace planar_mapping::visualization
