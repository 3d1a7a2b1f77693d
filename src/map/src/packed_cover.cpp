// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "packed_cover.h"

#include <utility>

#include "belief.h"
#include "key_map.h"
#include "packed_numbers.h"

namespace planar_mapping::detail {
namespace {

/// Most probabilities are beliefs of a cell, which are whole steps.
constexpr std::uint8_t kOther = 255;

void putProbability(float probability, PackWriter& out) {
  const std::uint8_t belief = quantiseBelief(static_cast<double>(probability));
  if (beliefOf(belief) == probability) return out.byte(belief);
  out.byte(kOther);
  out.raw(probability);
}
float takeProbability(PackReader& in) {
  const std::uint8_t belief = in.byte();
  return belief == kOther ? in.raw<float>() : beliefOf(belief);
}

void put(const std::vector<PatchCover::Rectangle>& rectangles, PackWriter& out) {
  HalfCellRectangle last{};
  for (const PatchCover::Rectangle& r : rectangles) {
    out.difference(r.place.b - last.b);
    out.difference(r.place.a - last.a);
    out.difference(r.place.width);
    out.difference(r.place.height);
    putProbability(r.probability, out);
    last = r.place;
  }
}

// A loose quarter: how far along it is, shifted by what else it says, then that.
constexpr std::uint64_t kNewRow = 1;
constexpr std::uint64_t kNewProbability = 2;

void put(const std::vector<LooseQuarter>& loose, PackWriter& out) {
  LooseQuarter last{};
  for (const LooseQuarter& q : loose) {
    const std::uint64_t along = foldSign(static_cast<std::uint64_t>(std::int64_t{q.a} - last.a));
    const bool same = q.probability == last.probability;
    out.number(along << 2u | (q.b != last.b ? kNewRow : 0) | (same ? 0 : kNewProbability));
    if (q.b != last.b) out.difference(q.b - last.b);
    if (!same) putProbability(q.probability, out);
    last = q;
  }
}

void put(const std::vector<std::uint64_t>& regions, PackWriter& out) {
  Int3 last;
  for (const std::uint64_t key : regions) {
    const Int3 at = unpackKey(key);
    out.difference(at.x - last.x);
    out.difference(at.y - last.y);
    out.difference(at.z - last.z);
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

Head takeHead(PackReader& in) {
  Head head;
  head.cover.plane = in.as<std::int32_t>();
  const auto pa = in.differenceAs<std::int32_t>();
  const auto pb = in.differenceAs<std::int32_t>();
  head.cover.key = packKey(pa, pb);
  head.cover.revision = in.as<std::uint32_t>();
  head.cover.frame_revision = in.as<std::uint32_t>();
  head.cover.spread = in.byte();
  head.regions = in.as<std::size_t>();
  head.rectangles = in.as<std::size_t>();
  head.loose = in.as<std::size_t>();
  return head;
}

std::vector<std::uint64_t> takeRegions(std::size_t count, PackReader& in) {
  std::vector<std::uint64_t> regions;
  regions.reserve(count);
  Int3 at;
  for (std::size_t i = 0; i < count; ++i) {
    at.x += in.differenceAs<std::int32_t>();
    at.y += in.differenceAs<std::int32_t>();
    at.z += in.differenceAs<std::int32_t>();
    regions.push_back(packKey(at));
  }
  return regions;
}

}  // namespace

std::vector<std::uint8_t> packCover(const PatchCover& cover) {
  PackWriter out;
  out.number(static_cast<std::uint64_t>(cover.plane));
  std::int32_t pa = 0, pb = 0;
  unpackKey(cover.key, pa, pb);
  out.difference(pa);
  out.difference(pb);
  out.number(cover.revision);
  out.number(cover.frame_revision);
  out.byte(cover.spread);
  out.number(cover.regions.size());
  out.number(cover.rectangles.size());
  out.number(cover.loose.size());
  put(cover.regions, out);
  put(cover.rectangles, out);
  put(cover.loose, out);
  out.bytes.resize(out.bytes.size() + cover.rectangles.size(), 0);
  return std::move(out.bytes);
}

PatchCover PackedCover::head() const {
  PackReader in(data_);
  return takeHead(in).cover;
}

std::vector<std::uint64_t> PackedCover::regions() const {
  PackReader in(data_);
  const Head head = takeHead(in);
  return takeRegions(head.regions, in);
}

std::size_t PackedCover::count() const {
  PackReader in(data_);
  const Head head = takeHead(in);
  std::size_t count = 0;
  for (std::size_t r = 0; r < head.rectangles; ++r) {
    count += isReplaced(r) ? 0 : 1;
  }
  return count;
}

PatchCover PackedCover::unpacked() const {
  PackReader in(data_);
  Head head = takeHead(in);
  PatchCover& cover = head.cover;
  cover.regions = takeRegions(head.regions, in);
  cover.rectangles.resize(head.rectangles);
  HalfCellRectangle place{};
  for (PatchCover::Rectangle& rectangle : cover.rectangles) {
    place.b += in.differenceAs<std::int32_t>();
    place.a += in.differenceAs<std::int32_t>();
    place.width = in.differenceAs<std::int32_t>();
    place.height = in.differenceAs<std::int32_t>();
    rectangle = {place, takeProbability(in)};
  }
  cover.loose.resize(head.loose);
  LooseQuarter last{};
  for (LooseQuarter& quarter : cover.loose) {
    const std::uint64_t number = in.number();
    last.a += static_cast<std::int32_t>(static_cast<std::int64_t>(unfoldSign(number >> 2u)));
    if ((number & kNewRow) != 0) last.b += in.differenceAs<std::int32_t>();
    if ((number & kNewProbability) != 0) last.probability = takeProbability(in);
    quarter = last;
  }
  return std::move(head.cover);
}

}  // namespace planar_mapping::detail
