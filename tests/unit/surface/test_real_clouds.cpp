// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"
#include "real_data.h"

namespace planar_mapping {
namespace {

using Cell = std::tuple<int, int, int>;

Cell cellOf(const Vector3& p, double side) {
  return {static_cast<int>(std::floor(p.x() / side)), static_cast<int>(std::floor(p.y() / side)),
          static_cast<int>(std::floor(p.z() / side))};
}

/// Axis-aligned boxes that cover the cells exactly: first free cell, grown along x, y, z.
std::size_t greedyBoxes(std::set<Cell> left) {
  std::size_t boxes = 0;
  while (!left.empty()) {
    const auto [x0, y0, z0] = *left.begin();
    std::array<int, 3> size = {1, 1, 1};
    const auto layerFree = [&](int axis) {
      std::array<int, 3> low = {x0, y0, z0};
      std::array<int, 3> extent = size;
      low[static_cast<std::size_t>(axis)] += size[static_cast<std::size_t>(axis)];
      extent[static_cast<std::size_t>(axis)] = 1;
      for (int x = 0; x < extent[0]; ++x) {
        for (int y = 0; y < extent[1]; ++y) {
          for (int z = 0; z < extent[2]; ++z) {
            if (!left.count({low[0] + x, low[1] + y, low[2] + z})) return false;
          }
        }
      }
      return true;
    };
    for (int axis = 0; axis < 3; ++axis) {
      while (layerFree(axis)) ++size[static_cast<std::size_t>(axis)];
    }
    for (int x = 0; x < size[0]; ++x) {
      for (int y = 0; y < size[1]; ++y) {
        for (int z = 0; z < size[2]; ++z) left.erase({x0 + x, y0 + y, z0 + z});
      }
    }
    ++boxes;
  }
  return boxes;
}

double fractionWithin(const PointsView& points, const std::vector<Cuboid>& cuboids, double margin) {
  constexpr double kBin = 0.5;
  std::map<Cell, std::vector<std::size_t>> bins;
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const auto corner = corners(cuboids[i]);
    Vector3 low = corner[0], high = corner[0];
    for (const Vector3& c : corner) {
      low = low.cwiseMin(c);
      high = high.cwiseMax(c);
    }
    const auto [x0, y0, z0] = cellOf(low.array() - margin, kBin);
    const auto [x1, y1, z1] = cellOf(high.array() + margin, kBin);
    for (int x = x0; x <= x1; ++x) {
      for (int y = y0; y <= y1; ++y) {
        for (int z = z0; z <= z1; ++z) bins[{x, y, z}].push_back(i);
      }
    }
  }
  std::size_t inside = 0, all = 0;
  for (std::size_t i = 0; i < points.size; i += 11) {
    if (!points.isMeasured(i)) continue;
    ++all;
    const auto bin = bins.find(cellOf(points.point(i), kBin));
    if (bin == bins.end()) continue;
    inside += std::any_of(bin->second.begin(), bin->second.end(), [&](std::size_t c) {
      return contains(cuboids[c], points.point(i), margin);
    });
  }
  return static_cast<double>(inside) / static_cast<double>(all);
}

struct RealCloud {
  const char* path;
  Vector3 up;
};

void PrintTo(const RealCloud& cloud, std::ostream* out) {
  *out << cloud.path;
}

class RealClouds : public ::testing::TestWithParam<RealCloud> {};

TEST_P(RealClouds, FewerCuboidsThanGreedyBoxesAndNoPointLeftOut) {
  const std::string path = test::realData(GetParam().path);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const io::Frame frame = io::Sequence({path}).read(0, io::CloudChannels::none());
  const PointsView points = frame.cloud.view();
  MultiPlaneParams plane_params;
  plane_params.min_inliers = 1000;
  const PlaneSet found = findPlanes(points, nullptr, plane_params);

  constexpr double kResolution = 0.1;
  const auto cuboidsOf = [&](Profile profile) {
    PlanarMapParams params = PlanarMapParams::of(profile);
    params.approximation.resolution = kResolution;
    params.approximation.up = GetParam().up;
    params.min_cell_fraction = 0.0;  // all points count
    PlanarMap map(params);
    FrameObservation observation;
    observation.points = points;
    observation.planes = &found.planes;
    map.insert(observation);
    return map.cuboids();
  };
  const std::vector<Cuboid> compact = cuboidsOf(Profile::Compact);
  const std::vector<Cuboid> paper = cuboidsOf(Profile::Paper);
  std::set<Cell> cells;
  for (std::size_t i = 0; i < points.size; ++i) {
    if (points.isMeasured(i)) cells.insert(cellOf(points.point(i), kResolution));
  }
  EXPECT_LT(compact.size(), greedyBoxes(cells));
  EXPECT_LT(compact.size(), paper.size());
  EXPECT_GT(fractionWithin(points, compact, 0.5 * kResolution + 1e-6), 0.98);
  EXPECT_GT(fractionWithin(points, paper, 0.5 * kResolution + 1e-6), 0.98);
}

INSTANTIATE_TEST_SUITE_P(
    AtTenCentimetres, RealClouds,
    ::testing::Values(RealCloud{"rgbd_icl_five", {0, -1, 0}},
                      RealCloud{"rgbd_tum_cabinet", {0, -1, 0}},
                      RealCloud{"clouds_pcl/office1.pcd", {0, -1, 0}},
                      RealCloud{"clouds_pcl/room_scan1.pcd", {0, 0, 1}},
                      RealCloud{"clouds_pcl/table_scene_mug_stereo_textured.pcd", {0, -1, 0}},
                      RealCloud{"labelled_mosd_tabletop/test16.pcd", {0, -1, 0}}),
    [](const ::testing::TestParamInfo<RealCloud>& cloud) {
      return std::filesystem::path(cloud.param.path).stem().string();
    });

/// docs/dev/automatic_parameters.md: these clouds chose the thresholds.
TEST(RealClouds, MergedCloudsAndResolutionsAreFound) {
  struct Known {
    const char* name;
    bool merged;
    double resolution;
  };
  const Known known[] = {{"clouds_pcl/room_scan1.pcd", false, 0.1},
                         {"clouds_pcl/room_scan2.pcd", false, 0.2},
                         {"clouds_pcl/office1.pcd", false, 0.05},
                         {"clouds_velodyne/street_scan.pcd", false, 0.2},
                         {"clouds_steps/tilted_steps.pcd", true, 0.1},
                         {"labelled_office_rooms/room1_gt_fine.pcd", true, 0.1},
                         {"map_fr079_corridor/geb079_occupied.pcd", true, 0.2}};
  for (const Known& cloud : known) {
    if (test::isMissing(cloud.name)) continue;
    const io::CloudData data =
        io::readCloudFile(test::realData(cloud.name), io::CloudChannels::none());
    const Indices usable = usablePoints(data.view());
    EXPECT_EQ(cloud.merged, isMerged(data.view(), &usable)) << cloud.name;
    EXPECT_EQ(cloud.resolution, automaticResolution(scaleOf(data.view(), usable))) << cloud.name;
  }
}

}  // namespace
}  // namespace planar_mapping
