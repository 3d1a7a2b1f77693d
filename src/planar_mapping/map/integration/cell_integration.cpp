// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/integration/placed_cells.h"
#include "planar_mapping/map/store/belief.h"
#include "planar_mapping/map/store/lattice.h"
#include "planar_mapping/map/store/surface_band.h"

namespace planar_mapping::detail {
namespace {

/// A plane as the absorption test sees it: world coordinates in cells.
struct Cover {
  const PlaneLayer* layer = nullptr;
  double u[4];
  double v[4];
  double n[4];
  double front = 0.0;
  double back = 0.0;

  Cover(const MapData& map, const PlaneLayer& plane) : layer(&plane) {
    const double s = map.resolution();
    const SurfaceBand band = surfaceBand(map, plane.moments());
    front = band.front / s;
    back = band.back / s;
    const PlaneFrame& f = plane.frame();
    const auto fill = [&](double* row, const Vector3& axis) {
      for (int i = 0; i < 3; ++i) row[i] = axis[i];
      row[3] = -axis.dot(f.origin) / s;
    };
    fill(u, f.u);
    fill(v, f.v);
    fill(n, f.n);
  }
  static double along(const double* row, const double* p) {
    return row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
  }
  /// Does the point (in cells) lie within \p margin of the cuboid of an occupied cell, in front of
  /// it or behind it? Beside the cell there is no margin: the rectangles that cover a raster leave
  /// the tolerance along its border, where a point would come to lie twice as far from them.
  /// \param margin     in cells, at most 1/2
  /// \param at_a, at_b that cell
  bool contains(const double* p, double margin, std::int32_t& at_a, std::int32_t& at_b) const {
    const double height = along(n, p);
    if (!(height <= front + margin && height >= -back - margin)) return false;
    const double a = along(u, p);
    const double b = along(v, p);
    if (!(std::abs(a) < kLatticeLimit - 1) || !(std::abs(b) < kLatticeLimit - 1)) return false;
    at_a = static_cast<std::int32_t>(std::floor(a));
    at_b = static_cast<std::int32_t>(std::floor(b));
    return layer->raster.at(at_a, at_b);
  }
};

/// World coordinates of points and their cells: found twice, in batches, as keeping them takes more
/// than the cloud itself.
class WorldPoints {
 public:
  WorldPoints(const MapData& map, const Frame& frame) : view_(frame.observation->points) {
    const double per_cell = 1.0 / map.resolution();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) m_[4 * r + c] = frame.rotation(r, c) * per_cell;
      m_[4 * r + 3] = frame.sensor[r] * per_cell;
    }
  }
  /// Calls visit(i, coordinates, cell) for the points; x of the cell = kOutside: dropped.
  template <typename Visit>
  void forEach(const Indices& points, Visit&& visit) const {
    double xyz[3 * kBatch];
    std::int32_t cells[3 * kBatch];
    for (std::size_t begin = 0; begin < points.size(); begin += kBatch) {
      const std::size_t n = std::min(kBatch, points.size() - begin);
      worldCells(view_.data, view_.stride, points.data() + begin, n, m_, xyz, cells);
      for (std::size_t k = 0; k < n; ++k) visit(begin + k, xyz + 3 * k, cells + 3 * k);
    }
  }

 private:
  const PointsView& view_;
  double m_[12];
};

