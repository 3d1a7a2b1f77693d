// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// ROS 1: publishes a map for RViz and planners, latched.
//
//   rosrun planar_map_publisher planar_map_publisher out/map.pmap _frame_id:=map
//
//   ~cuboids  visualization_msgs/MarkerArray  a cube for each cuboid, a namespace for each plane
//   ~unknown  visualization_msgs/MarkerArray  unknown space
//   ~grid     nav_msgs/OccupancyGrid          0 free, 100 occupied, -1 unknown
#include <nav_msgs/OccupancyGrid.h>
#include <ros/ros.h>
#include <visualization_msgs/MarkerArray.h>

#include <cmath>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/plan/plan.h"

namespace {

using planar_mapping::CellState;
using planar_mapping::Cuboid;

visualization_msgs::MarkerArray markersOf(const std::vector<Cuboid>& cuboids,
                                          const std::string& frame_id) {
  visualization_msgs::MarkerArray array;
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame_id;
  marker.header.stamp = ros::Time::now();
  marker.action = visualization_msgs::Marker::DELETEALL;
  array.markers.push_back(marker);  // of an earlier map
  marker.type = visualization_msgs::Marker::CUBE;
  marker.action = visualization_msgs::Marker::ADD;
  for (const Cuboid& c : cuboids) {
    const bool unknown = c.state == CellState::Unknown;
    marker.ns = unknown ? "unknown" : c.plane_id < 0 ? "no plane" : std::to_string(c.plane_id);
    marker.id = static_cast<int>(array.markers.size());
    marker.pose.position.x = c.center.x();
    marker.pose.position.y = c.center.y();
    marker.pose.position.z = c.center.z();
    marker.pose.orientation.x = c.orientation.x();
    marker.pose.orientation.y = c.orientation.y();
    marker.pose.orientation.z = c.orientation.z();
    marker.pose.orientation.w = c.orientation.w();
    marker.scale.x = c.size.x();  // full lengths
    marker.scale.y = c.size.y();
    marker.scale.z = c.size.z();
    const bool gray = unknown || c.plane_id < 0;
    const double turn = 2.0 * M_PI * (gray ? 0.0 : 0.381966 * c.plane_id);
    marker.color.r = static_cast<float>(gray ? 0.6 : 0.6 + 0.35 * std::cos(turn));
    marker.color.g = static_cast<float>(gray ? 0.6 : 0.6 + 0.35 * std::cos(turn - 2.1));
    marker.color.b = static_cast<float>(gray ? 0.6 : 0.6 + 0.35 * std::cos(turn + 2.1));
    marker.color.a = unknown ? 0.2f : c.probability;
    array.markers.push_back(marker);
  }
  return array;
}

nav_msgs::OccupancyGrid messageOf(const planar_mapping::Plan& grid, const std::string& frame_id) {
  nav_msgs::OccupancyGrid message;
  message.header.frame_id = frame_id;
  message.header.stamp = ros::Time::now();
  message.info.resolution = static_cast<float>(grid.cell);
  message.info.width = grid.width;
  message.info.height = grid.height;
  message.info.origin.position.x = grid.origin.x();
  message.info.origin.position.y = grid.origin.y();
  message.info.origin.orientation.w = 1.0;
  message.data.assign(grid.values.begin(), grid.values.end());
  return message;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "planar_map_publisher");
  if (argc != 2) {
    ROS_FATAL("usage: planar_map_publisher MAP.pmap");
    return 2;
  }
  try {
    const planar_mapping::PlanarMap map = planar_mapping::io::loadMap(argv[1]);
    ros::NodeHandle node("~");
    const auto frame_id = node.param<std::string>("frame_id", "map");
    planar_mapping::RobotModel robot;
    node.param("robot_height", robot.height, robot.height);
    node.param("max_step", robot.max_step, robot.max_step);
    constexpr bool kLatched = true;
    auto cuboids = node.advertise<visualization_msgs::MarkerArray>("cuboids", 1, kLatched);
    auto unknown = node.advertise<visualization_msgs::MarkerArray>("unknown", 1, kLatched);
    auto grid = node.advertise<nav_msgs::OccupancyGrid>("grid", 1, kLatched);
    cuboids.publish(markersOf(map.cuboids(), frame_id));
    unknown.publish(markersOf(map.unknownCuboids(), frame_id));
    grid.publish(messageOf(planar_mapping::plansOf(map, robot).front(), frame_id));
    ros::spin();
  } catch (const planar_mapping::Error& error) {
    ROS_FATAL("%s", error.what());
    return 1;
  }
}
