// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "map_walk.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/joined_map.h"
#include "planar_mapping/map/map_tiles.h"

namespace planar_mapping {
namespace {

class MapTiles : public ::testing::Test {
 protected:
  MapTiles() {
    for (const test::View& view : test::walk(5)) map_.insert(view.frame());
    side_ = tileSide(map_.params(), 1.0);
    const Eigen::AlignedBox3d reach = reachOf(map_);
    for (int x = at(reach.min().x()); x <= at(reach.max().x()); ++x)
      for (int y = at(reach.min().y()); y <= at(reach.max().y()); ++y)
        tiles_.emplace(std::make_pair(x, y), tileOf(map_, side_, x, y));
  }
  int at(double metres) const { return static_cast<int>(std::floor(metres / side_)); }
  /// Where the scene is.
  static Vector3 anywhere(Random& random) {
    return {8.0 * random.uniform() - 2.0, 6.0 * random.uniform() - 3.0,
            3.0 * random.uniform() - 0.2};
  }

  PlanarMap map_{test::paramsAt(0.1)};
  double side_ = 0.0;
  std::map<std::pair<int, int>, PlanarMap> tiles_;
};

TEST_F(MapTiles, AreOfWholeCubesOfSpace) {
  EXPECT_DOUBLE_EQ(3.2, side_);
  EXPECT_DOUBLE_EQ(6.4, tileSide(map_.params(), 6.4));
  EXPECT_DOUBLE_EQ(9.6, tileSide(map_.params(), 6.5));
  EXPECT_THROW(tileSide(map_.params(), 0.0), ParameterError);
  EXPECT_GT(tiles_.size(), 3u);
}

TEST_F(MapTiles, AnswerAsTheMapDoesButForHalfACellAtTheirSides) {
  Random random(1);
  std::size_t occupied = 0, asked = 0, others = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3 point = anywhere(random);
    const auto inner = [&](double x) {
      return x - side_ * at(x) > 0.1 && side_ * (at(x) + 1) - x > 0.1;
    };
    if (!inner(point.x()) || !inner(point.y())) continue;
    const auto tile = tiles_.find({at(point.x()), at(point.y())});
    const CellState state = tile == tiles_.end() ? CellState::Unknown : tile->second.stateAt(point);
    ++asked;
    others += map_.stateAt(point) == state ? 0 : 1;
    occupied += state == CellState::Occupied ? 1 : 0;
  }
  EXPECT_GT(occupied, 100u);
  // Cuboids of the rest of a surface may end elsewhere.
  EXPECT_LT(100 * others, asked) << others << " of " << asked;
}

TEST_F(MapTiles, AreTogetherTheMap) {
  JoinedMap joined;
  std::size_t frames = 0;
  for (const auto& [place, tile] : tiles_) {
    joined.set(static_cast<std::int32_t>(joined.size()), std::make_shared<PlanarMap>(tile),
               Pose::Identity());
    frames += tile.frames();
  }
  EXPECT_GE(frames, map_.frames());
  Random random(2);
  for (int i = 0; i < 20000; ++i) {
    const Vector3 point = anywhere(random);
    ASSERT_EQ(map_.stateAt(point), joined.map().stateAt(point)) << point.transpose();
  }
  EXPECT_EQ(map_.planes().size(), joined.map().planes().size());
}

TEST_F(MapTiles, WhereNothingIsThereIsAnEmptyMap) {
  EXPECT_EQ(0u, tileOf(map_, side_, 1000, 1000).frames());
  EXPECT_THROW(tileOf(map_.finished(), side_, 0, 0), InputError);
  EXPECT_TRUE(reachOf(PlanarMap()).isEmpty());
}

}  // namespace
}  // namespace planar_mapping