/// How far off its surface, along the ray, a point may be measured; all in cells.
class DepthTolerance {
 public:
  DepthTolerance(const MapData& map, const Frame& frame) {
    const double s = map.resolution();
    for (int i = 0; i < 3; ++i) sensor_[i] = frame.sensor[i] / s;
    if (!frame.observation->noise) return;
    const StereoNoise& noise = *frame.observation->noise;
    // dz / z = z dd / (B f): the fraction of the ray by which a point at depth z may be off.
    fraction_ = map.params.noise_factor * s * noise.depthError(1.0);
    for (int i = 0; i < 3; ++i) forward_[i] = frame.rotation(i, 2);
  }
  bool isNone() const { return fraction_ == 0.0; }
  /// Of a point, and of all points within \p radius of it.
  double at(const double* p, double radius = 0.0) const {
    const double z = radius + forward_[0] * (p[0] - sensor_[0]) +
                     forward_[1] * (p[1] - sensor_[1]) + forward_[2] * (p[2] - sensor_[2]);
    return z > 0.0 ? fraction_ * z * z : 0.0;
  }
  /// Moves the point along its ray onto a plane. \return false if that is too far
  bool moveOnto(const double* plane, const double* p, double* moved) const {
    double ray[3];
    for (int i = 0; i < 3; ++i) ray[i] = p[i] - sensor_[i];
    const double slope = plane[0] * ray[0] + plane[1] * ray[1] + plane[2] * ray[2];
    const double z = forward_[0] * ray[0] + forward_[1] * ray[1] + forward_[2] * ray[2];
    const double fraction = -Cover::along(plane, p) / slope;
    if (!(std::abs(fraction) <= fraction_ * z)) return false;  // false for a ray along the plane
    for (int i = 0; i < 3; ++i) moved[i] = p[i] + fraction * ray[i];
    return true;
  }

 private:
  double sensor_[3];
  double forward_[3] = {0.0, 0.0, 0.0};
  double fraction_ = 0.0;
};

/// A block with points of the frame.
struct HitBlock {
  std::uint32_t first_candidate = 0;  ///< planes that may cover points of the block
  std::uint32_t last_candidate = 0;
};

/// Planes that may cover points of each block.
std::vector<std::uint32_t> findCandidates(const std::vector<Cover>& covers, double margin,
                                          const DepthTolerance& tolerance, KeyMap<HitBlock>& hits) {
  std::vector<std::uint32_t> candidates;
  const double radius = 2.0 * std::sqrt(3.0);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Int3 block = unpackKey(hits.key(i));
    const double middle[3] = {4.0 * block.x + 2.0, 4.0 * block.y + 2.0, 4.0 * block.z + 2.0};
    const double reach = radius + margin + tolerance.at(middle, radius);
    HitBlock& hit = hits.value(i);
    hit.first_candidate = static_cast<std::uint32_t>(candidates.size());
    for (std::size_t c = 0; c < covers.size(); ++c) {
      const double height = Cover::along(covers[c].n, middle);
      if (height <= reach + covers[c].front && height >= -reach - covers[c].back) {
        candidates.push_back(static_cast<std::uint32_t>(c));
      }
    }
    hit.last_candidate = static_cast<std::uint32_t>(candidates.size());
  }
  return candidates;
}

/// Planes whose cells come near the box, in cells.
std::vector<Cover> coversNear(const MapData& map, const Eigen::AlignedBox3d& box) {
  std::vector<Cover> covers;
  const double s = map.resolution();
  const Eigen::AlignedBox3d metric(box.min() * s, box.max() * s);
  for (const PlaneLayer& layer : map.planes) {
    if (layer.bounds(s, map.thickness()).intersects(metric)) covers.emplace_back(map, layer);
  }
  return covers;
}

