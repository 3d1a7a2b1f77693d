// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/packed_cover.h"

#include <cstring>
#include <utility>

#include "store/belief.h"
#include "store/key_map.h"
#include "store/packed_numbers.h"

namespace planar_mapping::detail {
namespace {

// How large the numbers of a cover mostly are, as powers of two (BitWriter).
constexpr unsigned kPlane = 4;
constexpr unsigned kNear = 0;  // patches, regions and how many there are
constexpr unsigned kRevision = 3;
constexpr unsigned kFrameRevision = 1;
constexpr unsigned kSpread = 2;
constexpr unsigned kPlace = 2;
constexpr unsigned kSize = 3;
constexpr unsigned kLoose = 2;  // how many
constexpr unsigned kStep = 1;   // from one loose quarter to the next

/// Most probabilities are beliefs of a cell, which are whole steps.
constexpr std::uint8_t kOther = 255;

void putProbability(float probability, BitWriter& out) {
  const std::uint8_t belief = quantiseBelief(static_cast<double>(probability));
  if (beliefOf(belief) == probability) return out.bits(belief, 8);
  out.bits(kOther, 8);
  std::uint32_t bits = 0;
  std::memcpy(&bits, &probability, sizeof bits);
  out.bits(bits, 32);
}
float takeProbability(BitReader& in) {
  const auto belief = static_cast<std::uint8_t>(in.bits(8));
  if (belief != kOther) return beliefOf(belief);
  const auto bits = static_cast<std::uint32_t>(in.bits(32));
  float probability = 0.0f;
  std::memcpy(&probability, &bits, sizeof probability);
  return probability;
}

void put(const std::vector<PatchCover::Rectangle>& rectangles, BitWriter& out) {
  HalfCellRectangle last{};
  for (const PatchCover::Rectangle& r : rectangles) {
    out.difference(r.place.b - last.b, kPlace);
    out.difference(r.place.a - last.a, kPlace);
    out.difference(r.place.width, kSize);
    out.difference(r.place.height, kSize);
    putProbability(r.probability, out);
    last = r.place;
  }
}

// What a loose quarter says beside how far along it is.
constexpr std::uint64_t kNewRow = 1;
constexpr std::uint64_t kNewProbability = 2;

void put(const std::vector<LooseQuarter>& loose, BitWriter& out) {
  LooseQuarter last{};
  for (const LooseQuarter& q : loose) {
    const bool new_row = q.b != last.b;
    const bool same = q.probability == last.probability;
    out.bits((new_row ? kNewRow : 0) | (same ? 0 : kNewProbability), 2);
    out.difference(q.a - last.a, kStep);
    if (new_row) out.difference(q.b - last.b, kStep);
    if (!same) putProbability(q.probability, out);
    last = q;
  }
}

void put(const std::vector<std::uint64_t>& regions, BitWriter& out) {
  Int3 last;
  for (const std::uint64_t key : regions) {
    const Int3 at = unpackKey(key);
    out.difference(at.x - last.x, kNear);
    out.difference(at.y - last.y, kNear);
    out.difference(at.z - last.z, kNear);
    last = at;
  }
}

/// The numbers before the lists, and the sizes of these.
struct Head {
  PatchCover cover;
  std::size_t regions = 0;
  std::size_t rectangles = 0;
  std::size_t loose = 0;
};

Head takeHead(BitReader& in) {
  Head head;
  head.cover.plane = in.as<std::int32_t>(kPlane);
  const auto pa = in.differenceAs<std::int32_t>(kNear);
  const auto pb = in.differenceAs<std::int32_t>(kNear);
  head.cover.key = packKey(pa, pb);
  head.cover.revision = in.as<std::uint32_t>(kRevision);
  head.cover.frame_revision = in.as<std::uint32_t>(kFrameRevision);
  head.cover.spread = in.as<std::uint8_t>(kSpread);
  head.regions = in.as<std::size_t>(kNear);
  head.rectangles = in.as<std::size_t>(kNear);
  head.loose = in.as<std::size_t>(kLoose);
  return head;
}

std::vector<std::uint64_t> takeRegions(std::size_t count, BitReader& in) {
  std::vector<std::uint64_t> regions;
  regions.reserve(count);
  Int3 at;
  for (std::size_t i = 0; i < count; ++i) {
    at.x += in.differenceAs<std::int32_t>(kNear);
    at.y += in.differenceAs<std::int32_t>(kNear);
    at.z += in.differenceAs<std::int32_t>(kNear);
    regions.push_back(packKey(at));
  }
  return regions;
}

}  // namespace

std::vector<std::uint8_t> packCover(const PatchCover& cover) {
  PackWriter out;
  BitWriter bits(out);
  bits.number(static_cast<std::uint64_t>(cover.plane), kPlane);
  std::int32_t pa = 0, pb = 0;
  unpackKey(cover.key, pa, pb);
  bits.difference(pa, kNear);
  bits.difference(pb, kNear);
  bits.number(cover.revision, kRevision);
  bits.number(cover.frame_revision, kFrameRevision);
  bits.number(cover.spread, kSpread);
  bits.number(cover.regions.size(), kNear);
  bits.number(cover.rectangles.size(), kNear);
  bits.number(cover.loose.size(), kLoose);
  put(cover.regions, bits);
  put(cover.rectangles, bits);
  put(cover.loose, bits);
  out.bytes.resize(out.bytes.size() + cover.rectangles.size(), 0);
  return std::move(out.bytes);
}

PatchCover PackedCover::head() const {
  PackReader bytes(data_);
  BitReader in(bytes);
  return takeHead(in).cover;
}

std::vector<std::uint64_t> PackedCover::regions() const {
  PackReader bytes(data_);
  BitReader in(bytes);
  const Head head = takeHead(in);
  return takeRegions(head.regions, in);
}

std::size_t PackedCover::count() const {
  PackReader bytes(data_);
  BitReader in(bytes);
  const Head head = takeHead(in);
  std::size_t count = 0;
  for (std::size_t r = 0; r < head.rectangles; ++r) {
    count += isReplaced(r) ? 0 : 1;
  }
  return count;
}

PatchCover PackedCover::unpacked() const {
  PackReader bytes(data_);
  BitReader in(bytes);
  Head head = takeHead(in);
  PatchCover& cover = head.cover;
  cover.regions = takeRegions(head.regions, in);
  cover.rectangles.resize(head.rectangles);
  HalfCellRectangle place{};
  for (PatchCover::Rectangle& rectangle : cover.rectangles) {
    place.b += in.differenceAs<std::int32_t>(kPlace);
    place.a += in.differenceAs<std::int32_t>(kPlace);
    place.width = in.differenceAs<std::int32_t>(kSize);
    place.height = in.differenceAs<std::int32_t>(kSize);
    rectangle = {place, takeProbability(in)};
  }
  cover.loose.resize(head.loose);
  LooseQuarter last{};
  for (LooseQuarter& quarter : cover.loose) {
    const std::uint64_t also = in.bits(2);
    last.a += in.differenceAs<std::int32_t>(kStep);
    if ((also & kNewRow) != 0) last.b += in.differenceAs<std::int32_t>(kStep);
    if ((also & kNewProbability) != 0) last.probability = takeProbability(in);
    quarter = last;
  }
  return std::move(head.cover);
}

}  // namespace planar_mapping::detail
