// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <vector>

#include "depth_scene.h"
#include "numbers.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {
namespace {

using namespace test;

MultiPlaneParams organized(double distance_threshold = 0.05, int min_inliers = 500) {
  MultiPlaneParams params;
  params.method = PlaneSearchMethod::Organized;
  params.distance_threshold = distance_threshold;
  params.min_inliers = min_inliers;
  return params;
}

PlaneSet search(const DepthScene& scene, const MultiPlaneParams& params) {
  return findPlanes(scene.view(), nullptr, params);
}

void expectSurfaceFound(const DepthScene& scene, const PlaneSet& set, int surface,
                        double min_recall, double max_angle) {
  std::size_t k = 0;
  ASSERT_GE(recall(scene, set, surface, &k), min_recall) << "surface " << surface;
  EXPECT_LE(angleBetween(set.planes[k].plane, scene.plane(surface)), max_angle)
      << "surface " << surface;
}

/// The planes are these two surfaces.
void expectJust(const DepthScene& scene, const PlaneSet& set, int one, int other, double min_recall,
                double max_angle) {
  ASSERT_EQ(set.planes.size(), 2u);
  expectSurfaceFound(scene, set, one, min_recall, max_angle);
  expectSurfaceFound(scene, set, other, min_recall, max_angle);
}

TEST(OrganizedPlanes, FindsPlanesExactlyAndWithNoiseAndMissingPixels) {
  struct Case {
    double noise, missing, min_recall, max_degrees;
  };
  for (const Case& one : {Case{0.0, 0.0, 0.97, 0.02}, Case{0.0015, 0.2, 0.95, 0.3}}) {
    DepthScene scene = cornerOfARoom();
    scene.render(one.noise, one.missing, one.noise > 0.0 ? 2 : 1);
    const PlaneSet set = search(scene, organized());
    ASSERT_EQ(set.planes.size(), 3u);
    for (int surface = 0; surface < 3; ++surface)
      expectSurfaceFound(scene, set, surface, one.min_recall, one.max_degrees * test::kDegree);
  }
}

TEST(OrganizedPlanes, AnImageWithoutThePixelsThatMeasuredNothingHasItsPlanes) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.0015, 0.2, 2);
  MultiPlaneParams params = organized();
  const PlaneSet expected = search(scene, params);
  std::vector<float> dense;
  Indices pixels;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    if (!scene.view().isMeasured(i)) continue;
    dense.insert(dense.end(), scene.view()[i], scene.view()[i] + 3);
    pixels.push_back(static_cast<int>(i));
  }
  params.method = PlaneSearchMethod::Automatic;
  const PlaneSet found = findPlanes({dense.data(), pixels.size()}, nullptr, params);
  EXPECT_EQ(found.diagnostics.method, PlaneSearchMethod::Organized);
  ASSERT_EQ(found.planes.size(), expected.planes.size());
  for (std::size_t k = 0; k < found.planes.size(); ++k) {
    Indices inliers = found.planes[k].inliers;
    for (int& inlier : inliers) inlier = pixels[static_cast<std::size_t>(inlier)];
    EXPECT_EQ(inliers, expected.planes[k].inliers);
  }
}

