// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "plane_layer.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace planar_mapping::detail {
namespace {

void put(const RoundedNumber& number, PackWriter& out) {
  out.number(number.mantissa);
  if (number.mantissa != 0) out.difference(number.exponent);
}
RoundedNumber takeRounded(PackReader& in) {
  RoundedNumber number;
  number.mantissa = in.as<std::uint16_t>();
  if (number.mantissa != 0) number.exponent = in.differenceAs<std::int16_t>();
  return number;
}

void put(const PlaneState& state, PackWriter& out) {
  out.number(state.frames);
  out.number(state.frame_revision);
  const StoredPlane& p = state.stored;
  out.byte(p.axis);
  for (const std::int32_t n : p.normal) out.difference(n);
  out.difference(p.turn);
  for (const std::int64_t o : p.origin) out.difference(o);
  put(p.weight, out);
  for (const std::int64_t m : p.mean) out.difference(m);
  for (const RoundedNumber& v : p.variance) put(v, out);
  out.difference(p.correlation);
  for (const std::int32_t slope : p.slope) out.difference(slope);
  put(p.residual, out);
}

PlaneState takeState(PackReader& in) {
  PlaneState state;
  state.frames = in.as<std::uint32_t>();
  state.frame_revision = in.as<std::uint32_t>();
  StoredPlane& p = state.stored;
  p.axis = in.byte();
  for (std::int32_t& n : p.normal) n = in.differenceAs<std::int32_t>();
  p.turn = in.differenceAs<std::int32_t>();
  for (std::int64_t& o : p.origin) o = in.difference();
  p.weight = takeRounded(in);
  for (std::int64_t& m : p.mean) m = in.difference();
  for (RoundedNumber& v : p.variance) v = takeRounded(in);
  p.correlation = in.differenceAs<std::int32_t>();
  for (std::int32_t& slope : p.slope) slope = in.differenceAs<std::int32_t>();
  p.residual = takeRounded(in);
  return state;
}

}  // namespace

PlaneLayer::PlaneLayer(const std::uint8_t* packed) {
  PackReader in(packed);
  id = in.as<std::int32_t>();
  state_ = takeState(in);
  raster_ = OpenRaster(in);
  changed_ = false;
}

bool PlaneLayer::pack(std::uint32_t revision, PackWriter& out) const {
  out.number(static_cast<std::uint64_t>(id));
  put(state_, out);
  return raster_.pack(revision, out);
}

bool PlaneLayer::settle() {
  if (!settled_) store(StoredPlane::from(frame_, moments()));
  return changed_ || raster_.dirtyPatches() > 0;
}

void PlaneLayer::store(const StoredPlane& plane) {
  if (!state_.stored.hasFrameOf(plane)) ++state_.frame_revision;
  state_.stored = plane;
  settled_ = true;
  changed_ = true;
}

void PlaneLayer::wake() {
  frame_ = state_.stored.frame();
  plane_ = planeOf(frame_);
}

const PlaneMoments& PlaneLayer::moments() const {
  if (!moments_) moments_ = state_.stored.moments(state_.stored.frame());
  return *moments_;
}

void PlaneLayer::setFrame(const PlaneFrame& wanted) {
  frame_ = wanted;
  plane_ = planeOf(wanted);
  settled_ = false;
}

void PlaneLayer::setMoments(const PlaneMoments& moments) {
  moments_ = moments;
  settled_ = false;
}

void PlaneLayer::setFrames(std::uint32_t frames) {
  state_.frames = frames;
  changed_ = true;
}

void PlaneLayer::restore(const StoredPlane& plane) {
  store(plane);
  wake();
  moments_.reset();
}

void PlaneLayer::setCell(std::int32_t a, std::int32_t b, std::uint8_t belief) {
  raster_.tileAt(a >> 3, b >> 3).setBelief(static_cast<std::size_t>(8 * (b & 7) + (a & 7)), belief);
  raster_.markDirty(a >> 3, b >> 3);
}

bool PlaneLayer::extent(std::int32_t& low_a, std::int32_t& low_b, std::int32_t& high_a,
                        std::int32_t& high_b) const {
  const TileWindow tiles = raster_.window();
  if (tiles.empty()) return false;
  low_a = 8 * tiles.low_a;
  low_b = 8 * tiles.low_b;
  high_a = 8 * tiles.high_a + 7;
  high_b = 8 * tiles.high_b + 7;
  return true;
}