/// Removes cells that the planes touched in this frame cover now.
void removeCovered(MapData& map, Frame& frame) {
  if (map.cells.empty()) return;
  const double s = map.resolution();
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  for (const PlaneHits& hits : frame.hits) {
    const PlaneLayer& layer = map.planes[hits.layer];
    const Cover cover(map, layer);
    for (const std::uint64_t key : hits.tiles.keys()) {
      std::int32_t ta = 0, tb = 0;
      unpackKey(key, ta, tb);
      const Vector3 middle =
          layer.frame().fromPlane({(8 * ta + 4) * s, (8 * tb + 4) * s, 0.0}) / s +
          0.5 * (cover.front - cover.back) * layer.frame().n;
      const Vector3 half = 4.0 * layer.frame().u.cwiseAbs() + 4.0 * layer.frame().v.cwiseAbs() +
                           0.5 * (cover.front + cover.back) * layer.frame().n.cwiseAbs();
      const Vector3 low = ((middle - half) / 4.0).array().floor();
      const Vector3 high = ((middle + half) / 4.0).array().floor();
      if (!(low.cwiseAbs().maxCoeff() < kLatticeLimit / 4) ||
          !(high.cwiseAbs().maxCoeff() < kLatticeLimit / 4)) {
        continue;
      }
      forEachPlace(toInt3(low), toInt3(high), [&](const Int3& at) {
        CellBlock* block = map.cells.find(at);
        if (block == nullptr) return;
        for (std::uint64_t bits = block->occupied(); bits != 0; bits &= bits - 1) {
          const int bit = __builtin_ctzll(bits);
          const Int3 c = CellLayer::cellOf(at, bit);
          const double centre[3] = {c.x + 0.5, c.y + 0.5, c.z + 0.5};
          std::int32_t a = 0, b = 0;
          if (!cover.contains(centre, 0.0, a, b)) continue;
          block->remove(static_cast<std::size_t>(bit));
          map.cells.markDirty(at, frame_number);
          ++frame.update.cells_removed;
        }
      });
    }
  }
}

/// \param key  of the block
void applyHits(MapData& map, Frame& frame, std::uint64_t key, const BlockHits& hit) {
  const PlanarMapParams& params = map.params;
  const bool believed = frame.observation->probability != nullptr;
  const bool with_mean = !map.isCompact();
  const auto enough = static_cast<std::uint32_t>(params.approximation.min_points_per_cell);
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  const Int3 at = unpackKey(key);
  CellBlock* block = map.cells.find(at);
  bool changed = false;
  std::uint64_t seen = 0;
  const Vector3 middle =
      4.0 * map.resolution() * (Vector3(at.x, at.y, at.z) + Vector3::Constant(0.5));
  // A cloud on its own is covered whole: nothing will confirm what there is little of.
  const bool is_whole = frame_number == 0 && frame.images.size() > 1;
  const double min_count = is_whole ? 0.0 : frame.pointsToBeSeen(params, middle, 1.0);
  for (std::size_t bit = 0; bit < 64; ++bit) {
    const std::uint32_t count = hit.count[bit];
    if (count == 0) continue;
    if (count < min_count) {
      frame.update.dropped_points += count;
      continue;
    }
    const double q = believed ? static_cast<double>(hit.belief[bit]) / count : 1.0;
    const std::uint64_t flag = std::uint64_t{1} << bit;
    seen |= flag;
    const bool known = block != nullptr && (block->occupied() & flag) != 0;
    const std::uint8_t before = known ? block->belief(bit) : 0;
    const std::uint8_t after =
        known ? afterHit(before, q, params.belief_gain)
              : quantiseBelief(std::min(q, std::max(params.first_belief, params.min_probability)));
    if (!known && (count < enough || !isKept(after, params.min_probability))) {
      frame.update.dropped_points += count;
      continue;
    }
    if (!known) {
      if (block == nullptr) block = &map.cells.blockAt(at);
      ++frame.update.cells_added;
    }
    // Each profile keeps what its cuboids are made from, which is what the file holds.
    const int before_octants = known ? block->octants(bit) : 0;
    const auto octants =
        static_cast<std::uint8_t>(with_mean ? 0 : before_octants | hit.octants[bit]);
    changed |= after != before || octants != before_octants;
    if (!isKept(after, params.min_probability)) {
      block->remove(bit);
      ++frame.update.cells_removed;
      continue;
    }
    block->setBelief(bit, after);
    if (!with_mean) {
      block->setOctants(bit, octants);
      continue;
    }
    const CellBlock::Mean before_mean = known ? block->mean(bit) : CellBlock::Mean{};
    CellBlock::Mean after_mean{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double fresh = hit.mean[bit][axis] / count;
      const double old = (before_mean[axis] + 0.5) / 256.0;
      const double mean = known ? old + params.belief_gain * (fresh - old) : fresh;
      after_mean[axis] = static_cast<std::uint8_t>(std::clamp(256.0 * mean, 0.0, 255.0));
    }
    changed |= after_mean != before_mean;
    block->setMean(bit, after_mean);
  }
  frame.cell_hits[key] |= seen;
  if (changed) map.cells.markDirty(at, frame_number);
}