/// Cameras along each axis and scanners about each.
TEST(OrganizedPlanes, AShuffledImageHasItsPlanes) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.0015, 0.2, 2);
  const PlaneSet expected = search(scene, organized());
  const Vector3 sensor(0.5, -2.0, 1.0);
  MultiPlaneParams params = organized();
  params.method = PlaneSearchMethod::Automatic;
  for (const int turn : {0, 1, 2}) {
    std::vector<float> mixed;
    Indices pixels;
    const std::size_t all = scene.truth.size();
    for (std::size_t i = 0; i < all; ++i) {
      const std::size_t pixel = 7919 * i % all;
      if (!scene.view().isMeasured(pixel)) continue;
      const Vector3 p = scene.view().point(pixel);
      const Vector3 turned(p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3]);
      for (int axis = 0; axis < 3; ++axis)
        mixed.push_back(static_cast<float>(turned[axis] + sensor[axis]));
      pixels.push_back(static_cast<int>(pixel));
    }
    const PlaneSet found = findPlanes({mixed.data(), pixels.size()}, nullptr, params, sensor);
    EXPECT_EQ(found.diagnostics.method, PlaneSearchMethod::Organized) << turn;
    ASSERT_EQ(found.planes.size(), expected.planes.size()) << turn;
    for (std::size_t k = 0; k < found.planes.size(); ++k) {
      const Indices& inliers = found.planes[k].inliers;
      EXPECT_TRUE(std::is_sorted(inliers.begin(), inliers.end()));
      Indices of_image;
      for (const int i : inliers) of_image.push_back(pixels[static_cast<std::size_t>(i)]);
      std::sort(of_image.begin(), of_image.end());
      Indices same;
      std::set_intersection(of_image.begin(), of_image.end(), expected.planes[k].inliers.begin(),
                            expected.planes[k].inliers.end(), std::back_inserter(same));
      EXPECT_GE(static_cast<double>(same.size()),
                0.97 * static_cast<double>(expected.planes[k].inliers.size()))
          << turn;
    }
  }
}

TEST(OrganizedPlanes, AShuffledScanByAnglesIsAnImage) {
  // A corner of two walls and a floor, by azimuth and elevation from x forward.
  std::vector<float> xyz;
  for (int i = 0; i < 200 * 150; ++i) {
    const int pixel = static_cast<int>(7919LL * i % (200 * 150));
    const double azimuth = (pixel % 200 - 100) * 0.005;
    const double elevation = (pixel / 200 - 75) * 0.005;
    const Vector3 ray(std::cos(elevation) * std::cos(azimuth),
                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    const double range = std::min({3.0 / (ray.x() + 0.5 * ray.y()), 3.0 / (ray.x() - 0.5 * ray.y()),
                                   ray.z() < 0.0 ? -0.8 / ray.z() : 1e9});
    for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(range * ray[axis]));
  }
  const PlaneSet found = findPlanes({xyz.data(), xyz.size() / 3}, nullptr, {});
  EXPECT_EQ(found.diagnostics.method, PlaneSearchMethod::Organized);
  EXPECT_EQ(found.planes.size(), 3u);
}

TEST(OrganizedPlanes, ZerosAmongListedPointsAreNoMeasurements) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.0015, 0.2, 2);
  Indices all(scene.truth.size());
  std::iota(all.begin(), all.end(), 0);
  const PlaneSet by_nan = findPlanes(scene.view(), &all, organized());
  for (float& value : scene.xyz) value = std::isnan(value) ? 0.0F : value;
  const PlaneSet by_zero = findPlanes(scene.view(), &all, organized());
  ASSERT_EQ(3u, by_zero.planes.size());
  EXPECT_EQ(by_nan.diagnostics.points_not_measured, by_zero.diagnostics.points_not_measured);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_EQ(by_nan.planes[k].inliers, by_zero.planes[k].inliers);
}

TEST(OrganizedPlanes, DescribesEachPlaneByItsInliers) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.0015, 0.1, 3);
  const PlaneSet set = search(scene, organized());
  std::vector<int> owners(scene.truth.size(), 0);
  std::size_t before = scene.truth.size();
  for (const PlaneSegment& segment : set.planes) {
    EXPECT_TRUE(std::is_sorted(segment.inliers.begin(), segment.inliers.end()));
    EXPECT_LE(segment.inliers.size(), before);
    before = segment.inliers.size();
    EXPECT_GT(segment.plane.offset, 0.0);  // the sensor at the origin is in front
    EXPECT_NEAR(segment.plane.normal.norm(), 1.0, 1e-9);
    EXPECT_EQ(segment.moments.weight(), static_cast<double>(segment.inliers.size()));
    double squares = 0.0;
    Vector3 mean = Vector3::Zero();
    for (const int i : segment.inliers) {
      const Vector3 p = scene.view().point(static_cast<std::size_t>(i));
      ++owners[static_cast<std::size_t>(i)];
      squares += std::pow(segment.plane.signedDistance(p), 2);
      mean += p;
    }
    const double n = static_cast<double>(segment.inliers.size());
    EXPECT_NEAR(segment.rms, std::sqrt(squares / n), 1e-5);
    EXPECT_LT((segment.moments.mean() - mean / n).norm(), 1e-5);
    EXPECT_NEAR(segment.tilt, normalizedTilt(segment.plane), 1e-12);
    EXPECT_GT(segment.covariance(3, 3), 0.0);
  }
  EXPECT_LE(*std::max_element(owners.begin(), owners.end()), 1);
}

