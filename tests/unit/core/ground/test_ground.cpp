// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/ground/ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "ground_scene.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

using test::GroundScene;

/// The camera of the scenes, as the paper has it.
GroundParams paperParams() {
  GroundParams params;
  params.camera_height = GroundParams::kPaperCameraHeight;
  params.up = -Vector3::UnitY();
  return params;
}

/// The ground of a scene, which has one.
Ground groundOf(GroundScene& scene, const GroundParams& params = paperParams()) {
  scene.render();
  const Ground ground = findGround(scene.view(), nullptr, params);
  EXPECT_TRUE(ground.found) << toString(ground.diagnostics.status);
  return ground;
}

TEST(Ground, FlatGroundIsFoundAndRemoved) {
  GroundScene scene;
  scene.wall_distance = 3.0;
  const Ground ground = groundOf(scene);
  EXPECT_NEAR(ground.height, 0.37, 1e-3);
  EXPECT_NEAR((ground.plane.normal - Vector3(0, -1, 0)).norm(), 0.0, 1e-3);
  EXPECT_NEAR(ground.plane.offset, 0.37, 1e-3);
  EXPECT_GT(scene.fraction(ground.is_ground, 1), 0.99);
  EXPECT_LT(scene.fraction(ground.is_ground, 2), 0.02);
}

TEST(Ground, FootOfAWallStays) {
  GroundScene scene;
  scene.wall_distance = 1.5;
  GroundParams params = paperParams();
  params.distance_threshold = 0.05;
  const Ground ground = groundOf(scene, params);
  // Wall points under the threshold, but over the narrow band at a wall's foot.
  std::size_t low = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    const double over = 0.37 - scene.xyz[3 * i + 1];
    if (scene.truth[i] != 2 || over > 0.05 || over < 0.012) continue;
    ++low;
    kept += ground.is_ground[i] ? 0 : 1;
  }
  ASSERT_GT(low, 500u);
  EXPECT_EQ(kept, low);
  EXPECT_GT(ground.diagnostics.wall_foot_points, 0u);
  params.wall_height = 0.0;
  EXPECT_EQ(findGround(scene.view(), nullptr, params).diagnostics.wall_foot_points, 0u);
}

TEST(Ground, PitchAndRollWithinToleranceAreFollowed) {
  for (const double pitch : {-0.1, 0.15, 0.22}) {
    for (const double roll : {-0.12, 0.0, 0.12}) {
      GroundScene scene;
      scene.pitch = pitch;
      scene.roll = roll;
      scene.disparity_noise = 0.2;
      scene.wall_distance = 4.0;
      SCOPED_TRACE(std::to_string(pitch) + " " + std::to_string(roll));
      const Ground ground = groundOf(scene);
      const Vector3 up = scene.levelFromCamera().transpose() * Vector3::UnitZ();
      EXPECT_LT(std::acos(std::min(1.0, ground.plane.normal.dot(up))), 0.01)
          << pitch << " " << roll;
      EXPECT_NEAR(ground.height, 0.37, 0.01);
    }
  }
}

TEST(Ground, TiltBeyondToleranceIsNoGround) {
  GroundScene scene;
  scene.pitch = 0.6;
  scene.render();
  const Ground ground = findGround(scene.view(), nullptr, paperParams());
  EXPECT_FALSE(ground.found);
  EXPECT_EQ(std::count(ground.is_ground.begin(), ground.is_ground.end(), 1), 0);
}

TEST(Ground, NoiseOfTheStereoCameraIsFollowed) {
  GroundScene scene;
  scene.disparity_noise = 0.5;
  scene.pitch = 0.05;
  scene.render();
  GroundParams params = paperParams();
  params.distance_threshold = 0.01;
  const double fixed = scene.fraction(findGround(scene.view(), nullptr, params).is_ground, 1);
  params.noise = StereoNoise{GroundScene::kBaseline, scene.focal, 0.5};
  const double following = scene.fraction(findGround(scene.view(), nullptr, params).is_ground, 1);
  EXPECT_GT(following, 0.98);
  EXPECT_LT(fixed, 0.95);
}

TEST(Ground, RampAheadIsFollowed) {
  GroundScene scene;
  scene.ground = [](double x, double) { return 0.15 * std::max(0.0, x - 2.0); };  // 8.5 degrees
  scene.wall_distance = 6.0;
  GroundParams params = paperParams();
  const Ground followed = groundOf(scene, params);
  EXPECT_GT(scene.fraction(followed.is_ground, 1), 0.97);
  EXPECT_LT(scene.fraction(followed.is_ground, 2), 0.05);
  EXPECT_GT(followed.diagnostics.slope_cells, 0u);
  params.slope_cell = 0.0;
  EXPECT_LT(scene.fraction(findGround(scene.view(), nullptr, params).is_ground, 1), 0.9);
}

