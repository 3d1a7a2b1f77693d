// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/export/page_assets.h"

// The bytes of a file between two symbols. The paths are CMake's.
#define PLANAR_MAPPING_EMBED(name, path)                                         \
  __asm__(".pushsection .rodata\n" #name "_begin:\n.incbin \"" path "\"\n" #name \
          "_end:\n.popsection\n.hidden " #name "_begin\n.hidden " #name          \
          "_end\n"                                                               \
          ".global " #name "_begin\n.global " #name "_end\n");                   \
  extern "C" __attribute__((visibility("hidden"))) const char name##_begin[];    \
  extern "C" __attribute__((visibility("hidden"))) const char name##_end[]

PLANAR_MAPPING_EMBED(planar_mapping_page_html, PLANAR_MAPPING_PAGE "/page.html");
PLANAR_MAPPING_EMBED(planar_mapping_page_licence, PLANAR_MAPPING_PAGE "/three_licence.js");
PLANAR_MAPPING_EMBED(planar_mapping_page_three, PLANAR_MAPPING_THREE);
PLANAR_MAPPING_EMBED(planar_mapping_page_controls, PLANAR_MAPPING_ORBIT_CONTROLS);
PLANAR_MAPPING_EMBED(planar_mapping_page_script, PLANAR_MAPPING_PAGE "/page.js");

namespace planar_mapping::io {

std::string_view pageAsset(PageAsset asset) {
  const auto between = [](const char* begin, const char* end) {
    return std::string_view(begin, static_cast<std::size_t>(end - begin));
  };
  switch (asset) {
    case PageAsset::Html:
      return between(planar_mapping_page_html_begin, planar_mapping_page_html_end);
    case PageAsset::Licence:
      return between(planar_mapping_page_licence_begin, planar_mapping_page_licence_end);
    case PageAsset::Three:
      return between(planar_mapping_page_three_begin, planar_mapping_page_three_end);
    case PageAsset::Controls:
      return between(planar_mapping_page_controls_begin, planar_mapping_page_controls_end);
    case PageAsset::Script:
      break;
  }
  return between(planar_mapping_page_script_begin, planar_mapping_page_script_end);
}

}  // namespace planar_mapping::io
