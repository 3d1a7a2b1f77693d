// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/view_options.h"

#include <array>
#include <cmath>
#include <sstream>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

namespace {

/// Enumerations as words: one table per enumeration serves both directions and the message.
template <typename Enum, std::size_t N>
using Words = std::array<std::pair<Enum, const char*>, N>;

template <typename Enum, std::size_t N>
const char* wordOf(const Words<Enum, N>& words, Enum value) {
  for (const auto& [entry, word] : words) {
    if (entry == value) return word;
  }
  return "invalid";
}

template <typename Enum, std::size_t N>
Enum fromWord(const char* what, const Words<Enum, N>& words, const std::string& text) {
  std::string allowed;
  for (const auto& [entry, word] : words) {
    if (text == word) return entry;
    allowed += (allowed.empty() ? "" : ", ") + std::string(word);
  }
  throw ParameterError(std::string(what) + " is '" + text + "', but must be one of " + allowed);
}

constexpr Words<ColorBy, 5> kColorWords = {{{ColorBy::Plane, "plane"},
                                            {ColorBy::Height, "height"},
                                            {ColorBy::Probability, "probability"},
                                            {ColorBy::State, "state"},
                                            {ColorBy::Tilt, "tilt"}}};

constexpr Words<CameraPreset, 7> kCameraWords = {{{CameraPreset::Iso, "iso"},
                                                  {CameraPreset::Top, "top"},
                                                  {CameraPreset::Front, "front"},
                                                  {CameraPreset::Back, "back"},
                                                  {CameraPreset::Left, "left"},
                                                  {CameraPreset::Right, "right"},
                                                  {CameraPreset::FirstPerson, "first-person"}}};
constexpr Words<Cutaway, 3> kCutawayWords = {
    {{Cutaway::None, "none"}, {Cutaway::Ceiling, "ceiling"}, {Cutaway::Seen, "seen"}}};
constexpr Words<bool Layers::*, 8> kLayerWords = {{{&Layers::occupied, "occupied"},
                                                   {&Layers::unknown, "unknown"},
                                                   {&Layers::trajectory, "trajectory"},
                                                   {&Layers::cloud, "cloud"},
                                                   {&Layers::edges, "edges"},
                                                   {&Layers::axes, "axes"},
                                                   {&Layers::ground_grid, "ground-grid"},
                                                   {&Layers::legend, "legend"}}};

void requireFinite(const char* name, const std::optional<Vector3>& value) {
  if (value && !value->allFinite()) throw ParameterError(std::string(name) + " is not finite");
}

}  // namespace

const char* toString(CameraPreset preset) {
  return wordOf(kCameraWords, preset);
}

CameraPreset cameraPresetFromString(const std::string& word) {
  return fromWord("the camera", kCameraWords, word);
}

const char* toString(Cutaway cutaway) {
  return wordOf(kCutawayWords, cutaway);
}

Cutaway cutawayFromString(const std::string& word) {
  return fromWord("the cutaway", kCutawayWords, word);
}

const char* toString(ColorBy color) {
  return wordOf(kColorWords, color);
}

ColorBy colorByFromString(const std::string& word) {
  return fromWord("the colour mode", kColorWords, word);
}

Layers Layers::fromString(const std::string& list) {
  Layers layers;
  for (const auto& [member, word] : kLayerWords) layers.*member = list == "all";
  if (list == "all" || list == "none") return layers;
  std::istringstream stream(list);
  std::string word;
  while (std::getline(stream, word, ',')) layers.*fromWord("the layer", kLayerWords, word) = true;
  return layers;
}

void ViewOptions::validate() const {
  requireFinite("camera position", camera_position);
  requireFinite("focal point", focal_point);
  requireFinite("view up", view_up);
  if (view_up && !(view_up->norm() > 1e-9)) throw ParameterError("view up is the zero vector");
  if (!(zoom > 0.0 && zoom <= 1000.0)) throw ParameterError("zoom", zoom, "(0, 1000]");
  if (clip_above && !std::isfinite(*clip_above)) throw ParameterError("clip above is not finite");
  requireInRange("point size", point_size, 1.0, 50.0, "px");
  requireInRange("picture width", width, 16, 16384, "px");
  requireInRange("picture height", height, 16, 16384, "px");
  if (static_cast<long long>(width) * height > (1LL << 26))
    throw ParameterError("picture area", static_cast<double>(width) * height, "at most 67108864",
                         "px");
}

void ViewOptions::setSize(const std::string& text) {
  int w = 0;
  int h = 0;
  int end = 0;
  const int fields = std::sscanf(text.c_str(), "%5dx%5d%n", &w, &h, &end);
  if (fields != 2 || static_cast<std::size_t>(end) != text.size())
    throw ParameterError("the picture size is '" + text + "', but must look like 1280x720");
  ViewOptions changed = *this;
  changed.width = w;
  changed.height = h;
  changed.validate();
  width = w;
  height = h;
}

}  // namespace planar_mapping
