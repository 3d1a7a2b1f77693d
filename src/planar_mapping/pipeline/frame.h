// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/feature_beliefs.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/localization/localizer.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {

using FrameCloud = pcl::PointCloud<pcl::PointXYZ>;

/// The images of a frame, as read; empty where there is none.
struct FrameImages {
  io::Image left;   ///< of a stereo pair, else the only image (RGB-D)
  io::Image right;  ///< of a stereo pair
  std::optional<io::Calibration> calibration;
};

/// A figure a stage leaves in frames.csv, in a column of its own.
struct FrameStatistic {
  /// snake_case, with its unit as suffix; the time of a part of a stage is `stage.part_ms`
  std::string name;
  double value = 0.0;
};

/// One frame on its way through the stages. All geometry is in the sensor's frame but the pose.
///
/// Every index refers to `cloud`. A point is in at most one of `indices` (still to be mapped),
/// `ground` and none of them (removed).
struct Frame {
  std::size_t number = 0;  ///< position in the input, from 0
  std::string source;      ///< file it came from, for messages
  double timestamp = 0.0;  ///< seconds
  Pose T_world_sensor = Pose::Identity();
  std::optional<PinholeCamera> camera;  ///< of an organized cloud, where known
  std::optional<double> baseline;       ///< of a stereo camera, metres, where known
  FrameImages images;                   ///< where the input has any
  std::vector<std::uint8_t> even;       ///< evenTiles() of the left image of a stereo pair

  /// Pose from outside (file, VIEWPOINT, odometry), if there is one. T_world_sensor starts as it
  /// or as identity; a Motion stage decides what T_world_sensor becomes.
  std::optional<Pose> given_pose;
  /// The pose of the cloud is only assumed: its file has none.
  bool pose_assumed = false;
  bool is_prepared = false;  ///< Pipeline::prepare() has seen it
  /// The stages up to Features were run on it by another process; they are not run again.
  bool front_end_done = false;
  bool is_last = false;                  ///< of its input, where that is known
  std::vector<KeyFeature> key_features;  ///< left by a Features stage
  std::optional<FrameMotion> motion;     ///< since the frame before, left by a Motion stage
  /// Left by a Motion stage: T_world_sensor is in a world of this number. 0 = that of the first
  /// frame; in others are frames whose place among those before them is not known.
  std::size_t track = 0;
  /// Likewise: frames before in that track are in this one, and no more will be in that.
  std::optional<JoinedSubmap> joined;
  /// Likewise: what later frames of a pose that was found are farther off than those before; see
  /// FrameMotion::covariance.
  std::optional<Matrix6> drift;
  /// Why the frame cannot be used (no pose found, black image, ...); the stages after the one that
  /// set it leave the frame out and mapping goes on with the next. Empty = it can.
  std::string skip_reason;
  /// Left by a Motion stage: the pose is no given one, the world begins with this frame.
  bool starts_world = false;

  /// Where the sensor stood among the points is not known (io::CloudData::origin): rays mean
  /// nothing, and no space is classified.
  bool without_sensor = false;

  /// As measured; non-finite where nothing was, or where a stage before Motion removed a point.
  FrameCloud::Ptr cloud;
  Indices indices;  ///< points that still count, ascending
  Indices ground;   ///< removed as ground, ascending: it clears space but makes no cell
  std::vector<PlaneSegment> planes;
  std::vector<float> probability;  ///< belief per point of the cloud; empty = 1
  AssumedPoints assumed;           ///< of the planes, where nothing was measured

  std::size_t points_input = 0;            ///< in the file
  std::size_t points_valid = 0;            ///< finite ones
  std::size_t features = 0;                ///< followed by kl_occupancy
  std::size_t matches = 0;                 ///< of those, seen before
  std::size_t inliers = 0;                 ///< matches that agree with the motion (Motion stage)
  PlanarMap* map = nullptr;                ///< null before stages of kind Beliefs and Map
  bool inserted = false;                   ///< into the map
  FrameUpdate update;                      ///< what the insertion did
  std::vector<FrameStatistic> statistics;  ///< of the stages, for frames.csv
  double sensing_ms = 0.0;                 ///< of Pipeline::prepare() and sense()
  std::vector<double> stage_ms;            ///< of the stages so far, as the configuration has them
  std::vector<std::size_t> stage_removed;  ///< points that each of them removed, ground apart
  std::vector<std::string> notes;          ///< for run.log
  std::vector<std::string> warnings;       ///< the result is degraded
};

/// A cloud of rows of \p width points.
/// \param xyz  three floats a point, NaN where nothing was measured
PLANAR_MAPPING_EXPORT FrameCloud::Ptr cloudOf(const std::vector<float>& xyz, std::uint32_t width,
                                              std::uint32_t height);
/// The coordinates of a cloud, read in place.
PLANAR_MAPPING_EXPORT PointsView pointsOf(const FrameCloud& cloud);

}  // namespace planar_mapping