void addPoint(const MapData& map, const Frame& frame, int point, const double* p,
              const std::int32_t* c, BlockHits& hit) {
  const auto bit = static_cast<std::size_t>(CellLayer::bitOf({c[0], c[1], c[2]}));
  ++hit.count[bit];
  const int octant =
      (p[0] - c[0] >= 0.5 ? 1 : 0) + (p[1] - c[1] >= 0.5 ? 2 : 0) + (p[2] - c[2] >= 0.5 ? 4 : 0);
  hit.octants[bit] |= static_cast<std::uint8_t>(1 << octant);
  const std::vector<float>* belief = frame.observation->probability;
  if (belief != nullptr) hit.belief[bit] += (*belief)[static_cast<std::size_t>(point)];
  if (map.isCompact()) return;
  if (hit.mean.empty()) hit.mean.resize(64);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    hit.mean[bit][axis] += static_cast<float>(p[axis] - c[axis]);
  }
}

/// Are all eighths of a cell that hold points within absorption of the plane? Of a cell without
/// eighths: is its middle in the plane's cuboids?
bool isCovered(const MapData& map, const CellBlock& block, std::size_t bit, const Int3& cell,
               const std::vector<const Cover*>& covers) {
  const auto anyContains = [&](const double* p, double margin) {
    std::int32_t a = 0, b = 0;
    return std::any_of(covers.begin(), covers.end(),
                       [&](const Cover* cover) { return cover->contains(p, margin, a, b); });
  };
  if (!map.isCompact()) {
    const double middle[3] = {cell.x + 0.5, cell.y + 0.5, cell.z + 0.5};
    return anyContains(middle, 0.0);
  }
  bool is_covered = true;
  forEachPartOf(map, block, bit, cell, [&](const Vector3& part) {
    is_covered = is_covered && anyContains(part.data(), map.params.approximation.absorption);
  });
  return is_covered;
}

}  // namespace

void absorbCells(MapData& map, const Eigen::AlignedBox3d& box, Frame& frame) {
  if (map.cells.empty() || box.isEmpty()) return;
  const double s = map.resolution();
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  const std::vector<Cover> covers = coversNear(map, {box.min() / s, box.max() / s});
  const double radius = 2.0 * std::sqrt(3.0) + map.params.approximation.absorption;
  std::vector<const Cover*> near;
  for (std::size_t r = 0; r < map.cells.regions.size(); ++r) {
    const Int3 region = unpackKey(map.cells.regions.key(r));
    const Int3& anchor = map.cells.anchor;
    const Vector3 low = s * (kRegionCells * Vector3(region.x, region.y, region.z) +
                             Vector3(anchor.x, anchor.y, anchor.z));
    if (!box.intersects({low, low + Vector3::Constant(s * kRegionCells)})) continue;
    KeyMap<CellBlock>& blocks = map.cells.regions.value(r).blocks;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const Int3 at = unpackKey(blocks.key(i));
      const Vector3 corner = 4.0 * s * Vector3(at.x, at.y, at.z);
      if (!box.intersects({corner, corner + Vector3::Constant(4.0 * s)})) continue;
      const double middle[3] = {4.0 * at.x + 2.0, 4.0 * at.y + 2.0, 4.0 * at.z + 2.0};
      near.clear();
      for (const Cover& cover : covers) {
        const double height = Cover::along(cover.n, middle);
        if (height <= radius + cover.front && height >= -radius - cover.back)
          near.push_back(&cover);
      }
      if (near.empty()) continue;
      CellBlock& block = blocks.value(i);
      bool changed = false;
      forEachBit(block.occupied(), [&](std::size_t bit) {
        if (!isCovered(map, block, bit, CellLayer::cellOf(at, static_cast<int>(bit)), near)) return;
        block.remove(bit);
        changed = true;
        ++frame.update.cells_removed;
      });
      if (changed) map.cells.markDirty(at, frame_number);
    }
  }
}

