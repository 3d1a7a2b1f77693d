// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/colors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

namespace {

/// Nine colours 0xRRGGBB at equal distances.
using Scale = std::array<std::uint32_t, 9>;
constexpr Scale kViridis = {0x440154, 0x472D7B, 0x3B528B, 0x2C728E, 0x21918C,
                            0x28AE80, 0x5EC962, 0xADDC30, 0xFDE725};
// Light enough to be shaded: the dark end of viridis swallows floors.
constexpr Scale kTerrain = {0x4A68BE, 0x4291CD, 0x4AB2BE, 0x6CC696, 0xA6D470,
                            0xE0D860, 0xF8BE54, 0xF29452, 0xE26458};
constexpr Scale kPlasma = {0x0D0887, 0x4C02A1, 0x7E03A8, 0xAA2395, 0xCC4778,
                           0xE66C5C, 0xF89540, 0xFDC527, 0xF0F921};

std::uint8_t toByte(double value) {
  return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
}

// Oklch to sRGB (B. Ottosson): equal steps of hue look about equally far apart.
Color fromOklch(double lightness, double chroma, double hue) {
  const double a = chroma * std::cos(hue);
  const double b = chroma * std::sin(hue);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  const auto gamma = [](double linear) {
    const double x = std::clamp(linear, 0.0, 1.0);
    return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
  };
  return {toByte(gamma(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s)),
          toByte(gamma(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s)),
          toByte(gamma(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s))};
}

}  // namespace

Color colorFromString(const std::string& text) {
  static const std::array<std::pair<const char*, Color>, 5> names = {{{"white", {255, 255, 255}},
                                                                      {"black", {0, 0, 0}},
                                                                      {"gray", {128, 128, 128}},
                                                                      {"light", {240, 242, 245}},
                                                                      {"dark", {30, 33, 39}}}};
  for (const auto& [name, color] : names) {
    if (text == name) return color;
  }
  const bool hex = text.size() == 7 && text[0] == '#' &&
                   text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
  if (!hex)
    throw ParameterError("the colour is '" + text +
                         "', but must be #rrggbb or one of white, black, gray, light, dark");
  const unsigned long value = std::stoul(text.substr(1), nullptr, 16);
  return {static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>((value >> 8) & 0xffu),
          static_cast<std::uint8_t>(value & 0xffu)};
}

Color planeColor(std::int32_t plane_id) {
  if (plane_id < 0) return {158, 160, 164};
  static constexpr std::array<double, 3> kLightness = {0.77, 0.70, 0.84};
  constexpr double kGoldenAngle = 2.399963229728653;
  const double hue = std::fmod(4.4 + kGoldenAngle * plane_id, 2.0 * M_PI);
  return fromOklch(kLightness[static_cast<std::size_t>(plane_id) % 3], 0.115, hue);
}

Color stateColor(CellState state) {
  switch (state) {
    case CellState::Free:
      return {255, 255, 255};
    case CellState::Occupied:
      return {72, 120, 176};
    case CellState::Unknown:
      return {128, 130, 138};
  }
  return {255, 0, 255};
}

Color scaleColor(ColorBy color, double value) {
  const Scale& scale = color == ColorBy::Probability ? kPlasma
                       : color == ColorBy::Height    ? kTerrain
                                                     : kViridis;
  const double position = std::isnan(value) ? 0.0 : std::clamp(value, 0.0, 1.0) * 8.0;
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(position), 7);
  const double t = position - static_cast<double>(i);
  const auto mixed = [&](unsigned shift) {
    const int a = scale[i] >> shift & 0xFFu, b = scale[i + 1] >> shift & 0xFFu;
    return static_cast<std::uint8_t>(std::lround(a + t * (b - a)));
  };
  return {mixed(16), mixed(8), mixed(0)};
}

double ScalarRange::normalized(double value) const {
  return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
}

}  // namespace planar_mapping
