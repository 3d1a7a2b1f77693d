// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/base/export.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/scene/view_options.h"
#include "planar_mapping/viewer/window/image.h"

namespace planar_mapping {

/// Draws the content off screen. Needs no display: surfaceless EGL first, so that the same machine
/// always gives the same pixels, then the X server if there is one.
///
/// Not thread-safe: one picture at a time in a process (VTK).
/// \throws RenderError if nothing here can draw, or the picture came out blank; the message says
///         which package to install
/// \throws InputError, ParameterError for content or options that cannot be drawn
PLANAR_MAPPING_EXPORT Image renderSnapshot(const SceneContent& content,
                                           const ViewOptions& options = ViewOptions());

}  // namespace planar_mapping
