// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "peer_planes.h"

#ifdef PLANAR_MAPPING_HAS_CGAL
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Shape_detection/Efficient_RANSAC.h>
#include <CGAL/Shape_detection/Region_growing/Region_growing.h>
#include <CGAL/Shape_detection/Region_growing/Region_growing_on_point_set.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>

#include <boost/iterator/function_output_iterator.hpp>
#include <cmath>
#include <tuple>

namespace {

using planar_mapping::PlaneSegment;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
/// The index travels along: Efficient_RANSAC reorders its input.
using OrientedPoint = std::tuple<Kernel::Point_3, Kernel::Vector_3, int>;
using Points = std::vector<OrientedPoint>;
using PointMap = CGAL::Nth_of_tuple_property_map<0, OrientedPoint>;
using NormalMap = CGAL::Nth_of_tuple_property_map<1, OrientedPoint>;

constexpr double kDegree = M_PI / 180.0;

Points orientedPoints(const PeerTask& task) {
  Points points;
  for (const int i : finiteOf(task.points)) {
    const float* p = task.points[static_cast<std::size_t>(i)];
    points.emplace_back(Kernel::Point_3(p[0], p[1], p[2]), Kernel::Vector_3(0, 0, 1), i);
  }
  CGAL::pca_estimate_normals<CGAL::Sequential_tag>(
      points, static_cast<unsigned>(task.neighbours),
      CGAL::parameters::point_map(PointMap()).normal_map(NormalMap()));
  return points;
}

std::vector<PlaneSegment> efficientRansac(const PeerTask& task) {
  using Traits =
      CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, Points, PointMap, NormalMap>;
  using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;
  Points points = orientedPoints(task);
  CGAL::get_default_random() = CGAL::Random(12345);
  Ransac search;
  search.set_input(points);
  search.add_shape_factory<CGAL::Shape_detection::Plane<Traits>>();
  Ransac::Parameters parameters;
  parameters.probability = 0.01;
  parameters.min_points = static_cast<std::size_t>(task.min_inliers);
  parameters.epsilon = task.distance;
  parameters.cluster_epsilon = 2.0 * task.distance;
  parameters.normal_threshold = std::cos(25.0 * kDegree);
  search.detect(parameters);
  std::vector<PlaneSegment> found;
  for (const auto& shape : search.shapes()) {
    std::vector<int> inliers;
    for (const std::size_t i : shape->indices_of_assigned_points()) {
      inliers.push_back(std::get<2>(points[i]));
    }
    // CGAL does not refit its planes: their points tell better.
    found.push_back(fitted(task.points, std::move(inliers)));
  }
  return found;
}

std::vector<PlaneSegment> regionGrowing(const PeerTask& task) {
  using Neighbours = CGAL::Shape_detection::Point_set::K_neighbor_query<Kernel, Points, PointMap>;
  using Region =
      CGAL::Shape_detection::Point_set::Least_squares_plane_fit_region<Kernel, Points, PointMap,
                                                                       NormalMap>;
  using Sorting =
      CGAL::Shape_detection::Point_set::Least_squares_plane_fit_sorting<Kernel, Points, Neighbours,
                                                                        PointMap>;
  using Growing =
      CGAL::Shape_detection::Region_growing<Points, Neighbours, Region, Sorting::Seed_map>;
  Points points = orientedPoints(task);
  Neighbours neighbours(points, 12);
  Region region(points, task.distance, 20.0, static_cast<std::size_t>(task.min_inliers));
  Sorting sorting(points, neighbours);
  sorting.sort();
  Growing growing(points, neighbours, region, sorting.seed_map());
  std::vector<PlaneSegment> found;
  growing.detect(boost::make_function_output_iterator([&](const std::vector<std::size_t>& grown) {
    std::vector<int> inliers;
    for (const std::size_t i : grown) inliers.push_back(std::get<2>(points[i]));
    found.push_back(fitted(task.points, std::move(inliers)));
  }));
  return found;
}

}  // namespace

std::vector<Peer> cgalPeers() {
  return {{"CGAL efficient RANSAC", false, efficientRansac},
          {"CGAL region growing", false, regionGrowing}};
}
#else
std::vector<Peer> cgalPeers() {
  return {};
}
#endif
