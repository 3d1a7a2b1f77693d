// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Space that is unknown until a measurement passes it: Unseen::Unknown, the default.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "map_scene.h"
#include "numbers.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using namespace test;

/// The inside of a hall, walls at x = +-8, y = -1 and 12, z = +-8, and a wall of 2 m x 2 m in it at
/// y = 4 whose back is at y = 4.2. The camera looks along +y: at depth y it sees |x| < 0.64 y and
/// |z| < 0.48 y.
struct Hall {
  Scene scene;
  Hall() {
    scene.boxes = {{{-8.0, -1.0, -8.0}, {8.0, 12.0, 8.0}, true, true},
                   {{-1.0, 4.0, -1.0}, {1.0, 4.2, 1.0}, false, true}};
  }
  View view(const Vector3& from = Vector3::Zero(), double yaw = 0.0) const {
    return look(scene, lookFrom(from, yaw, 0.0));
  }
};

PlanarMap mapOf(const std::vector<View>& views, const PlanarMapParams& params = PlanarMapParams()) {
  PlanarMap map(params);
  for (const View& view : views) map.insert(view.frame());
  return map;
}

/// Places of the hall seen from the origin, with what must be known of them.
void expectSeenFromTheOrigin(const PlanarMap& map) {
  EXPECT_TRUE(map.isFree({0.05, 2.05, 0.05}));      // before the wall
  EXPECT_TRUE(map.isFree({2.05, 6.05, 0.05}));      // beside it
  EXPECT_TRUE(map.isFree({4.05, 11.05, 3.05}));     // far away
  EXPECT_TRUE(map.isUnknown({0.05, 6.05, 0.05}));   // behind it
  EXPECT_TRUE(map.isUnknown({0.05, 12.55, 0.05}));  // behind the end of the hall
  EXPECT_TRUE(map.isUnknown({0.05, -0.55, 0.05}));  // behind the camera
  EXPECT_TRUE(map.isUnknown({3.05, 2.05, 0.05}));   // beside the image
  EXPECT_TRUE(map.isUnknown({0.05, 2.05, 1.45}));   // above it
  EXPECT_TRUE(map.isUnknown({1000.0, 1000.0, 1.0}));
  EXPECT_TRUE(map.isUnknown({1e9, 0.0, 0.0}));
}

TEST(ObservedSpace, IsFreeOnlyWhereAMeasurementPassed) {
  const PlanarMap map = mapOf({Hall().view()});
  expectSeenFromTheOrigin(map);
  EXPECT_EQ(map.occupancyAt({0.05, -0.55, 0.05}), 0.5);
  EXPECT_EQ(map.occupancyAt({0.05, 2.05, 0.05}), 0.0);
}

TEST(ObservedSpace, IsWhatBoxesAndRaysAgreeOn) {
  const PlanarMap map = mapOf({Hall().view()});
  EXPECT_EQ(stateOfBox(map, {-0.5, 1.5, -0.5}, {0.5, 3.5, 0.5}).state, CellState::Free);
  EXPECT_EQ(stateOfBox(map, {-0.5, 4.5, -0.5}, {0.5, 6.5, 0.5}).state, CellState::Unknown);
  EXPECT_EQ(stateOfBox(map, {-2.5, 1.5, -0.5}, {0.5, 3.5, 0.5}).state, CellState::Unknown);
  // From before the wall out of the side of the image.
  const auto hit = castRay(map, {0.05, 3.05, 0.05}, {1.0, 0.0, 0.0}, 20.0);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->state, CellState::Unknown);
  EXPECT_NEAR(hit->distance, 0.64 * 3.05, 0.15);
  // From the camera itself, which is in free space.
  EXPECT_FALSE(castRay(map, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 3.5).has_value());
  const auto wall = castRay(map, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 20.0);
  ASSERT_TRUE(wall.has_value());
  EXPECT_EQ(wall->state, CellState::Occupied);
  EXPECT_NEAR(wall->distance, 4.0, 0.1);
}

