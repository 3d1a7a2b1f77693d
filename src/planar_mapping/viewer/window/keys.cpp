// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/window/keys.h"

#include <array>

#include "planar_mapping/viewer/window/window.h"

namespace planar_mapping::visualization {

namespace {

struct Toggle {
  const char* key;
  bool Layers::*layer;
  const char* name;
};
constexpr std::array<Toggle, 8> kToggles = {{{"o", &Layers::occupied, "occupied cuboids"},
                                             {"u", &Layers::unknown, "unknown space"},
                                             {"t", &Layers::trajectory, "trajectory"},
                                             {"p", &Layers::cloud, "point clouds"},
                                             {"e", &Layers::edges, "edges"},
                                             {"a", &Layers::axes, "axes"},
                                             {"g", &Layers::ground_grid, "ground grid"},
                                             {"l", &Layers::legend, "legend"}}};

/// The value that comes so many places after another of an enumeration that has \p count.
template <typename Enum>
Enum after(Enum value, int step, int count) {
  return static_cast<Enum>((static_cast<int>(value) + step) % count);
}

}  // namespace

KeyAction applyKey(const std::string& key, ViewOptions& options, std::string& message) {
  message.clear();
  for (const Toggle& toggle : kToggles) {
    if (key != toggle.key) continue;
    bool& shown = options.show.*toggle.layer;
    shown = !shown;
    message = std::string(toggle.name) + (shown ? " shown" : " hidden");
    return KeyAction::ChangeView;
  }
  if (key.size() == 1 && key[0] >= '1' && key[0] <= '7') {
    options.camera = static_cast<CameraPreset>(key[0] - '1');
    options.camera_position.reset();
    options.focal_point.reset();
    options.view_up.reset();
    options.zoom = 1.0;
    message = std::string("camera: ") + toString(options.camera);
    return KeyAction::PlaceCamera;
  }
  if (key == "c" || key == "C") {
    options.color = after(options.color, key == "c" ? 1 : 4, 5);
    message = std::string("colour by ") + toString(options.color);
    return KeyAction::ChangeView;
  }
  if (key == "x") {
    options.cutaway = after(options.cutaway, 1, 3);
    message = std::string("cutaway: ") + toString(options.cutaway);
    return KeyAction::ChangeView;
  }
  if (key == "b") {
    if (options.background) {
      options.background.reset();
    } else {
      options.background = colorFromString("dark");
    }
    return KeyAction::ChangeView;
  }
  if (key == "r") return KeyAction::PlaceCamera;
  if (key == "plus" || key == "equal" || key == "KP_Add") return KeyAction::ZoomIn;
  if (key == "minus" || key == "KP_Subtract") return KeyAction::ZoomOut;
  if (key == "h" || key == "F1" || key == "question") return KeyAction::Help;
  if (key == "s") return KeyAction::Screenshot;
  if (key == "Escape") return KeyAction::Clear;
  if (key == "q") return KeyAction::Quit;
  return KeyAction::None;
}

}  // namespace planar_mapping::visualization

namespace planar_mapping {

std::string Window::keyHelp() {
  return "mouse left   turn; click: data of a cuboid\n"
         "mouse wheel  nearer, farther (also + -)\n"
         "mouse middle move\n"
         "c  C         next, previous colour\n"
         "1 ... 7      iso top front back left right\n"
         "             first-person\n"
         "r            camera as at the start\n"
         "o u t p      occupied unknown path points\n"
         "e a g l      edges axes grid legend\n"
         "x            cutaway: none ceiling seen\n"
         "b            background\n"
         "s            screenshot\n"
         "h            this help\n"
         "Esc          clear   q  quit";
}

}  // namespace planar_mapping
