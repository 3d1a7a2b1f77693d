// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A class and the stage of its name give the same planes and cuboids, bit for bit.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "pipeline_frames.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"
#include "planar_mapping/surface/planar_mapping.h"
#include "real_data.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

constexpr char kStages[] =
    "  - stage: multi_plane_segmentation\n"
    "    distance_threshold_m: 0.04\n"
    "    min_inliers: 400\n"
    "  - stage: planar_cuboid_approximation\n"
    "    resolution_m: 0.15\n"
    "    min_points_per_cell: 2\n";
constexpr char kMaxRange[] = "    max_range_m: 8\n";  // else it follows from the first cloud

Configuration configurationOf(const std::string& input = "", bool with_range = true) {
  Configuration configuration =
      test::configurationOf(std::string(kStages) + (with_range ? kMaxRange : ""));
  if (!input.empty()) configuration.inputs = {input};
  return configuration;
}

/// The parameters of kStages, by the setters of the classes.
MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation() {
  MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setDistanceThreshold(0.04);
  segmentation.setMinInliers(400);
  return segmentation;
}
template <typename Class>
void setParameters(Class& object, bool with_range = true) {
  object.setResolution(0.15);
  object.setMinPointsPerCell(2);
  if (with_range) object.setMaxRange(8.0);
}

/// A cloud as a user of PCL has it: the pose of the sensor is not with it.
pcl::PointCloud<pcl::PointXYZ>::Ptr cloudOf(const Frame& frame) {
  return pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*frame.cloud);
}

void expectSamePlanes(const std::vector<PlaneSegment>& a, const std::vector<PlaneSegment>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].plane.normal, b[i].plane.normal);
    EXPECT_EQ(a[i].plane.offset, b[i].plane.offset);
    EXPECT_EQ(a[i].inliers, b[i].inliers);
  }
}

void expectSameCuboids(const std::vector<Cuboid>& a, const std::vector<Cuboid>& b) {
  EXPECT_EQ(test::numbersOf(a), test::numbersOf(b));
}

/// One frame through the stages, its points through the classes.
void expectAgreement(Frame frame) {
  const auto cloud = cloudOf(frame);
  Pipeline pipeline(configurationOf());
  pipeline.process(frame);
  ASSERT_EQ(frame.skip_reason, "");

  auto planes = segmentation();
  planes.setInputCloud(cloud);
  planes.segment();
  expectSamePlanes(frame.planes, planes.getPlanes());

  PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  setParameters(approximation);
  approximation.setInputCloud(cloud);
  approximation.setPlanes(planes.getPlanes());
  approximation.setCamera(frame.camera);
  approximation.setSensorPose(frame.T_world_sensor);
  std::vector<Cuboid> cuboids;
  approximation.approximate(cuboids);
  EXPECT_GT(cuboids.size(), 0u);
  expectSameCuboids(pipeline.map().cuboids(), cuboids);
}

/// The frames of a sequence through the stages, their points through the classes.
void expectAgreement(std::vector<Frame> frames, bool with_range = true) {
  Pipeline pipeline(configurationOf("", with_range));
  auto planes = segmentation();
  PlanarMapping<pcl::PointXYZ> mapping;
  setParameters(mapping, with_range);
  for (Frame& frame : frames) {
    const auto cloud = cloudOf(frame);
    pipeline.process(frame);
    ASSERT_EQ(frame.skip_reason, "");
    planes.setInputCloud(cloud);
    planes.segment();
    expectSamePlanes(frame.planes, planes.getPlanes());
    mapping.setInputCloud(cloud);
    mapping.setPlanes(planes.getPlanes());
    mapping.setSensorPose(frame.T_world_sensor);
    mapping.setTimestamp(frame.timestamp);
    mapping.setCamera(frame.camera);
    const FrameUpdate update = mapping.integrate();
    EXPECT_EQ(update.cells_added, frame.update.cells_added);
    EXPECT_EQ(update.planes_matched, frame.update.planes_matched);
  }
  expectSameCuboids(pipeline.map().cuboids(), mapping.map().cuboids());
  EXPECT_TRUE(pipeline.map().serialize() == mapping.map().serialize());
}

