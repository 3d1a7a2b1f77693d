// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping::io {

/// A cloud as a file holds it: points in the sensor's frame, metres, row major when organized.
///
/// Optional channels are empty or as long as the cloud. Points without a measurement are NaN.
///
/// Doubles farther than a kilometre from 0 along an axis, and farther than the cloud is large, as
/// UTM and ECEF coordinates are, would lose their last digits as floats: points are then relative
/// to `origin`, and the pose is that of this place. Where the sensor stood is not known then.
struct CloudData {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> xyz;             ///< three floats a point
  std::vector<std::uint32_t> colors;  ///< 0xRRGGBB a point
  std::vector<std::uint32_t> labels;
  std::vector<float> intensities;
  /// VIEWPOINT of a PCD, identity elsewhere; times a translation by the origin.
  Pose T_world_sensor = Pose::Identity();
  Vector3 origin = Vector3::Zero();  ///< of the points in the file's coordinates, whole metres

  std::size_t size() const { return xyz.size() / 3; }
  /// Valid as long as the cloud is neither moved from nor changed.
  PointsView view() const {
    PointsView points(xyz.data(), size());
    points.width = width;
    points.height = height;
    return points;
  }
};

/// Which optional channels to read; those not asked for cost no memory.
struct CloudChannels {
  bool colors = true;
  bool labels = true;
  bool intensities = true;

  static CloudChannels none() { return {false, false, false}; }
};

enum class CloudFormat { None, Pcd, Ply, Velodyne };

/// Says by its first bytes what a file is; None for anything but PCD, PLY and KITTI's scans (.bin:
/// x, y, z, intensity as float32), also for a missing file.
PLANAR_MAPPING_EXPORT CloudFormat recognizeCloudFile(const std::string& path);

/// Reads a PCD (versions 0.5 to 0.7; ascii, binary, binary_compressed) or PLY (1.0; ascii, binary
/// of either byte order) file, whichever its first bytes say, or a scan as KITTI writes it (.bin).
///
/// x, y, z must be float32 or float64 (see CloudData::origin) at any position among the fields;
/// fields we do not know are skipped. Memory is bounded by the size of the file, not by what its
/// header says: at most the cloud itself, twice that for binary_compressed.
/// Independent of the locale.
/// \throws IoError naming the file and what is wrong: missing, not regular, neither PCD nor PLY,
///         cut short, sizes that contradict each other or the file, no points, unusable field types
PLANAR_MAPPING_EXPORT CloudData readCloudFile(const std::string& path,
                                              const CloudChannels& channels = CloudChannels());

/// Multiplies the coordinates of points, origin and sensor.
PLANAR_MAPPING_EXPORT void scaleCloud(CloudData& cloud, double scale);

/// For a cloud in the coordinates of the world: its points become those that a sensor at \p
/// position sees, with the axes of the world. That replaces the VIEWPOINT. \param position  world,
/// metres
PLANAR_MAPPING_EXPORT void placeSensor(CloudData& cloud, const Vector3& position);

/// What the header of a PCD or PLY file says, checked against the file as far as possible without
/// reading the points.
struct CloudFileInfo {
  CloudFormat format = CloudFormat::None;
  std::string encoding;  ///< "ascii", "binary", "binary_compressed", "binary_big_endian"
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::string> fields;
  Pose T_world_sensor = Pose::Identity();
};

/// \throws IoError
PLANAR_MAPPING_EXPORT CloudFileInfo readCloudFileInfo(const std::string& path);

/// Writes binary PCD 0.7: x y z as float32, then rgb, label and intensity where present; the pose
/// as VIEWPOINT. \throws IoError; InputError if sizes disagree or the pose is no rigid motion
PLANAR_MAPPING_EXPORT void writePcd(const std::string& path, const CloudData& cloud,
                                    Overwrite overwrite = Overwrite::Refuse);

}  // namespace planar_mapping::io
