// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// PlanarMap::memoryBytes() against the allocator: this program counts the blocks that operator new
// hands out.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#include "noisy_sequence.h"
#include "planar_mapping/map/planar_map.h"

namespace {

/// What is in use now. This program has one thread.
struct Heap {
  std::size_t bytes = 0;
  std::size_t blocks = 0;
};
Heap heap;

/// More than malloc adds to a block by its head and by rounding.
constexpr std::size_t kMaxBlockOverhead = 64;

std::size_t blockBytes(void* block) {
  return malloc_usable_size(block) + sizeof(std::size_t);
}

void* take(std::size_t size) {
  void* block = std::malloc(size == 0 ? 1 : size);
  if (block == nullptr) throw std::bad_alloc();
  heap.bytes += blockBytes(block);
  ++heap.blocks;
  return block;
}
void giveBack(void* block) {
  if (block == nullptr) return;
  heap.bytes -= blockBytes(block);
  --heap.blocks;
  std::free(block);
}

}  // namespace

void* operator new(std::size_t size) {
  return take(size);
}
void* operator new[](std::size_t size) {
  return take(size);
}
void operator delete(void* block) noexcept {
  giveBack(block);
}
void operator delete[](void* block) noexcept {
  giveBack(block);
}
void operator delete(void* block, std::size_t) noexcept {
  giveBack(block);
}
void operator delete[](void* block, std::size_t) noexcept {
  giveBack(block);
}

namespace planar_mapping {
namespace {

/// The capacity of containers, without what the allocator adds to each block.
void expectCounted(const PlanarMap& map, const Heap& before) {
  const std::size_t measured = heap.bytes - before.bytes;
  const std::size_t blocks = heap.blocks - before.blocks;
  const std::size_t counted = map.memoryBytes() - sizeof(PlanarMap);
  EXPECT_LE(counted, measured);
  EXPECT_GE(counted + kMaxBlockOverhead * blocks, measured);
}

void insert(PlanarMap& map, const test::View& view) {
  FrameObservation frame = view.frame();
  frame.noise = StereoNoise{0.25, view.camera.fx, 0.5};
  map.insert(frame);
  static_cast<void>(map.cuboidCount());
}

void walkAndCount(const std::vector<test::View>& views, Profile profile, double cell) {
  PlanarMapParams params;
  params.approximation.profile = profile;
  params.approximation.resolution = cell;
  params.approximation.threads = 1;
  const Heap before = heap;
  PlanarMap map(params);
  for (const test::View& view : views) {
    insert(map, view);
    expectCounted(map, before);
  }
  static_cast<void>(map.cuboids());
  expectCounted(map, before);
  static_cast<void>(map.planes());
  static_cast<void>(map.trajectory());
  static_cast<void>(map.unknownCells());
  expectCounted(map, before);

  const Heap before_copy = heap;
  const PlanarMap copy(map);
  expectCounted(copy, before_copy);
  const std::vector<std::uint8_t> file = map.serialize();
  const Heap before_loading = heap;
  const PlanarMap loaded = PlanarMap::deserialize(file.data(), file.size());
  expectCounted(loaded, before_loading);

  const std::vector<std::uint8_t> finished_file = map.finished().serialize();
  const Heap before_finished = heap;
  const PlanarMap finished = PlanarMap::deserialize(finished_file.data(), finished_file.size());
  static_cast<void>(finished.unknownCells());
  expectCounted(finished, before_finished);
  const Heap before_finished_copy = heap;
  const PlanarMap finished_copy(finished);
  expectCounted(finished_copy, before_finished_copy);
}

TEST(MapHeap, IsWhatTheMapSaysItTakes) {
#ifdef PLANAR_MAPPING_SANITIZED
  GTEST_SKIP() << "the allocator is the sanitizer's";
#endif
  const std::vector<test::View> views = test::noisyWalk({0, 1, 2, 3, 4});
  walkAndCount(views, Profile::Compact, 0.1);
  walkAndCount(views, Profile::Compact, 0.5);
  walkAndCount(views, Profile::Paper, 0.1);
}

}  // namespace
}  // namespace planar_mapping
