// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>

#include "planar_mapping/core/cuboid_approximation.h"
#include "planar_mapping/core/error.h"
#include "plane_cover.h"

namespace planar_mapping {
namespace {

float meanProbability(const CellMask& mask, const std::vector<float>& probability,
                      const CellRectangle& r) {
  double sum = 0.0;
  std::int64_t count = 0;
  for (std::int32_t b = r.b - mask.b0; b < r.b - mask.b0 + r.height; ++b) {
    for (std::int32_t a = r.a - mask.a0; a < r.a - mask.a0 + r.width; ++a) {
      if (!mask.at(a, b)) continue;  // a filled hole has no belief of its own
      sum += probability[static_cast<std::size_t>(b) * mask.width + static_cast<std::size_t>(a)];
      ++count;
    }
  }
  return count > 0 ? static_cast<float>(sum / static_cast<double>(count)) : 1.0f;
}

}  // namespace

namespace detail {

std::vector<Cuboid> cuboidsOfRectangles(const PlaneFrame& frame, const CellMask& mask,
                                        const std::vector<float>& cell_probability,
                                        const std::vector<CellRectangle>& rectangles,
                                        std::int32_t plane_id,
                                        const CuboidApproximationParams& params) {
  const double s = params.resolution;
  const double thickness = thicknessOf(params);
  Matrix3 axes;
  axes << frame.u, frame.v, frame.n;
  const Quaternion orientation(axes);
  std::vector<Cuboid> cuboids(rectangles.size());
  for (std::size_t i = 0; i < rectangles.size(); ++i) {
    const CellRectangle& r = rectangles[i];
    Cuboid& cuboid = cuboids[i];
    cuboid.size = {r.width * s, r.height * s, thickness};
    cuboid.center =
        frame.fromPlane({(r.a + 0.5 * r.width) * s, (r.b + 0.5 * r.height) * s, -0.5 * thickness});
    cuboid.orientation = orientation;
    cuboid.plane_id = plane_id;
    if (!cell_probability.empty()) {
      cuboid.probability = meanProbability(mask, cell_probability, r);
    }
  }
  return cuboids;
}

}  // namespace detail

std::vector<Cuboid> cuboidsOfPlane(const PlaneFrame& frame, const CellMask& mask,
                                   const std::vector<float>& cell_probability,
                                   std::int32_t plane_id, const CuboidApproximationParams& params) {
  params.validate();
  if (!cell_probability.empty() && cell_probability.size() != mask.cells.size()) {
    throw InputError("cell mask of " + std::to_string(mask.cells.size()) + " cells comes with " +
                     std::to_string(cell_probability.size()) + " probabilities");
  }
  const std::vector<CellRectangle> rectangles = detail::rectanglesOfPlane(mask, nullptr, params);
  return detail::cuboidsOfRectangles(frame, mask, cell_probability, rectangles, plane_id, params);
}

}  // namespace planar_mapping
