// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/store/belief.h"

namespace planar_mapping::detail {
namespace {

/// Points of a segment that are looked at to see what of the map it is near.
constexpr std::size_t kSamples = 64;

/// Points that scatter about their plane by more than this fraction of their spread along it, and
/// by more than so many resolutions, have no certain normal: the next frame would fit another one.
constexpr double kMaxRoughness = 0.15;
constexpr double kHarmlessScatter = 0.1;
/// Where the map has something already, what is smaller than 3 x 3 cells is no other plane: every
/// frame would fit another one.
constexpr double kMinCells = 9.0;

/// Calls visit(world) for up to about kSamples points of the segment, until that is true.
template <typename Visit>
bool anySample(const Frame& frame, std::size_t segment, Visit&& visit) {
  const Indices& inliers = frame.inliersOf(segment);
  const PointsView& points = frame.observation->points;
  const std::size_t step = std::max<std::size_t>(1, inliers.size() / kSamples);
  for (std::size_t i = 0; i < inliers.size(); i += step) {
    const auto at = static_cast<std::size_t>(inliers[i]);
    if (!points.isMeasured(at)) continue;
    if (visit(Vector3(frame.rotation * points.point(at) + frame.sensor))) return true;
  }
  return false;
}

constexpr double kCosineRounding = 1e-9;  // of cosines

/// Is most of the segment where the map has something?
bool isMapped(const MapData& map, const Frame& frame, std::size_t segment) {
  std::size_t looked = 0, mapped = 0;
  anySample(frame, segment, [&](const Vector3& world) {
    ++looked;
    mapped += isMapped(map, world) ? 1 : 0;
    return false;
  });
  return 2 * mapped > looked;
}

/// Likewise of the cells of a plane.
bool isMapped(const MapData& map, const PlaneLayer& layer) {
  const double s = map.resolution();
  std::size_t looked = 0, mapped = 0;
  layer.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
    forEachBit(tile.occupied(), [&](std::size_t bit) {
      const double a = 8.0 * ta + static_cast<double>(bit & 7u) + 0.5;
      const double b = 8.0 * tb + static_cast<double>(bit >> 3u) + 0.5;
      ++looked;
      mapped += isMapped(map, layer.frame().fromPlane({a * s, b * s, 0.0})) ? 1 : 0;
    });
  });
  return 2 * mapped > looked;
}

/// Do the points behind the moments spread over less than a plane needs that is to be told from
/// what the map has already?
bool isSmall(const MapData& map, const PlaneMoments::Fit& fit) {
  const double s = map.resolution();
  const Vector3 spread = fit.eigenvalues.cwiseMax(0.0).cwiseSqrt();  // of a side a: a / sqrt(12)
  return 12.0 * spread[1] * spread[2] < kMinCells * s * s;
}

/// Are the points of a segment that is on no plane of the map a plane of it, or just cells?
bool isPlane(const MapData& map, const Frame& frame, std::size_t segment) {
  const PlaneMoments::Fit fit = frame.moments[segment].fit();
  if (isSmall(map, fit) && isMapped(map, frame, segment)) return false;
  // Where the depth error is known, the search for planes has tested the roughness.
  return frame.observation->noise ||
         fit.rms <= std::max(kHarmlessScatter * map.resolution(),
                             kMaxRoughness * std::sqrt(std::max(0.0, fit.eigenvalues[1])));
}

/// Root mean square distance of the points behind the moments to a plane.
double rmsDistance(const PlaneMoments& moments, const Plane& plane) {
  if (!(moments.weight() > 0.0)) return INFINITY;
  const double mean = plane.signedDistance(moments.mean());
  const double spread = plane.normal.dot(moments.scatter() * plane.normal) / moments.weight();
  return std::sqrt(mean * mean + std::max(0.0, spread));
}

/// Of two planes: radians, and metres at a point.
struct Apart {
  double angle = 0.0;
  double offset = 0.0;
};

/// One standard deviation of a fitted plane.
Apart uncertaintyAt(const PlaneMoments& moments, const Vector3& point) {
  const PlaneMoments::Fit fit = moments.fit();
  if (!fit.valid) return {};
  const Matrix4 covariance = moments.planeCovariance(fit);
  const Vector4 p(point.x(), point.y(), point.z(), 1.0);
  return {std::sqrt(std::max(0.0, covariance.topLeftCorner<3, 3>().trace())),
          std::sqrt(std::max(0.0, p.dot(covariance * p)))};
}

