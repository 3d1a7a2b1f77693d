// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// ROS 2: publishes a map for RViz and planners, latched (transient local).
//
//   ros2 run planar_map_publisher planar_map_publisher out/map.pmap --ros-args -p frame_id:=map
//
//   ~cuboids  visualization_msgs/MarkerArray  a cube for each cuboid, a namespace for each plane
//   ~unknown  visualization_msgs/MarkerArray  unknown space
//   ~grid     nav_msgs/OccupancyGrid          0 free, 100 occupied, -1 unknown

#include <cmath>
#include <memory>
#include <nav_msgs/msg/occupancy_grid.hpp>
#include <rclcpp/rclcpp.hpp>
#include <string>
#include <vector>
#include <visualization_msgs/msg/marker_array.hpp>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/plan/plan.h"

namespace {

using planar_mapping::CellState;
using planar_mapping::Cuboid;

visualization_msgs::msg::MarkerArray markersOf(const std::vector<Cuboid>& cuboids,
                                               const std::string& frame_id,
                                               const rclcpp::Time& now) {
  visualization_msgs::msg::MarkerArray array;
  visualization_msgs::msg::Marker marker;
  marker.header.frame_id = frame_id;
  marker.header.stamp = now;
  marker.action = visualization_msgs::msg::Marker::DELETEALL;
  array.markers.push_back(marker);  // of an earlier map
  marker.type = visualization_msgs::msg::Marker::CUBE;
  marker.action = visualization_msgs::msg::Marker::ADD;
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

nav_msgs::msg::OccupancyGrid messageOf(const planar_mapping::Plan& grid,
                                       const std::string& frame_id, const rclcpp::Time& now) {
  nav_msgs::msg::OccupancyGrid message;
  message.header.frame_id = frame_id;
  message.header.stamp = now;
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
  const std::vector<std::string> arguments = rclcpp::init_and_remove_ros_arguments(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("planar_map_publisher");
  if (arguments.size() != 2) {
    RCLCPP_FATAL(node->get_logger(), "usage: planar_map_publisher MAP.pmap");
    return 2;
  }
  const auto frame_id = node->declare_parameter<std::string>("frame_id", "map");
  planar_mapping::RobotModel robot;
  robot.height = node->declare_parameter<double>("robot_height", robot.height);
  robot.max_step = node->declare_parameter<double>("max_step", robot.max_step);
  try {
    const planar_mapping::PlanarMap map = planar_mapping::io::loadMap(arguments[1]);
    const auto latched = rclcpp::QoS(1).transient_local().reliable();
    using visualization_msgs::msg::MarkerArray;
    const auto cuboids = node->create_publisher<MarkerArray>("~/cuboids", latched);
    const auto unknown = node->create_publisher<MarkerArray>("~/unknown", latched);
    const auto grid = node->create_publisher<nav_msgs::msg::OccupancyGrid>("~/grid", latched);
    cuboids->publish(markersOf(map.cuboids(), frame_id, node->now()));
    unknown->publish(markersOf(map.unknownCuboids(), frame_id, node->now()));
    grid->publish(messageOf(planar_mapping::plansOf(map, robot).front(), frame_id, node->now()));
    rclcpp::spin(node);
  } catch (const planar_mapping::Error& error) {
    RCLCPP_FATAL(node->get_logger(), "%s", error.what());
    return 1;
  }
  rclcpp::shutdown();
}
