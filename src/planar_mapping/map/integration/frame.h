// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/map/sensor/depth_image.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// What is seen again of a map plane in one frame.
struct PlaneHits {
  std::size_t layer = 0;  ///< position in MapData::planes
  bool is_new = false;
  std::vector<std::size_t> segments;  ///< of the frame
  KeyMap<TileHits> tiles;             ///< points per cell
};

/// One frame on its way into the map: checked input, world-frame planes, working memory.
struct Frame {
  const FrameObservation* observation = nullptr;
  Quaternion orientation = Quaternion::Identity();
  Matrix3 rotation = Matrix3::Identity();
  Vector3 sensor = Vector3::Zero();
  std::vector<std::uint8_t> use;  ///< per point: mapped or not; empty = all are
  std::vector<Plane> planes;      ///< world frame, towards the sensor
  std::vector<PlaneMoments> moments;
  /// Of each segment, filtered by `use`; empty where all are used.
  std::vector<std::optional<Indices>> inliers;
  Indices non_planar;
  std::vector<PlaneHits> hits;  ///< one per touched map plane
  /// Cells in which points of no plane lie, by position in MapData::planes: seen, if not as a
  /// plane.
  std::vector<KeyMap<std::uint64_t>> absorbed;
  /// Depth images that cells are tested against; may be empty.
  std::vector<DepthImage> images;
  KeyMap<std::uint64_t> cell_hits;  ///< bits of the non-planar cells seen, by block
  FrameUpdate update;

  /// How many points a cell of the map at a place (world) must have to count as seen.
  /// \param facing cosine between the cell's surface and the ray; 1 for a cell without one
  /// \return 0 where there is no camera to tell
  double pointsToBeSeen(const PlanarMapParams& params, const Vector3& world, double facing) const;
  const Indices& inliersOf(std::size_t segment) const {
    return inliers[segment] ? *inliers[segment] : (*observation->planes)[segment].inliers;
  }
};

/// Is it a finite rigid motion within what poses may be? \throws InputError
void requirePose(const Pose& pose);
/// Checks everything before anything is changed. \throws InputError
Frame makeFrame(const FrameObservation& observation);

/// Leaves out points of a scan that its rays may have got where they met an edge: each alone in its
/// cell, between what is before and what is behind, in space that was seen free.
void leaveOutStray(const MapData& map, Frame& frame);
/// Finds the map plane of each segment or makes a new one; fills frame.hits.
void associatePlanes(MapData& map, Frame& frame);
/// Points of the segments into the rasters, moments merged, planes refitted.
void integratePlanes(MapData& map, Frame& frame);
/// Planes of another map, placed in this one, as if they were seen in one frame: joined with those
/// on which they lie, else added. \return those that are too small to be told from what is there
std::vector<PlaneLayer> joinPlanes(MapData& map, std::vector<PlaneLayer> others, Frame& frame);
/// Merges planes of the map that turned out to be one.
void mergePlanes(MapData& map, Frame& frame);
/// Lowers the belief of cells that the sensor looks through.
void integrateMisses(MapData& map, Frame& frame);
/// Non-planar points into cells; cells that planes cover now are given up.
void integrateCells(MapData& map, Frame& frame);
/// Gives up cells of a box (metres) for which planes stand now.
void absorbCells(MapData& map, const Eigen::AlignedBox3d& box, Frame& frame);

/// Is a place (world) in an occupied cell, or within one resolution of a plane's?
bool isMapped(const MapData& map, const Vector3& world);

/// Adds what another map knows; see PlanarMap::merge(). \throws InputError, before anything changes
FrameUpdate mergeMaps(MapData& map, const MapData& other, const Pose& T_map_other);

}  // namespace planar_mapping::detail