/// Tolerances widened by two standard deviations, at most doubled.
Apart toleranceAt(const PlanarMapParams& params, const PlaneMoments& map_plane,
                  const PlaneMoments& seen) {
  const Apart m = uncertaintyAt(map_plane, seen.mean());
  const Apart s = uncertaintyAt(seen, seen.mean());
  return {
      params.association_angle + std::min(2.0 * (m.angle + s.angle), params.association_angle),
      params.association_offset + std::min(2.0 * (m.offset + s.offset), params.association_offset)};
}

/// Within one frame, and between planes of the map, no error of the pose excuses an offset.
double noiseTolerance(const PlanarMapParams& params, double rms_a, double rms_b) {
  return std::min(params.association_offset,
                  std::max(0.25 * params.approximation.resolution, 3.0 * (rms_a + rms_b)));
}
bool isOnePlane(const PlanarMapParams& params, const Plane& plane_a, const PlaneMoments& a,
                const Plane& plane_b, const PlaneMoments& b) {
  // What is cheap first: most planes of a map are nowhere near.
  if (!(angleBetween(plane_a.normal, plane_b.normal) <= params.association_angle)) return false;
  const double apart = std::max(rmsDistance(a, plane_b), rmsDistance(b, plane_a));
  return apart <= params.association_offset &&
         apart <= noiseTolerance(params, a.fit().rms, b.fit().rms);
}

std::int32_t gapInCells(const MapData& map) {
  const double cells = std::ceil(map.params.association_gap / map.resolution());
  return static_cast<std::int32_t>(std::clamp(cells, 1.0, 1.0 * kLatticeLimit));
}

bool isNear(const MapData& map, const Frame& frame, std::size_t segment, const PlaneLayer& layer) {
  const std::int32_t gap = gapInCells(map);
  return anySample(frame, segment, [&](const Vector3& world) {
    std::int32_t a = 0, b = 0;
    return layer.cellOf(world, map.resolution(), a, b) && layer.raster.anyWithin(a, b, gap);
  });
}

/// Do the bounding rectangles, in the raster of the first? Else areNear() is false. This asks for
/// neither cells nor moments: most planes of a map are elsewhere.
bool mayBeNear(const MapData& map, const PlaneLayer& layer, const PlaneLayer& other) {
  const TileWindow own = layer.extent();
  const TileWindow w = other.extent();
  if (own.empty() || w.empty()) return false;
  const double s = map.resolution();
  Eigen::AlignedBox2d corners;
  for (const std::int32_t a : {w.low_a, w.high_a + 1}) {
    for (const std::int32_t b : {w.low_b, w.high_b + 1}) {
      const Vector3 corner = layer.frame().toPlane(other.frame().fromPlane({a * s, b * s, 0.0}));
      corners.extend(corner.head<2>() / s);
    }
  }
  const double margin = gapInCells(map) + 1.0;  // and one for what is rounded
  const Eigen::Vector2d low(own.low_a - margin, own.low_b - margin);
  const Eigen::Vector2d high(own.high_a + 1 + margin, own.high_b + 1 + margin);
  return corners.intersects(Eigen::AlignedBox2d(low, high));
}

/// Do the patches of two planes of the map come within the association gap of each other?
bool areNear(const MapData& map, const PlaneLayer& layer, const PlaneLayer& other) {
  const std::int32_t gap = gapInCells(map);
  const double s = map.resolution();
  bool near = false;
  other.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
    if (near) return;
    const int bit = __builtin_ctzll(tile.occupied());
    const Vector3 centre = other.frame().fromPlane(
        {(8 * ta + (bit & 7) + 0.5) * s, (8 * tb + (bit >> 3) + 0.5) * s, 0.0});
    std::int32_t a = 0, b = 0;
    near = layer.cellOf(centre, s, a, b) && layer.raster.anyWithin(a, b, gap);
  });
  return near;
}

