// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/trajectory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::detail {
namespace {

void expectSame(const StoredPose& a, const StoredPose& b) {
  EXPECT_EQ(a.timestamp, b.timestamp);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.orientation, b.orientation);
}

/// Every way to read gives what was pushed.
void expectHolds(const Trajectory& trajectory, const std::vector<StoredPose>& poses) {
  ASSERT_EQ(trajectory.size(), poses.size());
  for (const std::size_t from : {std::size_t{0}, std::size_t{63}, poses.size() / 2, poses.size()}) {
    std::size_t next = from;
    trajectory.forEach(from, [&](const StoredPose& pose) { expectSame(pose, poses[next++]); });
    EXPECT_EQ(next, std::max(from, poses.size()));
  }
  for (std::size_t i = 0; i < poses.size(); ++i) expectSame(trajectory.at(i), poses[i]);
  if (!poses.empty()) expectSame(trajectory.back(), poses.back());
}

Trajectory packed(const std::vector<StoredPose>& poses) {
  Trajectory trajectory;
  for (const StoredPose& pose : poses) trajectory.push(pose);
  return trajectory;
}

Vector3 anyPlace(Random& random, double reach) {
  return {random.uniform(-reach, reach), random.uniform(-reach, reach),
          random.uniform(-reach, reach)};
}

TEST(Trajectory, IsEmptyAtFirst) {
  expectHolds(Trajectory(), {});
  EXPECT_TRUE(Trajectory().empty());
  EXPECT_EQ(Trajectory().memoryBytes(), 0u);
}

TEST(Trajectory, HoldsPosesWithoutAnyOrder) {
  Random random(5);
  std::vector<StoredPose> poses;
  for (int i = 0; i < 500; ++i) {
    const Quaternion turn(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0),
                          random.uniform(-1.0, 1.0), 0.5);
    // Seconds back and forth, and now and then nanoseconds, which are not kept to the microsecond.
    const double time = i % 7 == 0 ? random.uniform(0.0, 2e18) : random.uniform(-3e9, 3e9);
    const double reach = i % 5 == 0 ? kFarthestPose : 10.0;
    poses.push_back(StoredPose::from(time, turn.normalized(), anyPlace(random, reach)));
  }
  expectHolds(packed(poses), poses);
}

TEST(Trajectory, GoesOnAfterACopy) {
  Random random(6);
  std::vector<StoredPose> poses;
  Trajectory trajectory;
  for (int i = 0; i < 200; ++i) {
    poses.push_back(StoredPose::from(0.1 * (i / 3), Quaternion::Identity(),
                                     i % 40 < 20 ? Vector3::Zero() : anyPlace(random, 1.0)));
    const Trajectory copy = trajectory;
    trajectory = copy;
    trajectory.push(poses.back());
  }
  expectHolds(trajectory, poses);
}

TEST(Trajectory, TakesAFewBytesAPoseAndNextToNoneAtRest) {
  Random random(7);
  std::vector<StoredPose> moving, resting;
  for (int i = 0; i < 1000; ++i) {
    const Quaternion turn(Eigen::AngleAxisd(0.01 * i, Vector3::UnitZ()));
    const Vector3 shaken = Vector3(0.02 * i, 0.0, 1.0) + anyPlace(random, 0.002);
    moving.push_back(StoredPose::from(1.7e9 + i / 30.0, turn, shaken));
    resting.push_back(StoredPose::from(1.7e9 + 0.1 * i, Quaternion::Identity(), Vector3::Zero()));
  }
  expectHolds(packed(moving), moving);
  expectHolds(packed(resting), resting);
  EXPECT_LT(packed(moving).memoryBytes(), 1000u * sizeof(StoredPose) / 3);
  EXPECT_LT(packed(resting).memoryBytes(), 1000u);
}

TEST(Trajectory, TakesNextToNothingWhileAllGoesOnAsItDid) {
  std::vector<StoredPose> poses;
  for (int i = 0; i < 1000; ++i) {
    poses.push_back(StoredPose::from(0.1 * i, Quaternion::Identity(), Vector3(0.25 * i, 0.0, 1.0)));
  }
  const Trajectory steady = packed(poses);
  expectHolds(steady, poses);
  EXPECT_LT(Trajectory(steady).memoryBytes(), 100u);
}

TEST(Trajectory, GoesOnAfterResting) {
  Random random(8);
  std::vector<StoredPose> poses;
  Trajectory resting;
  for (int i = 0; i < 3000; ++i) {
    // At rest for a while, then moving, over the ends of chunks.
    const double moved = i / 100 % 2 == 0 ? 0.0 : 0.01 * i;
    poses.push_back(StoredPose::from(0.1 * i, Quaternion::Identity(), Vector3(moved, 0.0, 1.0)));
    resting.push(poses.back());
    if (random.uniform(0.0, 1.0) < 0.5) resting.rest();
    expectSame(resting.back(), poses.back());
    if (random.uniform(0.0, 1.0) < 0.1) resting = Trajectory(resting);
  }
  expectHolds(resting, poses);
  Trajectory once = packed(poses);
  once.rest();
  resting.rest();
  EXPECT_EQ(Trajectory(resting).memoryBytes(), Trajectory(once).memoryBytes());
}

}  // namespace
}  // namespace planar_mapping::detail