void integrateCells(MapData& map, Frame& frame) {
  removeCovered(map, frame);
  if (frame.non_planar.empty()) return;
  const WorldPoints points(map, frame);
  constexpr std::uint32_t kNoBlock = UINT32_MAX;
  std::vector<std::uint32_t> block_of(frame.non_planar.size(), kNoBlock);
  std::vector<std::uint32_t> first(1, 0);  // of the points of each block, and the end

  KeyMap<HitBlock> hits;
  Eigen::AlignedBox3d bounds;
  Int3 last{INT32_MIN, 0, 0};
  std::size_t index = 0;
  points.forEach(frame.non_planar, [&](std::size_t i, const double*, const std::int32_t* c) {
    if (c[0] == kOutside) {
      ++frame.update.dropped_points;
      ++frame.update.points_beyond;
      return;
    }
    const Int3 block = CellLayer::blockOf({c[0], c[1], c[2]});
    if (!(block == last)) {
      index = hits.insert(packKey(block));
      last = block;
      first.resize(hits.size() + 1, 0);
      const Vector3 low = 4.0 * Vector3(block.x, block.y, block.z);
      bounds.extend(low).extend(low + Vector3::Constant(4.0));
    }
    block_of[i] = static_cast<std::uint32_t>(index);
    ++first[index + 1];
  });
  if (hits.empty()) return;
  if (map.cells.empty()) {
    const auto middle = [](double coordinate) {
      return 4 * static_cast<std::int32_t>(std::floor(coordinate / 4.0)) - kRegionCells / 2;
    };
    const Vector3 sensor = (frame.sensor / map.resolution())
                               .cwiseMax(-0.9 * kLatticeLimit)
                               .cwiseMin(0.9 * kLatticeLimit);
    map.cells.anchor = {middle(sensor.x()), middle(sensor.y()), middle(sensor.z())};
  }

  const double margin = map.params.approximation.absorption;
  const DepthTolerance tolerance(map, frame);
  std::vector<Cover> covers;
  std::vector<std::uint32_t> candidates;
  if (map.isCompact()) {
    covers = coversNear(map, bounds);
    candidates = findCandidates(covers, margin, tolerance, hits);
    frame.absorbed.resize(map.planes.size());
  }
  // Block by block, in the order of their first points: counts for all of them at once would take
  // half a kilobyte for each.
  for (std::size_t b = 0; b < hits.size(); ++b) first[b + 1] += first[b];
  Indices order(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < block_of.size(); ++i) {
    if (block_of[i] != kNoBlock) order[next[block_of[i]]++] = frame.non_planar[i];
  }
  block_of = next = std::vector<std::uint32_t>();
  std::size_t block = 0;
  BlockHits hit;
  points.forEach(order, [&](std::size_t k, const double* p, const std::int32_t* c) {
    if (k == first[block + 1]) {
      applyHits(map, frame, hits.key(block++), hit);
      hit = BlockHits();
    }
    const HitBlock& near = hits.value(block);
    bool absorbed = false;
    for (std::uint32_t i = near.first_candidate; i < near.last_candidate && !absorbed; ++i) {
      const Cover& cover = covers[candidates[i]];
      std::int32_t a = 0, b = 0;
      absorbed = cover.contains(p, margin, a, b);
      double moved[3];
      if (!absorbed && !tolerance.isNone() && tolerance.moveOnto(cover.n, p, moved)) {
        absorbed = cover.contains(moved, margin, a, b);
      }
      if (absorbed) {
        frame.absorbed[static_cast<std::size_t>(cover.layer - map.planes.data())]
                      [packKey(a >> 3, b >> 3)] |= std::uint64_t{1} << (8 * (b & 7) + (a & 7));
      }
    }
    if (absorbed) {
      ++frame.update.absorbed_points;
    } else {
      addPoint(map, frame, order[k], p, c, hit);
    }
  });
  applyHits(map, frame, hits.key(block), hit);
}

}  // namespace planar_mapping::detail
