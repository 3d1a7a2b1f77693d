// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace planar_mapping::io {

/// The parts of a page, in the library since it was built: an installed program needs no files.
enum class PageAsset {
  Html,      ///< page/page.html, which ends inside its body
  Licence,   ///< of three.js, as a comment
  Three,     ///< three.min.js
  Controls,  ///< OrbitControls.js
  Script,    ///< page/page.js
};
std::string_view pageAsset(PageAsset asset);

}  // namespace planar_mapping::io
