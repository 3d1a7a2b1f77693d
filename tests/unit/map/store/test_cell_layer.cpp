// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Whatever happens to non-planar cells, and whenever they are committed, there is what a plain map
// of cells would hold.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <thread>
#include <tuple>
#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "noisy_sequence.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/map/store/cell_layer.h"

namespace planar_mapping::detail {
namespace {

using Cell = std::tuple<std::int32_t, std::int32_t, std::int32_t>;
struct Content {
  std::uint8_t belief = 0;
  std::uint8_t octants = 0;
  CellBlock::Mean mean{};
  bool operator==(const Content& o) const {
    return belief == o.belief && octants == o.octants && mean == o.mean;
  }
};
using Cells = std::map<Cell, Content>;

std::int32_t whole(Random& random, std::int32_t low, std::int32_t high) {
  return static_cast<std::int32_t>(std::floor(random.uniform(low, high + 1.0)));
}
std::uint8_t byte(Random& random, std::int32_t low, std::int32_t high) {
  return static_cast<std::uint8_t>(whole(random, low, high));
}

Cells contentOf(const CellLayer& layer, bool with_means) {
  Cells cells;
  layer.forEachBlock([&](const Int3& at, const CellBlock& block) {
    EXPECT_NE(block.occupied(), 0u);
    for (std::uint64_t bits = block.occupied(); bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::size_t>(__builtin_ctzll(bits));
      const Int3 c = CellLayer::cellOf(at, static_cast<int>(bit));
      Content& content = cells[{c.x, c.y, c.z}];
      content.belief = block.belief(bit);
      if (with_means) {
        content.mean = block.mean(bit);
      } else {
        content.octants = block.octants(bit);
      }
    }
  });
  return cells;
}

/// Sets or removes a cell, in the layer and in the plain map.
void change(CellLayer& layer, Cells& cells, bool with_means, Random& random) {
  const Int3 at{whole(random, -90, 90), whole(random, -20, 20), whole(random, -12, 4)};
  const auto bit = static_cast<std::size_t>(CellLayer::bitOf(at));
  const Int3 block_at = CellLayer::blockOf(at);
  const bool known = cells.count({at.x, at.y, at.z}) == 1;
  CellBlock* found = layer.find(block_at);
  ASSERT_EQ(found != nullptr && (found->occupied() >> bit & 1u) != 0, known);
  if (known && random.uniform(0.0, 1.0) < 0.6) {
    found->remove(bit);
    cells.erase({at.x, at.y, at.z});
  } else {
    Content& content = cells[{at.x, at.y, at.z}];
    CellBlock& block = layer.blockAt(block_at);
    content.belief = random.uniform(0.0, 1.0) < 0.6 ? 12 : byte(random, 1, 17);
    block.setBelief(bit, content.belief);
    if (with_means) {
      for (std::uint8_t& part : content.mean) part = byte(random, 0, 255);
      block.setMean(bit, content.mean);
    } else {
      content.octants = random.uniform(0.0, 1.0) < 0.3 ? 255 : byte(random, 1, 255);
      block.setOctants(bit, content.octants);
    }
  }
  layer.markDirty(block_at, 3);
}

void expectTheSame(bool with_means) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Random random(seed);
    CellLayer layer;
    layer.anchor = {4 * whole(random, -9, 9), 4 * whole(random, -9, 9), 4 * whole(random, -9, 9)};
    Cells cells;
    for (std::uint32_t frame = 1; frame <= 30; ++frame) {
      for (int i = whole(random, 0, 300); i > 0; --i) change(layer, cells, with_means, random);
      layer.commit(frame);
      ASSERT_EQ(contentOf(layer, with_means), cells) << "seed " << seed << " frame " << frame;
      for (std::size_t r = 0; r < layer.regions.size(); ++r)
        EXPECT_FALSE(layer.regions.value(r).blocks.empty());
    }
    for (auto cell = cells.begin(); cell != cells.end(); cell = cells.erase(cell)) {
      const auto [x, y, z] = cell->first;
      layer.find(CellLayer::blockOf({x, y, z}))
          ->remove(static_cast<std::size_t>(CellLayer::bitOf({x, y, z})));
      layer.markDirty(CellLayer::blockOf({x, y, z}), 1);
    }
    layer.commit(99);
    EXPECT_TRUE(layer.empty());
  }
}

TEST(CellLayer, HoldsTheSameCellsWheneverItIsCommitted) {
  expectTheSame(false);
}

TEST(CellLayer, HoldsTheSameMeans) {
  expectTheSame(true);
}

