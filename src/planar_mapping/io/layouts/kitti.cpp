// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <map>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/io/text_lines.h"

// KITTI odometry: sequences/NN/{image_0,image_1,image_2,image_3,velodyne,calib.txt,times.txt} with
// the poses of camera 0 in poses/NN.txt. KITTI raw, a drive synchronised and rectified:
// image_00 to image_03, each with data/ and timestamps.txt, and calib_cam_to_cam.txt.
namespace planar_mapping::io::layouts {
namespace {

/// The matrices of calib.txt: P0 to P3 project points of camera 0, Tr maps velodyne to camera 0; of
/// calib_cam_to_cam.txt: P_rect_00 to P_rect_03, and the size S_rect_00 of rectified images.
class KittiCalibration {
 public:
  explicit KittiCalibration(const std::string& path) : path_(path) {
    forEachLine(path, ":", [this](const Words& words, std::size_t line) {
      Matrix34 matrix;
      double v[12];
      if (words.size() == 3 && words[0].compare(0, 7, "S_rect_") == 0)
        finiteNumbers(words, 1, size_, 2, path_, line);
      if (words.size() != 13) return;  // other keys of other versions
      finiteNumbers(words, 1, v, 12, path_, line);
      for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = v[i];
      matrices_[std::string(words[0])] = matrix;
    });
  }

  /// A rectified pair with camera \p left at the left.
  Calibration pair(int left, const std::string& image, const std::string& name = "P") const {
    const Matrix34& P = matrix(name + std::to_string(left));
    const Matrix34& Q = matrix(name + std::to_string(left + 1));
    const double baseline = (P(0, 3) - Q(0, 3)) / P(0, 0);
    if (!(P(0, 0) > 0.0 && P(1, 1) > 0.0 && baseline > 0.0))
      throw IoError(path_, name + std::to_string(left) + " and " + name + std::to_string(left + 1) +
                               " are not of a rectified pair: focal lengths and baseline must be "
                               "> 0");
    const Image size = readImageSize(image);
    if (size_[0] > 0.0 && (size.width != size_[0] || size.height != size_[1]))
      throw IoError(image, "is " + std::to_string(size.width) + " x " +
                               std::to_string(size.height) + ", but rectified images are " +
                               std::to_string(std::lround(size_[0])) + " x " +
                               std::to_string(std::lround(size_[1])) +
                               ": take the 'synced+rectified data' of this drive, or give a "
                               "calibration of pairs that are not rectified by --calib FILE");
    Calibration calibration;
    calibration.camera = {P(0, 0), P(1, 1), P(0, 2), P(1, 2), size.width, size.height};
    calibration.baseline = baseline;
    calibration.cx_right = Q(0, 2);
    return calibration;
  }

  Pose cameraInCamera0(int camera) const {
    const Matrix34& P = matrix("P" + std::to_string(camera));
    Pose T = Pose::Identity();
    T.translation() = -P.leftCols<3>().inverse() * P.col(3);
    return T;
  }

  Pose velodyneInCamera0() const {
    const Matrix34& Tr = matrix("Tr");
    return poseOf(Vector3(Tr.col(3)), Eigen::Quaterniond(Matrix3(Tr.leftCols<3>())));
  }

 private:
  using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::DontAlign>;

  const Matrix34& matrix(const std::string& name) const {
    const auto found = matrices_.find(name);
    if (found == matrices_.end())
      throw IoError(path_, "has no line '" + name + ": ' with 12 numbers");
    return found->second;
  }

