// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "temporary_directory.h"

namespace planar_mapping::io {

inline constexpr const char* kKittiProjections =
    "P0: 2 0 1.5 0 0 2 1 0 0 0 1 0\nP1: 2 0 1.5 -1 0 2 1 0 0 0 1 0\n"
    "P2: 2 0 1.5 0.4 0 2 1 0 0 0 1 0\nP3: 2 0 1.5 -0.6 0 2 1 0 0 0 1 0\n"
    "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.3\n";

/// Small folders of each layout; tests take something away from them.
class LayoutFolders : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    const std::string path = dir_ / name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  /// Numbers as they are in memory.
  std::string floats(const std::string& name, const std::vector<float>& values) const {
    return write(name, std::string(reinterpret_cast<const char*>(values.data()),
                                   values.size() * sizeof(float)));
  }
  void image(const std::string& name) const {
    const Image image{4, 3, 1, std::vector<std::uint8_t>(12, 7)};
    std::filesystem::create_directories(std::filesystem::path(dir_ / name).parent_path());
    writeImage(dir_ / name, image);
  }
  void depth(const std::string& name) const {
    const DepthImage image{4, 3, std::vector<std::uint16_t>(12, 1500)};
    std::filesystem::create_directories(std::filesystem::path(dir_ / name).parent_path());
    writeDepthPng(dir_ / name, image);
  }
  static std::string numbered(int i) { return "00000" + std::to_string(i); }

  /// Three frames of image_0 to image_3 and velodyne, poses along z in ../../poses/07.txt.
  std::string kitti() const {
    std::string times;
    std::string poses;
    for (int i = 0; i < 3; ++i) {
      for (const char* camera : {"image_0", "image_1", "image_2", "image_3"})
        image(std::string("sequences/07/") + camera + "/" + numbered(i) + ".png");
      floats("sequences/07/velodyne/" + numbered(i) + ".bin", {1, 2, 3, 0.5f, 4, 5, 6, 0.25f});
      times += std::to_string(i) + ".5e-01\n";
      poses += "1 0 0 0 0 1 0 0 0 0 1 " + std::to_string(i) + "\n";
    }
    write("sequences/07/calib.txt", kKittiProjections);
    write("sequences/07/times.txt", times);
    write("poses/07.txt", poses);
    return dir_ / "sequences/07";
  }
  /// Three depth images, colour 8 ms later, truth every 50 ms.
  std::string tum(const std::string& name = "freiburg2_desk") const {
    std::string depths = "# depth\n";
    std::string colors = "# color\n";
    std::string poses;
    for (int i = 0; i < 3; ++i) {
      const std::string time = "10." + std::to_string(i);
      depth(name + "/depth/" + time + ".png");
      image(name + "/rgb/" + time + "08.png");
      depths += time + " depth/" + time + ".png\n";
      colors += time + "08 rgb/" + time + "08.png\n";
    }
    for (int i = -1; i < 6; ++i)
      poses += std::to_string(10.0 + 0.05 * i) + " " + std::to_string(i) + " 0 0 0 0 0 1\n";
    write(name + "/depth.txt", depths);
    write(name + "/rgb.txt", colors);
    write(name + "/groundtruth.txt", poses);
    return dir_ / name;
  }
  std::string euroc() const {
    const std::string body = "1403636579763555584";
    for (const char* camera : {"cam0", "cam1"}) {
      const std::string base = std::string("V1/mav0/") + camera;
      image(base + "/data/" + body + ".png");
      write(base + "/data.csv", "#timestamp [ns],filename\r\n" + body + "," + body + ".png\r\n");
      // Both look along the body's x axis, 0.1 m apart along its y axis.
      const std::string shift = camera == std::string("cam0") ? "0.05" : "-0.05";
      write(base + "/sensor.yaml",
            "T_BS:\n  cols: 4\n  rows: 4\n  data: [0, 0, 1, 0.2, -1, 0, 0, " + shift +
                ", 0, -1, 0, 0, 0, 0, 0, 1]\nresolution: [4, 3]\nintrinsics: [2, 2, 1.5, 1]\n"
                "distortion_model: radial-tangential\n"
                "distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n");
    }
    write("V1/mav0/state_groundtruth_estimate0/data.csv",
          "#timestamp, p_RS_R_x [m]\n" + body + ",1,2,3,1,0,0,0,0,0,0\n");
    return dir_ / "V1";
  }
  std::string middlebury() const {
    image("Shelves/im0.png");
    image("Shelves/im1.png");
    write("Shelves/calib.txt",
          "cam0=[2 0 1.5; 0 2 1; 0 0 1]\ncam1=[2 0 1.75; 0 2 1; 0 0 1]\ndoffs=0.25\n"
          "baseline=193.001\nwidth=4\nheight=3\nndisp=280\n");
    return dir_ / "Shelves";
  }
  std::string open3d() const {
    for (int i = 0; i < 2; ++i) {
      depth("o3d/depth/" + numbered(i) + ".png");
      image("o3d/color/" + numbered(i) + "-1234.jpg.png");
    }
    write("o3d/camera_intrinsic.json",
          R"({"width": 4, "height": 3, "intrinsic_matrix": [2, 0, 0, 0, 2.5, 0, 1.5, 1, 1]})");
    write(
        "o3d/trajectory.log",
        "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    return dir_ / "o3d";
  }
  std::string icl() const {
    std::string poses;
    for (const int i : {2, 9, 10}) {
      depth("icl/depth/" + std::to_string(i) + ".png");
      image("icl/rgb/" + std::to_string(i) + ".png");
      poses += std::to_string(i) + " 0 1 2 0.5 0.5 0.5 0.5\n";
    }
    write("icl/livingRoom1.gt.freiburg", poses);
    return dir_ / "icl";
  }
  void expectProblem(const std::string& input, const std::string& part,
                     const SequenceOptions& options = {}) const {
    try {
      Sequence sequence({input}, options);
      FAIL() << "no problem, expected: " << part;
    } catch (const IoError& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find(part)) << error.what();
    }
  }

  /// Of a folder that has scans too.
  static SequenceOptions stereo() {
    SequenceOptions options;
    options.preferred = SequenceKind::Stereo;
    return options;
  }

  TemporaryDirectory dir_;
};

}  // namespace planar_mapping::io