TEST(OrganizedPlanes, SurvivesFlyingPixels) {
  DepthScene scene(320, 240, 260.0);
  const int wall = scene.addPlane({0.0, 0.0, 3.0}, {0.1, 0.0, -1.0});
  const int board = scene.addRectangle({0.2, 0.1, 1.8}, {0.4, 0.0, 0.1}, {0.0, 0.35, 0.0});
  scene.render(0.001, 0.05, 4);
  scene.addFlyingPixels(5);
  const PlaneSet set = search(scene, organized());
  ASSERT_EQ(set.planes.size(), 2u);
  expectSurfaceFound(scene, set, wall, 0.97, 0.2 * test::kDegree);
  expectSurfaceFound(scene, set, board, 0.95, 0.3 * test::kDegree);
}

TEST(OrganizedPlanes, KeepsAStepApart) {
  DepthScene scene(320, 240, 300.0);
  const int low = scene.addPlane({0.0, 0.0, 1.50}, {0.0, 0.0, -1.0});
  const int high = scene.addRectangle({0.3, 0.0, 1.42}, {0.3, 0.0, 0.0}, {0.0, 1.0, 0.0});
  scene.render(0.001, 0.0, 6);
  expectJust(scene, search(scene, organized(0.02)), low, high, 0.97, 0.2 * test::kDegree);
}

TEST(OrganizedPlanes, KeepsSurfacesApartThatLieThreeCentimetresOffEachOther) {
  // One plane through both is nowhere a centimetre rms off, but nothing between them bends.
  DepthScene scene(320, 240, 300.0);
  const int near = scene.addRectangle({-0.5, 0.0, 2.0}, {0.4, 0.0, 0.0}, {0.0, 0.6, 0.0});
  const int far = scene.addRectangle({0.6, 0.0, 2.03}, {0.2, 0.0, 0.0}, {0.0, 0.5, 0.0});
  scene.render(0.0005, 0.0, 6);
  expectJust(scene, search(scene, organized()), near, far, 0.97, 0.2 * test::kDegree);
}

TEST(OrganizedPlanes, JoinsWhatTouchesWhereASurfaceBends) {
  DepthScene scene(320, 240, 300.0);
  const int left = scene.addRectangle({-0.5, 0.0, 2.0}, {0.5, 0.0, 0.012}, {0.0, 1.0, 0.0});
  const int right = scene.addRectangle({0.5, 0.0, 2.0}, {0.5, 0.0, -0.012}, {0.0, 1.0, 0.0});
  scene.render(0.0005, 0.0, 7);
  const PlaneSet set = search(scene, organized());
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_GT(set.planes.front().inliers.size(),
            0.95 * static_cast<double>(scene.pixelsOf(left) + scene.pixelsOf(right)));
}

TEST(OrganizedPlanes, KeepsPlanesThatTouchAtAnEdge) {
  DepthScene scene(320, 240, 300.0);
  const int left = scene.addRectangle({-0.5, 0.0, 2.0}, {0.5, 0.0, 0.3}, {0.0, 1.0, 0.0});
  const int right = scene.addRectangle({0.5, 0.0, 2.0}, {0.5, 0.0, -0.3}, {0.0, 1.0, 0.0});
  scene.render(0.001, 0.0, 7);
  expectJust(scene, search(scene, organized()), left, right, 0.95, 0.3 * test::kDegree);
}

