// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/plane_layer.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace planar_mapping::detail {
namespace {

// How large the numbers of a plane mostly are, as powers of two (BitWriter).
constexpr unsigned kFrames = 2;
constexpr unsigned kRevision = 1;
constexpr unsigned kNormal = 11;
constexpr unsigned kTurn = 15;
constexpr unsigned kOrigin = 12;
constexpr unsigned kMean = 4;
constexpr unsigned kHeight = 1;  // of the mean above the plane
constexpr unsigned kExponent = 4;
constexpr unsigned kCorrelation = 4;
constexpr unsigned kSlope = 6;

void put(const RoundedNumber& number, unsigned mantissa_bits, BitWriter& out) {
  out.number(number.mantissa, mantissa_bits - 1);
  if (number.mantissa != 0) out.difference(number.exponent, kExponent);
}
RoundedNumber takeRounded(unsigned mantissa_bits, BitReader& in) {
  RoundedNumber number;
  number.mantissa = in.as<std::uint16_t>(mantissa_bits - 1);
  if (number.mantissa != 0) number.exponent = in.differenceAs<std::int16_t>(kExponent);
  return number;
}

void put(const PlaneState& state, BitWriter& out) {
  out.number(state.frames, kFrames);
  out.number(state.frame_revision, kRevision);
  const StoredPlane& p = state.stored;
  out.bits(p.axis, 3);
  for (const std::int32_t n : p.normal) out.difference(n, kNormal);
  out.bits(p.turn != 0 ? 1 : 0, 1);
  if (p.turn != 0) out.difference(p.turn, kTurn);
  for (const std::int64_t o : p.origin) out.difference(o, kOrigin);
  put(p.weight, StoredPlane::kWeightBits, out);
  for (std::size_t i = 0; i < 3; ++i) out.difference(p.mean[i], i < 2 ? kMean : kHeight);
  for (const RoundedNumber& v : p.variance) put(v, StoredPlane::kVarianceBits, out);
  out.difference(p.correlation, kCorrelation);
  for (const std::int32_t slope : p.slope) out.difference(slope, kSlope);
  put(p.residual, StoredPlane::kVarianceBits, out);
}

PlaneState takeState(BitReader& in) {
  PlaneState state;
  state.frames = in.as<std::uint32_t>(kFrames);
  state.frame_revision = in.as<std::uint32_t>(kRevision);
  StoredPlane& p = state.stored;
  p.axis = static_cast<std::uint8_t>(in.bits(3));
  for (std::int32_t& n : p.normal) n = in.differenceAs<std::int32_t>(kNormal);
  p.turn = in.bits(1) != 0 ? in.differenceAs<std::int32_t>(kTurn) : 0;
  for (std::int64_t& o : p.origin) o = in.difference(kOrigin);
  p.weight = takeRounded(StoredPlane::kWeightBits, in);
  for (std::size_t i = 0; i < 3; ++i) p.mean[i] = in.difference(i < 2 ? kMean : kHeight);
  for (RoundedNumber& v : p.variance) v = takeRounded(StoredPlane::kVarianceBits, in);
  p.correlation = in.differenceAs<std::int32_t>(kCorrelation);
  for (std::int32_t& slope : p.slope) slope = in.differenceAs<std::int32_t>(kSlope);
  p.residual = takeRounded(StoredPlane::kVarianceBits, in);
  return state;
}

}  // namespace

PlaneLayer::PlaneLayer(const std::uint8_t* packed) {
  PackReader in(packed);
  id = in.as<std::int32_t>();
  BitReader bits(in);
  state_ = takeState(bits);
  raster_ = OpenRaster(in);
  changed_ = false;
}

bool PlaneLayer::pack(std::uint32_t revision, PackWriter& out) const {
  out.number(static_cast<std::uint64_t>(id));
  BitWriter bits(out);
  put(state_, bits);
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
