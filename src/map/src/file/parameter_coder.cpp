// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/parameter_coder.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace planar_mapping::detail {
namespace {

constexpr int kMostPlaces = 7;
constexpr std::int64_t kMostDigits = 1000000000;

double fromDecimal(std::int64_t digits, int places) {
  double scale = 1.0;
  for (int i = 0; i < places; ++i) scale *= 10.0;
  return static_cast<double>(digits) / scale;
}
/// Is it digits times a power of ten, as what a person wrote is?
bool isDecimal(double value, std::int64_t& digits, int& places) {
  double scaled = value;
  for (places = 0; places <= kMostPlaces && std::abs(scaled) < static_cast<double>(kMostDigits);
       ++places) {
    digits = std::llround(scaled);
    if (fromDecimal(digits, places) == value) return true;
    scaled *= 10.0;
  }
  return false;
}

/// A number and its usual value, which is part of the format: it stays what it is when defaults
/// change.
struct Parameter {
  double* value;
  double usual;
};

std::array<Parameter, 26> numbersOf(PlanarMapParams& p) {
  CuboidApproximationParams& a = p.approximation;
  return {{
      {&a.resolution, 0.1},
      {&a.thickness, 0.0},
      {&a.density_threshold, 0.9},
      {&a.min_width, 0.0},
      {&a.min_height, 0.0},
      {&a.hole_size, 0.0},
      {&a.absorption, 0.5},
      {&a.rectangle_cells, 4.0},
      {&a.up.x(), 0.0},
      {&a.up.y(), 0.0},
      {&a.up.z(), 1.0},
      {&p.association_angle, 0.087},
      {&p.association_offset, 0.1},
      {&p.association_gap, 0.5},
      {&p.unknown_resolution, 0.0},
      {&p.max_range, 10.0},
      {&p.min_probability, 0.5},
      {&p.belief_gain, 0.5},
      {&p.miss_factor, 0.7},
      {&p.first_belief, 0.7},
      {&p.noise_factor, 1.0},
      {&p.min_cell_share, 0.15},
      {&p.rim_pixels, 1.0},
      {&p.surface_factor, 3.0},
      {&p.refit_tolerance, 0.1},
      {&p.range_image_step, 0.0087},
  }};
}

}  // namespace

double codeDouble(BitCoder& coder, double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  bits = coder.plain(bits, 64);
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

double ParameterCoder::codeNew(BitCoder& coder, double value) {
  std::int64_t digits = 0;
  int places = 0;
  if (!decimal_.code(coder, isDecimal(value, digits, places))) return codeDouble(coder, value);
  places = static_cast<int>(places_.code(coder, static_cast<std::uint32_t>(places)));
  return fromDecimal(digits_.codeWithin(coder, digits, -kMostDigits, kMostDigits), places);
}

double ParameterCoder::codeOne(BitCoder& coder, Known& known, double value) {
  for (std::size_t i = 0; i < known.values.size(); ++i) {
    if (known.is_value[i].code(coder, value == known.values[i])) return known.values[i];
  }
  value = codeNew(coder, value);
  if (known.values.size() < kMostKnown) known.values.push_back(value);
  return value;
}

void ParameterCoder::codeNumber(BitCoder& coder, std::size_t place, PlanarMapParams& p) {
  const Parameter parameter = numbersOf(p)[place];
  Known& known = known_[place];
  if (known.values.empty()) known.values.push_back(parameter.usual);
  *parameter.value = codeOne(coder, known, *parameter.value);
}

void ParameterCoder::codeKinds(BitCoder& coder, PlanarMapParams& p) {
  CuboidApproximationParams& a = p.approximation;
  a.profile =
      compact_.code(coder, a.profile == Profile::Compact) ? Profile::Compact : Profile::Paper;
  p.unknown_space = unknown_space_.code(coder, p.unknown_space);
}

void ParameterCoder::code(BitCoder& coder, PlanarMapParams& p) {
  for (std::size_t i = 0; i < kNumbers; ++i) codeNumber(coder, i, p);
  codeKinds(coder, p);
  int& min_points = p.approximation.min_points_per_cell;
  min_points = static_cast<int>(min_points_.codeWithin(coder, min_points, 0, 1000000000));
  if (coder.isReading()) p.validate();
}

void ParameterCoder::codeFinished(BitCoder& coder, PlanarMapParams& p) {
  constexpr std::size_t kKept[] = {0, 1, 14, 23};  // resolutions, thickness, surface_factor
  for (const std::size_t i : kKept) codeNumber(coder, i, p);
  codeKinds(coder, p);
  if (!coder.isReading()) return;
  // A usual range may be too long for small cells.
  const double cell =
      p.unknown_resolution > 0.0 ? p.unknown_resolution : p.approximation.resolution;
  p.max_range = std::min(p.max_range, 2048.0 * cell);
  p.validate();
}

void ParameterCoder::forget() {
  forgetAll(decimal_, compact_, unknown_space_, places_, digits_, min_points_);
  for (Known& known : known_) {
    for (AdaptiveBit& bit : known.is_value) bit.forget();
  }
}

}  // namespace planar_mapping::detail
