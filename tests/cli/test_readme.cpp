// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The first program of README.md, as it stands there, and `planar_map run` give the same cuboids.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "cli_fixture.h"
#include "evaluation/metrics/cuboid_geometry.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "planar_mapping/surface/planar_mapping.h"
#include "real_data.h"

namespace {

struct Frame {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud{new pcl::PointCloud<pcl::PointXYZ>};
  planar_mapping::Pose T_world_sensor = planar_mapping::Pose::Identity();
};

Frame frameOf(const std::string& path) {
  const planar_mapping::io::CloudData file = planar_mapping::io::readCloudFile(path);
  Frame frame;
  frame.T_world_sensor = file.T_world_sensor;
  for (std::size_t i = 0; i < file.size(); ++i)
    frame.cloud->push_back({file.xyz[3 * i], file.xyz[3 * i + 1], file.xyz[3 * i + 2]});
  frame.cloud->width = static_cast<std::uint32_t>(file.width);
  frame.cloud->height = static_cast<std::uint32_t>(file.height);
  return frame;
}

planar_mapping::PlanarMap mapOfReadme(const std::vector<Frame>& frames) {
#include "readme_program.inc"
  return mapping.map();
}

class Readme : public planar_mapping::CliTest {
 protected:
  void expectAgreement(const std::vector<std::string>& paths) {
    // The numbers of the program.
    const std::string yaml =
        "version: 1\nstages:\n"
        "  - stage: multi_plane_segmentation\n    distance_threshold_m: 0.05\n    min_inliers: "
        "100\n"
        "  - stage: planar_cuboid_approximation\n    resolution_m: 0.1\n";
    std::vector<Frame> frames;
    std::vector<std::string> arguments = {"run", write("readme.yaml", yaml), "-o",
                                          directory_ / "out", "-q"};
    for (const std::string& path : paths) {
      frames.push_back(frameOf(path));
      arguments.insert(arguments.end(), {"-i", path});
    }
    expectExit(0, planarMap(arguments));
    const planar_mapping::PlanarMap ours = mapOfReadme(frames);
    const planar_mapping::PlanarMap map = planar_mapping::io::loadMap(directory_ / "out/map.pmap");
    EXPECT_GT(ours.cuboids().size(), 5u);
    EXPECT_EQ(planar_mapping::test::numbersOf(ours.cuboids()),
              planar_mapping::test::numbersOf(map.cuboids()));
    EXPECT_EQ(ours.frames(), paths.size());
  }
};

TEST_F(Readme, ItsProgramAndTheCommandGiveTheSameCuboidsOfOneCloud) {
  expectAgreement({planar_mapping::test::realData("clouds_pcl/room_scan1.pcd")});
}

TEST_F(Readme, ItsProgramAndTheCommandGiveTheSameCuboidsOfSeveralClouds) {
  expectAgreement({planar_mapping::test::realData("clouds_pcl/room_scan1.pcd"),
                   planar_mapping::test::realData("labelled_synpeb/small_clean.pcd")});
}

}  // namespace
