// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "cloud_file_bytes.h"
#include "cloud_file_fixture.h"

namespace planar_mapping {
namespace io {
namespace {

using PlyFile = CloudFile;

TEST_F(PlyFile, ReadsAsciiPly) {
  const CloudData cloud =
      read(plyHeader("ascii",
                     "property float x\nproperty float y\nproperty double z\nproperty uchar red\n"
                     "property uchar green\nproperty uchar blue\n",
                     "element camera 1\nproperty list uchar int k\n",
                     "element face 1\nproperty list uchar int vertex_indices\n") +
           "3 1 2 3\n1 2 3 255 128 1\n4 5 6 0 0 0\n3 0 1 0\n");
  ASSERT_EQ(cloud.size(), 2u);
  expectPoint(cloud, 1, 4.0f, 5.0f, 6.0f);
  EXPECT_EQ(cloud.colors, (std::vector<std::uint32_t>{0xFF8001, 0}));
}

template <typename T>
void appendIn(std::string& bytes, T value, bool big_endian) {
  std::string raw;
  append(raw, value);
  bytes += big_endian ? std::string(raw.rbegin(), raw.rend()) : raw;
}

TEST_F(PlyFile, ReadsBinaryPlyOfEitherByteOrderAndSkipsOtherElements) {
  for (const bool big : {false, true}) {
    std::string bytes = plyHeader(
        big ? "binary_big_endian" : "binary_little_endian",
        "property double x\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "property float y\nproperty float z\nproperty float scalar_intensity\n",
        "element camera 2\nproperty float f\nproperty list ushort double k\n"
        "element fixed 3\nproperty short a\nproperty char b\n",
        "element face 1\nproperty list uchar int vertex_indices\n");
    for (int i = 0; i < 2; ++i) {
      appendIn(bytes, 1.0f, big);
      appendIn<std::uint16_t>(bytes, static_cast<std::uint16_t>(i + 1), big);
      for (int k = 0; k <= i; ++k) appendIn(bytes, 2.0, big);
    }
    bytes += std::string(9, '\x55');
    for (int i = 0; i < 2; ++i) {
      appendIn(bytes, 1.5 + i, big);
      bytes += "\x01\x02\x03";
      appendIn(bytes, 2.5f, big);
      appendIn(bytes, 3.5f, big);
      appendIn(bytes, 0.25f, big);
    }
    const CloudData cloud = read(bytes);
    ASSERT_EQ(cloud.size(), 2u);
    expectPoint(cloud, 0, 1.5f, 2.5f, 3.5f);
    expectPoint(cloud, 1, 2.5f, 2.5f, 3.5f);
    EXPECT_EQ(cloud.colors, (std::vector<std::uint32_t>{0x010203, 0x010203}));
    EXPECT_EQ(cloud.intensities, (std::vector<float>{0.25f, 0.25f}));
  }
}

TEST_F(PlyFile, SaysWhatIsWrongWithAPly) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  expectProblem(plyHeader("ascii", xyz) + "1 2 3\n", "cut short");
  expectProblem(plyHeader("binary_little_endian", xyz) + "12345678901234567890123", "23 bytes");
  expectProblem(plyHeader("ascii", "property float x\nproperty float y\n") + "1 2\n3 4\n",
                "no field 'z'");
  expectProblem(plyHeader("ascii", "property int x\nproperty float y\nproperty float z\n"),
                "field 'x' is of type I4");
  expectProblem(plyHeader("ascii", xyz + "property list uchar int n\n"), "lists among");
  expectProblem(plyHeader("ascii", xyz + "property quux n\n"), "unknown type");
  expectProblem(plyHeader("binary_middle_endian", xyz), "format must be");
  expectProblem("ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'");
  expectProblem("ply\nelement vertex 1\nend_header\n", "no format line");
  expectProblem("ply\nformat ascii 1.0\n", "before end_header");
  std::string zero = plyHeader("ascii", xyz);
  zero.replace(zero.find("vertex 2"), 8, "vertex 0");
  expectProblem(zero, "holds no points");
  std::string huge =
      plyHeader("binary_little_endian", xyz, "element a 18446744073709551615\nproperty double b\n");
  expectProblem(huge + std::string(24, 'x'), "cut short");
}

}  // namespace
}  // namespace io
}  // namespace planar_mapping