TEST(Ground, RampDownIsFollowed) {
  GroundScene scene;
  scene.ground = [](double x, double) { return -0.1 * std::max(0.0, x - 1.5); };
  scene.pitch = 0.15;
  const Ground ground = groundOf(scene);
  EXPECT_GT(scene.fraction(ground.is_ground, 1), 0.95);
}

TEST(Ground, KerbStays) {
  GroundScene scene;
  // A pavement 12 cm above the road from 0.5 m to the left on.
  scene.ground = [](double, double y) { return y > 0.5 ? 0.12 : 0.0; };
  scene.pitch = 0.1;
  const Ground ground = groundOf(scene);
  EXPECT_NEAR(ground.height, 0.37, 0.01);
  std::size_t road = 0, road_removed = 0, kerb = 0, kerb_removed = 0;
  const auto level = scene.robotFrame();
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    if (scene.truth[i] != 1) continue;
    const double height = level[3 * i + 2] + 0.37;
    (height > 0.05 ? kerb : road) += 1;
    (height > 0.05 ? kerb_removed : road_removed) += ground.is_ground[i];
  }
  ASSERT_GT(kerb, 2000u);
  EXPECT_GT(static_cast<double>(road_removed) / static_cast<double>(road), 0.97);
  EXPECT_LT(static_cast<double>(kerb_removed) / static_cast<double>(kerb), 0.02);
}

TEST(Ground, StairsUpStay) {
  GroundScene scene;
  scene.ground = [](double x, double) {
    return x < 1.5 ? 0.0 : 0.16 * (1 + std::floor((x - 1.5) / 0.3));
  };
  scene.pitch = 0.1;
  const Ground ground = groundOf(scene);
  const auto level = scene.robotFrame();
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    if (scene.truth[i] == 1 && level[3 * i + 2] + 0.37 > 0.05) {
      ASSERT_EQ(ground.is_ground[i], 0) << "height " << level[3 * i + 2] + 0.37;
    }
  }
}

TEST(Ground, WallWithoutFloorIsNoGround) {
  // The camera looks at a wall from near by; the floor is out of sight.
  GroundScene scene;
  scene.pitch = -0.2;
  scene.wall_distance = 0.6;
  scene.wall_top = 3.0;
  scene.render();
  ASSERT_EQ(std::count(scene.truth.begin(), scene.truth.end(), 1), 0);
  for (const double height : {0.37, 0.0}) {
    GroundParams params = paperParams();
    params.camera_height = height;
    params.up = scene.levelFromCamera().transpose() * Vector3::UnitZ();
    const Ground ground = findGround(scene.view(), nullptr, params);
    EXPECT_FALSE(ground.found) << height;
    EXPECT_NE(ground.diagnostics.status, GroundStatus::Found);
    EXPECT_EQ(std::count(ground.is_ground.begin(), ground.is_ground.end(), 1), 0);
    EXPECT_EQ(ground.covariance, Matrix4(Matrix4::Zero()));
  }
}

TEST(Ground, TableTopAtAnotherHeightIsNotTheGround) {
  GroundScene scene;
  scene.camera_height = 1.2;
  scene.ground = [](double x, double y) {
    return x > 0.8 && x < 2.0 && std::abs(y) < 0.8 ? 0.7 : 0.0;
  };
  scene.pitch = 0.4;
  scene.render();
  GroundParams params = paperParams();
  params.up = scene.levelFromCamera().transpose() * Vector3::UnitZ();
  for (const double height : {1.2, 0.0}) {
    params.camera_height = height;
    const Ground ground = findGround(scene.view(), nullptr, params);
    ASSERT_TRUE(ground.found);
    EXPECT_NEAR(ground.height, 1.2, 0.02) << "prior " << height;
  }
}

TEST(Ground, IsRepeatableAndTheSeedMattersLittle) {
  GroundScene scene;
  scene.wall_distance = 3.0;
  scene.disparity_noise = 0.3;
  scene.render();
  GroundParams params = paperParams();
  const Ground a = findGround(scene.view(), nullptr, params);
  const Ground b = findGround(scene.view(), nullptr, params);
  EXPECT_EQ(a.is_ground, b.is_ground);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    params.seed = seed;
    const Ground c = findGround(scene.view(), nullptr, params);
    ASSERT_TRUE(c.found) << seed;
    EXPECT_NEAR(c.height, 0.37, 0.005);
    EXPECT_GT(scene.fraction(c.is_ground, 1), 0.97);
  }
}

