// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/text_lines.h"

// EuRoC MAV in the ASL format: mav0/camN/{sensor.yaml,data.csv,data/}, the pose of the body in
// mav0/state_groundtruth_estimate0 or mav0/vicon0.
namespace planar_mapping::io::layouts {
namespace {

/// A sensor.yaml. \throws IoError naming the file and the key
class Sensor {
 public:
  explicit Sensor(const std::string& path) : path_(path) {
    constexpr std::size_t kLargest = std::size_t{1} << 20;
    const std::string text = readWholeText(path, kLargest);
    try {
      root_ = YAML::Load(text);
    } catch (const YAML::Exception& error) {
      failAtLine(path, static_cast<std::size_t>(error.mark.line + 1), error.msg);
    }
    if (!root_.IsMap()) throw IoError(path, "holds no 'key: value' lines");
  }

  std::vector<double> numbers(const char* key, std::size_t count) const {
    YAML::Node node = root_[key];
    if (node && node.IsMap()) node = node["data"];
    std::vector<double> values;
    if (node && node.IsSequence())
      for (const auto& item : node) {
        double value = 0.0;
        if (!item.IsScalar() || !parseNumber(item.Scalar(), value) || !std::isfinite(value)) break;
        values.push_back(value);
      }
    if (values.size() < count || (node.size() != values.size()))
      throw IoError(path_,
                    std::string("has no '") + key + "' of " + std::to_string(count) + " numbers");
    return values;
  }

  PinholeCamera camera() const {
    const std::vector<double> size = numbers("resolution", 2);
    const std::vector<double> k = numbers("intrinsics", 4);
    if (!(size[0] >= 1 && size[1] >= 1 && size[0] <= 65535 && size[1] <= 65535 && k[0] > 0.0 &&
          k[1] > 0.0))
      throw IoError(path_, "resolution and focal lengths must be > 0");
    return {k[0], k[1], k[2], k[3], static_cast<int>(size[0]), static_cast<int>(size[1])};
  }

  LensDistortion distortion() const {
    const YAML::Node model = root_["distortion_model"];
    if (model && model.IsScalar() && model.Scalar() != "radial-tangential" &&
        model.Scalar() != "radtan")
      throw IoError(path_, "distortion_model is " + quoted(model.Scalar()) +
                               "; only radial-tangential is read");
    const std::vector<double> d = numbers("distortion_coefficients", 4);
    return {d[0], d[1], d[2], d[3], d.size() > 4 ? d[4] : 0.0};
  }

  /// T_BS, which maps points of the sensor into the body.
  Pose inBody() const {
    const std::vector<double> v = numbers("T_BS", 16);
    const auto T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(v.data());
    const Matrix3 R = T.topLeftCorner<3, 3>();
    if (!rotationOf(R)) throw IoError(path_, "T_BS has no rotation matrix");
    return poseOf(Vector3(T.topRightCorner<3, 1>()), Eigen::Quaterniond(R));
  }

