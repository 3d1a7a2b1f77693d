// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Data sets of stereo pairs and scans: KITTI, EuRoC, Middlebury.
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io::layouts {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor | Eigen::DontAlign>;

/// The lines `key numbers` of a text file; other lines are of other versions.
class KeyedNumbers {
 public:
  KeyedNumbers(const std::string& path, const std::string& separators) : path_(path) {
    forEachLine(path, separators, [this](const Words& words, std::size_t) {
      std::vector<double> numbers(words.size() - 1);
      for (std::size_t i = 0; i < numbers.size(); ++i)
        if (!parseNumber(words[i + 1], numbers[i]) || !std::isfinite(numbers[i])) return;
      values_[std::string(words[0])] = std::move(numbers);
    });
  }

  bool has(const std::string& key) const { return values_.count(key) != 0; }
  const std::vector<double>& get(const std::string& key, std::size_t count) const {
    const auto found = values_.find(key);
    if (found == values_.end() || found->second.size() != count)
      throw IoError(path_, "has no line '" + key + "' with " + std::to_string(count) + " numbers");
    return found->second;
  }
  Matrix34 matrix(const std::string& key) const { return Matrix34(get(key, 12).data()); }

 private:
  std::string path_;
  std::map<std::string, std::vector<double>> values_;
};

/// A rectified pair of the size of an image.
Calibration pairCalibration(const std::string& path, const PinholeCamera& left, double cx_right,
                            double baseline, const std::string& image) {
  if (!(left.fx > 0.0 && left.fy > 0.0 && baseline > 0.0))
    throw IoError(path, "is not of a rectified pair: focal lengths and baseline must be > 0");
  const Image size = readImageSize(image);
  Calibration calibration;
  calibration.camera = left;
  calibration.camera.width = size.width;
  calibration.camera.height = size.height;
  calibration.baseline = baseline;
  calibration.cx_right = cx_right;
  return calibration;
}

/// \throws IoError unless the images have the size that the calibration is for
void requireSize(const std::string& path, const Image& image, const std::vector<double>& size,
                 const std::string& remedy) {
  if (image.width != size[0] || image.height != size[1])
    throw IoError(
        path, concatenated("is for images of ", size[0], " x ", size[1],
                           " pixels, but they are of ", image.width, " x ", image.height, remedy));
}

// KITTI odometry: sequences/NN/{image_0,image_1,image_2,image_3,velodyne,calib.txt,times.txt} with
// the poses of camera 0 in poses/NN.txt. KITTI raw, a drive synchronised and rectified: image_00 to
// image_03, each with data/ and timestamps.txt, and calib_cam_to_cam.txt.

std::string kittiImages(bool is_raw, int camera) {
  return is_raw ? "image_0" + std::to_string(camera) + "/data" : "image_" + std::to_string(camera);
}

/// The left camera of the pair that there is: gray (0) before colour (2), -1 = none.
int leftCameraOf(const std::string& folder, bool is_raw) {
  for (const int left : {0, 2})
    if (isDirectory(joined(folder, kittiImages(is_raw, left))) &&
        isDirectory(joined(folder, kittiImages(is_raw, left + 1))))
      return left;
  return -1;
}

/// Adds the pairs, and for each the number in its name and the time in that line of a file.
void listKittiPairs(const std::string& folder, int left, bool is_raw, Description& description) {
  if (left < 0)
    throw IoError(folder, "has no image pair (" + kittiImages(is_raw, 0) + " and " +
                              kittiImages(is_raw, 1) + ", or 2 and 3)");
  description.layout += left == 0 ? " (gray)" : " (colour)";
  listStereo(folder, kittiImages(is_raw, left), kittiImages(is_raw, left + 1), description);
}

/// P of a camera of calib.txt or calib_cam_to_cam.txt projects points of camera 0.
Calibration calibrateKittiPair(const std::string& path, const std::string& name, int left,
                               const Description& description) {
  const KeyedNumbers numbers(path, ":");
  const std::string& image = description.frames.front().file;
  const Matrix34 P = numbers.matrix(name + std::to_string(left));
  const Matrix34 Q = numbers.matrix(name + std::to_string(left + 1));
  if (numbers.has("S_rect_00"))
    requireSize(path, readImageSize(image), numbers.get("S_rect_00", 2),
                ": take the 'synced+rectified data' of this drive, or give a calibration of pairs "
                "that are not rectified by --calib FILE");
  return pairCalibration(path, {P(0, 0), P(1, 1), P(0, 2), P(1, 2), 0, 0}, Q(0, 2),
                         (P(0, 3) - Q(0, 3)) / P(0, 0), image);
}

/// Sets number and time of each frame: a part of a sequence may be there only.
void setKittiTimes(const std::string& path, const std::vector<double>& times, bool growing,
                   std::vector<FrameEntry>& frames) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::uint64_t number = 0;
    const std::string stem = stemOf(frames[i].file);
    if (!parseNumber(std::string_view(stem), number))
      throw IoError(frames[i].file, "KITTI's frames are called by their number, as 000000.png");
    frames[i].number = static_cast<double>(number);
    if (path.empty()) continue;
    if (number < times.size()) {
      frames[i].timestamp = times[number];
    } else if (growing) {
      return frames.resize(i);
    } else {
      throw IoError(path, "holds " + std::to_string(times.size()) + " times, but none of frame " +
                              std::to_string(number));
    }
  }
}

}  // namespace

