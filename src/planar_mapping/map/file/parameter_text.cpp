// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/file/parameter_text.h"

#include <array>
#include <charconv>
#include <sstream>
#include <string_view>
#include <type_traits>

#include "planar_mapping/base/error.h"

namespace planar_mapping::detail {
namespace {

/// What 0 and 1 are called.
using Words = std::array<const char*, 2>;
constexpr Words wordsOf(bool) {
  return {"false", "true"};
}
constexpr Words wordsOf(Profile) {
  return {"paper", "compact"};
}
constexpr Words wordsOf(Unseen) {
  return {"unknown", "free"};
}
constexpr Words wordsOf(MapFrame) {
  return {"world", "start"};
}

template <typename T>
constexpr bool kIsChoice = std::is_enum_v<T> || std::is_same_v<T, bool>;

template <typename T>
std::string textOf(T value) {
  if constexpr (kIsChoice<T>) {
    return wordsOf(value)[value == T(0) ? 0 : 1];
  } else {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
  }
}
template <typename T>
bool parse(const std::string& text, T& value) {
  if constexpr (kIsChoice<T>) {
    value = T(text == wordsOf(value)[0] ? 0 : 1);
    return text == textOf(value);
  } else {
    const char* end = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && at == end;
  }
}

/// Calls visit(name, value) for every parameter; of a finished map for those that queries depend
/// on.
template <typename Params, typename Visit>
void forEachParameter(Params& p, bool is_finished, Visit&& visit) {
  auto& a = p.approximation;
  visit("frame", p.frame);
  visit("origin_x", p.origin.x());
  visit("origin_y", p.origin.y());
  visit("origin_z", p.origin.z());
  visit("profile", a.profile);
  visit("resolution", a.resolution);
  visit("thickness", a.thickness);
  visit("up_x", a.up.x());
  visit("up_y", a.up.y());
  visit("up_z", a.up.z());
  visit("unknown_space", p.unknown_space);
  visit("unseen", p.unseen);
  visit("unknown_resolution", p.unknown_resolution);
  visit("max_range", p.max_range);
  if (is_finished) return;
  visit("density_threshold", a.density_threshold);
  visit("min_width", a.min_width);
  visit("min_height", a.min_height);
  visit("min_points_per_cell", a.min_points_per_cell);
  visit("hole_size", a.hole_size);
  visit("absorption", a.absorption);
  visit("rectangle_cells", a.rectangle_cells);
  visit("association_angle", p.association_angle);
  visit("association_offset", p.association_offset);
  visit("association_gap", p.association_gap);
  visit("min_probability", p.min_probability);
  visit("belief_gain", p.belief_gain);
  visit("miss_factor", p.miss_factor);
  visit("miss_range", p.miss_range);
  visit("first_belief", p.first_belief);
  visit("noise_factor", p.noise_factor);
  visit("min_cell_share", p.min_cell_fraction);
  visit("rim_pixels", p.rim_pixels);
  visit("surface_factor", p.surface_factor);
  visit("refit_tolerance", p.refit_tolerance);
  visit("range_image_step", p.range_image_step);
}

}  // namespace

std::string parameterText(const PlanarMapParams& params, bool is_finished) {
  std::string text;
  forEachParameter(params, is_finished, [&](const char* name, const auto& value) {
    const bool is_origin = std::string_view(name).substr(0, 7) == "origin_";
    if (is_origin && params.origin.isZero(0.0)) return;  // as it is in most maps
    text += std::string(name) + ' ' + textOf(value) + '\n';
  });
  return text;
}

PlanarMapParams parametersOf(const std::string& text) {
  PlanarMapParams params;
  params.unseen = Unseen::Free;  // of maps that do not say
  std::istringstream lines(text);
  std::string name;
  std::string value;
  while (lines >> name >> value) {
    bool is_known = false;
    forEachParameter(params, false, [&](const char* known, auto& parameter) {
      is_known = is_known || (name == known && parse(value, parameter));
    });
    if (!is_known)
      throw Error("the map has the parameter '" + name + " " + value +
                  "', which this version does not know");
  }
  params.validate();
  return params;
}

}  // namespace planar_mapping::detail
