// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A corridor there and back by an odometer that drifts by half a metre and five degrees.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/io/map_file.h"
#include "simulated_rgbd.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kOneWay = 60;  // frames

class AtlasDrift : public CliTest {
 protected:
  /// A robot drives through the corridor and backs out of it. On the way in somebody stands there.
  std::string twoWays() const {
    const SimulatedRgbd in(program(), {"corridor", "--frames", "60", "--moving"});
    const SimulatedRgbd out(program(), {"corridor", "--frames", "60", "--seed", "5"});
    const std::string folder = directory_ / "walk";
    const auto name = [](std::size_t frame) {
      const std::string number = std::to_string(frame);
      return std::string(6 - number.size(), '0') + number + ".png";
    };
    for (const char* kind : {"rgb/", "depth/"}) {
      std::filesystem::create_directories(folder + "/" + kind);
      for (std::size_t i = 0; i < 2 * kOneWay; ++i) {
        const bool is_back = i >= kOneWay;
        const std::size_t from = is_back ? 2 * kOneWay - 1 - i : i;
        std::filesystem::rename((is_back ? out : in).path() + "/" + kind + name(from),
                                folder + "/" + kind + name(i));
      }
    }
    std::filesystem::rename(in.path() + "/calib.yaml", folder + "/calib.yaml");
    std::vector<io::StampedPose> poses = in.poses;
    poses.insert(poses.end(), in.poses.rbegin(), in.poses.rend());
    for (std::size_t i = 0; i < poses.size(); ++i) poses[i].timestamp = 0.5 * double(i);
    io::writeTumPoses(folder + "/poses.txt", poses);
    const Vector3 axis = Vector3(0.4, 0.2, 0.9).normalized();
    const Vector3 shift = 0.5 * Vector3(0.6, 0.5, 0.6).normalized();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const double part = double(i) / double(poses.size() - 1);
      poses[i].pose.prerotate(Eigen::AngleAxisd(5.0 * kRadiansPerDegree * part, axis));
      poses[i].pose.pretranslate(part * shift);
    }
    io::writeTumPoses(directory_ / "odometry.txt", poses);
    return folder;
  }
  PlanarMap mapOf(const std::string& folder, const std::string& name,
                  const std::vector<std::string>& more) const {
    expectExit(0, planarMap(joined({"run", folder, "-o", directory_ / name, "-q"}, more)));
    PlanarMap map = io::loadMap(directory_ / (name + "/map.pmap"));
    std::printf("%s: %zu planes, %td floors\n", name.c_str(), map.planes().size(), floorsOf(map));
    return map;
  }
  /// The person of the scene stands at 4.3, 0.35.
  bool isOccupiedByAPerson(const std::string& name) const {
    const std::string answer =
        expectExit(0, planarMap({"query", directory_ / name, "--box", "4.1,0.15,0.6,4.5,0.55,1.2"}))
            .out;
    return answer.find("occupied") != std::string::npos;
  }
  static std::ptrdiff_t floorsOf(const PlanarMap& map) {
    const std::vector<MapPlane>& planes = map.planes();
    return std::count_if(planes.begin(), planes.end(), [](const MapPlane& plane) {
      return std::abs(plane.plane.normal.z()) > 0.95 && std::abs(plane.plane.offset) < 0.6;
    });
  }
};

TEST_F(AtlasDrift, HalfAMetreAndFiveDegreesBetweenTwoWaysAreCorrected) {
  const std::string folder = twoWays();
  const PlanarMap truth = mapOf(folder, "truth", {});
  const std::vector<std::string> odometry = {"--poses", directory_ / "odometry.txt"};
  const PlanarMap drifted = mapOf(folder, "drifted", odometry);
  const PlanarMap closed =
      mapOf(folder, "closed",
            joined(odometry, {"--atlas", directory_ / "a.atlas", "--submap-frames", "5"}));
  EXPECT_GT(floorsOf(drifted), 1);
  EXPECT_GT(drifted.planes().size(), truth.planes().size() * 3 / 2);
  // The floor is one plane, and walls are single.
  EXPECT_EQ(1, floorsOf(closed));
  EXPECT_LE(closed.planes().size(), truth.planes().size() + truth.planes().size() / 5);
  // Points of frames are counted where the loop moved them.
  const auto coverage = [this](const std::string& name) -> double {
    return nlohmann::json::parse(read(name + "/metrics.json"))["coverage"];
  };
  EXPECT_GT(coverage("closed"), coverage("truth") - 0.03);
  // Who stood there at first has gone.
  mapOf(folder, "first", joined(odometry, {"--frames", ":8"}));
  EXPECT_TRUE(isOccupiedByAPerson("first"));
  EXPECT_FALSE(isOccupiedByAPerson("closed"));
}

}  // namespace
}  // namespace planar_mapping