void listKitti(const std::string& folder, const SequenceOptions& options,
               Description& description) {
  const std::string scans = joined(folder, "velodyne");
  const int left = leftCameraOf(folder, false);
  if (isDirectory(scans) && (left < 0 || options.preferred != SequenceKind::Stereo)) {
    description.layout += " (velodyne)";
    description.kind = SequenceKind::Clouds;
    listClouds(scans, description);
    description.pose_source = PoseSource::None;
    if (description.frames.empty()) throw IoError(scans, "holds no .bin files of points");
  } else {
    listKittiPairs(folder, left, false, description);
  }
  const std::string path = firstOf(folder, {"times.txt"});
  std::vector<double> times;
  if (!path.empty())
    forEachLine(path, "", [&](const Words& words, std::size_t line) {
      times.push_back(finiteNumber(words[0], path, line));
    });
  setKittiTimes(path, times, options.growing, description.frames);
}

std::optional<Calibration> calibrateKitti(const std::string& folder,
                                          const Description& description) {
  return calibrateKittiPair(joined(folder, "calib.txt"), "P", leftCameraOf(folder, false),
                            description);
}

void addKittiPoses(const std::string& folder, const SequenceOptions& options,
                   Description& description) {
  const std::string name = nameOf(folder);
  const std::string poses = firstOf(
      folder,
      {"poses.txt", name + ".txt", "../../poses/" + name + ".txt", "../poses/" + name + ".txt"});
  if (poses.empty()) return;
  Pose T_camera0_sensor = Pose::Identity();
  const bool are_scans = description.kind == SequenceKind::Clouds;
  const int left = leftCameraOf(folder, false);
  if (are_scans || left != 0) {
    const KeyedNumbers calibration(joined(folder, "calib.txt"), ":");
    if (are_scans) {
      const Matrix34 Tr = calibration.matrix("Tr");
      T_camera0_sensor = poseOf(Vector3(Tr.col(3)), Eigen::Quaterniond(Matrix3(Tr.leftCols<3>())));
    } else {
      const Matrix34 P = calibration.matrix("P" + std::to_string(left));
      T_camera0_sensor.translation() = -P.leftCols<3>().inverse() * P.col(3);
    }
  }
  const Trajectory trajectory = readTrajectory(poses);
  addPoses(poses, trajectory, trajectory.has_times ? PosesBy::Time : PosesBy::Number,
           T_camera0_sensor, options, description);
}

void listKittiRaw(const std::string& folder, const SequenceOptions& options,
                  Description& description) {
  constexpr double kDay = 86400.0;
  const int left = leftCameraOf(folder, true);
  listKittiPairs(folder, left, true, description);
  // "2011-09-26 13:02:25.964389445" a line, as seconds of the first day.
  const std::string path = firstOf(folder, {kittiImages(true, left) + "/../timestamps.txt"});
  std::vector<double> times;
  if (!path.empty())
    forEachLine(path, "-:", [&](const Words& words, std::size_t line) {
      double v[6];
      finiteNumbers(words, 0, v, 6, path, line);
      double time = (v[3] * 60.0 + v[4]) * 60.0 + v[5];
      if (!times.empty() && time < times.back() - 0.5 * kDay) time += kDay;  // past midnight
      times.push_back(time);
    });
  setKittiTimes(path, times, options.growing, description.frames);
}

std::optional<Calibration> calibrateKittiRaw(const std::string& folder,
                                             const Description& description) {
  const std::string path = firstOf(folder, {"calib_cam_to_cam.txt", "../calib_cam_to_cam.txt"});
  if (path.empty())
    throw IoError(joined(folder, "calib_cam_to_cam.txt"),
                  "no such file, nor one folder up; it is in the calibration archive of the day; "
                  "or give a calib.yaml by --calib FILE");
  return calibrateKittiPair(path, "P_rect_0", leftCameraOf(folder, true), description);
}

// Middlebury 2014 and later: im0.png, im1.png and calib.txt (cam0, cam1, doffs, baseline in mm).

void listMiddlebury(const std::string& folder, const SequenceOptions&, Description& description) {
  const std::string left = joined(folder, "im0.png"), right = joined(folder, "im1.png");
  for (const std::string& image : {left, right})
    if (!exists(image)) throw IoError(image, "no such file; Middlebury has im0.png and im1.png");
  description.frames.push_back({left, right, {}, {}});
}

