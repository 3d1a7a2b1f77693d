// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/finished_record.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "file/map_record.h"
#include "store/surface_band.h"

namespace planar_mapping::detail {
namespace {

/// A map with nothing but parameters, for what follows from these.
MapData mapWith(const PlanarMapParams& params) {
  MapData map;
  map.params = params;
  return map;
}

PlanarMapParams keptParams(const PlanarMapParams& params) {
  PlanarMapParams kept;
  kept.approximation.profile = params.approximation.profile;
  kept.approximation.resolution = params.approximation.resolution;
  kept.approximation.thickness = params.approximation.thickness;
  kept.surface_factor = params.surface_factor;
  kept.unknown_resolution = params.unknown_resolution;
  kept.unknown_space = params.unknown_space;
  return kept;
}

bool isSame(const Cuboid& a, const Cuboid& b) {
  return a.center == b.center && a.size == b.size &&
         a.orientation.coeffs() == b.orientation.coeffs();
}

/// A plane while its rectangles are looked for.
struct OpenPlane {
  FinishedPlane kept;
  PlaneFrame frame;
  SurfaceBand band;
};

OpenPlane openPlane(const MapData& map, const PlaneLayer& layer) {
  OpenPlane open;
  open.kept.id = layer.id;
  open.kept.stored = layer.stored();
  open.kept.spread = surfaceSpread(map, layer.moments());
  open.frame = layer.frame();
  open.band = surfaceBand(map, open.kept.spread);
  return open;
}

/// Nothing unless the rectangle's cuboid is the very same.
std::optional<CellRectangle> rectangleOf(const Cuboid& wanted, const OpenPlane& plane,
                                         const CuboidApproximationParams& params) {
  constexpr double kFarthest = 1e9;
  const double half = 0.5 * params.resolution;
  const Vector3 center = plane.frame.toPlane(wanted.center) / half;
  const Vector3 size = wanted.size / half;
  if (!(center.cwiseAbs().maxCoeff() < kFarthest) || !(size.maxCoeff() < kFarthest)) return {};
  const auto rounded = [](double value) { return static_cast<std::int32_t>(std::lround(value)); };
  const CellRectangle place{rounded(center.x() - 0.5 * size.x()),
                            rounded(center.y() - 0.5 * size.y()), rounded(size.x()),
                            rounded(size.y())};
  if (!isSame(cuboidOf(place, plane.frame, plane.band, params), wanted)) return {};
  return place;
}

std::optional<FinishedBox> boxOf(const Cuboid& wanted, double half) {
  Cuboid unsigned_zeros = wanted;
  unsigned_zeros.center.array() += 0.0;
  unsigned_zeros.orientation.coeffs().array() += 0.0;
  const std::optional<HalfCellBox> box = HalfCellBox::from(unsigned_zeros, half);
  if (!box || (box->axes != 0 && wanted.plane_id < 0)) return {};
  const std::array<std::int64_t, 3> size = box->worldSize();
  for (std::size_t i = 0; i < 3; ++i) {
    if ((box->middle[i] - size[i]) % 2 != 0) return {};
  }
  return FinishedBox{*box, wanted.plane_id};
}

FreeCuboid freeCuboidOf(const Cuboid& wanted, double cell) {
  FreeCuboid made;
  const double unit = FreeCuboid::kLength * cell;
  const Quaternion turn = wanted.orientation.normalized();
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    made.center[k] = std::llround(wanted.center[i] / unit);
    made.size[k] = std::llround(wanted.size[i] / unit);
  }
  for (int i = 0; i < 4; ++i) {
    made.turn[static_cast<std::size_t>(i)] = std::lround(turn.coeffs()[i] * FreeCuboid::kOne);
  }
  made.plane_id = wanted.plane_id;
  return made;
}

Cuboid cuboidOf(const FreeCuboid& kept, double cell) {
  Cuboid cuboid;
  const double unit = FreeCuboid::kLength * cell;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    cuboid.center[i] = unit * static_cast<double>(kept.center[k]);
    cuboid.size[i] = unit * static_cast<double>(kept.size[k]);
  }
  for (int i = 0; i < 4; ++i) {
    cuboid.orientation.coeffs()[i] = static_cast<double>(kept.turn[static_cast<std::size_t>(i)]);
  }
  cuboid.orientation.normalize();
  cuboid.plane_id = kept.plane_id;
  return cuboid;
}

