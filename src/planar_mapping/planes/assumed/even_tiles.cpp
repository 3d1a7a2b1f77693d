// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/planes/assumed/tile_image.h"

namespace planar_mapping {
namespace {

constexpr float kStep = 3.0f;      // gray levels between neighbouring tiles that are an edge
constexpr float kEven = 3.0f;      // standard deviations of the noise within an even tile
constexpr float kMinNoise = 2.0f;  // gray levels: saturated parts of an image have none

}  // namespace

std::vector<std::uint8_t> evenTiles(const std::uint8_t* gray, int width, int height) {
  const int columns = width / kEvenTileSide;
  const int rows = height / kEvenTileSide;
  constexpr float kPixels = kEvenTileSide * kEvenTileSide;
  std::vector<float> means;
  std::vector<float> deviations;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      int sum = 0;
      int squares = 0;
      for (int row = kEvenTileSide * y; row < kEvenTileSide * (y + 1); ++row) {
        const std::uint8_t* values =
            gray + static_cast<std::ptrdiff_t>(row) * width + kEvenTileSide * x;
        for (int column = 0; column < kEvenTileSide; ++column) {
          sum += values[column];
          squares += values[column] * values[column];
        }
      }
      const float mean = static_cast<float>(sum) / kPixels;
      means.push_back(mean);
      deviations.push_back(
          std::sqrt(std::max(0.0f, static_cast<float>(squares) / kPixels - mean * mean)));
    }
  }
  std::vector<std::uint8_t> even(means.size(), 0);
  if (means.empty()) return even;
  // The evenest tenth shows the noise of the camera.
  std::vector<float> sorted = deviations;
  const float most = std::max(kEven * detail::ranked(sorted, sorted.size() / 10), kMinNoise);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const auto i = static_cast<std::size_t>(y * columns + x);
      unsigned flags = deviations[i] <= most ? 1u : 0u;
      for (unsigned k = 0; k < 4; ++k) {
        const int u = x + detail::kTileDirections[k][0];
        const int v = y + detail::kTileDirections[k][1];
        if (u < 0 || u >= columns || v >= rows) continue;
        const float step = means[i] - means[static_cast<std::size_t>(v * columns + u)];
        flags |= std::fabs(step) > kStep ? 2u << k : 0u;
      }
      even[i] = static_cast<std::uint8_t>(flags);
    }
  }
  return even;
}

}  // namespace planar_mapping
