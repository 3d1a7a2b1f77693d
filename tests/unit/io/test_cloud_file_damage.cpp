// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cloud_file_bytes.h"
#include "cloud_file_fixture.h"

namespace planar_mapping::io {
namespace {

using CloudFileDamage = CloudFile;

/// Whatever happens to a file, reading it ends in a cloud of sound shape or in an IoError.
void expectSoundOrIoError(const std::string& path) {
  try {
    const CloudData cloud = readCloudFile(path);
    EXPECT_EQ(cloud.size(), std::size_t{cloud.width} * cloud.height);
    EXPECT_GT(cloud.size(), 0u);
    EXPECT_LE(cloud.size(), 10000u);
  } catch (const IoError&) {
  }
}

std::vector<std::string> smallFiles() {
  std::string binary = header("x y z rgb", "4 4 4 4", "F F F F", "1 1 1 1", 5, 2, "binary");
  for (int i = 0; i < 40; ++i) append(binary, static_cast<float>(i));
  std::string ascii = xyzHeader(3, 1, "ascii") + "1 2 3\n4.5 -5e3 nan\n7 8 9\n";
  std::string ply =
      plyHeader("binary_big_endian", "property float x\nproperty float y\nproperty float z\n",
                "element camera 1\nproperty list uchar float k\n");
  ply += '\x02' + std::string(8, 'a') + std::string(24, '\x41');
  const std::string ply_ascii =
      plyHeader("ascii", "property float x\nproperty float y\nproperty float z\n") +
      "1 2 3\n4 5 6\n";
  return {binary, ascii, compressedCloud(20), ply, ply_ascii};
}

TEST_F(CloudFileDamage, SurvivesEveryTruncation) {
  for (const std::string& sound : smallFiles()) {
    const std::size_t points = readCloudFile(write(sound)).size();
    for (std::size_t size = 0; size < sound.size(); ++size) {
      const std::string path = write(sound.substr(0, size));
      expectSoundOrIoError(path);
      if (size + 4 < sound.size()) {
        try {
          EXPECT_EQ(readCloudFile(path).size(), points) << "lost points without a word";
        } catch (const IoError&) {
        }
      }
    }
  }
}

TEST_F(CloudFileDamage, SurvivesEveryFlippedBit) {
  for (const std::string& sound : smallFiles()) {
    for (std::size_t bit = 0; bit < 8 * sound.size(); bit += 3) {
      std::string damaged = sound;
      damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
      expectSoundOrIoError(write(damaged));
    }
  }
}

}  // namespace
}  // namespace planar_mapping::io
