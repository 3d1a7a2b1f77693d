// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/finished_map.h"

#include <algorithm>
#include <utility>

#include "file/file_frame.h"
#include "file/finished_coder.h"
#include "file/map_record.h"
#include "store/surface_band.h"

namespace planar_mapping::detail {
namespace {

constexpr FileFrame kFrame{{'P', 'B', 'O', 'X'}, 2, "versions 1 and 2"};
constexpr FileFrame kFrame1{{'P', 'B', 'O', 'X'}, 1, "version 1"};

}  // namespace

std::size_t FinishedMap::memoryBytes() const {
  return sizeof(FinishedMap) + file.capacity() + capacityBytes(cuboids) + index.memoryBytes();
}

std::vector<std::uint8_t> writeFinishedMap(const MapData& map, const std::vector<Cuboid>& cuboids) {
  FinishedRecord record = finishedRecordOf(map, cuboids);
  BitCoder coder;
  const std::size_t fewest = FinishedCoder::experienced().code(coder, record);
  return kFrame.around(coder.finish(fewest));
}

bool isFinishedFile(const std::uint8_t* data, std::size_t size) {
  return kFrame.starts(data, size);
}

std::unique_ptr<const FinishedMap> readFinishedMap(const std::uint8_t* data, std::size_t size,
                                                   MapData& map) {
  const bool is_first = kFrame1.isOfThisVersion(data, size);
  BitCoder coder = (is_first ? kFrame1 : kFrame).open(data, size);
  FinishedRecord record;
  coder.finishReading(FinishedCoder::experienced().code(coder, record));
  if (is_first) {
    // It had no cuboids that reach farther before planes of much noise.
    for (FinishedPlane& plane : record.planes) {
      plane.spread = std::min(plane.spread, SurfaceSpread::kLinear);
    }
  }
  auto finished = std::make_unique<FinishedMap>();
  finished->file.assign(data, data + size);
  finished->cuboids = cuboidsOf(record);
  finished->index.build(finished->cuboids);
  map.params = record.params;
  // No question tells seen free from never seen.
  std::vector<UnknownSpace::PlacedBlock> unknown;
  for (const LatticeBundle& b : record.space) {
    if (b.twos != 0) unknown.push_back({b.at, {0, b.twos}});
  }
  map.unknown.add(unknown);
  return finished;
}

}  // namespace planar_mapping::detail
