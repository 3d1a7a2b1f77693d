// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/viewer/scene/view_options.h"

namespace planar_mapping::visualization {

/// What a key asks of the window.
enum class KeyAction {
  None,
  ChangeView,   ///< options changed: draw again
  PlaceCamera,  ///< options changed: place the camera as they say
  ZoomIn,
  ZoomOut,
  Help,
  Screenshot,
  Clear,
  Quit,
};

/// Applies the key to the options; \p message says what it did, empty if that is plain to see.
KeyAction applyKey(const std::string& key, ViewOptions& options, std::string& message);

}  // namespace planar_mapping::visualization
