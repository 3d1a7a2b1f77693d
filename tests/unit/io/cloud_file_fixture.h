// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <fstream>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/cloud_file.h"
#include "temporary_directory.h"

namespace planar_mapping::io {

class CloudFile : public ::testing::Test {
 protected:
  std::string write(const std::string& bytes, const std::string& name = "cloud") {
    // Not atomically: syncing thousands of small files to a disk takes minutes.
    std::ofstream(dir_ / name, std::ios::binary) << bytes;
    return dir_ / name;
  }
  CloudData read(const std::string& bytes) { return readCloudFile(write(bytes)); }
  std::string problemOf(const std::string& bytes) {
    const std::string path = write(bytes);
    try {
      readCloudFile(path);
    } catch (const IoError& error) {
      EXPECT_EQ(error.path(), path);
      EXPECT_EQ(std::string(error.what()).rfind(path + ": ", 0), 0u) << error.what();
      return error.what();
    }
    return "no problem";
  }
  void expectProblem(const std::string& bytes, const std::string& part) {
    const std::string problem = problemOf(bytes);
    EXPECT_NE(problem.find(part), std::string::npos) << problem;
  }

  TemporaryDirectory dir_;
};

inline void expectPoint(const CloudData& cloud, std::size_t i, float x, float y, float z) {
  ASSERT_LT(i, cloud.size());
  EXPECT_FLOAT_EQ(cloud.xyz[3 * i], x);
  EXPECT_FLOAT_EQ(cloud.xyz[3 * i + 1], y);
  EXPECT_FLOAT_EQ(cloud.xyz[3 * i + 2], z);
}

}  // namespace planar_mapping::io
