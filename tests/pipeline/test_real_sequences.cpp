// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The ready configurations on real sequences, with the camera's motion found from the images alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "planar_mapping/localization/trajectory_error.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "real_run.h"

namespace planar_mapping {
namespace {

/// Frames [first, last) of a sequence beside the sources.
RealRun mapOf(const std::string& configuration_file, const std::string& sequence, int first,
              int last,
              const std::vector<std::string>& assignments = {"motion_estimation.poses=ignore"}) {
  return runOver({sequence}, {first, last, 1}, configuration_file, assignments);
}

/// The offset of a point from a path: metres aside and above, NaN beyond its ends.
struct FromPath {
  double aside = std::nan("");
  double above = std::nan("");
};

FromPath fromPath(const Vector3& point, const std::vector<Pose>& path, const Vector3& up) {
  FromPath nearest;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vector3 from = path[i].translation();
    const Vector3 step = path[i + 1].translation() - from;
    const double fraction = (point - from).dot(step) / step.squaredNorm();
    if (!(fraction >= 0.0 && fraction <= 1.0)) continue;
    const Vector3 offset = point - from - fraction * step;
    const double above = offset.dot(up);
    const double aside = (offset - above * up).norm();
    if (!(aside >= nearest.aside)) nearest = {aside, above};
  }
  return nearest;
}

/// Area of the occupied cuboids of each plane, seen along its normal.
std::map<std::int32_t, double> planeAreas(const PlanarMap& map) {
  std::map<std::int32_t, double> areas;
  for (const Cuboid& cuboid : map.cuboids()) {
    if (cuboid.plane_id >= 0) areas[cuboid.plane_id] += cuboid.size.x() * cuboid.size.y();
  }
  return areas;
}

class RealSequences : public ::testing::Test {
 protected:
  void SetUp() override {
    if (test::isMissing("stereo_kitti_street")) GTEST_SKIP() << "no real data beside the sources";
  }
};

TEST_F(RealSequences, StreetIsMappedWithoutPhantomsInTheDrivenCorridor) {
  const RealRun street = mapOf("stereo_outdoor.yaml", "stereo_kitti_street", 0, -1);
  EXPECT_EQ(0u, street.skipped);
  const TrajectoryError error = trajectoryError(street.estimated, street.given);
  EXPECT_GT(error.path_length, 32.0);
  EXPECT_LT(error.endDriftPercent(), 2.0);

  // The car is 1.7 m wide and its camera 1.65 m up: nothing may stand where it drove.
  const Vector3 up = -street.estimated.front().linear().col(1);
  std::size_t phantoms = 0;
  for (const Cuboid& cuboid : street.map.cuboids()) {
    const FromPath place = fromPath(cuboid.center, street.estimated, up);
    const bool driven = place.aside < 0.85 && place.above > -1.45 && place.above < 0.35;
    if (driven) ++phantoms;
  }
  EXPECT_EQ(0u, phantoms);

  // The house on the right: a vertical plane along the road, 5 m to 15 m aside.
  double largest_facade = 0.0;
  const Vector3 forward = street.estimated.front().linear().col(2);
  const std::map<std::int32_t, double> areas = planeAreas(street.map);
  for (const MapPlane& plane : street.map.planes()) {
    const Vector3 normal = plane.plane.normal;
    const double aside = std::abs(plane.plane.signedDistance(street.estimated[14].translation()));
    const bool along = std::abs(normal.dot(up)) < 0.15 && std::abs(normal.dot(forward)) < 0.2;
    if (!along || aside < 5.0 || aside > 15.0 || areas.count(plane.id) == 0) continue;
    largest_facade = std::max(largest_facade, areas.at(plane.id));
  }
  EXPECT_GT(largest_facade, 4.0);
}

TEST_F(RealSequences, CameraAtRestAddsFewCells) {
  const RealRun one = mapOf("stereo_indoor.yaml", "stereo_euroc_room", 0, 1);
  const RealRun ten = mapOf("stereo_indoor.yaml", "stereo_euroc_room", 0, 10);
  ASSERT_GT(one.map.cuboids().size(), 0u);
  const auto cells = [](const PlanarMap& map) {
    const double s = map.params().approximation.resolution;
    double volume = 0.0;
    for (const Cuboid& cuboid : map.cuboids()) volume += cuboid.volume();
    return volume / (s * s * s);
  };
  // What flickers widens boxes: more than their number grows. Single frames differ by a quarter.
  double most = cells(one.map);
  std::size_t cuboids = one.map.cuboids().size();  // of all single frames
  for (int frame = 1; frame < 10; ++frame) {
    const RealRun other = mapOf("stereo_indoor.yaml", "stereo_euroc_room", frame, frame + 1);
    most = std::max(most, cells(other.map));
    cuboids += other.map.cuboids().size();
  }
  EXPECT_LE(static_cast<double>(ten.map.cuboids().size()),
            1.17 * 0.1 * static_cast<double>(cuboids));
  EXPECT_LE(cells(ten.map), 1.11 * most);
  for (const Pose& pose : ten.estimated)
    EXPECT_LT((pose.translation() - ten.estimated.front().translation()).norm(), 0.02);
}

TEST_F(RealSequences, LivingRoomIsWalkedThroughWithoutPoses) {
  const RealRun room = mapOf("rgbd_indoor.yaml", "rgbd_icl_livingroom", 0, -1);
  EXPECT_EQ(0u, room.skipped);
  EXPECT_LT(trajectoryError(room.estimated, room.given).absolute_rms, 0.03);
}

/// The plane with this normal at this place that was seen in most frames, or null.
const MapPlane* planeAt(const PlanarMap& map, const Vector3& normal, double offset) {
  const MapPlane* found = nullptr;
  for (const MapPlane& plane : map.planes()) {
    const double cosine = plane.plane.normal.dot(normal);
    if (std::abs(cosine) < std::cos(3.0 * M_PI / 180.0)) continue;
    // Where the plane meets the line through the middle of the cabinet.
    const double place = cosine > 0.0 ? plane.plane.offset : -plane.plane.offset;
    if (std::abs(place - offset) > 0.04) continue;
    if (found == nullptr || plane.frames > found->frames) found = &plane;
  }
  return found;
}

TEST_F(RealSequences, CabinetIsClosedAndStandsOnNoFloor) {
  const RealRun walk = mapOf("rgbd_indoor.yaml", "rgbd_tum_cabinet", 0, -1,
                             {"ground_removal.enabled=true", "motion_estimation.poses=use"});
  EXPECT_EQ(0u, walk.skipped);
  // 0.8 m x 0.46 m and 0.55 m high, turned by 3.4 degrees in the world of the poses.
  const double turn = 3.37 * M_PI / 180.0;
  const Vector3 along(std::cos(turn), -std::sin(turn), 0.0);
  const Vector3 across(std::sin(turn), std::cos(turn), 0.0);
  struct Face {
    Vector3 normal;
    double offset;
    double area;
  };
  const std::map<std::int32_t, double> areas = planeAreas(walk.map);
  for (const Face& face : {Face{Vector3::UnitZ(), -0.548, 0.81 * 0.46},
                           Face{along, 1.949, 0.46 * 0.5}, Face{along, 1.143, 0.46 * 0.5},
                           Face{across, -0.601, 0.81 * 0.5}, Face{across, -0.138, 0.81 * 0.5}}) {
    const MapPlane* plane = planeAt(walk.map, face.normal, face.offset);
    ASSERT_NE(plane, nullptr) << face.normal.transpose() << " " << face.offset;
    EXPECT_GE(plane->frames, 8u) << face.normal.transpose() << " " << face.offset;
    EXPECT_LT(plane->rms(), 0.02);
    ASSERT_EQ(1u, areas.count(plane->id));
    EXPECT_GT(areas.at(plane->id), 0.9 * face.area) << face.normal.transpose();
  }
  // The floor at z = 0: nothing of it is left but what single frames saw wrongly far away.
  for (const MapPlane& plane : walk.map.planes()) {
    const bool floor = plane.plane.normal.z() > 0.95 && std::abs(plane.plane.offset) < 0.2;
    EXPECT_FALSE(floor && plane.frames > 1) << plane.frames;
  }
  for (const Cuboid& cuboid : walk.map.cuboids()) {
    const bool beside = (cuboid.center - Vector3(-1.5, 0.44, 0.0)).head<2>().norm() < 1.0;
    EXPECT_FALSE(beside && cuboid.center.z() < 0.05) << cuboid.center.transpose();
  }
}

TEST(SequenceSource, MeanUpIsThatOfThePosesOfItsFrames) {
  const std::string source = PLANAR_MAPPING_SOURCE_DIR;
  Configuration configuration = test::readyConfiguration("rgbd_indoor.yaml");
  configuration.inputs = {source + "/examples/data/rgbd_icl_five"};
  configuration.frames.step = 2;
  SequenceSource frames(configuration);
  const std::optional<ImagesUp> up = frames.meanUp();
  ASSERT_TRUE(up);
  Vector3 sum = Vector3::Zero();
  double count = 0.0;
  while (const std::optional<Frame> frame = frames.next()) {
    ASSERT_TRUE(frame->given_pose);
    sum -= frame->given_pose->linear().col(1);
    ++count;
  }
  EXPECT_GE(count, 2.0);
  EXPECT_LT((up->mean.normalized() - sum.normalized()).norm(), 1e-12);
  EXPECT_EQ(nearestAxis(up->mean), -Vector3::UnitY());
  EXPECT_TRUE(up->starts_at_identity);

  configuration.inputs = {source + "/examples/data/clouds_pcl/room_scan1.pcd"};
  configuration.frames.step = 1;
  EXPECT_FALSE(SequenceSource(configuration).meanUp());
}

TEST(ShippedSequences, RoomStandsBetweenItsFloorAndItsCeiling) {
  const RealRun room = mapOf("rgbd_indoor.yaml", "rgbd_icl_five", 0, -1,
                             {"ground_removal.enabled=false", "motion_estimation.poses=use"});
  ASSERT_EQ(0u, room.skipped);
  // y points down: ceiling at -1.13, floor at 1.38.
  for (const double y : {-1.13, 1.38}) {
    const MapPlane* plane = planeAt(room.map, Vector3::UnitY(), -y);
    ASSERT_NE(plane, nullptr) << y;
    EXPECT_LT(std::abs(std::abs(plane->plane.offset) - std::abs(y)), 0.02) << y;
    EXPECT_GT(planeAreas(room.map)[plane->id], 0.5) << y;  // of the floor little is seen
  }
  for (const Cuboid& cuboid : room.map.cuboids()) {
    EXPECT_GT(cuboid.center.y(), -1.13 - 0.1);
    EXPECT_LT(cuboid.center.y(), 1.38 + 0.1);
  }
}

TEST_F(RealSequences, TableIsInTheMapThoughItMightBeTheGround) {
  // The board lies at z = 0, the floor 0.73 m below it.
  const RealRun table =
      mapOf("stereo_indoor.yaml", "stereo_chess_table", 0, -1, {"motion_estimation.poses=use"});
  ASSERT_EQ(0u, table.skipped);
  ASSERT_EQ(7u, table.estimated.size());
  const MapPlane* board = planeAt(table.map, Vector3::UnitZ(), 0.0);
  ASSERT_NE(board, nullptr);
  EXPECT_LT(std::abs(board->plane.offset), 0.01);
  EXPECT_GT(planeAreas(table.map)[board->id], 0.6);
  for (double x = -0.3; x < 0.31; x += 0.1) {
    for (double y = -0.2; y < 0.21; y += 0.1)
      EXPECT_EQ(CellState::Occupied, table.map.stateAt({x, y, 0.0})) << x << " " << y;
  }
}

TEST_F(RealSequences, StreetStartsOverTheGroundItSees) {
  // Nobody says how high the camera is: 1.65 m.
  const RealRun street = mapOf("stereo_outdoor.yaml", "stereo_kitti_street", 0, 2,
                               {"motion_estimation.poses=ignore", "motion_estimation.start=ground",
                                "motion_estimation.camera_height_m=0"});
  ASSERT_EQ(2u, street.estimated.size());
  EXPECT_NEAR(street.estimated[0].translation().z(), 1.65, 0.1);
  const Vector3 up = street.estimated[0].linear().transpose() * Vector3::UnitZ();
  EXPECT_GT(up.dot(-Vector3::UnitY()), std::cos(3.0 * M_PI / 180.0));
}

}  // namespace
}  // namespace planar_mapping
