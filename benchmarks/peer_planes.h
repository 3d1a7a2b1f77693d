// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/planes/multi_plane.h"

/// What a search for planes is told of a cloud: the same for every method.
struct PeerTask {
  planar_mapping::PointsView points;  ///< organized if height > 1, sensor at the origin
  double distance = 0.05;             ///< of inliers, metres
  int min_inliers = 100;
  double angle = 0.05;      ///< OMPS: between neighbours of a plane, radians
  double smoothness = 0.1;  ///< region growing: between neighbours, radians
  int neighbours = 30;      ///< of a normal
};

/// A method of somebody else.
struct Peer {
  std::string name;
  bool organized_only = false;
  /// Disjoint segments; planes are fitted by least squares where the library reports none.
  std::vector<planar_mapping::PlaneSegment> (*find)(const PeerTask& task) = nullptr;
};

std::vector<Peer> pclPeers();
/// Empty where CGAL is not installed.
std::vector<Peer> cgalPeers();

/// Finite points of a cloud and where they come from.
std::vector<int> finiteOf(const planar_mapping::PointsView& points);
/// A segment of these points with the plane of least squares.
planar_mapping::PlaneSegment fitted(const planar_mapping::PointsView& points,
                                    std::vector<int> inliers);
