// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Every setter of every class: what is set is what is got, and what is out of range is refused.
#include <gtest/gtest.h>
#include <pcl/point_types.h>

#include <limits>
#include <type_traits>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/filters/kl_occupancy_filter.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"
#include "planar_mapping/surface/planar_mapping.h"

namespace planar_mapping {
namespace {

using Point = pcl::PointXYZ;
using Segmentation = MultiPlaneSACSegmentation<Point>;
using Approximation = PlanarCuboidApproximation<Point>;
using Mapping = PlanarMapping<Point>;
using Occupancy = KLOccupancyFilter<Point>;
using Removal = GroundRemoval<Point>;

using test::kNan;
constexpr double kInf = std::numeric_limits<double>::infinity();

/// \p good is taken and given back; each of \p bad throws and changes nothing.
template <typename Class, typename Owner, typename Argument, typename Value>
void checkSetter(void (Owner::*set)(Argument), Value (Owner::*get)() const,
                 std::decay_t<Argument> good, const std::vector<std::decay_t<Argument>>& bad) {
  static_assert(std::is_same_v<std::decay_t<Argument>, std::decay_t<Value>>,
                "setX and getX must agree");
  Class object;
  (object.*set)(good);
  EXPECT_EQ((object.*get)(), good);
  for (const auto& value : bad) {
    EXPECT_THROW((object.*set)(value), ParameterError);
    EXPECT_EQ((object.*get)(), good);
  }
}

TEST(Parameters, MultiPlaneSACSegmentation) {
  using C = Segmentation;
  checkSetter<C>(&C::setDistanceThreshold, &C::getDistanceThreshold, 0.02, {0.0, -1.0, kNan, kInf});
  checkSetter<C>(&C::setMinInliers, &C::getMinInliers, 50, {2, 0, -1});
  checkSetter<C>(&C::setMaxPlanes, &C::getMaxPlanes, 3, {-1});
  checkSetter<C>(&C::setNoiseFactor, &C::getNoiseFactor, 2.0, {-0.1, kNan});
  checkSetter<C>(&C::setPatchGap, &C::getPatchGap, 0.3, {-0.1, kNan});
  checkSetter<C>(&C::setNumberOfModels, &C::getNumberOfModels, 4, {-1});
  checkSetter<C>(&C::setMaxIterations, &C::getMaxIterations, 40, {-1});
  checkSetter<C>(&C::setMissProbability, &C::getMissProbability, 0.1, {0.0, 1.0, kNan});
  checkSetter<C>(&C::setSignificance, &C::getSignificance, 3.0, {-1.0, kNan});
  checkSetter<C>(&C::setMaxNormalDeviation, &C::getMaxNormalDeviation, 0.3, {-0.1, 1.6, kNan});
  checkSetter<C>(&C::setNumberOfThreads, &C::getNumberOfThreads, 2, {-1});
  checkSetter<C>(&C::setSeed, &C::getSeed, std::uint64_t{42}, {});
  checkSetter<C>(&C::setSource, &C::getSource, PlaneSource::Auto, {static_cast<PlaneSource>(77)});
  checkSetter<C>(&C::setMethod, &C::getMethod, PlaneSearchMethod::Sequential,
                 {static_cast<PlaneSearchMethod>(77)});
  C object;
  object.setNoiseModel(StereoNoise{0.1, 400.0, 0.25});
  ASSERT_TRUE(object.getNoiseModel().has_value());
  EXPECT_EQ(object.getNoiseModel()->focal_length, 400.0);
  EXPECT_THROW(object.setNoiseModel(StereoNoise{kNan, 400.0, 0.25}), ParameterError);
  object.setNoiseModel(std::nullopt);
  EXPECT_FALSE(object.getNoiseModel().has_value());
}

template <typename C>
void checkMappingSetters() {
  checkSetter<C>(&C::setProfile, &C::getProfile, Profile::Paper, {static_cast<Profile>(77)});
  checkSetter<C>(&C::setResolution, &C::getResolution, 0.05, {0.0, -1.0, kNan, kInf});
  checkSetter<C>(&C::setThickness, &C::getThickness, 0.2, {-1.0, kNan});
  checkSetter<C>(&C::setMinPointsPerCell, &C::getMinPointsPerCell, 3, {0, -1});
  checkSetter<C>(&C::setHoleSize, &C::getHoleSize, 0.2, {-1.0, kNan});
  checkSetter<C>(&C::setAbsorption, &C::getAbsorption, 0.2, {-0.1, 0.6, kNan});
  checkSetter<C>(&C::setUpDirection, &C::getUpDirection, Vector3(0, -1, 0),
                 {Vector3(0, 0, 0), Vector3(kNan, 0, 1), Vector3(0, kInf, 0)});
  checkSetter<C>(&C::setMaxRange, &C::getMaxRange, 5.0, {-1.0, kNan, kInf});
  checkSetter<C>(&C::setMinProbability, &C::getMinProbability, 0.2, {-0.1, 1.1, kNan});
  checkSetter<C>(&C::setNumberOfThreads, &C::getNumberOfThreads, 2, {-1});
  C object;
  object.setPointProbabilities({0.5f});
  EXPECT_EQ(object.getPointProbabilities(), (std::vector<float>{0.5f}));
  object.setGroundIndices({1, 2});
  EXPECT_EQ(object.getGroundIndices(), (Indices{1, 2}));
  EXPECT_FALSE(object.getSensorPose().has_value());
  object.setSensorPose(Pose::Identity());
  EXPECT_TRUE(object.getSensorPose().has_value());
  object.setTimestamp(1.5);
  EXPECT_EQ(object.getTimestamp(), 1.5);
  object.setCamera(PinholeCamera{1.0, 2.0, 3.0, 4.0, 5, 6});
  EXPECT_EQ(object.getCamera()->height, 6);
  object.setNoiseModel(StereoNoise{0.1, 400.0, 0.25});
  EXPECT_THROW(object.setNoiseModel(StereoNoise{kNan, 400.0, 0.25}), ParameterError);
  EXPECT_EQ(object.getNoiseModel()->focal_length, 400.0);
}

TEST(Parameters, PlanarCuboidApproximation) {
  checkMappingSetters<Approximation>();
}

TEST(Parameters, PlanarMapping) {
  checkMappingSetters<Mapping>();
}

TEST(Parameters, GroundRemoval) {
  using C = Removal;
  checkSetter<C>(&C::setCameraHeight, &C::getCameraHeight, 0.0, {-0.1, kNan, kInf});
  checkSetter<C>(&C::setNumberOfThreads, &C::getNumberOfThreads, 2, {-1});
  checkSetter<C>(&C::setHeightTolerance, &C::getHeightTolerance, 0.2, {0.0, kNan, kInf});
  checkSetter<C>(&C::setUpAxis, &C::getUpAxis, Vector3(0, 0, 2),
                 {Vector3(0, 0, 0), Vector3(kNan, 0, 1), Vector3(0, kInf, 0)});
  checkSetter<C>(&C::setOpticalAxis, &C::getOpticalAxis, Vector3(1, 0, 0),
                 {Vector3(0, 0, 0), Vector3(kNan, 0, 1)});
  checkSetter<C>(&C::setPitchTolerance, &C::getPitchTolerance, 0.1, {0.0, 1.6, kNan});
  checkSetter<C>(&C::setRollTolerance, &C::getRollTolerance, 0.1, {0.0, 1.6, kNan});
  checkSetter<C>(&C::setDistanceThreshold, &C::getDistanceThreshold, 0.02, {0.0, -1.0, kNan, kInf});
  checkSetter<C>(&C::setNoiseFactor, &C::getNoiseFactor, 2.0, {-0.1, kNan, kInf});
  checkSetter<C>(&C::setSlopeCell, &C::getSlopeCell, 0.0, {-1.0, kNan, kInf});
  checkSetter<C>(&C::setMaxSlope, &C::getMaxSlope, 0.0, {-0.1, 1.6, kNan});
  checkSetter<C>(&C::setWallHeight, &C::getWallHeight, 0.0, {-0.1, kNan, kInf});
  checkSetter<C>(&C::setWallCell, &C::getWallCell, 0.2, {0.0, kNan, kInf});
  checkSetter<C>(&C::setWallFootThreshold, &C::getWallFootThreshold, 0.02, {0.0, kNan, kInf});
  checkSetter<C>(&C::setMinFraction, &C::getMinFraction, 0.1, {0.0, 1.1, kNan});
  checkSetter<C>(&C::setMinPoints, &C::getMinPoints, 10, {2, -1});
  checkSetter<C>(&C::setSampleSize, &C::getSampleSize, 500, {99, -1});
  checkSetter<C>(&C::setSeed, &C::getSeed, std::uint64_t{42}, {});
  C object;
  object.setNoiseModel(StereoNoise{0.1, 400.0, 0.25});
  EXPECT_EQ(object.getNoiseModel()->focal_length, 400.0);
  EXPECT_THROW(object.setNoiseModel(StereoNoise{0.1, 0.0, 0.25}), ParameterError);
  EXPECT_EQ(object.getNoiseModel()->focal_length, 400.0);
}

TEST(Parameters, KLOccupancyFilter) {
  using C = Occupancy;
  checkSetter<C>(&C::setMinProbability, &C::getMinProbability, 0.3, {-0.1, 1.1, kNan});
  checkSetter<C>(&C::setResolution, &C::getResolution, 0.05, {0.0, kNan, kInf});
  checkSetter<C>(&C::setRangeFloor, &C::getRangeFloor, 0.0, {-0.1, kNan, kInf});
  checkSetter<C>(&C::setSingleFeatureProbability, &C::getSingleFeatureProbability, 0.4,
                 {-0.1, 1.1, kNan});
  checkSetter<C>(&C::setOpticalAxis, &C::getOpticalAxis, Vector3(0, 0, 0),
                 {Vector3(kNan, 0, 1), Vector3(0, kInf, 0)});
  checkSetter<C>(&C::setBias, &C::getBias, 2.0, {-0.1, kNan, kInf});
  checkSetter<C>(&C::setMotionReading, &C::getMotionReading, MotionReading::RobotPose,
                 {static_cast<MotionReading>(77)});
  checkSetter<C>(&C::setMaxUnseenFrames, &C::getMaxUnseenFrames, 5, {-1});
  checkSetter<C>(&C::setFeatureSource, &C::getFeatureSource, FeatureSource::Cells, {});
  checkSetter<C>(&C::setUpdateRule, &C::getUpdateRule, UpdateRule::LogOdds,
                 {static_cast<UpdateRule>(77)});
  checkSetter<C>(&C::setFeaturesPerCell, &C::getFeaturesPerCell, 3, {0});
  checkSetter<C>(&C::setDenseGroups, &C::getDenseGroups, false, {});
  checkSetter<C>(&C::setDoubtSpreads, &C::getDoubtSpreads, true, {});
  checkSetter<C>(&C::setNumberOfThreads, &C::getNumberOfThreads, 2, {-1});
  C object;
  object.setNoiseModel(StereoNoise{0.1, 400.0, 0.25});
  EXPECT_EQ(object.getNoiseModel().focal_length, 400.0);
  EXPECT_THROW(object.setNoiseModel(StereoNoise{0.1, 400.0, -1.0}), ParameterError);
  EXPECT_EQ(object.getNoiseModel().disparity_error, 0.25);
  object.setInputTracks({1, 2});
  object.setInputPlaneLabels({3, 4});
  EXPECT_EQ(object.getInputTracks(), (std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(object.getInputPlaneLabels(), (std::vector<std::int32_t>{3, 4}));
  Pose broken = Pose::Identity();
  broken.translation().x() = kNan;
  EXPECT_THROW(object.setMotion(broken, Matrix6::Identity()), InputError);
  EXPECT_THROW(object.setMotion(Pose::Identity(), -Matrix6::Identity()), ParameterError);
  EXPECT_FALSE(object.getMotion().has_value());
  object.setMotion(Pose::Identity(), Matrix6::Identity());
  EXPECT_TRUE(object.getMotion().has_value());
}

template <typename Class, typename Params, typename Change, typename Spoil>
void checkParams(Change change, Spoil spoil) {
  Class object;
  Params params = object.getParams();
  change(params);
  object.setParams(params);
  Class other;
  other.setParams(object.getParams());
  Params bad = params;
  spoil(bad);
  EXPECT_THROW(other.setParams(bad), ParameterError);
  Params again = other.getParams();
  spoil(again);
  EXPECT_THROW(again.validate(), ParameterError);
}

TEST(Parameters, WholeStructsMoveInAndOut) {
  checkParams<Segmentation, MultiPlaneParams>([](auto& p) { p.min_inliers = 77; },
                                              [](auto& p) { p.distance_threshold = kNan; });
  checkParams<Approximation, PlanarMapParams>([](auto& p) { p.approximation.resolution = 0.3; },
                                              [](auto& p) { p.belief_gain = kNan; });
  checkParams<Removal, GroundParams>([](auto& p) { p.camera_height = 1.0; },
                                     [](auto& p) { p.max_slope = kNan; });
  checkParams<Occupancy, KlOccupancyParams>([](auto& p) { p.min_probability = 0.1; },
                                            [](auto& p) { p.beliefs.update.eta3 = kNan; });
  Segmentation segmentation;
  MultiPlaneParams params;
  params.min_inliers = 77;
  segmentation.setParams(params);
  EXPECT_EQ(segmentation.getMinInliers(), 77);
}

}  // namespace
}  // namespace planar_mapping