/// Takes the cells of \p other over. Every cell of the receiving raster asks which cell of the
/// other lies at its centre: the other way round would leave holes.
/// \param join  (belief here, belief there): that of a cell of both
template <typename Join>
void takeCells(const MapData& map, PlaneLayer& layer, const PlaneLayer& other, Join&& join) {
  const double s = map.resolution();
  other.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& from) {
    const Vector3 middle = other.frame().fromPlane({(8 * ta + 4) * s, (8 * tb + 4) * s, 0.0});
    std::int32_t ma = 0, mb = 0;
    if (!layer.cellOf(middle, s, ma, mb)) return;
    // A tile turned by any angle reaches 6 cells from its middle.
    for (std::int32_t b = mb - 7; b <= mb + 7; ++b) {
      for (std::int32_t a = ma - 7; a <= ma + 7; ++a) {
        const Vector3 centre = layer.frame().fromPlane({(a + 0.5) * s, (b + 0.5) * s, 0.0});
        std::int32_t oa = 0, ob = 0;
        if (!other.cellOf(centre, s, oa, ob) || (oa >> 3) != ta || (ob >> 3) != tb) continue;
        const int bit = 8 * (ob & 7) + (oa & 7);
        if (((from.occupied() >> bit) & 1u) == 0) continue;
        const std::uint8_t belief = from.belief(static_cast<std::size_t>(bit));
        const auto own_bit = static_cast<std::size_t>(8 * (b & 7) + (a & 7));
        const RasterTile* own = layer.raster.find(a >> 3, b >> 3);
        const bool known = own != nullptr && (own->occupied() >> own_bit & 1u) != 0;
        const std::uint8_t joined = known ? join(own->belief(own_bit), belief) : belief;
        if (!known || joined != own->belief(own_bit)) layer.setCell(a, b, joined);
      }
    }
  });
}

/// Of a cell of two planes of the same map: what saw it is the same.
std::uint8_t larger(std::uint8_t a, std::uint8_t b) {
  return std::max(a, b);
}

/// How the rasters of new floors and table tops are turned; see dominantDirection().
Vector3 directionOfWalls(const MapData& map, const Frame& frame) {
  if (map.params.approximation.profile == Profile::Paper) return Vector3::Zero();
  std::vector<Plane> planes = frame.planes;
  std::vector<double> weights;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    weights.push_back(static_cast<double>(frame.inliersOf(k).size()));
  }
  for (const PlaneLayer& layer : map.planes) {
    planes.push_back(layer.plane());
    weights.push_back(layer.moments().weight());
  }
  return dominantDirection(planes, weights, map.params.approximation.up);
}

/// A plane that was seen on a plane of the map, by their numbers.
struct Association {
  std::size_t plane;
  std::size_t layer;
};

/// On which plane of the map each of the planes lies that were seen together, the most alike first;
/// two that are told apart by what saw them are not on one.
/// \param near  (number, layer): does it come within the association gap of the layer's cells?
template <typename Near>
std::vector<Association> associationsOf(const MapData& map, const std::vector<Plane>& planes,
                                        const std::vector<PlaneMoments>& moments, Near&& near) {
  struct Pair {
    double score;
    std::size_t plane;
    std::size_t layer;
  };
  std::vector<Pair> pairs;
  const double least_cosine = std::cos(2.0 * map.params.association_angle) - kCosineRounding;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const double own = moments[k].fit().rms;
    for (std::size_t l = 0; l < map.planes.size(); ++l) {
      const PlaneLayer& layer = map.planes[l];
      // What is cheap first: most planes of a map are nowhere near.
      if (planes[k].normal.dot(layer.plane().normal) < least_cosine) continue;
      const double angle = angleBetween(planes[k].normal, layer.plane().normal);
      if (angle > 2.0 * map.params.association_angle) continue;
      const double offset = rmsDistance(moments[k], layer.plane());
      if (!(offset <= 2.0 * map.params.association_offset + 3.0 * own)) continue;
      // Its own noise is no reason to doubt that it lies on the plane.
      const double apart = std::sqrt(std::max(0.0, offset * offset - own * own));
      if (!near(k, layer)) continue;
      const Apart tolerance = toleranceAt(map.params, layer.moments(), moments[k]);
      if (angle > tolerance.angle || apart > tolerance.offset) continue;
      pairs.push_back({angle / tolerance.angle + apart / tolerance.offset, k, l});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& x, const Pair& y) {
    return std::tie(x.score, x.plane, x.layer) < std::tie(y.score, y.plane, y.layer);
  });
  std::vector<Association> associations;
  std::vector<bool> is_associated(planes.size(), false);
  std::vector<std::vector<std::size_t>> on(map.planes.size());  // each plane of the map
  for (const Pair& pair : pairs) {
    if (is_associated[pair.plane]) continue;
    std::vector<std::size_t>& others = on[pair.layer];
    const bool is_one = std::all_of(others.begin(), others.end(), [&](std::size_t other) {
      return isOnePlane(map.params, planes[pair.plane], moments[pair.plane], planes[other],
                        moments[other]);
    });
    if (!is_one) continue;
    others.push_back(pair.plane);
    is_associated[pair.plane] = true;
    associations.push_back({pair.plane, pair.layer});
  }
  return associations;
}

