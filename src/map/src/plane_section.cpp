// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>

#include "belief.h"
#include "sections.h"

namespace planar_mapping::detail {
namespace {

void writePlane(const PlaneLayer& layer, ByteWriter& out) {
  out.varint(static_cast<std::uint64_t>(layer.info.id));
  out.varint(layer.info.frames);
  writeVector(out, layer.frame.origin);
  for (const float axis : layer.axes) out.f32(axis);
  const PlaneMoments& m = layer.info.moments;
  out.f64(m.weight());
  writeVector(out, m.mean());
  for (int r = 0; r < 3; ++r) {
    for (int c = r; c < 3; ++c) out.f32(static_cast<float>(m.scatter()(r, c)));
  }
  out.zigzag(layer.anchor_a / 8);
  out.zigzag(layer.anchor_b / 8);

  std::vector<CellBundle> bundles;
  for (std::size_t i = 0; i < layer.tiles.size(); ++i) {
    if (layer.tiles.value(i).occupied() == 0) continue;
    CellBundle b;
    unpackKey(layer.tiles.key(i), b.at.x, b.at.y);
    b.cells = layer.tiles.value(i).occupied();
    bundles.push_back(b);
  }
  writeTree(TreeKind::Quadtree, bundles, Label::Occupied, out);
  std::vector<std::uint8_t> beliefs;
  const RasterTile* tile = nullptr;
  Int3 last{INT32_MIN, 0, 0};
  forEachCell(TreeKind::Quadtree, bundles, [&](const CellBundle& b, int bit) {
    if (!(b.at == last)) tile = layer.tiles.find(packKey(b.at.x, b.at.y));
    last = b.at;
    beliefs.push_back(tile->belief(static_cast<std::size_t>(bit)));
  });
  writeRuns(beliefs, out);
}

PlaneLayer readPlane(ByteReader& in) {
  PlaneLayer layer;
  const std::uint64_t id = in.varint();
  const std::uint64_t frames = in.varint();
  if (id > INT32_MAX || frames > UINT32_MAX) in.fail("holds a number that is too large");
  layer.info.id = static_cast<std::int32_t>(id);
  layer.info.frames = static_cast<std::uint32_t>(frames);
  const Vector3 origin = readVector(in);
  PlaneAxes axes;
  for (float& axis : axes) axis = in.f32();
  const Vector3 u(axes[0], axes[1], axes[2]);
  const Vector3 n(axes[3], axes[4], axes[5]);
  constexpr double kTolerance = 1e-6;
  if (!(std::abs(u.norm() - 1.0) < kTolerance) || !(std::abs(n.norm() - 1.0) < kTolerance) ||
      !(std::abs(u.dot(n)) < kTolerance)) {
    in.fail("has a plane whose axes are not orthonormal");
  }
  layer.setFrame(origin, axes);
  const double weight = readFinite(in);
  const Vector3 mean = readVector(in);
  Matrix3 scatter;
  for (int r = 0; r < 3; ++r) {
    for (int c = r; c < 3; ++c) {
      scatter(r, c) = scatter(c, r) = in.f32();
      if (!std::isfinite(scatter(r, c))) in.fail("holds a number that is not finite");
    }
  }
  if (weight < 0.0) in.fail("has a plane of negative weight");
  layer.info.moments = PlaneMoments::fromSums(weight, Vector3::Zero(), scatter, mean);
  layer.anchor_a = 8 * in.within(-2 * kLatticeLimit / 8, 2 * kLatticeLimit / 8);
  layer.anchor_b = 8 * in.within(-2 * kLatticeLimit / 8, 2 * kLatticeLimit / 8);

  const std::vector<CellBundle> bundles = readTree(TreeKind::Quadtree, Label::Occupied, in);
  std::vector<std::uint8_t> beliefs;
  readRuns(countCells(bundles), in, [&](std::uint8_t value) { beliefs.push_back(value); });
  std::size_t next = 0;
  RasterTile* tile = nullptr;
  Int3 last{INT32_MIN, 0, 0};
  forEachCell(TreeKind::Quadtree, bundles, [&](const CellBundle& b, int bit) {
    if (!(b.at == last)) {
      tile = &layer.tileAt(b.at.x, b.at.y);
      layer.markDirty(b.at.x, b.at.y);
    }
    last = b.at;
    tile->setBelief(static_cast<std::size_t>(bit), beliefs[next++]);
  });
  return layer;
}

}  // namespace

void writePlanes(const MapData& map, ByteWriter& out) {
  out.varint(static_cast<std::uint64_t>(map.next_plane_id));
  out.varint(map.planes.size());
  for (const PlaneLayer& layer : map.planes) writePlane(layer, out);
}

void readPlanes(MapData& map, ByteReader& in) {
  const std::uint64_t next = in.varint();
  if (next > INT32_MAX) in.fail("holds a number that is too large");
  map.next_plane_id = static_cast<std::int32_t>(next);
  constexpr std::size_t kSmallestPlane = 7 * 8 + 12 * 4 + 8;
  const std::size_t n = in.count(kSmallestPlane);
  for (std::size_t i = 0; i < n; ++i) {
    map.planes.push_back(readPlane(in));
    const std::int32_t id = map.planes[i].info.id;
    if (id >= map.next_plane_id || (i > 0 && id <= map.planes[i - 1].info.id)) {
      in.fail("has plane numbers that do not ascend");
    }
  }
  in.end();
}

}  // namespace planar_mapping::detail
