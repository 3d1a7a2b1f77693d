// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A map file: a byte of flags, then its sections. They are packed here and get their checksum, so
// that what is mutated gets as far as the map.
#include <zstd.h>

#include "fuzz.h"
#include "planar_mapping/base/crc32.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/map/planar_map.h"

using namespace planar_mapping;

namespace {

/// Of a map that takes more in memory only reading is fuzzed: to cover its cells takes seconds.
constexpr std::size_t kMaxBytes = std::size_t{1} << 18;

std::vector<std::uint8_t> fileOf(const std::string& sections, bool is_finished) {
  constexpr std::size_t kHeader = 20;
  std::vector<std::uint8_t> file(kHeader + ZSTD_compressBound(sections.size()));
  file.resize(kHeader + ZSTD_compress(&file[kHeader], file.size() - kHeader, sections.data(),
                                      sections.size(), 1));
  const std::uint64_t size = sections.size();
  std::memcpy(file.data(), "PMAP\5", 5);
  file[5] = is_finished ? 1 : 0;
  std::memcpy(&file[8], &size, sizeof size);
  const std::uint32_t crc =
      detail::crc32(detail::crc32(0, file.data(), 16), &file[kHeader], file.size() - kHeader);
  std::memcpy(&file[16], &crc, sizeof crc);
  return file;
}

PlanarMap load(const std::vector<std::uint8_t>& file) {
  return PlanarMap::deserialize(file.data(), file.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const bool is_finished = input.flag();
  const std::vector<std::uint8_t> file = fileOf(input.rest(), is_finished);
  PlanarMap map;
  if (!fuzz::succeeds([&] { map = load(file); })) return 0;
  fuzz::require(map.isFinished() == is_finished, "the flag says whether a map is finished");
  if (map.memoryBytes() > kMaxBytes) return 0;
  const std::vector<std::uint8_t> saved = map.serialize();
  const PlanarMap again = load(saved);
  fuzz::require(again.serialize() == saved, "a map that was read is saved as the same bytes");
  const Vector3 somewhere = map.cuboids().empty() ? Vector3::Zero() : map.cuboids()[0].center;
  fuzz::require(map.stateAt(somewhere) == again.stateAt(somewhere), "a saved map answers the same");
  fuzz::succeeds([&] { castRay(map, somewhere, Vector3(1, 0.1, 0.1), 10.0); });
  return 0;
}