TEST(CellLayer, StampsTheRegionsThatChangedOnly) {
  CellLayer layer;
  const Int3 here{0, 0, 0}, there{1000, 0, 0};
  for (const Int3& at : {here, there}) {
    layer.blockAt(at).setBelief(0, 17);
    layer.markDirty(at, 4);
  }
  EXPECT_EQ(layer.commit(5), 2u);
  ASSERT_NE(layer.find(here), nullptr);  // looked at, not changed
  layer.find(there)->setBelief(1, 12);
  layer.markDirty(there, 7);
  EXPECT_EQ(layer.commit(8), 1u);
  EXPECT_EQ(layer.regions.find(layer.regionKey(here))->revision, 5u);
  EXPECT_EQ(layer.regions.find(layer.regionKey(there))->revision, 8u);
  EXPECT_EQ(layer.regions.find(layer.regionKey(there))->frame, 7u);
}

// Whatever is asked of a map between frames, and whether it is copied, saved and loaded meanwhile,
// it goes on as if nothing had happened.

/// There and back again, so that patches that were left are touched once more.
const std::vector<int> kWalk = {0, 1, 2, 3, 3, 2, 1, 0};

void insert(PlanarMap& map, const test::View& view) {
  FrameObservation frame = view.frame();
  frame.noise = StereoNoise{0.25, view.camera.fx, 0.5};
  map.insert(frame);
}

/// Everything that can be told of a map, as numbers to be compared exactly.
std::vector<double> answersOf(const PlanarMap& map, const std::vector<Vector3>& places) {
  std::vector<double> answers;
  for (const Vector3& place : places) {
    answers.push_back(static_cast<double>(map.stateAt(place)));
    answers.push_back(map.occupancyAt(place));
  }
  const std::vector<double> numbers = test::numbersOf(map.cuboids());
  answers.insert(answers.end(), numbers.begin(), numbers.end());
  for (const MapPlane& p : map.planes()) {
    answers.push_back(p.id);
    answers.push_back(p.frames);
    answers.push_back(p.plane.signedDistance(Vector3::Zero()));
    answers.push_back(p.moments.weight());
    answers.push_back(p.rms());
  }
  answers.push_back(static_cast<double>(map.unknownCells()));
  return answers;
}

std::vector<Vector3> placesIn(Random& random) {
  std::vector<Vector3> places;
  for (int i = 0; i < 500; ++i) {
    places.emplace_back(random.uniform(-2.2, 2.2), random.uniform(-1.2, 5.2),
                        random.uniform(-0.2, 2.8));
  }
  return places;
}

TEST(MapState, GoesOnAsIfNothingHadBeenAsked) {
  const std::vector<test::View> views = test::noisyWalk(kWalk);
  Random random(4);
  const std::vector<Vector3> places = placesIn(random);
  std::vector<std::vector<std::uint8_t>> files;
  std::vector<std::vector<double>> answers;
  PlanarMap undisturbed;
  for (const test::View& view : views) {
    insert(undisturbed, view);
    files.push_back(undisturbed.serialize());
    answers.push_back(answersOf(PlanarMap(undisturbed), places));
  }
  ASSERT_GT(undisturbed.cuboidCount(), 30u);
  ASSERT_GT(undisturbed.unknownCells(), 1000u);

  for (int run = 0; run < 4; ++run) {
    PlanarMap map;
    for (std::size_t i = 0; i < views.size(); ++i) {
      insert(map, views[i]);
      for (int act = 0; act < 2; ++act) {
        const double draw = random.uniform(0.0, 6.0);
        if (draw < 1.0) {
          EXPECT_EQ(answersOf(map, places), answers[i]);
        } else if (draw < 2.0) {
          map = PlanarMap(map);
        } else if (draw < 3.0) {
          map = PlanarMap::deserialize(files[i].data(), files[i].size());
        } else if (draw < 4.0) {
          static_cast<void>(map.cuboidCount());
        } else if (draw < 5.0) {
          EXPECT_EQ(map.serialize(), files[i]);
        }
      }
    }
    EXPECT_EQ(map.serialize(), files.back()) << "run " << run;
    EXPECT_EQ(answersOf(map, places), answers.back()) << "run " << run;
  }
}

TEST(MapState, AnswersSeveralThreadsAtOnce) {
  const std::vector<test::View> views = test::noisyWalk(kWalk);
  Random random(5);
  const std::vector<Vector3> places = placesIn(random);
  PlanarMap map;
  for (const test::View& view : views) insert(map, view);
  const std::vector<std::uint8_t> file = map.serialize();
  const std::vector<double> expected = answersOf(PlanarMap(map), places);
  std::vector<std::vector<double>> answers(4);
  std::vector<std::vector<std::uint8_t>> files(answers.size());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    threads.emplace_back([&, i] {
      if (i % 2 == 0) files[i] = map.serialize();
      answers[i] = answersOf(map, places);
      if (i % 2 == 1) files[i] = PlanarMap(map).serialize();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<double>& given : answers) EXPECT_EQ(given, expected);
  for (const std::vector<std::uint8_t>& given : files) EXPECT_EQ(given, file);
}

}  // namespace
}  // namespace planar_mapping::detail