TEST(OrganizedPlanes, FindsAStripNarrowerThanTwoCells) {
  DepthScene scene(320, 240, 300.0);
  scene.addPlane({0.0, 0.0, 3.0}, {0.0, 0.0, -1.0});
  const int strip = scene.addRectangle({0.0, 0.03, 1.5}, {0.6, 0.0, 0.0}, {0.0, 0.03, 0.02});
  scene.render(0.0005, 0.0, 8);
  ASSERT_GT(scene.pixelsOf(strip), 2000u);
  const PlaneSet set = search(scene, organized());
  expectSurfaceFound(scene, set, strip, 0.9, 2.0 * test::kDegree);
}

TEST(OrganizedPlanes, FindsNoPlaneOnABall) {
  DepthScene scene(320, 240, 300.0);
  const int ball = scene.addBall({0.0, 0.0, 1.5}, 0.4);
  scene.render(0.001, 0.0, 9);
  ASSERT_GT(scene.pixelsOf(ball), 10000u);
  EXPECT_TRUE(search(scene, organized()).planes.empty());
}

TEST(OrganizedPlanes, FindsNoPlaneAlongAStaircase) {
  // The slope through the edges is nowhere farther from a step than d_T, yet nothing lies along it.
  DepthScene scene(320, 240, 300.0);
  constexpr double kStep = 0.1;
  for (int i = 0; i < 8; ++i) {
    const double y = 0.7 - kStep * i;
    const double z = 1.2 + kStep * i;
    scene.addRectangle({0.0, y - kStep / 2.0, z}, {0.8, 0.0, 0.0}, {0.0, kStep / 2.0, 0.0});
    scene.addRectangle({0.0, y - kStep, z + kStep / 2.0}, {0.8, 0.0, 0.0}, {0.0, 0.0, kStep / 2.0});
  }
  scene.render(0.001, 0.0, 21);
  const Vector3 slope = Vector3(0.0, 1.0, 1.0).normalized();
  for (const PlaneSegment& segment : search(scene, organized()).planes) {
    EXPECT_LT(std::fabs(segment.plane.normal.dot(slope)), std::cos(20.0 * test::kDegree))
        << segment.inliers.size() << " points";
  }
}

TEST(OrganizedPlanes, LeavesOutWhatThePlaneCutsOutOfABall) {
  DepthScene scene(320, 240, 300.0);
  const int wall = scene.addPlane({0.0, 0.0, 2.0}, {0.0, 0.0, -1.0});
  const int ball = scene.addBall({0.0, 0.0, 2.0}, 0.35);
  scene.render(0.001, 0.0, 22);
  const PlaneSet set = search(scene, organized());
  expectSurfaceFound(scene, set, wall, 0.97, 0.2 * test::kDegree);
  for (const PlaneSegment& segment : set.planes) {
    std::size_t on_ball = 0;
    for (const int i : segment.inliers) on_ball += scene.truth[static_cast<std::size_t>(i)] == ball;
    EXPECT_LE(on_ball, segment.inliers.size() / 50);
  }
}

TEST(OrganizedPlanes, AnyThreadCountGivesTheSameBytes) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.002, 0.1, 11);
  MultiPlaneParams params = organized();
  const PlaneSet one = search(scene, params);
  for (const int threads : {2, 4, 0}) {
    params.threads = threads;
    expectSameBytes(one, search(scene, params));
  }
}

TEST(OrganizedPlanes, AnyStrideGivesTheSameBytes) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.001, 0.1, 12);
  const PlaneSet packed = search(scene, organized());
  for (const std::size_t stride : {4u, 5u, 8u}) {
    std::vector<float> padded(stride * scene.truth.size(), test::kNanFloat);
    for (std::size_t i = 0; i < scene.truth.size(); ++i)
      std::copy_n(&scene.xyz[3 * i], 3, &padded[stride * i]);
    expectSameBytes(packed,
                    findPlanes(PointsView(padded.data(), 320, 240, stride), nullptr, organized()));
  }
}