TEST(ObservedSpace, EndsAtTheRangeThatWasAskedFor) {
  PlanarMapParams params;
  params.max_range = 3.0;
  const PlanarMap map = mapOf({Hall().view()}, params);
  EXPECT_TRUE(map.isFree({0.05, 2.85, 0.05}));
  EXPECT_TRUE(map.isUnknown({0.05, 3.15, 0.05}));
  EXPECT_TRUE(map.isUnknown({2.05, 6.05, 0.05}));
}

TEST(ObservedSpace, ReachesBeyondThePointsThatAreMapped) {
  const View view = Hall().view();
  Indices near;
  for (std::size_t i = 0; i < view.xyz.size() / 3; ++i) {
    if (view.xyz[3 * i + 2] < 5.0f) near.push_back(static_cast<int>(i));
  }
  FrameObservation frame = view.frame();
  frame.indices = &near;
  PlanarMap map;
  map.insert(frame);
  EXPECT_FALSE(map.isOccupied({4.05, 12.05, 3.05}));
  expectSeenFromTheOrigin(map);
}

/// What seems to be free may lie behind a wall that seems too far away.
TEST(ObservedSpace, EndsBeforeFarPointsOfAStereoCameraByTheirError) {
  const auto mapWith = [](double disparity_error) {
    const View view = Hall().view();
    FrameObservation frame = view.frame();
    frame.noise = StereoNoise{0.12, 500.0, disparity_error};
    PlanarMap map;
    map.insert(frame);
    return map;
  };
  // 4 cells of error at 6.9 m, 1.2 m at the end of the hall: 0.8 m more.
  const PlanarMap map = mapWith(0.5);
  EXPECT_TRUE(map.isFree({0.05, 3.85, 0.05}));  // a near wall clears all before it
  EXPECT_TRUE(map.isFree({2.05, 6.05, 0.05}));
  EXPECT_TRUE(map.isFree({4.05, 11.05, 3.05}));
  EXPECT_FALSE(map.isFree({4.05, 11.35, 3.05}));
  EXPECT_TRUE(mapWith(0.0001).isFree({4.05, 11.35, 3.05}));
  // No more is known of what has an error of half its depth than of nearer points.
  const PlanarMap rough = mapWith(3.0);
  EXPECT_TRUE(rough.isFree({2.05, 5.25, 0.05}));
  EXPECT_FALSE(rough.isFree({4.05, 8.05, 3.05}));
}

TEST(ObservedSpace, IsNotAlongPixelsWithoutAMeasurement) {
  // The right half of the image, and of the left one a stripe of 12 pixels, measure nothing.
  View view = Hall().view();
  for (std::size_t i = 0; i < view.xyz.size() / 3; ++i) {
    const std::size_t column = i % 320;
    if (column >= 160 || (column >= 80 && column < 92)) {
      for (std::size_t k = 0; k < 3; ++k) view.xyz[3 * i + k] = test::kNanFloat;
    }
  }
  view.planes.clear();
  PlanarMap map;
  map.insert(view.frame());
  int free = 0;
  for (double y = 1.05; y < 12.0; y += 0.1) {
    for (double x = 0.15; x < 7.0; x += 0.1)
      EXPECT_FALSE(map.isFree({x, y, 0.05})) << x << ' ' << y;
    // The middle of the stripe; it is 0.048 y wide.
    if (y < 3.0) continue;
    EXPECT_FALSE(map.isFree({-73.5 / 250.0 * y, y, 0.05})) << y;
    free += map.isFree({-115.0 / 250.0 * y, y, 0.05}) ? 1 : 0;
  }
  EXPECT_GT(free, 80);
  // Scattered pixels without a measurement take nothing away.
  View scattered = Hall().view();
  for (std::size_t i = 0; i < scattered.xyz.size() / 3; i += 3)
    scattered.xyz[3 * i] = test::kNanFloat;
  for (std::size_t i = 0; i < scattered.xyz.size() / 3; i += 3)
    scattered.xyz[3 * i + 2] = test::kNanFloat;
  scattered.planes.clear();
  PlanarMap other;
  other.insert(scattered.frame());
  EXPECT_TRUE(other.isFree({0.05, 2.05, 0.05}));
  EXPECT_TRUE(other.isFree({4.05, 11.05, 3.05}));
}

