// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/cell_layer.h"

#include <algorithm>

#include "store/belief.h"
#include "store/packed_numbers.h"
#include "store/set_bits.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kRegionBlocks = kRegionCells / 4;

// A block: how many places it is after the one before, a head, then what the head says there is:
// the cells, the least belief, how far each is above that, and octants or means.
constexpr unsigned kCountMask = 7u;  ///< so many cells, by their bits; kMany: as 64 bits
constexpr unsigned kMany = 7u;
constexpr unsigned kAlikeOctants = 8u;  ///< those of one cell stand for all
constexpr unsigned kMeans = 16u;
constexpr unsigned kAlikeBeliefs = 32u;

std::size_t placeOf(const Int3& block, const Int3& first) {
  return static_cast<std::size_t>(block.x - first.x + kRegionBlocks * (block.y - first.y) +
                                  kRegionBlocks * kRegionBlocks * (block.z - first.z));
}

void put(const CellBlock& block, PackWriter& out) {
  const std::uint64_t cells = block.occupied();
  const auto count = static_cast<unsigned>(__builtin_popcountll(cells));
  const auto first = static_cast<std::size_t>(__builtin_ctzll(cells));
  bool alike_octants = true;
  bool alike_beliefs = true;
  forEachBit(cells, [&](std::size_t bit) {
    alike_octants &= block.octants(bit) == block.octants(first);
    alike_beliefs &= block.belief(bit) == block.belief(first);
  });
  out.byte(std::min(count, kMany) | (alike_octants ? kAlikeOctants : 0) |
           (block.hasMeans() ? kMeans : 0) | (alike_beliefs ? kAlikeBeliefs : 0));
  if (count < kMany) {
    forEachBit(cells, [&](std::size_t bit) { out.byte(static_cast<unsigned>(bit)); });
  } else {
    out.raw(cells);
  }
  const auto putEach = [&](bool alike, auto&& value) {
    if (alike) return out.byte(value(first));
    forEachBit(cells, [&](std::size_t bit) { out.byte(value(bit)); });
  };
  putEach(alike_beliefs, [&](std::size_t bit) { return block.belief(bit); });
  if (!block.hasMeans()) {
    putEach(alike_octants, [&](std::size_t bit) { return block.octants(bit); });
  } else {
    forEachBit(cells, [&](std::size_t bit) { out.raw(block.mean(bit)); });
  }
}

void take(PackReader& in, CellBlock& block) {
  const unsigned head = in.byte();
  std::uint64_t cells = 0;
  if ((head & kCountMask) != kMany) {
    for (unsigned i = head & kCountMask; i > 0; --i) cells |= std::uint64_t{1} << in.byte();
  } else {
    cells = in.raw<std::uint64_t>();
  }
  const auto takeEach = [&](bool alike, auto&& set) {
    const std::uint8_t all = alike ? in.byte() : 0;
    forEachBit(cells, [&](std::size_t bit) { set(bit, alike ? all : in.byte()); });
  };
  takeEach((head & kAlikeBeliefs) != 0,
           [&](std::size_t bit, std::uint8_t belief) { block.setBelief(bit, belief); });
  if ((head & kMeans) == 0) {
    takeEach((head & kAlikeOctants) != 0,
             [&](std::size_t bit, std::uint8_t octants) { block.setOctants(bit, octants); });
  } else {
    forEachBit(cells, [&](std::size_t bit) { block.setMean(bit, in.raw<CellBlock::Mean>()); });
  }
}

}  // namespace

std::uint64_t CellLayer::regionKey(const Int3& block) const {
  static_assert(kRegionBlocks == 16);
  return packKey(Int3{(block.x - anchor.x / 4) >> 4, (block.y - anchor.y / 4) >> 4,
                      (block.z - anchor.z / 4) >> 4});
}

Int3 CellLayer::firstBlock(std::uint64_t region) const {
  const Int3 at = unpackKey(region);
  return {anchor.x / 4 + kRegionBlocks * at.x, anchor.y / 4 + kRegionBlocks * at.y,
          anchor.z / 4 + kRegionBlocks * at.z};
}

std::vector<CellLayer::PlacedBlock> CellLayer::unpacked(std::size_t region) const {
  std::vector<PlacedBlock> blocks;
  const PackedBytes& packed = regions.value(region).blocks;
  if (packed.empty()) return blocks;
  PackReader in(packed.data());
  blocks.resize(in.as<std::size_t>());
  const Int3 first = firstBlock(regions.key(region));
  std::size_t place = 0;
  for (PlacedBlock& placed : blocks) {
    place += in.as<std::size_t>();
    const auto at = static_cast<std::int32_t>(place);
    placed.key = packKey(Int3{first.x + (at & 15), first.y + (at >> 4 & 15), first.z + (at >> 8)});
    take(in, placed.block);
  }
  return blocks;
}