PlaneHits& hitsOf(std::size_t layer, Frame& frame) {
  const auto hits = std::find_if(frame.hits.begin(), frame.hits.end(),
                                 [&](const PlaneHits& h) { return h.layer == layer; });
  if (hits != frame.hits.end()) return *hits;
  frame.hits.push_back({layer, false, {}, {}});
  return frame.hits.back();
}

}  // namespace

bool isMapped(const MapData& map, const Vector3& world) {
  const double s = map.resolution();
  const Vector3 at = (world / s).array().floor();
  if (!(at.cwiseAbs().maxCoeff() < kLatticeLimit)) return false;
  const Int3 cell = toInt3(at);
  const CellBlock* block = map.cells.find(CellLayer::blockOf(cell));
  if (block != nullptr && ((block->occupied() >> CellLayer::bitOf(cell)) & 1u) != 0) return true;
  return std::any_of(map.planes.begin(), map.planes.end(), [&](const PlaneLayer& layer) {
    std::int32_t a = 0, b = 0;
    return std::abs(layer.plane().signedDistance(world)) <= s && layer.cellOf(world, s, a, b) &&
           layer.raster.at(a, b);
  });
}

void associatePlanes(MapData& map, Frame& frame) {
  const std::size_t segments = frame.planes.size();
  std::vector<bool> assigned(segments, false);
  const auto near = [&](std::size_t k, const PlaneLayer& layer) {
    return !frame.inliersOf(k).empty() && isNear(map, frame, k, layer);
  };
  for (const Association& found : associationsOf(map, frame.planes, frame.moments, near)) {
    hitsOf(found.layer, frame).segments.push_back(found.plane);
    assigned[found.plane] = true;
    ++frame.update.planes_matched;
  }
  std::optional<Vector3> along;  // asks every plane of the map
  const std::size_t clutter = frame.non_planar.size();
  for (std::size_t k = 0; k < segments; ++k) {
    const Indices& inliers = frame.inliersOf(k);
    if (assigned[k] || inliers.empty()) continue;
    if (map.isCompact() && !isPlane(map, frame, k)) {
      frame.non_planar.insert(frame.non_planar.end(), inliers.begin(), inliers.end());
      continue;
    }
    if (!along) along = directionOfWalls(map, frame);
    PlaneLayer layer;
    layer.id = map.next_plane_id++;
    layer.setFrame(
        makePlaneFrame(frame.planes[k], frame.sensor, map.params.approximation.up, *along));
    map.planes.push_back(std::move(layer));
    frame.hits.push_back({map.planes.size() - 1, true, {k}, {}});
    ++frame.update.planes_new;
  }
  if (frame.non_planar.size() > clutter) {
    std::sort(frame.non_planar.begin(), frame.non_planar.end());
  }
}