 private:
  std::string path_;
  YAML::Node root_;
};

/// Nanoseconds as text to seconds: their digits do not fit a double.
double secondsOf(std::string_view word, const std::string& path, std::size_t line) {
  std::uint64_t nanoseconds = 0;
  if (!parseNumber(word, nanoseconds))
    failAtLine(path, line, quoted(word) + " is no time in nanoseconds");
  return static_cast<double>(nanoseconds) / 1e9;
}

std::vector<StampedFile> imagesOf(const std::string& camera) {
  const std::string list = joined(camera, "data.csv");
  const std::string data = joined(camera, "data");
  std::vector<StampedFile> files;
  if (!exists(list)) {  // the names are the times
    for (const std::string& file : imageFilesOf(data))
      files.push_back({secondsOf(stemOf(file), file, 0), file});
  } else {
    forEachLine(list, ",", [&](const Words& words, std::size_t line) {
      if (words.size() < 2 || words[1].find('/') != std::string_view::npos)
        failAtLine(list, line, "is not `timestamp,file`");
      files.push_back({secondsOf(words[0], list, line), joined(data, std::string(words[1]))});
    });
  }
  if (files.empty()) throw IoError(camera, "lists no image");
  return files;
}

/// Poses of the body.
bool readBodyPoses(const std::string& mav, std::string& list, std::vector<StampedPose>& poses) {
  for (const char* name : {"state_groundtruth_estimate0", "vicon0"}) {
    const std::string folder = joined(mav, name);
    list = joined(folder, "data.csv");
    if (!exists(list)) continue;
    const std::string sensor = joined(folder, "sensor.yaml");
    const Pose T_sensor_body =
        exists(sensor) ? Sensor(sensor).inBody().inverse() : Pose::Identity();
    forEachLine(list, ",", [&](const Words& words, std::size_t line) {
      double v[7];
      finiteNumbers(words, 1, v, 7, list, line);
      const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
      if (!(std::abs(q.norm() - 1.0) <= 1e-3))
        failAtLine(list, line, "the quaternion is not of length 1");
      poses.push_back(
          {secondsOf(words[0], list, line), poseOf(Vector3(v[0], v[1], v[2]), q) * T_sensor_body});
    });
    return true;
  }
  return false;
}

std::string mavOf(const std::string& folder) {
  const std::string inner = joined(folder, "mav0");
  return isDirectory(inner) ? inner : folder;
}

}  // namespace

bool hasEuroc(const std::string& folder) {
  const std::string camera = joined(mavOf(folder), "cam0");
  return isDirectory(joined(folder, "mav0")) || exists(joined(camera, "sensor.yaml")) ||
         exists(joined(camera, "data.csv"));
}

Description readEuroc(const std::string& folder, const SequenceOptions& options) {
  const std::string mav = mavOf(folder);
  const std::string cameras[2] = {joined(mav, "cam0"), joined(mav, "cam1")};
  for (const std::string& camera : cameras) {
    if (!isDirectory(camera))
      throw IoError(camera,
                    "no such directory; EuRoC has the images of a stereo pair in cam0/ and "
                    "cam1/");
  }
  Description description("EuRoC (ASL)", SequenceKind::Stereo);
  const std::vector<StampedFile> lefts = imagesOf(cameras[0]);
  const std::vector<StampedFile> rights = imagesOf(cameras[1]);
  for (const StampedFile& left : lefts) {
    const StampedFile* const right = nearestFile(rights, left.timestamp);
    if (right == nullptr) continue;
    description.frames.push_back({left.file, right->file, left.timestamp, {}});
  }
  if (description.frames.empty())
    throw IoError(mav, "cam1/ has no image within 20 ms of any of cam0/");
  noteLeftOut(lefts.size() - description.frames.size(), lefts.size(), "left images",
              "no right image within 20 ms of them", description);

  const Sensor left(joined(cameras[0], "sensor.yaml"));
  const Pose T_body_left = left.inBody();
  if (options.calibration_file.empty()) {
    const Sensor right(joined(cameras[1], "sensor.yaml"));
    Calibration calibration;
    calibration.camera = left.camera();
    const UnrectifiedPair pair = {left.distortion(), right.distortion(), right.camera(),
                                  right.inBody().inverse() * T_body_left};
    calibration.baseline = pair.T_right_left.translation().norm();
    calibration.cx_right = pair.right_camera.cx;
    if (!(*calibration.baseline > 0.0))
      throw IoError(joined(cameras[1], "sensor.yaml"),
                    "T_BS is that of cam0: there is no baseline");
    calibration.unrectified = pair;
    description.calibration = calibration;
  }
  std::string list;
  std::vector<StampedPose> poses;
  if (options.poses_file.empty() && readBodyPoses(mav, list, poses))
    addPosesByTime(list, std::move(poses), T_body_left, options, description);
  return description;
}

}  // namespace planar_mapping::io::layouts
