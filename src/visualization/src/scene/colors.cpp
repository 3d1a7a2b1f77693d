// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/colors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/core/base/error.h"
#include "scene/words.h"

namespace planar_mapping {

namespace {

using visualization::Words;

constexpr Words<ColorBy, 5> kColorWords = {{{ColorBy::Plane, "plane"},
                                            {ColorBy::Height, "height"},
                                            {ColorBy::Probability, "probability"},
                                            {ColorBy::State, "state"},
                                            {ColorBy::Tilt, "tilt"}}};

constexpr std::array<Color, 9> kViridis = {{{68, 1, 84},
                                            {71, 45, 123},
                                            {59, 82, 139},
                                            {44, 114, 142},
                                            {33, 145, 140},
                                            {40, 174, 128},
                                            {94, 201, 98},
                                            {173, 220, 48},
                                            {253, 231, 37}}};
// Light enough to be shaded: the dark end of viridis swallows floors.
constexpr std::array<Color, 9> kTerrain = {{{74, 104, 190},
                                            {66, 145, 205},
                                            {74, 178, 190},
                                            {108, 198, 150},
                                            {166, 212, 112},
                                            {224, 216, 96},
                                            {248, 190, 84},
                                            {242, 148, 82},
                                            {226, 100, 88}}};
constexpr std::array<Color, 9> kPlasma = {{{13, 8, 135},
                                           {76, 2, 161},
                                           {126, 3, 168},
                                           {170, 35, 149},
                                           {204, 71, 120},
                                           {230, 108, 92},
                                           {248, 149, 64},
                                           {253, 197, 39},
                                           {240, 249, 33}}};

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

const char* toString(ColorBy color) {
  return visualization::wordOf(kColorWords, color);
}

ColorBy colorByFromString(const std::string& word) {
  return visualization::fromWord("the colour mode", kColorWords, word);
}

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
  if (!hex) {
    throw ParameterError("the colour is '" + text +
                         "', but must be #rrggbb or one of white, black, gray, light, dark");
  }
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
  const auto& table = color == ColorBy::Probability ? kPlasma
                      : color == ColorBy::Height    ? kTerrain
                                                    : kViridis;
  const double position = std::isnan(value) ? 0.0 : std::clamp(value, 0.0, 1.0) * 8.0;
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(position), 7);
  const double t = position - static_cast<double>(i);
  const auto mix = [t](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + t * (b - a)));
  };
  return {mix(table[i].red, table[i + 1].red), mix(table[i].green, table[i + 1].green),
          mix(table[i].blue, table[i + 1].blue)};
}

double ScalarRange::normalized(double value) const {
  return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
}

}  // namespace planar_mapping