void sortForFile(FinishedRecord& record) {
  for (FinishedPlane& plane : record.planes) {
    std::sort(plane.rectangles.begin(), plane.rectangles.end(),
              [](const CellRectangle& l, const CellRectangle& r) {
                return std::tie(l.b, l.a, l.height, l.width) <
                       std::tie(r.b, r.a, r.height, r.width);
              });
  }
  const auto placeOf = [](const FinishedBox& b) {
    const std::array<std::int64_t, 3> size = b.box.worldSize();
    std::array<std::int64_t, 3> low{};
    for (std::size_t i = 0; i < 3; ++i) low[i] = (b.box.middle[i] - size[i]) / 2;
    return std::make_tuple(low[2], low[1], low[0], size[2], size[1], size[0], b.plane_id,
                           b.box.axes);
  };
  std::sort(record.boxes.begin(), record.boxes.end(),
            [&](const FinishedBox& l, const FinishedBox& r) { return placeOf(l) < placeOf(r); });
}

}  // namespace

FinishedRecord finishedRecordOf(const MapData& map, const std::vector<Cuboid>& cuboids) {
  FinishedRecord record;
  record.params = keptParams(map.params);
  const CuboidApproximationParams& params = map.params.approximation;
  std::vector<OpenPlane> planes;
  for (const PlaneLayer& layer : map.planes) planes.push_back(openPlane(map, layer));
  for (const Cuboid& cuboid : cuboids) {
    const auto plane =
        std::lower_bound(planes.begin(), planes.end(), cuboid.plane_id,
                         [](const OpenPlane& open, std::int32_t id) { return open.kept.id < id; });
    std::optional<CellRectangle> rectangle;
    if (plane != planes.end() && plane->kept.id == cuboid.plane_id) {
      rectangle = rectangleOf(cuboid, *plane, params);
    }
    if (rectangle) {
      plane->kept.rectangles.push_back(*rectangle);
    } else if (const auto box = boxOf(cuboid, 0.5 * params.resolution)) {
      record.boxes.push_back(*box);
    } else {
      record.free_cuboids.push_back(freeCuboidOf(cuboid, params.resolution));
    }
  }
  for (OpenPlane& plane : planes) {
    if (!plane.kept.rectangles.empty()) record.planes.push_back(std::move(plane.kept));
  }
  sortForFile(record);
  record.space = bundlesOf(map.unknown);
  return record;
}

std::vector<Cuboid> cuboidsOf(const FinishedRecord& record) {
  const MapData map = mapWith(record.params);
  const CuboidApproximationParams& params = record.params.approximation;
  std::vector<Cuboid> cuboids;
  for (const FinishedPlane& plane : record.planes) {
    const PlaneFrame frame = plane.stored.frame();
    const SurfaceBand band = surfaceBand(map, plane.spread);
    for (const CellRectangle& rectangle : plane.rectangles) {
      cuboids.push_back(cuboidOf(rectangle, frame, band, params));
      cuboids.back().plane_id = plane.id;
    }
  }
  for (const FinishedBox& box : record.boxes) {
    cuboids.push_back(box.box.cuboid(0.5 * params.resolution));
    cuboids.back().plane_id = box.plane_id;
  }
  for (const FreeCuboid& cuboid : record.free_cuboids) {
    cuboids.push_back(cuboidOf(cuboid, params.resolution));
  }
  cuboids.shrink_to_fit();
  return cuboids;
}

}  // namespace planar_mapping::detail
