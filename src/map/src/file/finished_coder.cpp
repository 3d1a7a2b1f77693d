// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/finished_coder.h"

#include <algorithm>

#include "file/prior_maps.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kCuboidsPerByte = 8;
constexpr std::size_t kFree = 64;  ///< regions, planes, cuboids that a file may always have
constexpr std::int64_t kLongest = PointSetCoder::kLimit;
constexpr std::int64_t kFarthest = std::int64_t{1} << 40;  ///< of a free cuboid

std::size_t bitLength(std::int64_t value) {
  std::size_t bits = 0;
  while (value >> bits != 0) ++bits;
  return bits;
}

}  // namespace

std::int64_t FinishedCoder::Lengths::code(BitCoder& coder, std::int64_t length,
                                          std::int64_t before) {
  NumberModel& model = models_[std::min(bitLength(before), kKinds - 1)];
  const std::uint64_t more = model.code(coder, static_cast<std::uint64_t>(length - 1));
  if (more >= static_cast<std::uint64_t>(kLongest)) coder.fail("holds a number outside its range");
  return static_cast<std::int64_t>(more) + 1;
}

void FinishedCoder::Lengths::forget() {
  for (NumberModel& model : models_) model.forget();
}

FinishedCoder FinishedCoder::experienced() {
  static const FinishedCoder coder = [] {
    FinishedCoder learning;
    if (kPriorFinishedMapCount == 0) return learning;
    BitCoder in(kPriorFinishedMaps, kPriorFinishedMapsSize, "the prior maps");
    for (std::size_t i = 0; i < kPriorFinishedMapCount; ++i) {
      FinishedRecord record;
      learning.code(in, record);
    }
    learning.forget();
    return learning;
  }();
  return coder;
}

std::size_t FinishedCoder::codeCount(BitCoder& coder, NumberModel& model, std::size_t count) {
  const std::uint64_t n = model.code(coder, count);
  const std::size_t most = kFree + kCuboidsPerByte * coder.size();  // when reading
  if (coder.isReading() && n > most - cuboids_) coder.fail("holds too many cuboids");
  cuboids_ += static_cast<std::size_t>(n);
  return static_cast<std::size_t>(n);
}

void FinishedCoder::codePlane(BitCoder& coder, FinishedPlane& plane, std::int32_t last_id) {
  const std::int64_t wanted = std::int64_t{plane.id} - last_id - 1;
  const std::uint64_t more = id_.code(coder, static_cast<std::uint64_t>(wanted));
  if (more >= static_cast<std::uint64_t>(INT32_MAX - std::int64_t{last_id})) {
    coder.fail("holds a number outside its range");
  }
  plane.id = static_cast<std::int32_t>(last_id + 1 + static_cast<std::int64_t>(more));
  frame_.code(coder, plane.stored);
  plane.spread = static_cast<std::uint8_t>(spread_.code(coder, plane.spread));
  plane.rectangles.resize(codeCount(coder, rectangle_count_, plane.rectangles.size()));
  if (plane.rectangles.empty()) coder.fail("has a plane without a rectangle");
  codeRectangles(coder, plane.rectangles);
}

void FinishedCoder::codeRectangles(BitCoder& coder, std::vector<CellRectangle>& rectangles) {
  std::vector<Int3> places;
  places.reserve(rectangles.size());
  for (const CellRectangle& r : rectangles) places.push_back({r.a, r.b, 0});
  places_.code(coder, places);
  for (std::size_t i = 0; i < rectangles.size(); ++i) {
    CellRectangle& r = rectangles[i];
    r.a = places[i].x;
    r.b = places[i].y;
    r.height = static_cast<std::int32_t>(sides_[0].code(coder, r.height, 0));
    r.width = static_cast<std::int32_t>(sides_[1].code(coder, r.width, r.height));
  }
}

void FinishedCoder::codeBoxes(BitCoder& coder, std::vector<FinishedBox>& boxes) {
  std::vector<Int3> corners(boxes.size());
  for (std::size_t i = 0; i < boxes.size() && !coder.isReading(); ++i) {
    const std::array<std::int64_t, 3> size = boxes[i].box.worldSize();
    const auto low = [&](std::size_t k) {
      return static_cast<std::int32_t>((boxes[i].box.middle[k] - size[k]) / 2);
    };
    corners[i] = {low(0), low(1), low(2)};
  }
  corners_.code(coder, corners);
  last_plane_ = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    HalfCellBox& box = boxes[i].box;
    std::array<std::int64_t, 3> size = box.worldSize();
    size[2] = edges_[2].code(coder, size[2], 0);
    size[1] = edges_[1].code(coder, size[1], size[2]);
    size[0] = edges_[0].code(coder, size[0], size[1]);
    codePlaneOf(coder, boxes[i]);
    const std::array<std::int32_t, 3> low{corners[i].x, corners[i].y, corners[i].z};
    for (std::size_t k = 0; k < 3; ++k) box.middle[k] = 2 * std::int64_t{low[k]} + size[k];
    box.setWorldSize(size);
  }
}

