// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/occupancy.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {

/// A run over one input, by one robot.
struct AtlasSession {
  std::int64_t id = 0;
  std::string source;         ///< the input, as it was given
  std::string configuration;  ///< config.resolved.yaml
};

/// What is kept of a frame, so that others can be recognised and placed by it.
struct Keyframe {
  std::int64_t id = 0;                        ///< ascending over all sessions, never reused
  std::int64_t submap = 0;                    ///< the one it lies in
  std::size_t frame = 0;                      ///< number in its input
  std::string source;                         ///< file it came from
  double timestamp = 0.0;                     ///< seconds
  Pose T_submap_keyframe = Pose::Identity();  ///< from the sensor's frame to the submap's
  FeatureCamera camera;
  int width = 0;   ///< of its image, pixels
  int height = 0;  ///< of its image, pixels
  /// Features with depth, the strongest, spread over the image.
  std::vector<FeatureSighting> sightings;
  /// A row of descriptor_bytes for each of them.
  std::vector<std::uint8_t> descriptors;
  std::size_t descriptor_bytes = 0;
  /// Median inverse depth of cells of the image, row by row, in units of 1/4096 of 1/m; 0 = none.
  std::vector<std::uint16_t> inverse_depths;
  int cells_across = 0;                 ///< cells in a row of inverse_depths
  std::vector<std::uint8_t> thumbnail;  ///< PNG; empty without an image
  /// Of a cloud without an image: points spread over it, x y z, sensor's frame, in units of
  /// point_step.
  std::vector<std::int16_t> points;
  double point_step = 0.0;  ///< metres, > 0 where there are points
  bool is_scan = false;     ///< that cloud is of a scanner, which looks all around
};

/// A part of the map in a frame of its own that moves as a whole.
struct Submap {
  std::int64_t id = 0;  ///< ascending over all sessions, never reused
  std::int64_t session = 0;
  /// Submaps that links join have the same component: its number is the lowest id among them.
  std::int64_t component = 0;
  /// The submap's frame is the one that its session's poses were found in, so that submaps which no
  /// loop has moved lie on one lattice. From it to the component's world.
  Pose T_world_submap = Pose::Identity();
  std::shared_ptr<const PlanarMap> map;
};

enum class LinkKind : std::uint8_t {
  Neighbour,  ///< between a submap and the next of its session, by the motion that was found
  Loop,       ///< features of two keyframes far apart in time, or of two sessions
  Surface,    ///< the surfaces of a keyframe without an image, on those of another submap
};

enum class LinkState : std::uint8_t {
  Used,
  Rejected,  ///< it contradicts the others, or there is too little evidence to join components
  Refused,   ///< a person said so (--without-loop)
};

/// As they are called in the file, by `planar_map atlas` and in Python.
constexpr std::array<const char*, 3> kLinkKindWords = {"neighbour", "loop", "surface"};
constexpr std::array<const char*, 3> kLinkStateWords = {"used", "rejected", "refused"};
constexpr const char* wordOf(LinkKind kind) {
  return kLinkKindWords[static_cast<std::size_t>(kind)];
}
constexpr const char* wordOf(LinkState state) {
  return kLinkStateWords[static_cast<std::size_t>(state)];
}

/// What speaks for a link.
struct LinkEvidence {
  std::size_t inliers = 0;    ///< features, or small planes, that agree with it
  std::size_t matches = 0;    ///< features that look alike, or planes of the cloud
  std::size_t off_plane = 0;  ///< inliers beside the plane that holds most of them
  double agreement = 0.0;  ///< fraction of the depths both see that agree, the worse of both ways
  double seen_through = 0.0;  ///< fraction that lies where the other saw through, the worse
  double log_odds = 0.0;      ///< natural logarithm of right over wrong, of all this together
};

/// A measured motion between two submaps, with a covariance (an edge of the pose graph).
struct Link {
  std::int64_t id = 0;
  LinkKind kind = LinkKind::Loop;
  LinkState state = LinkState::Used;
  std::int64_t from_submap = 0;
  std::int64_t to_submap = 0;
  std::int64_t from_keyframe = -1;  ///< -1 = not by keyframes
  std::int64_t to_keyframe = -1;
  Pose T_to_from = Pose::Identity();         ///< between the frames of the submaps
  Matrix6 covariance = Matrix6::Identity();  ///< of T_to_from; see Matrix6
  LinkEvidence evidence;
  double residual = 0.0;  ///< squared Mahalanobis distance from the solution, 6 degrees of freedom

  /// Of a cloud that lies on surfaces of the other submap, but so much of whose points was seen
  /// through there or the other way round: it is never used, and speaks against joining. Rooms of
  /// one shape differ in what stands in them.
  bool isDoubt() const {
    constexpr double kMostSeenThrough = 0.02;
    return kind == LinkKind::Surface && evidence.seen_through > kMostSeenThrough;
  }
};

/// All that a store holds (*.atlas).
struct AtlasData {
  std::vector<AtlasSession> sessions;
  std::vector<Keyframe> keyframes;  ///< by id
  std::vector<Submap> submaps;      ///< by id
  std::vector<Link> links;          ///< by id
};

}  // namespace planar_mapping