TEST(ObservedSpace, OnceSeenFreeStaysKnownInWhateverOrderFramesCome) {
  const Vector3 behind(0.05, 6.05, 0.05);
  const View front = Hall().view(), side = Hall().view({5.0, 4.5, 0.0}, 1.2);
  EXPECT_TRUE(mapOf({front}).isUnknown(behind));
  for (const auto& views : {std::vector<View>{front, side}, {side, front}, {side, front, front}})
    EXPECT_TRUE(mapOf(views).isFree(behind));
}

TEST(ObservedSpace, OfTwoMapsIsWhatEitherSaw) {
  const View front = Hall().view(), side = Hall().view({5.0, 4.5, 0.0}, 1.2);
  PlanarMap merged = mapOf({front});
  merged.merge(mapOf({side}));
  const PlanarMap both = mapOf({front, side});
  std::size_t free = 0, different = 0;
  for (double x = -3.95; x < 8.0; x += 0.3) {
    for (double y = -0.95; y < 12.0; y += 0.3) {
      for (double z = -2.95; z < 3.0; z += 0.3) {
        const Vector3 p(x, y, z);
        free += both.isFree(p) ? 1 : 0;
        different += both.isUnknown(p) != merged.isUnknown(p) ? 1 : 0;
      }
    }
  }
  EXPECT_GT(free, 2000u);
  EXPECT_EQ(different, 0u);
  EXPECT_TRUE(merged.isUnknown({0.05, -0.55, 0.05}));
  // Placed elsewhere it is unknown where it was and free where it is.
  PlanarMap moved;
  Pose T = Pose::Identity();
  T.translation() = Vector3(20.0, 0.0, 0.0);
  moved.merge(mapOf({front}), T);
  EXPECT_TRUE(moved.isUnknown({0.05, 2.05, 0.05}));
  EXPECT_TRUE(moved.isFree({20.05, 2.05, 0.05}));
  EXPECT_TRUE(moved.isUnknown({20.05, 6.05, 0.05}));
}

TEST(ObservedSpace, IsKeptByFilesAndFinishedMaps) {
  for (const Unseen unseen : {Unseen::Unknown, Unseen::Free}) {
    PlanarMapParams params;
    params.unseen = unseen;
    const PlanarMap map = mapOf({Hall().view(), Hall().view({0.2, 0.1, 0.0}, 0.1)}, params);
    const PlanarMap finished = map.finished();
    const std::vector<std::uint8_t> full = map.serialize(), small = finished.serialize();
    const PlanarMap loaded = PlanarMap::deserialize(full.data(), full.size());
    const PlanarMap again = PlanarMap::deserialize(small.data(), small.size());
    EXPECT_EQ(loaded.serialize(), full);
    EXPECT_EQ(again.serialize(), small);
    for (double x = -9.95; x < 10.0; x += 0.7) {
      for (double y = -2.95; y < 20.0; y += 0.7) {
        for (double z = -3.95; z < 4.0; z += 0.7) {
          const CellState state = map.stateAt({x, y, z});
          ASSERT_EQ(finished.stateAt({x, y, z}), state);
          ASSERT_EQ(loaded.stateAt({x, y, z}), state);
          ASSERT_EQ(again.stateAt({x, y, z}), state);
        }
      }
    }
    const CellState beyond = unseen == Unseen::Unknown ? CellState::Unknown : CellState::Free;
    EXPECT_EQ(again.stateAt({1000.0, 1000.0, 1.0}), beyond);
    EXPECT_EQ(again.stateAt({0.05, -0.55, 0.05}), beyond);
    EXPECT_TRUE(again.isUnknown({0.05, 6.05, 0.05}));
  }
}