/// single_pcd.yaml, and the classes as they are made.
void expectAgreementByDefault(const std::string& path) {
  Configuration configuration = test::readyConfiguration("single_pcd.yaml");
  configuration.inputs = {path};
  Frame frame = *SequenceSource(configuration).next();
  const auto cloud = cloudOf(frame);
  if (!frame.pose_assumed) GTEST_SKIP() << "PCL keeps its pose as floats";
  Pipeline pipeline(std::move(configuration));
  pipeline.process(frame);
  ASSERT_EQ(frame.skip_reason, "");
  MultiPlaneSACSegmentation<pcl::PointXYZ> planes;
  planes.setInputCloud(cloud);
  planes.segment();
  expectSamePlanes(frame.planes, planes.getPlanes());
  PlanarMapping<pcl::PointXYZ> mapping;
  mapping.setInputCloud(cloud);
  mapping.setPlanes(planes.getPlanes());
  mapping.integrate();
  EXPECT_GT(mapping.map().cuboidCount(), 0u);
  expectSameCuboids(pipeline.map().cuboids(), mapping.map().cuboids());
  EXPECT_EQ(pipeline.map().params().unknown_space, mapping.map().params().unknown_space);
  PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  approximation.setInputCloud(cloud);
  approximation.setPlanes(planes.getPlanes());
  std::vector<Cuboid> cuboids;
  approximation.approximate(cuboids);
  expectSameCuboids(pipeline.map().cuboids(), cuboids);
}

std::vector<Frame> framesOf(const std::string& input, std::size_t limit) {
  SequenceSource source(configurationOf(input));
  std::vector<Frame> frames;
  while (frames.size() < limit) {
    std::optional<Frame> frame = source.next();
    if (!frame) break;
    frames.push_back(std::move(*frame));
  }
  return frames;
}

std::vector<Frame> simulated(const std::string& scene, int count) {
  evaluation::SimulationParams params;
  params.scene = scene;
  params.frames = count;
  params.width = 160;
  params.height = 120;
  params.colors = false;
  const evaluation::Simulation simulation(params);
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < simulation.size(); ++i) {
    Frame frame = test::simulatedFrame(simulation, i);
    frame.given_pose.reset();
    frame.camera.reset();
    frame.baseline.reset();
    frames.push_back(std::move(frame));
  }
  return frames;
}

TEST(StageAgreement, OneSimulatedFrame) {
  for (const char* scene : {"room", "corridor"}) {
    SCOPED_TRACE(scene);
    expectAgreement(std::move(simulated(scene, 1).front()));
  }
}

TEST(StageAgreement, SimulatedSequences) {
  expectAgreement(simulated("room", 4));
  expectAgreement(simulated("corridor", 4));
  expectAgreement(simulated("corridor", 4), false);
}

TEST(StageAgreement, PlanesOfSampledAndOfKeyFeatures) {
  for (const bool has_features : {false, true}) {
    Frame frame = std::move(simulated("room", 1).front());
    const auto cloud = cloudOf(frame);
    for (std::size_t i = 0; has_features && i < cloud->size(); i += 31) {
      KeyFeature feature;
      feature.position = (*cloud)[i].getVector3fMap().cast<double>();
      frame.key_features.push_back(feature);
    }
    Pipeline pipeline = test::pipelineOf(
        "  - stage: multi_plane_segmentation\n    source: auto\n    features: 600\n"
        "    min_inliers: 400\n");
    auto planes = segmentation();
    planes.setDistanceThreshold(0.05);
    MultiPlaneParams params = planes.getParams();
    params.source = PlaneSource::Auto;
    params.features.samples = 600;
    planes.setParams(params);
    planes.setInputFeatures(frame.key_features);
    planes.setInputCloud(cloud);
    planes.segment();
    EXPECT_GT(planes.getDiagnostics().features.planes_of_features, 0u);
    pipeline.process(frame);
    expectSamePlanes(frame.planes, planes.getPlanes());
  }
}