std::optional<Calibration> calibrateMiddlebury(const std::string& folder,
                                               const Description& description) {
  const std::string path = joined(folder, "calib.txt");
  const KeyedNumbers numbers(path, "=[];");
  const std::vector<double>& k = numbers.get("cam0", 9);
  const double cx_right = numbers.get("cam1", 9)[2];
  const Calibration calibration =
      pairCalibration(path, {k[0], k[4], k[2], k[5], 0, 0}, cx_right,
                      1e-3 * numbers.get("baseline", 1)[0], description.frames.front().file);
  const Image size{calibration.camera.width, calibration.camera.height, 0, {}};
  if (numbers.has("width") && numbers.has("height"))
    requireSize(path, size, {numbers.get("width", 1)[0], numbers.get("height", 1)[0]}, "");
  return calibration;
}

// EuRoC MAV in the ASL format: mav0/camN/{sensor.yaml,data.csv,data/}, the pose of the body in
// mav0/state_groundtruth_estimate0 or mav0/vicon0.
namespace {

/// A sensor.yaml. \throws IoError naming the file and the key
class Sensor {
 public:
  explicit Sensor(const std::string& path) : path_(path) {
    constexpr std::size_t kLargest = std::size_t{1} << 20;  // bytes; real ones have a thousand
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
    if (values.size() < count || node.size() != values.size())
      throw IoError(path_,
                    std::string("has no '") + key + "' of " + std::to_string(count) + " numbers");
    return values;
  }

  PinholeCamera camera() const {
    constexpr double kLargestImage = 65535;  // pixels a side, as of calib.yaml
    const std::vector<double> size = numbers("resolution", 2);
    const std::vector<double> k = numbers("intrinsics", 4);
    if (!(size[0] >= 1 && size[1] >= 1 && size[0] <= kLargestImage && size[1] <= kLargestImage &&
          k[0] > 0.0 && k[1] > 0.0))
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
    const std::optional<Pose> pose = poseOf(Matrix34(v.data()));
    if (!pose) throw IoError(path_, "T_BS has no rotation matrix");
    return *pose;
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

std::vector<StampedFile> eurocImages(const std::string& camera) {
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
  return files;
}

std::string partOf(const std::string& folder, const std::string& name) {
  const std::string inner = joined(folder, "mav0");
  return joined(isDirectory(inner) ? inner : folder, name);
}

}  // namespace

void listEuroc(const std::string& folder, const SequenceOptions&, Description& description) {
  for (const char* camera : {"cam0", "cam1"})
    if (!isDirectory(partOf(folder, camera)))
      throw IoError(partOf(folder, camera),
                    "no such directory; EuRoC has the images of a pair in cam0/ and cam1/");
  listByTime(eurocImages(partOf(folder, "cam0")), eurocImages(partOf(folder, "cam1")), folder,
             {"cam0/", "cam1/"}, description);
}

std::optional<Calibration> calibrateEuroc(const std::string& folder, const Description&) {
  const std::string right_file = partOf(folder, "cam1/sensor.yaml");
  const Sensor left(partOf(folder, "cam0/sensor.yaml")), right(right_file);
  Calibration calibration;
  calibration.camera = left.camera();
  const UnrectifiedPair pair = {left.distortion(), right.distortion(), right.camera(),
                                right.inBody().inverse() * left.inBody()};
  calibration.baseline = pair.T_right_left.translation().norm();
  calibration.cx_right = pair.right_camera.cx;
  if (!(*calibration.baseline > 0.0))
    throw IoError(right_file, "T_BS is that of cam0: there is no baseline");
  calibration.unrectified = pair;
  return calibration;
}

void addEurocPoses(const std::string& folder, const SequenceOptions& options,
                   Description& description) {
  for (const char* name : {"state_groundtruth_estimate0/", "vicon0/"}) {
    const std::string list = partOf(folder, std::string(name) + "data.csv");
    const std::string sensor = partOf(folder, std::string(name) + "sensor.yaml");
    if (!exists(list)) continue;
    Trajectory trajectory;
    forEachLine(list, ",", [&](const Words& words, std::size_t line) {
      constexpr double kNormTolerance = 1e-3;  // of a quaternion written with few digits
      double v[7];
      finiteNumbers(words, 1, v, 7, list, line);
      const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
      if (!(std::abs(q.norm() - 1.0) <= kNormTolerance))
        failAtLine(list, line, "the quaternion is not of length 1");
      trajectory.poses.push_back(
          {secondsOf(words[0], list, line), poseOf(Vector3(v[0], v[1], v[2]), q)});
    });
    const Pose T_sensor_body =
        exists(sensor) ? Sensor(sensor).inBody().inverse() : Pose::Identity();
    return addPoses(list, trajectory, PosesBy::Time,
                    T_sensor_body * Sensor(partOf(folder, "cam0/sensor.yaml")).inBody(), options,
                    description);
  }
}

}  // namespace planar_mapping::io::layouts
