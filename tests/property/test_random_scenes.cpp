// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What holds of maps of any scene: rooms with boxes, looked at from several places.
#include <gtest/gtest.h>

#include <rapidcheck.h>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "map_scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/map_query.h"

namespace planar_mapping {
namespace {

using namespace test;

/// The same scenes in each run; RC_PARAMS="seed=2 max_success=1000" asks for others.
const int kEnvironment = setenv("RC_PARAMS", "seed=1 max_success=25", 0);

constexpr double kCell = 0.125;
constexpr double kDiagonal = 1.7321 * kCell;

struct Walk {
  std::vector<View> views;
  Profile profile = Profile::Compact;
};

int anyOf(int low, int below) {
  return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(low, below));
}
/// Off the grid of cells: on a border of two, the last digit decides.
double between(double low, double high) {
  return low + (high - low) * (anyOf(0, 1 << 20) + 0.37) / (1 << 20);
}

/// \p frames at most
Walk anyWalk(int frames = 4) {
  Scene scene;
  scene.camera = {60.0, 60.0, 39.5, 29.5, 80, 60};
  const Vector3 half(between(1.51, 4.0), between(1.51, 4.0), between(1.31, 1.4));
  const Vector3 middle(between(-0.5, 0.5), between(-0.5, 0.5), 1.3);
  scene.boxes = {{middle - half, middle + half, true, true}};
  for (int i = anyOf(0, 4); i > 0; --i) {
    const Vector3 low(between(-1.2, 0.8) * half.x(), between(0.1, 0.7) * half.y(), 0.01);
    const Vector3 size(between(0.2, 1.0), between(0.2, 1.0), between(0.2, 1.5));
    scene.boxes.push_back({low, low + size, false, *rc::gen::arbitrary<bool>()});
  }
  Walk walk;
  walk.profile = *rc::gen::element(Profile::Compact, Profile::Paper);
  const int count = anyOf(1, frames + 1);
  for (int i = 0; i < count; ++i) {
    const Vector3 position(between(-0.3, 0.3), between(-1.0, 0.0), between(0.8, 1.6));
    walk.views.push_back(
        test::look(scene, test::lookFrom(position, between(-0.6, 0.6), between(-0.1, 0.4)), i));
  }
  return walk;
}

PlanarMapParams paramsOf(const Walk& walk) {
  PlanarMapParams params = PlanarMapParams::of(walk.profile);
  params.approximation.profile = walk.profile;
  params.approximation.resolution = kCell;
  return params;
}

PlanarMap mapOf(const Walk& walk, const PlanarMapParams& params, const Pose& moved) {
  PlanarMap map(params);
  for (const View& view : walk.views) {
    FrameObservation frame = view.frame();
    frame.T_world_sensor = moved * view.pose;
    map.insert(frame);
  }
  return map;
}
PlanarMap mapOf(const Walk& walk) {
  return mapOf(walk, paramsOf(walk), Pose::Identity());
}

Vector3 anyPlace() {
  return {between(-5, 5), between(-5, 5), between(-0.5, 3)};
}
Vector3 pointOf(const View& view, std::size_t i) {
  return Vector3(view.xyz[3 * i], view.xyz[3 * i + 1], view.xyz[3 * i + 2]);
}
bool isWithin(const Cuboid& cuboid, const Vector3& point) {
  const Vector3 at = cuboid.orientation.conjugate() * (point - cuboid.center);
  return (at.cwiseAbs().array() < 0.5 * cuboid.size.array()).all();
}
/// Whatever a property throws counts as its failure.
template <typename Property>
void expectHolds(const Property& property) {
  EXPECT_TRUE(rc::check(property));
}

TEST(RandomScenes, SavedAndLoadedIsTheSameMap) {
  expectHolds([] {
    const PlanarMap map = mapOf(anyWalk());
    const std::vector<std::uint8_t> saved = map.serialize();
    const PlanarMap loaded = PlanarMap::deserialize(saved.data(), saved.size());
    RC_ASSERT(loaded.serialize() == saved);
    for (int i = 0; i < 100; ++i) {
      const Vector3 p = anyPlace();
      RC_ASSERT(map.stateAt(p) == loaded.stateAt(p));
    }
  });
}

TEST(RandomScenes, ThreadsChangeNothing) {
  expectHolds([] {
    const Walk walk = anyWalk();
    PlanarMapParams params = paramsOf(walk);
    const std::vector<std::uint8_t> one = mapOf(walk, params, Pose::Identity()).serialize();
    params.approximation.threads = 3;
    RC_ASSERT(mapOf(walk, params, Pose::Identity()).serialize() == one);
  });
}

TEST(RandomScenes, FreeAndUnknownSpaceNeverOverlap) {
  expectHolds([] {
    const PlanarMap map = mapOf(anyWalk());
    for (int i = 0; i < 200; ++i) {
      const Vector3 p = anyPlace();
      RC_ASSERT(map.isOccupied(p) + map.isFree(p) + map.isUnknown(p) == 1);
    }
    const Vector3 low(-4, -4, -1), high(4, 4, 3);
    const std::vector<Cuboid> free = map.spaceCuboids(CellState::Free, low, high);
    const std::vector<Cuboid> unknown = map.spaceCuboids(CellState::Unknown, low, high);
    for (const Cuboid& a : free) {
      RC_ASSERT(map.stateAt(a.center) != CellState::Unknown);
      for (const Cuboid& b : unknown) {
        const Vector3 apart = (a.center - b.center).cwiseAbs() - 0.5 * (a.size + b.size);
        RC_ASSERT(apart.maxCoeff() > -1e-9);
      }
    }
  });
}

// Space is judged in regions of 32 x 32 x 32 cells. Boxes of what is no plane are joined in the
// order of their places, so that other ones may be joined, and cover other unknown cells between.
TEST(RandomScenes, AMotionByWholeRegionsMovesTheMap) {
  expectHolds([] {
    const Walk walk = anyWalk();
    Pose motion = Pose::Identity();
    motion.translation() = 32 * kCell * Vector3(anyOf(-99, 99), anyOf(-99, 99), anyOf(-99, 99));
    const PlanarMap map = mapOf(walk);
    const PlanarMap moved = mapOf(walk, paramsOf(walk), motion);
    RC_ASSERT(map.planes().size() == moved.planes().size());
    int other = 0;
    for (int i = 0; i < 200; ++i) {
      const Vector3 p = anyPlace();
      const CellState here = map.stateAt(p), there = moved.stateAt(motion * p);
      RC_ASSERT(here == there || here == CellState::Occupied || there == CellState::Occupied);
      other += here == there ? 0 : 1;
    }
    RC_ASSERT(other <= 2);
  });
}

// Any motion moves the planes; cells and space stay on the grid of the world.
TEST(RandomScenes, AnyMotionMovesThePlanes) {
  expectHolds([] {
    const Walk walk = anyWalk();
    Pose motion = Pose::Identity();
    motion.linear() = Eigen::AngleAxisd(between(-3, 3), Vector3::UnitZ()).toRotationMatrix();
    motion.translation() = Vector3(between(-9, 9), between(-9, 9), between(-9, 9));
    const PlanarMap map = mapOf(walk);
    const PlanarMap moved = mapOf(walk, paramsOf(walk), motion);
    RC_ASSERT(map.planes().size() == moved.planes().size());
    for (std::size_t i = 0; i < map.planes().size(); ++i) {
      const Plane expected = transformed(map.planes()[i].plane, motion);
      const Plane& plane = moved.planes()[i].plane;
      RC_ASSERT((expected.normal - plane.normal).norm() < 1e-6);
      RC_ASSERT(std::abs(expected.offset - plane.offset) < 1e-5);
    }
  });
}

TEST(RandomScenes, TheOrderOfThePointsChangesNoCell) {
  expectHolds([] {
    const Walk walk = anyWalk(1);
    const View& view = walk.views[0];
    const std::size_t count = view.xyz.size() / 3;
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    Random random(static_cast<std::uint64_t>(anyOf(0, 1000)));
    for (std::size_t i = count; i > 1; --i)
      std::swap(order[i - 1], order[random.below(static_cast<std::uint32_t>(i))]);
    const auto insert = [&](const std::vector<std::size_t>& from, PlanarMap& map) {
      std::vector<float> xyz;
      std::vector<int> place(count);
      for (std::size_t i = 0; i < count; ++i) {
        place[from[i]] = static_cast<int>(i);
        for (std::size_t k = 0; k < 3; ++k) xyz.push_back(view.xyz[3 * from[i] + k]);
      }
      std::vector<PlaneSegment> planes = view.planes;
      for (PlaneSegment& plane : planes) {
        for (int& i : plane.inliers) i = place[static_cast<std::size_t>(i)];
        std::sort(plane.inliers.begin(), plane.inliers.end());
      }
      FrameObservation frame;
      frame.T_world_sensor = view.pose;
      frame.points = PointsView(xyz.data(), count);
      frame.planes = &planes;
      map.insert(frame);
    };
    std::vector<std::size_t> as_it_was(count);
    std::iota(as_it_was.begin(), as_it_was.end(), std::size_t{0});
    PlanarMap one(paramsOf(walk)), two(paramsOf(walk));
    insert(as_it_was, one);
    insert(order, two);
    RC_ASSERT(one.cuboidCount() == two.cuboidCount());
    for (int i = 0; i < 200; ++i) {
      const Vector3 p = anyPlace();
      RC_ASSERT(one.stateAt(p) == two.stateAt(p));
    }
  });
}

TEST(RandomScenes, MergingIsCommutativeAndIdempotent) {
  expectHolds([] {
    Walk walk = anyWalk(6);
    const std::size_t half = walk.views.size() / 2;
    Walk later = walk;
    later.views.erase(later.views.begin(), later.views.begin() + static_cast<long>(half));
    walk.views.resize(half);
    const PlanarMap a = mapOf(walk);
    const PlanarMap b = mapOf(later);
    PlanarMap ab = a, ba = b, aa = a;
    ab.merge(b);
    ba.merge(a);
    aa.merge(a);
    RC_ASSERT(ab.serialize() == ba.serialize());
    RC_ASSERT(aa.serialize() == a.serialize());
    PlanarMap abb = ab;
    abb.merge(b);
    for (int i = 0; i < 200; ++i) {
      const Vector3 p = anyPlace();
      RC_ASSERT(abb.stateAt(p) == ab.stateAt(p));
    }
  });
}

// A ray of the sensor meets a cuboid where it measured; early only within a diagonal of a cell of
// another measurement, and late or never only where few points lie in a cell.
TEST(RandomScenes, QueriesAgreeWithTheDepthImage) {
  expectHolds([] {
    const Walk walk = anyWalk(1);
    const View& view = walk.views[0];
    const PlanarMap map = mapOf(walk);
    int rays = 0, late = 0;
    for (std::size_t i = 0; i < view.xyz.size() / 3; i += 61) {
      const Vector3 p = pointOf(view, i);
      if (!p.allFinite()) continue;
      ++rays;
      const auto hit = castRay(map, view.pose.translation(), view.pose.linear() * p, 20.0,
                               UnknownSpaceIs::Transparent);
      if (!hit || hit->distance > p.norm() + 2.0 * kDiagonal) {
        ++late;
        continue;
      }
      if (hit->distance > p.norm() - 2.0 * kDiagonal) continue;
      double nearest = 1e9;
      const Vector3 at = view.pose.inverse() * hit->point;
      for (std::size_t k = 0; k < view.xyz.size() / 3; ++k) {
        const Vector3 q = pointOf(view, k);
        if (q.allFinite()) nearest = std::min(nearest, (q - at).norm());
      }
      RC_ASSERT(nearest < 2.0 * kDiagonal);
    }
    RC_ASSERT(late <= rays / 10);
  });
}

// Margin: two diagonals of a cell.
TEST(RandomScenes, NoCuboidStandsWhereAllRaysPassed) {
  expectHolds([] {
    const Walk walk = anyWalk();
    const PlanarMap map = mapOf(walk);
    const auto passed = [](const View& view, const Vector3& place) {
      const Vector3 p = view.pose.inverse() * place;
      if (p.z() < 0.1) return 0;
      const int reach = 1 + static_cast<int>(view.camera.fx * kDiagonal / p.z());
      const int column =
          static_cast<int>(std::lround(view.camera.fx * p.x() / p.z() + view.camera.cx));
      const int row =
          static_cast<int>(std::lround(view.camera.fy * p.y() / p.z() + view.camera.cy));
      if (column - reach < 0 || row - reach < 0 || column + reach >= view.camera.width ||
          row + reach >= view.camera.height) {
        return 0;
      }
      for (int r = row - reach; r <= row + reach; ++r) {
        for (int c = column - reach; c <= column + reach; ++c) {
          const Vector3 q = pointOf(view, static_cast<std::size_t>(r * view.camera.width + c));
          if (!(q.z() > p.z() + 2.0 * kDiagonal)) return -1;
        }
      }
      return 1;
    };
    for (const Cuboid& cuboid : map.cuboids()) {
      for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
          const Vector3 place =
              cuboid.center +
              cuboid.orientation * (0.4 * cuboid.size.cwiseProduct(Vector3(x, y, 0)));
          RC_ASSERT(isWithin(cuboid, place));
          int by = 0, against = 0;
          for (const View& view : walk.views) {
            const int answer = passed(view, place);
            by += answer > 0;
            against += answer < 0;
          }
          RC_ASSERT(by == 0 || against > 0);
        }
      }
    }
  });
}

}  // namespace
}  // namespace planar_mapping