void FinishedCoder::codePlaneOf(BitCoder& coder, FinishedBox& box) {
  if (!on_plane_.code(coder, box.plane_id >= 0)) {
    box.plane_id = -1;
    box.box.axes = 0;
    return;
  }
  if (!same_plane_.code(coder, box.plane_id == last_plane_)) {
    last_plane_ += static_cast<std::int32_t>(
        plane_.codeWithin(coder, std::int64_t{box.plane_id} - last_plane_,
                          -std::int64_t{last_plane_}, INT32_MAX - std::int64_t{last_plane_}));
  }
  box.plane_id = last_plane_;
  codeAxes(coder, box.box.axes);
}

void FinishedCoder::codeAxes(BitCoder& coder, unsigned& axes) {
  constexpr unsigned kUnturned = 0321;  // u, v, n are x, y, z
  const unsigned wanted = axes == 0 ? kUnturned : axes;
  // An axis of the world, 3 more where it is turned round.
  const auto numberOf = [](unsigned axis) { return (axis & 3u) - 1 + ((axis & 4u) != 0 ? 3 : 0); };
  const auto axisOf = [](unsigned number) { return number % 3 + 1 + (number >= 3 ? 4u : 0u); };
  const unsigned n = normal_axis_.code(coder, numberOf(wanted >> 6u));
  if (n > 5) coder.fail("has a box without a normal");
  // u is the first or the second axis after n, and may be turned round.
  const unsigned u_wanted = numberOf(wanted & 7u);
  const unsigned choice =
      direction_axis_.code(coder, (u_wanted % 3 + 5 - n % 3) % 3 | (u_wanted >= 3 ? 2u : 0u));
  const bool is_second = (choice & 1u) != 0;
  const bool is_u_negative = (choice & 2u) != 0;
  const unsigned u = (n % 3 + (is_second ? 2 : 1)) % 3 + (is_u_negative ? 3 : 0);
  const bool is_v_negative = is_second != ((n >= 3) != is_u_negative);  // v = n x u
  const unsigned v = 3 - n % 3 - u % 3 + (is_v_negative ? 3 : 0);
  const unsigned coded = axisOf(u) | axisOf(v) << 3u | axisOf(n) << 6u;
  axes = coded == kUnturned ? 0 : coded;
}

void FinishedCoder::codeFree(BitCoder& coder, FreeCuboid& cuboid) {
  std::int64_t length = 0;
  for (std::int64_t& c : cuboid.center) {
    c = free_numbers_[0].codeWithin(coder, c, -kFarthest, kFarthest);
  }
  for (std::int64_t& s : cuboid.size) s = free_numbers_[1].codeWithin(coder, s, 0, kFarthest);
  for (std::int64_t& q : cuboid.turn) {
    q = free_numbers_[2].codeWithin(coder, q, -FreeCuboid::kOne, FreeCuboid::kOne);
    length += q * q;
  }
  constexpr std::int64_t kOneSquared = std::int64_t{FreeCuboid::kOne} * FreeCuboid::kOne;
  if (length < kOneSquared / 2 || length > 2 * kOneSquared) {
    coder.fail("has a quaternion that is not of length 1");
  }
  cuboid.plane_id =
      static_cast<std::int32_t>(free_numbers_[3].codeWithin(coder, cuboid.plane_id, -1, INT32_MAX));
}

std::size_t FinishedCoder::code(BitCoder& coder, FinishedRecord& record) {
  cuboids_ = 0;
  frame_.start();
  params_.codeFinished(coder, record.params);
  const std::uint64_t planes = plane_count_.code(coder, record.planes.size());
  if (coder.isReading() && planes > kFree + coder.size()) coder.fail("holds too many planes");
  record.planes.resize(static_cast<std::size_t>(planes));
  std::int32_t last_id = -1;
  for (FinishedPlane& plane : record.planes) {
    codePlane(coder, plane, last_id);
    last_id = plane.id;
  }
  record.boxes.resize(codeCount(coder, box_count_, record.boxes.size()));
  codeBoxes(coder, record.boxes);
  record.free_cuboids.resize(codeCount(coder, free_count_, record.free_cuboids.size()));
  for (FreeCuboid& cuboid : record.free_cuboids) codeFree(coder, cuboid);
  LatticeCount count;
  space_.code(coder, record.space, count);
  const auto least = [](std::size_t n, std::size_t per_byte) {
    const std::size_t bytes = (n + per_byte - 1) / per_byte;
    return bytes > kFree ? bytes - kFree : 0;
  };
  const std::size_t more = cuboids_ - std::min(cuboids_, kFree);
  return std::max({least(count.regions, 1), least(count.bundles, kBundlesPerByte),
                   least(record.planes.size(), 1), (more + kCuboidsPerByte - 1) / kCuboidsPerByte});
}

void FinishedCoder::forget() {
  forgetAll(params_, plane_count_, rectangle_count_, box_count_, free_count_, id_, frame_, spread_,
            places_, corners_, on_plane_, same_plane_, plane_, normal_axis_, direction_axis_,
            space_);
  for (Lengths& lengths : sides_) lengths.forget();
  for (Lengths& lengths : edges_) lengths.forget();
  for (NumberModel& model : free_numbers_) model.forget();
}

}  // namespace planar_mapping::detail
