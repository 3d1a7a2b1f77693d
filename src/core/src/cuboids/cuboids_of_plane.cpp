// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/cuboids/detail/compact_cover.h"
#include "planar_mapping/core/cuboids/cuboid_approximation.h"

namespace planar_mapping {

std::vector<Cuboid> cuboidsOfPlane(const PlaneFrame& frame, const CellMask& mask,
                                   const std::vector<float>& cell_probability,
                                   std::int32_t plane_id, const CuboidApproximationParams& params) {
  CuboidApproximationParams all = params;
  all.rectangle_cells = 0.0;  // there are no boxes to leave anything to
  const SurfaceCover cover = coverSurface(mask, nullptr, cell_probability, all);
  std::vector<Cuboid> cuboids;
  for (std::size_t i = 0; i < cover.rectangles.size(); ++i) {
    cuboids.push_back(cuboidOf(cover.rectangles[i], frame, params));
    cuboids.back().plane_id = plane_id;
    cuboids.back().probability = cover.probability[i];
  }
  return cuboids;
}

}  // namespace planar_mapping