void mergePlanes(MapData& map, Frame& frame) {
  // Of the angle: isOnePlane() asks again.
  const double least_cosine = std::cos(map.params.association_angle) - kCosineRounding;
  std::vector<bool> gone(map.planes.size(), false);
  std::vector<std::size_t> into(map.planes.size(), 0);  // of those that are gone
  std::vector<bool> is_new(map.planes.size(), false);
  for (const PlaneHits& hits : frame.hits) is_new[hits.layer] = hits.is_new;
  for (PlaneHits& hits : frame.hits) {
    for (std::size_t other = 0; other < map.planes.size(); ++other) {
      const std::size_t mine = hits.layer;
      if (other == mine || gone[other] || gone[mine] || (is_new[other] && is_new[mine])) continue;
      const PlaneLayer& a = map.planes[mine];
      const PlaneLayer& b = map.planes[other];
      if (a.plane().normal.dot(b.plane().normal) < least_cosine || !mayBeNear(map, a, b) ||
          !isOnePlane(map.params, a.plane(), a.moments(), b.plane(), b.moments()) ||
          !areNear(map, a, b)) {
        continue;
      }
      // The older plane keeps its id and its raster.
      const std::size_t kept = std::min(mine, other);
      const std::size_t merged = std::max(mine, other);
      PlaneLayer& layer = map.planes[kept];
      takeCells(map, layer, map.planes[merged], larger);
      PlaneMoments moments = layer.moments();
      moments.merge(map.planes[merged].moments());
      layer.setMoments(moments);
      layer.frames = std::max(layer.frames, map.planes[merged].frames);
      gone[merged] = true;
      into[merged] = kept;
      ++frame.update.planes_merged;
      if (merged == mine) hits.layer = kept;
    }
  }
  if (std::none_of(gone.begin(), gone.end(), [](bool is_gone) { return is_gone; })) return;
  for (std::size_t l = 0; l < map.planes.size(); ++l) {
    if (!gone[l])
      map.planes[l].refit(map.resolution(), map.params.refit_tolerance * map.resolution());
  }
  std::vector<std::size_t> place(map.planes.size(), 0);
  std::size_t kept = 0;
  for (std::size_t l = 0; l < map.planes.size(); ++l) {
    place[l] = kept;
    if (gone[l]) continue;
    if (kept != l) map.planes[kept] = std::move(map.planes[l]);
    ++kept;
  }
  map.planes.resize(kept);
  for (PlaneHits& hits : frame.hits) {
    while (gone[hits.layer]) hits.layer = into[hits.layer];
    hits.layer = place[hits.layer];
  }
}

std::vector<PlaneLayer> joinPlanes(MapData& map, std::vector<PlaneLayer> others, Frame& frame) {
  std::vector<Plane> planes;
  std::vector<PlaneMoments> moments;
  for (const PlaneLayer& other : others) {
    planes.push_back(other.plane());
    moments.push_back(other.moments());
  }
  const auto near = [&](std::size_t k, const PlaneLayer& layer) {
    return mayBeNear(map, layer, others[k]) && areNear(map, layer, others[k]);
  };
  std::vector<bool> is_taken(others.size(), false);
  for (const Association& found : associationsOf(map, planes, moments, near)) {
    hitsOf(found.layer, frame).segments.push_back(found.plane);
    is_taken[found.plane] = true;
  }
  frame.update.planes_new += others.size();
  std::vector<PlaneLayer> loose;
  std::vector<PlaneLayer> added;
  for (std::size_t k = 0; k < others.size(); ++k) {
    if (is_taken[k]) continue;
    const bool is_loose =
        map.isCompact() && isSmall(map, moments[k].fit()) && isMapped(map, others[k]);
    (is_loose ? loose : added).push_back(others[k]);
  }
  for (const PlaneHits& hits : frame.hits) {
    PlaneLayer& layer = map.planes[hits.layer];
    PlaneMoments all = layer.moments();
    for (const std::size_t k : hits.segments) {
      all.merge(moments[k]);
      layer.frames += others[k].frames;
    }
    layer.setMoments(all);
    layer.refit(map.resolution(), map.params.refit_tolerance * map.resolution());
    for (const std::size_t k : hits.segments) takeCells(map, layer, others[k], joinedBelief);
  }
  for (PlaneLayer& layer : added) {
    layer.id = map.next_plane_id++;
    layer.raster.markAllDirty();
    frame.hits.push_back({map.planes.size(), true, {}, {}});
    map.planes.push_back(std::move(layer));
  }
  frame.update.planes_merged += others.size() - added.size();
  return loose;
}

}  // namespace planar_mapping::detail
