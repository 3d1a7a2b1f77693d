// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/pose_file.h"

// Writes one of our sequence folders anew as the public data sets lay theirs out.
namespace planar_mapping {
namespace layout_test {

namespace fs = std::filesystem;

inline std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

inline void writeText(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

inline std::vector<std::string> filesIn(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

/// Copies the files of a folder under names that their number gives.
inline void copyFiles(const fs::path& from, const fs::path& to,
                      const std::function<std::string(std::size_t)>& name) {
  fs::create_directories(to);
  const std::vector<std::string> files = filesIn(from);
  for (std::size_t i = 0; i < files.size(); ++i) fs::copy_file(files[i], to / name(i));
}

inline std::string sixDigits(std::size_t i) {
  char text[32];
  std::snprintf(text, sizeof text, "%06zu", i);
  return text;
}

/// A matrix of 3 x 4 numbers, row by row.
inline std::string rows(const Pose& pose) {
  std::string text;
  for (int i = 0; i < 12; ++i) text += (i == 0 ? "" : " ") + number(pose.matrix()(i / 4, i % 4));
  return text;
}

inline std::string projection(const PinholeCamera& c, double baseline) {
  return number(c.fx) + " 0 " + number(c.cx) + " " + number(-c.fx * baseline) + " 0 " +
         number(c.fy) + " " + number(c.cy) + " 0 0 0 1 0\n";
}

/// sequences/00 with calib.txt, times.txt and \p images; poses/00.txt. \return the sequence
inline std::string kittiFolder(const std::string& root, const io::Calibration& calibration,
                               const std::vector<io::StampedPose>& poses) {
  const fs::path sequence = fs::path(root) / "sequences/00";
  const double baseline = calibration.baseline.value_or(0.5);
  std::string calib;
  const double shifts[] = {0.0, baseline, -0.06, baseline - 0.06};
  for (int i = 0; i < 4; ++i)
    calib += "P" + std::to_string(i) + ": " + projection(calibration.camera, shifts[i]);
  writeText(sequence / "calib.txt", calib + "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  std::string times;
  std::string lines;
  for (const io::StampedPose& pose : poses) {
    times += number(pose.timestamp) + "\n";
    lines += rows(pose.pose) + "\n";
  }
  writeText(sequence / "times.txt", times);
  writeText(fs::path(root) / "poses/00.txt", lines);
  return sequence.string();
}

/// left/ and right/ as image_0 and image_1.
inline std::string toKitti(const std::string& native, const std::string& root) {
  const std::string sequence = kittiFolder(root, io::readCalibration(native + "/calib.yaml"),
                                           io::readTumPoses(native + "/poses.txt"));
  const auto name = [](std::size_t i) { return sixDigits(i) + ".png"; };
  copyFiles(native + "/left", sequence + "/image_0", name);
  copyFiles(native + "/right", sequence + "/image_1", name);
  return sequence;
}

/// clouds/ as velodyne/.
inline std::string toVelodyne(const std::string& native, const std::string& root) {
  const std::string sequence =
      kittiFolder(root, io::Calibration{{500, 500, 320, 240, 640, 480}, 0.5, 320, {}, {}},
                  io::readTumPoses(native + "/poses.txt"));
  const std::vector<std::string> files = filesIn(native + "/clouds");
  for (std::size_t i = 0; i < files.size(); ++i) {
    const io::CloudData cloud = io::readCloudFile(files[i], io::CloudChannels::none());
    std::string bytes;
    for (std::size_t k = 0; k < cloud.size(); ++k) {
      const float point[4] = {cloud.xyz[3 * k], cloud.xyz[3 * k + 1], cloud.xyz[3 * k + 2], 0.5f};
      bytes.append(reinterpret_cast<const char*>(point), sizeof point);
    }
    writeText(sequence + "/velodyne/" + sixDigits(i) + ".bin", bytes);
  }
  return sequence;
}

/// depth/ and rgb/ with names that are times, lists of both, groundtruth.txt at other times too.
inline std::string toTum(const std::string& native, const std::string& folder) {
  const std::vector<io::StampedPose> poses = io::readTumPoses(native + "/poses.txt");
  std::string depth_list = "# depth maps\n# timestamp filename\n";
  std::string rgb_list = "# color images\n# timestamp filename\n";
  std::vector<io::StampedPose> truth;
  const auto nameOf = [&](std::size_t i) { return number(poses[i].timestamp) + ".png"; };
  copyFiles(native + "/depth", folder + "/depth", nameOf);
  copyFiles(native + "/rgb", folder + "/rgb", nameOf);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string time = number(poses[i].timestamp);
    depth_list += time + " depth/" + nameOf(i) + "\n";
    // Colour comes a little later, and one image too many.
    rgb_list += number(poses[i].timestamp + 0.004) + " rgb/" + nameOf(i) + "\n";
    rgb_list += number(poses[i].timestamp + 0.030) + " rgb/" + nameOf(i) + "\n";
    truth.push_back(poses[i]);
    truth.push_back({poses[i].timestamp + 0.007, Pose::Identity()});
  }
  writeText(folder + "/depth.txt", depth_list);
  writeText(folder + "/rgb.txt", rgb_list);
  writeText(folder + "/groundtruth.txt", io::toTum(truth));
  return folder;
}

/// mav0 with cam0 as the body, whose poses have times of their own; pairs are not rectified.
inline std::string toEuroc(const std::string& native, const std::string& folder) {
  const io::Calibration calibration = io::readCalibration(native + "/calib.yaml");
  const io::UnrectifiedPair& pair = *calibration.unrectified;
  const std::vector<io::StampedPose> poses = io::readTumPoses(native + "/poses.txt");
  const auto nanoseconds = [&](std::size_t i) {
    return std::to_string(static_cast<long long>(poses[i].timestamp * 1e9 + 0.5));
  };
  const auto addCamera = [&](const char* name, const char* images, const PinholeCamera& c,
                             const io::LensDistortion& d, const Pose& T_body_camera) {
    const std::string camera = folder + "/mav0/" + name;
    copyFiles(native + images, camera + "/data",
              [&](std::size_t i) { return nanoseconds(i) + ".png"; });
    std::string list = "#timestamp [ns],filename\r\n";
    for (std::size_t i = 0; i < poses.size(); ++i)
      list += nanoseconds(i) + "," + nanoseconds(i) + ".png\r\n";
    writeText(camera + "/data.csv", list);
    std::string matrix = rows(T_body_camera);
    std::replace(matrix.begin(), matrix.end(), ' ', ',');
    writeText(camera + "/sensor.yaml",
              "# General sensor definitions.\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
              "  data: [" +
                  matrix + ",0,0,0,1]\nrate_hz: 20\nresolution: [" + std::to_string(c.width) +
                  ", " + std::to_string(c.height) + "]\ncamera_model: pinhole\nintrinsics: [" +
                  number(c.fx) + ", " + number(c.fy) + ", " + number(c.cx) + ", " + number(c.cy) +
                  "]\ndistortion_model: radial-tangential\ndistortion_coefficients: [" +
                  number(d.k1) + ", " + number(d.k2) + ", " + number(d.p1) + ", " + number(d.p2) +
                  "]\n");
  };
  addCamera("cam0", "/left", calibration.camera, pair.left, Pose::Identity());
  addCamera("cam1", "/right", pair.right_camera, pair.right, pair.T_right_left.inverse());
  std::string truth = "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,v_y,v_z\n";
  const std::string tum = io::toTum(poses);
  std::size_t i = 0;
  for (const io::StampedPose& pose : poses) {
    const Eigen::Quaterniond q(Matrix3(pose.pose.linear()));
    const Vector3 t = pose.pose.translation();
    truth += nanoseconds(i++);
    for (const double v : {t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z(), 0.0, 0.0, 0.0})
      truth += "," + number(v);
    truth += "\n";
  }
  writeText(folder + "/mav0/state_groundtruth_estimate0/data.csv", truth);
  return folder;
}

}  // namespace layout_test
}  // namespace planar_mapping