  std::string path_;
  std::map<std::string, Matrix34> matrices_;
  double size_[2] = {0.0, 0.0};  ///< 0 = not known
};

/// poses.txt of the folder, or poses/NN.txt of the whole data set; "" if there is none.
std::string posesOf(const std::string& folder) {
  const std::string name = nameOf(folder);
  for (const std::string& path : {joined(folder, "poses.txt"), joined(folder, name + ".txt"),
                                  joined(folder, "../../poses/" + name + ".txt"),
                                  joined(folder, "../poses/" + name + ".txt")})
    if (exists(path)) return path;
  return "";
}

/// A name is the number of its frame, and so its line in times.txt and the poses: a part of a
/// sequence may be there only.
std::size_t numberOf(const FrameEntry& frame) {
  std::uint64_t number = 0;
  const std::string stem = stemOf(frame.file);
  if (!parseNumber(std::string_view(stem), number))
    throw IoError(frame.file, "KITTI's frames are called by their number, as 000000.png");
  return number;
}

/// Sets what a file has a line of for each frame.
template <typename Set>
void setLines(const std::string& path, const char* what, std::size_t lines, bool growing,
              Description& description, const Set& set) {
  std::vector<FrameEntry>& frames = description.frames;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t number = numberOf(frames[i]);
    if (number < lines) {
      set(frames[i], number);
    } else if (growing) {
      frames.resize(i);
    } else {
      throw IoError(path, "holds " + std::to_string(lines) + " " + what + ", but none of frame " +
                              std::to_string(number));
    }
  }
}

std::vector<double> readTimes(const std::string& path) {
  std::vector<double> times;
  forEachLine(path, "", [&](const Words& words, std::size_t line) {
    times.push_back(finiteNumber(words[0], path, line));
  });
  return times;
}

/// "2011-09-26 13:02:25.964389445" a line, as seconds of the first day.
std::vector<double> readClockTimes(const std::string& path) {
  constexpr double kDay = 86400.0;
  std::vector<double> times;
  forEachLine(path, "-:", [&](const Words& words, std::size_t line) {
    double v[6];
    finiteNumbers(words, 0, v, 6, path, line);
    double time = (v[3] * 60.0 + v[4]) * 60.0 + v[5];
    if (!times.empty() && time < times.back() - 0.5 * kDay) time += kDay;  // past midnight
    times.push_back(time);
  });
  return times;
}

void addTimes(const std::string& path, const std::vector<double>& times, bool growing,
              Description& description) {
  setLines(path, "times", times.size(), growing, description,
           [&](FrameEntry& frame, std::size_t i) { frame.timestamp = times[i]; });
}

void addKittiPoses(const std::string& path, const SequenceOptions& options,
                   Description& description) {
  const Trajectory trajectory = readTrajectory(path);
  if (trajectory.has_times) return addPoses(path, options, description);
  const std::size_t last = description.frames.empty() ? 0 : numberOf(description.frames.back());
  if (options.ignore_poses && last >= trajectory.poses.size())
    return notUsed(path, trajectory.poses.size(), description);
  setLines(
      path, "poses", trajectory.poses.size(), options.growing, description,
      [&](FrameEntry& frame, std::size_t i) { frame.T_world_sensor = trajectory.poses[i].pose; });
  description.pose_source = PoseSource::File;
}

/// The left camera of the pair that there is: gray (0) before colour (2), -1 = none.
int leftCameraOf(const std::string& folder) {
  const auto has = [&](int camera) {
    return isDirectory(joined(folder, "image_" + std::to_string(camera)));
  };
  for (const int left : {0, 2})
    if (has(left) && has(left + 1)) return left;
  if (isDirectory(joined(folder, "velodyne"))) return -1;
  throw IoError(joined(folder, has(0) ? "image_1" : "image_3"),
                "no such directory; KITTI odometry has the right image of each pair there");
}

void readPairs(const std::string& folder, const std::string& left_name,
               const std::string& right_name, Description& description) {
  const FilesByName rights = imagesByName(joined(folder, right_name));
  const std::vector<std::string> lefts = imageFilesOf(joined(folder, left_name));
  std::size_t pairs = 0;
  for (const std::string& file : lefts) {
    description.frames.push_back({file, fileOf(rights, stemOf(file)), {}, {}});
    pairs += rights.count(stemOf(file));
  }
  if (pairs == 0)
    throw IoError(folder, left_name + "/ (" + std::to_string(lefts.size()) + " images) and " +
                              right_name + "/ (" + std::to_string(rights.size()) +
                              ") have no file name in common");
}

}  // namespace