bool PlaneLayer::bounds(double s, double thickness, Vector3& low, Vector3& high) const {
  std::int32_t low_a = 0, low_b = 0, high_a = 0, high_b = 0;
  if (!extent(low_a, low_b, high_a, high_b)) return false;
  const PlaneFrame& f = frame();
  const Vector3 middle = f.fromPlane(
      {0.5 * s * (low_a + high_a + 1), 0.5 * s * (low_b + high_b + 1), -0.5 * thickness});
  const Vector3 half = 0.5 * s * (high_a - low_a + 1) * f.u.cwiseAbs() +
                       0.5 * s * (high_b - low_b + 1) * f.v.cwiseAbs() +
                       0.5 * thickness * f.n.cwiseAbs();
  low = middle - half;
  high = middle + half;
  return true;
}

bool PlaneLayer::cellOf(const Vector3& point, double s, std::int32_t& a, std::int32_t& b) const {
  const PlaneFrame& f = frame();
  const Vector3 d = point - f.origin;
  const double u = std::floor(f.u.dot(d) / s);
  const double v = std::floor(f.v.dot(d) / s);
  if (!(std::abs(u) < kLatticeLimit) || !(std::abs(v) < kLatticeLimit)) return false;
  a = static_cast<std::int32_t>(u);
  b = static_cast<std::int32_t>(v);
  return true;
}

bool PlaneLayer::refit(double s, double tolerance) {
  const PlaneMoments::Fit fit = moments().fit();
  if (!fit.valid) return false;
  const Plane plane = fit.plane.normal.dot(frame().n) < 0.0 ? fit.plane.flipped() : fit.plane;
  std::int32_t low_a = 0, low_b = 0, high_a = 0, high_b = 0;
  if (!extent(low_a, low_b, high_a, high_b)) return false;
  double deviation = 0.0;
  for (const std::int32_t a : {low_a, high_a + 1}) {
    for (const std::int32_t b : {low_b, high_b + 1}) {
      const Vector3 corner = frame().fromPlane({a * s, b * s, 0.0});
      deviation = std::max(deviation, std::abs(plane.signedDistance(corner)));
    }
  }
  if (!(deviation > tolerance)) return false;

  // The new frame keeps the in-plane coordinates of the middle of the points.
  const PlaneFrame before = frame();
  const Vector3 middle = before.toPlane(moments().mean());
  const Vector3 along = before.u - plane.normal.dot(before.u) * plane.normal;
  if (!(along.norm() > 0.5)) return false;  // turned by more than any association allows
  PlaneFrame after;
  after.n = plane.normal;
  after.u = along.normalized();
  after.v = after.n.cross(after.u);
  const Vector3 mean = moments().mean();
  const Vector3 foot = mean - plane.signedDistance(mean) * after.n;
  after.origin = foot - middle.x() * after.u - middle.y() * after.v;
  setFrame(after);
  return true;
}

std::vector<PlaneLayer> RestingPlanes::open() const {
  std::vector<PlaneLayer> planes;
  const std::vector<PackedRecords::Record> records = records_.list();
  planes.reserve(records.size());
  for (const PackedRecords::Record& record : records) planes.emplace_back(record.data);
  return planes;
}

std::size_t RestingPlanes::close(std::vector<PlaneLayer> planes, std::uint32_t revision) {
  std::size_t dirty = 0;
  const std::vector<PackedRecords::Record> before = records_.list();
  PackedRecords::Change change(before);
  std::size_t next = 0;
  for (PlaneLayer& layer : planes) {
    dirty += layer.raster().dirtyPatches();
    if (layer.settle()) {
      PackWriter out;
      if (layer.pack(revision, out)) change.put(out.bytes);
      continue;
    }
    const auto idOf = [&](std::size_t r) { return PackReader(before[r].data).as<std::int32_t>(); };
    while (idOf(next) != layer.id) ++next;
    change.keep(next++);
  }
  records_.apply(change);
  return dirty;
}

}  // namespace planar_mapping::detail
