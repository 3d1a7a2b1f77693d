// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "temporary_directory.h"

namespace planar_mapping::io {

/// Files of a folder: name and text. "@image" is an image of 4 x 3 pixels, "@depth" one of depth,
/// 1.5 m in millimetres, "@none" takes a file or folder away.
using Files = std::map<std::string, std::string>;

inline Files operator+(Files files, const Files& more) {
  for (const auto& [name, text] : more) {
    if (text == "@none")
      files.erase(files.lower_bound(name), files.upper_bound(name + "/~"));
    else
      files[name] = text;
  }
  return files;
}

inline std::string cameraWith(const std::string& last) {
  return "image_width: 4\nimage_height: 3\nfx: 2\nfy: 2\ncx: 1.5\ncy: 1\n" + last + "\n";
}
inline const std::string kDepthCamera = cameraWith("depth_scale: 1000");
inline const std::string kPairCamera = cameraWith("baseline_m: 0.1");

inline std::string floats(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

class LayoutFolders : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return dir_ / name; }
  void add(const Files& files) const {
    for (const auto& [name, text] : files) {
      const std::filesystem::path path = dir_ / name;
      std::filesystem::remove_all(path);
      if (text == "@none") continue;
      std::filesystem::create_directories(path.parent_path());
      if (text == "@image") {
        writeImage(path, Image{4, 3, 1, std::vector<std::uint8_t>(12, 7)});
      } else if (text == "@depth") {
        writeDepthPng(path, DepthImage{4, 3, std::vector<std::uint16_t>(12, 1500)});
      } else {
        std::ofstream(path, std::ios::binary) << text;
      }
    }
  }
  std::string problemOf(const std::vector<std::string>& inputs,
                        const SequenceOptions& options = {}) const {
    try {
      const Sequence sequence(inputs, options);
      for (std::size_t i = 0; i < sequence.size(); ++i) sequence.read(i);
      return "no problem";
    } catch (const IoError& error) {
      return error.what();
    }
  }
  void expectProblem(const std::string& input, const std::string& part,
                     const SequenceOptions& options = {}) const {
    const std::string problem = problemOf({input}, options);
    EXPECT_NE(std::string::npos, problem.find(part)) << problem << "\ninstead of " << part;
  }

  TemporaryDirectory dir_;
};

}  // namespace planar_mapping::io
