// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/viewer/scene/scene_content.h"

namespace planar_mapping::visualization {

/// A round step (1, 2 or 5 times a power of ten) that cuts length into at most parts pieces.
double roundStep(double length, int parts);

/// The multiples of step from low to high; at most 1000.
std::vector<double> multiples(double low, double high, double step);

/// The number without trailing zeros: "2.5", "0", "-12".
std::string shortNumber(double value);

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

/// Rectangle on the ground that the content stands on, in steps of the grid.
struct GroundFrame {
  Vector3 right = Vector3::UnitX();    ///< unit, horizontal
  Vector3 forward = Vector3::UnitY();  ///< unit, horizontal
  Vector3 up = Vector3::UnitZ();
  double height = 0.0;  ///< of the ground along up, metres
  double low_right = 0.0, high_right = 1.0, low_forward = 0.0, high_forward = 1.0;  ///< metres
  double step = 1.0;                                                                ///< metres

  double longest() const { return std::max(high_right - low_right, high_forward - low_forward); }
  Vector3 point(double along_right, double along_forward) const {
    return along_right * right + along_forward * forward + height * up;
  }
};
/// One metre steps, 0.1 m in a scene below 2.5 m, larger where there would be more than 200 lines.
GroundFrame groundFrame(const SceneContent& content);

}  // namespace planar_mapping::visualization