TEST(Ground, IsTheSameWithAnyNumberOfThreads) {
  GroundScene scene;
  scene.wall_distance = 2.0;
  scene.disparity_noise = 0.2;
  scene.render();
  // Several times over, so that there is enough for more than one thread; columns are counted to
  // the end of their range.
  std::vector<float> xyz;
  while (xyz.size() < 3 * 300000) xyz.insert(xyz.end(), scene.xyz.begin(), scene.xyz.end());
  const PointsView points(xyz.data(), xyz.size() / 3);
  GroundParams params = paperParams();
  const Ground one = findGround(points, nullptr, params);
  ASSERT_TRUE(one.found);
  ASSERT_GT(one.diagnostics.wall_foot_points, 0u);
  for (const int threads : {2, 3, 16}) {
    params.threads = threads;
    const Ground several = findGround(points, nullptr, params);
    EXPECT_EQ(several.is_ground, one.is_ground);
    EXPECT_EQ(several.diagnostics.wall_foot_points, one.diagnostics.wall_foot_points);
    EXPECT_EQ(several.diagnostics.ground_points, one.diagnostics.ground_points);
    EXPECT_EQ(several.diagnostics.points_not_measured, one.diagnostics.points_not_measured);
  }
}

TEST(Ground, CovarianceCoversTheErrorOfThePlane) {
  int within = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    GroundScene scene;
    scene.width = 160;
    scene.height = 120;
    scene.disparity_noise = 0.1;
    scene.max_range = 3.0;
    scene.pitch = 0.2;
    scene.seed = seed;
    GroundParams params = paperParams();
    params.slope_cell = 0.0;
    const Ground ground = groundOf(scene, params);
    EXPECT_GT(ground.covariance(3, 3), 0.0);
    within += std::abs(ground.plane.offset - 0.37) < 4.0 * std::sqrt(ground.covariance(3, 3));
  }
  EXPECT_GE(within, 24);
}

TEST(Ground, EmptyAndTinyCloudsHaveNone) {
  EXPECT_EQ(findGround(PointsView(), nullptr, paperParams()).diagnostics.status,
            GroundStatus::TooFewPoints);
  const std::vector<float> one{0, 0.37f, 1};
  const Ground ground = findGround({one.data(), 1}, nullptr, paperParams());
  EXPECT_FALSE(ground.found);
  EXPECT_EQ(ground.is_ground, (std::vector<std::uint8_t>{0}));
}

TEST(Ground, DegenerateCloudsHaveNone) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  for (const int kind : {0, 1, 2, 3, 4}) {
    std::vector<float> xyz;
    for (int i = 0; i < 2000; ++i) {
      const float t = 0.001f * static_cast<float>(i);
      if (kind == 0) xyz.insert(xyz.end(), {nan, nan, nan});
      if (kind == 1) xyz.insert(xyz.end(), {t, 0.37f, 1.0f});     // collinear, at ground height
      if (kind == 2) xyz.insert(xyz.end(), {0.5f, 0.37f, 1.0f});  // one point many times
      if (kind == 3) xyz.insert(xyz.end(), {1e9f + t, 1e9f, 1e9f});
      if (kind == 4) xyz.insert(xyz.end(), {inf, -inf, i % 2 ? 3e38f : inf});
    }
    for (const double height : {0.37, 0.0}) {
      GroundParams params = paperParams();
      params.camera_height = height;
      const Ground ground = findGround({xyz.data(), xyz.size() / 3}, nullptr, params);
      EXPECT_FALSE(ground.found) << "kind " << kind << " height " << height;
      EXPECT_EQ(ground.is_ground.size(), 2000u);
    }
  }
}

TEST(Ground, HostilePointsAmongGoodOnesAreNotRemoved) {
  GroundScene scene;
  scene.wall_distance = 3.0;
  scene.render();
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(), 1e9f, -3e38f,
                       std::numeric_limits<float>::infinity(), -1e9f};
  std::size_t not_finite = 0;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    if (i % 10 == 0) {
      for (int k = 0; k < 3; ++k) scene.xyz[3 * i + k] = bad[(i / 10 + k) % 5];
      scene.truth[i] = 3;
    }
    not_finite += scene.view().isMeasured(i) ? 0 : 1;
  }
  const Ground ground = findGround(scene.view(), nullptr, paperParams());
  ASSERT_TRUE(ground.found);
  EXPECT_EQ(scene.fraction(ground.is_ground, 3), 0.0);
  EXPECT_GT(scene.fraction(ground.is_ground, 1), 0.99);
  EXPECT_EQ(ground.diagnostics.points_not_measured, not_finite);
}

/// All ranges: Parameters.GroundRemoval of tests/contract.
TEST(Ground, RejectsBadArguments) {
  GroundParams params = paperParams();
  params.noise = StereoNoise{0, 1, 1};
  EXPECT_THROW(findGround(PointsView(), nullptr, params), ParameterError);
  const std::vector<float> one{0, 0, 1};
  const Indices outside{1};
  EXPECT_THROW(findGround({one.data(), 1}, &outside, paperParams()), InputError);
}

}  // namespace
}  // namespace planar_mapping
