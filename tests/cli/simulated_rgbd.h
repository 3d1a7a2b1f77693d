// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "cli_fixture.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping {

/// An RGB-D sequence of a simulated scene, 320 x 240, with its true poses. Made once for all tests.
class SimulatedRgbd {
 public:
  /// \param options  of planar_map simulate
  SimulatedRgbd(const std::string& program, const std::vector<std::string>& options) {
    const std::vector<std::string> command = {program,   "simulate", "--write",  "images",
                                              "--width", "320",      "--height", "240",
                                              "-q",      "-o",       path()};
    if (runProgram(joined(command, options)).exit_code != 0)
      throw std::runtime_error("the sequence cannot be simulated");
    std::filesystem::rename(path() + "/left", path() + "/rgb");
    std::filesystem::rename(path() + "/depth_gt", path() + "/depth");
    std::filesystem::remove_all(path() + "/right");
    std::filesystem::remove_all(path() + "/labels_gt");
    std::ofstream(path() + "/calib.yaml")
        << "image_width: 320\nimage_height: 240\nfx: 250\nfy: 250\ncx: 159.5\ncy: 119.5\n"
           "depth_scale: 1000\n";
    poses = io::readTumPoses(path() + "/poses.txt");
  }
  std::string path() const { return directory_.path() + "/sequence"; }

  std::vector<io::StampedPose> poses;

 private:
  TemporaryDirectory directory_;
};

}  // namespace planar_mapping
