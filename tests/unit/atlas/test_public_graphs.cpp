// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "planar_mapping/atlas/pose_graph.h"
#include "real_data.h"

namespace planar_mapping {
namespace {

/// A graph of the g2o format: its edges are links, those to the next node of neighbours.
AtlasData readGraph(const std::string& path) {
  AtlasData data;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "VERTEX_SE3:QUAT") {
      Submap submap;
      submap.id = static_cast<std::int64_t>(data.submaps.size());
      submap.component = submap.id;
      data.submaps.push_back(submap);
    }
    if (word != "EDGE_SE3:QUAT") continue;
    std::size_t i = 0;
    std::size_t j = 0;
    double x[7];
    words >> i >> j;
    for (double& value : x) words >> value;
    Pose T_i_j = Pose::Identity();
    T_i_j.translation() = Vector3(x[0], x[1], x[2]);
    T_i_j.linear() = Quaternion(x[6], x[3], x[4], x[5]).normalized().toRotationMatrix();
    Matrix6 information;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        words >> information(row, column);
        information(column, row) = information(row, column);
      }
    }
    // The error is in the frame of j: T_i_j^-1 (T_i^-1 T_j), of which ours is the same, disturbed
    // on the left where the link goes from j to i.
    Link link;
    link.id = static_cast<std::int64_t>(data.links.size());
    link.kind = j == i + 1 ? LinkKind::Neighbour : LinkKind::Loop;
    link.from_submap = static_cast<std::int64_t>(i);
    link.to_submap = static_cast<std::int64_t>(j);
    link.T_to_from = T_i_j.inverse();
    link.covariance = information.inverse();
    data.links.push_back(link);
  }
  return data;
}

double costOf(const AtlasData& data) {
  double sum = 0.0;
  for (const Link& link : data.links) sum += link.residual;
  return sum;
}

TEST(PoseGraph, PublicGraphsReachTheirOptimum) {
  const std::string folder = test::realData("graphs");
  if (test::isMissing("graphs")) GTEST_SKIP() << "no pose graphs in " << folder;
  AtlasData data = readGraph(folder + "/parking-garage.g2o");
  ASSERT_EQ(data.submaps.size(), 1661u);
  ASSERT_EQ(data.links.size(), 6275u);
  const PoseGraphResult result = solvePoseGraph(data);
  std::printf("parking-garage: cost %.5f, %.0f ms\n", costOf(data), result.ms);
  EXPECT_NEAR(costOf(data), 1.263, 0.013);
}

}  // namespace
}  // namespace planar_mapping