TEST(ObservedSpace, IsNotKeptTrackOfIfNotWanted) {
  PlanarMapParams params;
  params.unknown_space = false;
  EXPECT_TRUE(mapOf({Hall().view()}, params).isUnknown({0.05, 2.05, 0.05}));
  params.unseen = Unseen::Free;
  EXPECT_TRUE(mapOf({Hall().view()}, params).isFree({0.05, 6.05, 0.05}));
}

TEST(ObservedSpace, IsWholeWhereBlocksAreFarAway) {
  // 60 m along a hall whose sides no camera sees.
  Scene scene;
  scene.boxes = {{{-90.0, -1.0, -90.0}, {90.0, 60.0, 90.0}, true, true}};
  View view = look(scene, lookFrom({0.0, 0.0, 0.0}, 0.0, 0.0));
  view.planes.clear();
  const Indices nothing;
  FrameObservation frame = view.frame();
  frame.indices = &nothing;
  PlanarMap map;
  map.insert(frame);
  int free = 0;
  for (double y = 1.05; y < 59.0; y += 0.5) {
    free += map.isFree({0.5 * y, y, 0.4 * y}) ? 1 : 0;
    EXPECT_TRUE(map.isUnknown({0.66 * y + 0.1, y, 0.0})) << y;
    EXPECT_TRUE(map.isUnknown({0.0, y, -0.5 * y - 0.1})) << y;
  }
  EXPECT_EQ(free, 116);
  EXPECT_TRUE(map.isUnknown({0.0, 60.5, 0.0}));
  EXPECT_LT(map.memoryBytes(), 400000u);  // cells of one kind are stored as one
}

/// A lidar of 16 rings, 2 degrees apart, in the middle of a tube of 10 m radius.
TEST(ObservedSpace, OfALidarIsAroundItsRaysAndNotBetweenItsRings) {
  const double degree = M_PI / 180.0;
  std::vector<float> xyz;
  for (int ring = -8; ring < 8; ++ring) {
    const double elevation = (2.0 * ring + 1.0) * degree;
    for (int i = 0; i < 1800; ++i) {
      const double azimuth = 0.2 * degree * i;
      const Vector3 p(10.0 * std::cos(azimuth), 10.0 * std::sin(azimuth),
                      10.0 * std::tan(elevation));
      for (const double v : {p.x(), p.y(), p.z()}) xyz.push_back(static_cast<float>(v));
    }
  }
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  PlanarMap map;
  map.insert(frame);
  int on = 0, between = 0, all = 0;
  for (int i = 0; i < 90; ++i) {
    const double azimuth = (4.0 * i + 1.1) * degree;
    for (const double range : {2.0, 4.0, 6.0, 8.0, 9.5}) {
      const Vector3 to(range * std::cos(azimuth), range * std::sin(azimuth), 0.0);
      ++all;
      on += map.isFree(to + Vector3(0.0, 0.0, range * std::tan(3.0 * degree))) ? 1 : 0;
      // A degree from either ring is 0.14 m at 8 m.
      if (range < 7.0) continue;
      between += map.isFree(to + Vector3(0.0, 0.0, range * std::tan(4.0 * degree))) ? 1 : 0;
    }
  }
  EXPECT_GE(on, all * 95 / 100);
  EXPECT_EQ(between, 0);
  EXPECT_TRUE(map.isUnknown({0.0, 0.0, 3.0}));   // above all rings
  EXPECT_TRUE(map.isUnknown({12.0, 0.0, 0.0}));  // behind the tube
  EXPECT_TRUE(map.isFree({0.0, 0.0, 0.0}));      // where the sensor is
}

}  // namespace
}  // namespace planar_mapping