/// The rule for poses, see MappingInput.
TEST(StageAgreement, PoseOfACloudIsTheOneGivenElseItsViewpoint) {
  const Frame seen = std::move(simulated("room", 1).front());
  io::CloudData file;
  file.width = 160;
  file.height = 120;
  for (const pcl::PointXYZ& p : *seen.cloud) file.xyz.insert(file.xyz.end(), {p.x, p.y, p.z});
  file.T_world_sensor.linear() =
      Eigen::AngleAxisd(0.5, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  file.T_world_sensor.translation() = Vector3(1.5, -0.25, 2.0);  // floats hold it
  const TemporaryDirectory directory;
  const std::string path = directory / "cloud.pcd";
  io::writePcd(path, file);

  Frame frame = std::move(framesOf(path, 1).front());
  const auto cloud = cloudOf(frame);
  Pipeline pipeline(configurationOf());
  pipeline.process(frame);
  const std::vector<Cuboid> expected = pipeline.map().cuboids();
  ASSERT_GT(expected.size(), 3u);

  auto planes = segmentation();
  planes.setInputCloud(cloud);
  planes.segment();
  PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  PlanarMapping<pcl::PointXYZ> mapping;
  setParameters(approximation);
  setParameters(mapping);
  std::vector<Cuboid> cuboids;
  const auto approximate = [&] {
    approximation.setInputCloud(cloud);
    approximation.setPlanes(planes.getPlanes());
    approximation.approximate(cuboids);
    mapping.reset();
    mapping.setInputCloud(cloud);
    mapping.setPlanes(planes.getPlanes());
    mapping.integrate();
    expectSameCuboids(cuboids, mapping.map().cuboids());
  };
  // PCL keeps a VIEWPOINT as floats.
  cloud->sensor_origin_.head<3>() = file.T_world_sensor.translation().cast<float>();
  cloud->sensor_orientation_ =
      Eigen::Quaterniond(Matrix3(file.T_world_sensor.linear())).cast<float>();
  approximate();
  ASSERT_EQ(cuboids.size(), expected.size());
  for (std::size_t i = 0; i < cuboids.size(); ++i)
    EXPECT_NEAR((cuboids[i].center - expected[i].center).norm(), 0.0, 1e-4) << i;
  approximation.setSensorPose(frame.T_world_sensor);
  mapping.setSensorPose(frame.T_world_sensor);
  cloud->sensor_origin_ = Eigen::Vector4f(7, 7, 7, 0);
  approximate();
  expectSameCuboids(expected, cuboids);
  // Planes are in the frame of the cloud, towards the sensor there.
  planes.segment();
  expectSamePlanes(frame.planes, planes.getPlanes());
}

class RealCloud : public testing::TestWithParam<const char*> {};

TEST_P(RealCloud, GivesTheSamePlanesAndCuboids) {
  const std::string path = test::realData(GetParam());
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  expectAgreement(std::move(framesOf(path, 1).front()));
}
TEST_P(RealCloud, GivesTheSameMapByDefault) {
  const std::string path = test::realData(GetParam());
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  expectAgreementByDefault(path);
}

TEST_P(RealCloud, KeepsItsPlanesWithoutTheRowsOfItsImage) {
  const std::string path = test::realData(GetParam());
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const auto cloud = cloudOf(framesOf(path, 1).front());
  const auto dense = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const pcl::PointXYZ& point : *cloud) {
    if (std::isfinite(point.z)) dense->push_back(point);  // as removeNaNFromPointCloud()
  }
  MultiPlaneSACSegmentation<pcl::PointXYZ> planes;
  planes.setInputCloud(cloud);
  planes.segment();
  const std::size_t organized = planes.getPlanes().size();
  planes.setInputCloud(dense);
  planes.segment();
  EXPECT_GE(10 * planes.getPlanes().size(), 9 * organized);
}

INSTANTIATE_TEST_SUITE_P(
    StageAgreement, RealCloud,
    testing::Values("clouds_pcl/office1.pcd", "clouds_pcl/capture0001.pcd",
                    "clouds_pcl/room_scan1.pcd", "clouds_pcl/table_scene_mug_stereo_textured.pcd",
                    "clouds_velodyne/street_scan.pcd", "labelled_synpeb/small_clean.pcd"),
    [](const auto& cloud) { return std::filesystem::path(cloud.param).stem().string(); });

class RealSequence : public testing::TestWithParam<const char*> {};

TEST_P(RealSequence, GivesTheSameMap) {
  const std::string path = test::realData(GetParam());
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  constexpr std::size_t kFrames = 5;
  std::vector<Frame> frames = framesOf(path, kFrames);
  ASSERT_EQ(frames.size(), kFrames);
  expectAgreement(frames);
  expectAgreement(std::move(frames), false);
}
INSTANTIATE_TEST_SUITE_P(StageAgreement, RealSequence,
                         testing::Values("rgbd_icl_five", "rgbd_tum_cabinet"),
                         [](const auto& sequence) { return std::string(sequence.param); });

}  // namespace
}  // namespace planar_mapping