TEST(OrganizedPlanes, SubsetByIndexEqualsSubsetByCopy) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.001, 0.1, 13);
  Indices indices;
  for (int i = 0; i < static_cast<int>(scene.truth.size()); ++i) {
    if (i % 320 > 60 && i % 5 != 0) indices.push_back(i);
  }
  const PlaneSet by_index = findPlanes(scene.view(), &indices, organized());
  DepthScene copy = scene;
  std::fill(copy.xyz.begin(), copy.xyz.end(), test::kNanFloat);
  for (const int i : indices) std::copy_n(&scene.xyz[3 * i], 3, &copy.xyz[3 * i]);
  expectSameBytes(by_index, search(copy, organized()));
  EXPECT_EQ(by_index.diagnostics.points_considered, indices.size());
  ASSERT_GE(by_index.planes.size(), 2u);
}

TEST(OrganizedPlanes, FollowsARigidMotionOfCloudAndSensor) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.001, 0.1, 14);
  const PlaneSet before = search(scene, organized());
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(1.1, Vector3(1.0, -2.0, 0.5).normalized()).toRotationMatrix();
  T.translation() = Vector3(12.0, -7.0, 3.0);
  DepthScene moved = scene;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    const Vector3 p = T * scene.view().point(i);
    for (int axis = 0; axis < 3; ++axis) moved.xyz[3 * i + axis] = static_cast<float>(p[axis]);
  }
  const PlaneSet after = findPlanes(moved.view(), nullptr, organized(), T.translation());
  ASSERT_EQ(after.planes.size(), before.planes.size());
  for (std::size_t k = 0; k < before.planes.size(); ++k) {
    const Plane expected = transformed(before.planes[k].plane, T);
    EXPECT_LT((after.planes[k].plane.normal - expected.normal).norm(), 1e-3);
    EXPECT_NEAR(after.planes[k].plane.offset, expected.offset, 1e-2);
    const double size = static_cast<double>(before.planes[k].inliers.size());
    EXPECT_NEAR(static_cast<double>(after.planes[k].inliers.size()), size, 0.01 * size);
  }
}

TEST(OrganizedPlanes, PartsOfOnePlaneArePatches) {
  DepthScene scene(320, 240, 300.0);
  const int big = scene.addRectangle({-0.5, 0.0, 2.0}, {0.4, 0.0, 0.0}, {0.0, 0.6, 0.0});
  const int small = scene.addRectangle({0.6, 0.0, 2.0}, {0.2, 0.0, 0.0}, {0.0, 0.5, 0.0});
  scene.render(0.0005, 0.0, 15);
  for (const double gap : {0.0, 0.1}) {
    MultiPlaneParams params = organized();
    params.patch_gap = gap;
    const PlaneSet set = search(scene, params);
    ASSERT_EQ(set.planes.size(), 1u);
    const PlaneSegment& segment = set.planes.front();
    EXPECT_EQ(segment.number_of_patches, 2);
    ASSERT_EQ(segment.patches.size(), segment.inliers.size());
    for (std::size_t i = 0; i < segment.inliers.size(); ++i) {
      const int surface = scene.truth[static_cast<std::size_t>(segment.inliers[i])];
      ASSERT_EQ(segment.patches[i], surface == big ? 0 : 1);
    }
    EXPECT_GT(scene.pixelsOf(big), scene.pixelsOf(small));
  }
}

TEST(OrganizedPlanes, UsesTheNoiseOfAKnownSensor) {
  DepthScene scene(320, 240, 260.0);
  const int wall = scene.addPlane({0.0, 0.0, 6.0}, {0.4, 0.0, -1.0});
  MultiPlaneParams params = organized();
  params.noise = StereoNoise{0.1, 260.0, 0.06};
  scene.render(params.noise->depthError(1.0), 0.0, 16);
  const PlaneSet set = search(scene, params);
  ASSERT_FALSE(set.planes.empty());
  // Half of the points are farther than d_T from the wall: the band must follow the noise.
  expectSurfaceFound(scene, set, wall, 0.97, 0.5 * test::kDegree);
}