void CellLayer::pack(std::size_t region) {
  std::vector<std::uint64_t>& keys = *open_->keys.find(regions.key(region));
  std::sort(keys.begin(), keys.end());
  const Int3 first = firstBlock(regions.key(region));
  PackWriter out;
  std::size_t count = 0;
  std::size_t last = 0;
  for (const std::uint64_t key : keys) {
    const CellBlock& block = *open_->blocks.find(key);
    if (block.occupied() == 0) continue;
    const std::size_t place = placeOf(unpackKey(key), first);
    out.number(place - last);
    put(block, out);
    last = place;
    ++count;
  }
  PackWriter all;
  if (count > 0) {
    all.number(count);
    all.append(out.bytes.data(), out.bytes.size());
  }
  regions.value(region).blocks = PackedBytes(all.bytes);
}

void CellLayer::open(std::size_t region) {
  if (open_ == nullptr) open_.reset(new OpenRegions);
  regions.value(region).open = true;
  std::vector<std::uint64_t>& keys = open_->keys[regions.key(region)];
  std::vector<PlacedBlock> blocks = unpacked(region);
  open_->blocks.reserve(open_->blocks.size() + blocks.size());
  for (PlacedBlock& placed : blocks) {
    keys.push_back(placed.key);
    open_->blocks[placed.key] = std::move(placed.block);
  }
}

CellBlock* CellLayer::find(const Int3& block) {
  const std::size_t region = regions.indexOf(regionKey(block));
  if (region == KeyMap<Region>::kNone) return nullptr;
  if (!regions.value(region).open) open(region);
  return open_->blocks.find(packKey(block));
}

CellBlock& CellLayer::blockAt(const Int3& block) {
  if (CellBlock* found = find(block)) return *found;
  const std::uint64_t key = packKey(block);
  const std::size_t region = regions.insert(regionKey(block));
  if (!regions.value(region).open) open(region);
  open_->keys.find(regions.key(region))->push_back(key);
  return open_->blocks[key];
}

const std::vector<std::uint64_t>& CellLayer::keysOf(std::size_t region) {
  if (!regions.value(region).open) open(region);
  return *open_->keys.find(regions.key(region));
}

void CellLayer::markDirty(const Int3& block, std::uint32_t frame) {
  Region& region = regions[regionKey(block)];
  region.dirty = true;
  region.frame = frame;
}

std::size_t CellLayer::tidy(std::uint32_t revision) {
  std::size_t changed = 0;
  for (std::size_t r = 0; r < regions.size(); ++r) {
    Region& region = regions.value(r);
    if (region.dirty) {
      if (region.open) pack(r);
      region.revision = revision;
      ++changed;
    }
    region.dirty = region.open = false;
  }
  regions.removeIf([](std::uint64_t, const Region& region) { return region.blocks.empty(); });
  open_.reset();
  return changed;
}

std::vector<NonPlanarCell> CellLayer::cellsOf(std::size_t region,
                                              const CuboidApproximationParams& params) const {
  std::vector<NonPlanarCell> cells;
  forEachBlock(region, [&](const Int3& at, const CellBlock& block) {
    forEachBit(block.occupied(), [&](std::size_t bit) {
      const Int3 c = cellOf(at, static_cast<int>(bit));
      NonPlanarCell cell;
      cell.x = c.x;
      cell.y = c.y;
      cell.z = c.z;
      Vector3 within(0.5, 0.5, 0.5);
      if (block.hasMeans()) {
        const CellBlock::Mean m = block.mean(bit);
        within = Vector3(m[0] + 0.5, m[1] + 0.5, m[2] + 0.5) / 256.0;
      }
      cell.mean = params.resolution * (Vector3(c.x, c.y, c.z) + within);
      cell.weight = static_cast<float>(params.min_points_per_cell);  // it passed that test
      if (!block.hasMeans()) cell.octants = block.octants(bit);
      cell.probability = beliefOf(block.belief(bit));
      cells.push_back(cell);
    });
  });
  return cells;
}

std::size_t CellLayer::memoryBytes() const {
  std::size_t bytes = regions.memoryBytes();
  for (std::size_t r = 0; r < regions.size(); ++r) bytes += regions.value(r).blocks.memoryBytes();
  return bytes;
}

}  // namespace planar_mapping::detail