bool hasKitti(const std::string& folder) {
  return isDirectory(joined(folder, "image_0")) || isDirectory(joined(folder, "image_2")) ||
         isDirectory(joined(folder, "velodyne"));
}

Description readKitti(const std::string& folder, const SequenceOptions& options) {
  const std::string scans = joined(folder, "velodyne");
  const std::string calibration_file = joined(folder, "calib.txt");
  const int left = leftCameraOf(folder);
  const bool wants_images = left >= 0 && options.preferred == SequenceKind::Stereo;
  const bool takes_clouds = isDirectory(scans) && !wants_images;
  const std::string images = left == 0 ? "gray" : "colour";
  Description description("KITTI odometry (" + (takes_clouds ? "velodyne" : images) + ")",
                          takes_clouds ? SequenceKind::Clouds : SequenceKind::Stereo);
  if (takes_clouds) {
    for (const std::string& file : cloudFilesOf(scans))
      description.frames.push_back({file, {}, {}, {}});
    if (description.frames.empty()) throw IoError(scans, "holds no .bin files of points");
  } else {
    readPairs(folder, "image_" + std::to_string(left), "image_" + std::to_string(left + 1),
              description);
  }
  const std::string times = joined(folder, "times.txt");
  if (exists(times)) addTimes(times, readTimes(times), options.growing, description);
  const bool given = !options.calibration_file.empty();
  if (!takes_clouds && !given)
    description.calibration =
        KittiCalibration(calibration_file).pair(left, description.frames.front().file);
  const std::string poses = options.poses_file.empty() ? posesOf(folder) : "";
  if (poses.empty()) return description;
  addKittiPoses(poses, options, description);
  if (description.pose_source != PoseSource::File) return description;
  if (!takes_clouds && left == 0) return description;
  const KittiCalibration calibration(calibration_file);
  const Pose T_camera0_sensor =
      takes_clouds ? calibration.velodyneInCamera0() : calibration.cameraInCamera0(left);
  for (FrameEntry& frame : description.frames)
    frame.T_world_sensor = *frame.T_world_sensor * T_camera0_sensor;
  return description;
}

bool hasKittiRaw(const std::string& folder) {
  for (const char* part : {"image_00/data", "image_02/data", "velodyne_points/data"})
    if (isDirectory(joined(folder, part))) return true;
  return false;
}

Description readKittiRaw(const std::string& folder, const SequenceOptions& options) {
  const auto has = [&](const char* camera) { return isDirectory(joined(folder, camera)); };
  const bool is_gray = has("image_00/data") && has("image_01/data");
  if (!is_gray && !(has("image_02/data") && has("image_03/data")))
    throw IoError(folder,
                  "is a drive of KITTI raw without an image pair (image_00/data and image_01/data, "
                  "or 02 and 03); give velodyne_points/data to map its scans");
  Description description(std::string("KITTI raw (") + (is_gray ? "gray" : "colour") + ")",
                          SequenceKind::Stereo);
  const std::string left = is_gray ? "image_00" : "image_02";
  readPairs(folder, left + "/data", is_gray ? "image_01/data" : "image_03/data", description);
  const std::string times = joined(folder, left + "/timestamps.txt");
  if (exists(times)) addTimes(times, readClockTimes(times), options.growing, description);
  if (!options.calibration_file.empty()) return description;
  const std::string calibration =
      firstOf(folder, {"calib_cam_to_cam.txt", "../calib_cam_to_cam.txt"});
  if (calibration.empty())
    throw IoError(joined(folder, "calib_cam_to_cam.txt"),
                  "no such file, nor one folder up; it is in the calibration archive of the day; "
                  "or give a calib.yaml by --calib FILE");
  description.calibration = KittiCalibration(calibration)
                                .pair(is_gray ? 0 : 2, description.frames.front().file, "P_rect_0");
  return description;
}

}  // namespace planar_mapping::io::layouts