TEST(OrganizedPlanes, SaysWhatItDid) {
  DepthScene scene = cornerOfARoom();
  scene.render(0.001, 0.1, 17);
  MultiPlaneParams params = organized();
  params.max_planes = 2;
  const PlaneSet set = search(scene, params);
  EXPECT_EQ(set.planes.size(), 2u);
  EXPECT_FALSE(set.diagnostics.stopped_by_itself);
  EXPECT_EQ(set.diagnostics.method, PlaneSearchMethod::Organized);
  EXPECT_EQ(set.diagnostics.points_considered, scene.truth.size());
  const auto missing = static_cast<std::size_t>(
      std::count_if(scene.xyz.begin(), scene.xyz.end(), [](float x) { return std::isnan(x); }));
  EXPECT_EQ(3 * set.diagnostics.points_not_measured, missing);
  EXPECT_GE(set.diagnostics.hypotheses, 3u);
}

TEST(OrganizedPlanes, ImagesOfAnySizeWork) {
  for (const auto& [width, height] : std::vector<std::pair<int, int>>{
           {1, 2}, {2, 2}, {3, 3}, {1, 400}, {9, 7}, {33, 17}, {65, 2}}) {
    DepthScene scene(width, height, 0.8 * width);
    scene.addPlane({0.0, 0.0, 2.0}, {0.2, 0.1, -1.0});
    scene.render(0.0, 0.0, 18);
    for (const PlaneSegment& segment : search(scene, organized(0.05, 3)).planes)
      EXPECT_LT(angleBetween(segment.plane, scene.plane(0)), 0.1 * test::kDegree);
  }
  DepthScene scene(33, 17, 30.0);
  scene.addPlane({0.0, 0.0, 2.0}, {0.2, 0.1, -1.0});
  scene.render(0.0, 0.0, 19);
  const PlaneSet set = search(scene, organized(0.05, 3));
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_EQ(set.planes.front().inliers.size(), scene.truth.size());
}

TEST(OrganizedPlanes, HostileCoordinatesGiveFiniteResults) {
  constexpr int kSide = 64;
  constexpr std::size_t kSize = kSide * kSide;
  const float huge = std::numeric_limits<float>::max();
  const float infinite = std::numeric_limits<float>::infinity();
  Random random(20);
  std::vector<std::vector<float>> clouds;
  clouds.emplace_back(3 * kSize, test::kNanFloat);
  clouds.emplace_back(3 * kSize, infinite);
  clouds.emplace_back(3 * kSize, 1.0F);
  clouds.emplace_back(3 * kSize, 1e9F);
  std::vector<float> line, far, wild, mixed;
  for (std::size_t i = 0; i < kSize; ++i) {
    const auto t = static_cast<float>(i);
    line.insert(line.end(), {t, 2.0F * t, 0.5F * t});
    far.insert(far.end(), {1e9F + 1e3F * (i % kSide), 1e9F + 1e3F * (i / kSide), 1e9F});
    const bool even = i % 2 == 0;
    wild.insert(wild.end(), {even ? huge : -huge, even ? -huge : huge, huge});
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t kind = random.below(8);
      mixed.push_back(kind == 0 ? test::kNanFloat : kind == 1 ? infinite : kind == 2 ? huge : 1.0F);
    }
  }
  clouds.insert(clouds.end(), {line, far, wild, mixed});
  for (const std::vector<float>& cloud : clouds) {
    const PlaneSet set =
        findPlanes(PointsView(cloud.data(), kSide, kSide, 3), nullptr, organized(0.05, 3));
    for (const PlaneSegment& segment : set.planes) {
      EXPECT_TRUE(segment.plane.coefficients().allFinite());
      EXPECT_TRUE(std::isfinite(segment.rms));
      EXPECT_TRUE(segment.covariance.allFinite());
    }
  }
}

}  // namespace
}  // namespace planar_mapping
