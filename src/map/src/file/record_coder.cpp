// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/record_coder.h"

#include <algorithm>

#include "file/prior_maps.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kFramesPerByte = 64;
constexpr std::size_t kFree = 64;  ///< regions, planes, ... that a file may always have

}  // namespace

RecordCoder RecordCoder::experienced() {
  static const RecordCoder coder = [] {
    RecordCoder learning;
    if (kPriorMapCount == 0) return learning;
    BitCoder in(kPriorMaps, kPriorMapsSize, "the prior maps");
    for (std::size_t i = 0; i < kPriorMapCount; ++i) {
      MapRecord record;
      learning.code(in, record);
    }
    learning.forget();
    return learning;
  }();
  return coder;
}

void RecordCoder::codeCells(BitCoder& coder, MapRecord& record, LatticeCount& count) {
  constexpr std::int32_t kLimit = kLatticeLimit / 2;
  for (std::int32_t* a : {&record.anchor.x, &record.anchor.y, &record.anchor.z}) {
    *a = static_cast<std::int32_t>(anchor_.codeWithin(coder, *a, -kLimit, kLimit));
  }
  blocks_.code(coder, record.blocks, count);
  beliefs_.code(coder, record.blocks, record.beliefs);
  if (record.params.approximation.profile == Profile::Compact) {
    octants_.code(coder, record.blocks, record.beliefs, record.octants);
  } else {
    record.means.resize(record.beliefs.size());
    for (CellBlock::Mean& mean : record.means) {
      for (std::uint8_t& m : mean) m = static_cast<std::uint8_t>(coder.plain(m, 8));
    }
  }
  const std::uint64_t n = region_count_.code(coder, record.region_frames.size());
  if (n > record.blocks.size()) coder.fail("names too many regions");
  record.region_frames.resize(static_cast<std::size_t>(n));
  std::int64_t last = static_cast<std::int64_t>(record.trajectory.size()) - 1;
  for (std::uint32_t& frame : record.region_frames) {
    last += region_frame_.codeWithin(coder, frame - last, -std::int64_t{UINT32_MAX}, UINT32_MAX);
    if (last < 0 || last > UINT32_MAX) coder.fail("names a frame that is not in the trajectory");
    frame = static_cast<std::uint32_t>(last);
  }
}

std::size_t RecordCoder::code(BitCoder& coder, MapRecord& record) {
  params_.code(coder, record.params);
  LatticeCount count;
  const std::uint64_t frames = frame_count_.code(coder, record.trajectory.size());
  const std::size_t most = kFree + coder.size();  // when reading
  if (coder.isReading() && frames > kFramesPerByte * most) coder.fail("holds too many frames");
  record.trajectory.resize(static_cast<std::size_t>(frames));
  poses_.code(coder, record.trajectory);

  record.next_plane_id =
      static_cast<std::int32_t>(next_plane_.codeWithin(coder, record.next_plane_id, 0, INT32_MAX));
  const std::uint64_t planes = plane_count_.code(coder, record.planes.size());
  if (coder.isReading() && planes > most) coder.fail("holds too many planes");
  record.planes.resize(static_cast<std::size_t>(planes));
  planes_.code(coder, record.planes, record.params.approximation.resolution, count);
  const std::int32_t last_id = record.planes.empty() ? -1 : record.planes.back().id;
  if (last_id >= record.next_plane_id) coder.fail("has plane numbers that are yet to be given");

  codeCells(coder, record, count);
  space_.code(coder, record.space, count);

  // The chances that bits are coded with would let a few bytes stand for almost anything.
  const auto least = [](std::size_t n, std::size_t per_byte) {
    const std::size_t bytes = (n + per_byte - 1) / per_byte;
    return bytes > kFree ? bytes - kFree : 0;
  };
  return std::max({least(count.regions, 1), least(count.bundles, kBundlesPerByte),
                   least(record.planes.size(), 1),
                   least(record.trajectory.size(), kFramesPerByte)});
}

void RecordCoder::forget() {
  forgetAll(params_, frame_count_, next_plane_, plane_count_, poses_, planes_, anchor_, blocks_,
            beliefs_, octants_, region_count_, region_frame_, space_);
}

}  // namespace planar_mapping::detail
