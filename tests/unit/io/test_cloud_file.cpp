// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

#include "cloud_file_bytes.h"
#include "cloud_file_fixture.h"
#include "comma_locale.h"
#include "numbers.h"

namespace planar_mapping::io {
namespace {

TEST_F(CloudFile, ReadsAscii) {
  const CloudData cloud = read(xyzHeader(2, 1, "ascii") + "1 2.5 -3e-1\n  +4\t5  6 \n");
  EXPECT_EQ(cloud.width, 2u);
  EXPECT_EQ(cloud.height, 1u);
  expectPoint(cloud, 0, 1.0f, 2.5f, -0.3f);
  expectPoint(cloud, 1, 4.0f, 5.0f, 6.0f);
  EXPECT_TRUE(cloud.colors.empty());
  EXPECT_TRUE(cloud.T_world_sensor.isApprox(Pose::Identity()));
}

TEST_F(CloudFile, ReadsAsciiWithWindowsLineEndsCommentsAndWithoutFinalNewline) {
  std::string text =
      "# one\n# two\nVERSION .7\nFIELDS x y z\n\nSIZE 4 4 4\nTYPE F F F\n"
      "WIDTH 1\nHEIGHT 2\n# three\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6";
  const CloudData plain = read(text);
  expectPoint(plain, 1, 4.0f, 5.0f, 6.0f);
  std::string windows;
  for (const char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const CloudData same = read(windows);
  EXPECT_EQ(same.height, 2u);
  EXPECT_EQ(same.xyz, plain.xyz);
}

TEST_F(CloudFile, ReadsOldVersions) {
  const CloudData v5 = read("# .PCD v.5\nVERSION .5\nCOLUMNS x y z\nPOINTS 1\nDATA ascii\n1 2 3\n");
  expectPoint(v5, 0, 1.0f, 2.0f, 3.0f);
  const CloudData v6 = read(
      "VERSION 0.6\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
      "WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n");
  expectPoint(v6, 0, 1.0f, 2.0f, 3.0f);
}

TEST_F(CloudFile, ReadsNonFiniteText) {
  const CloudData cloud = read(xyzHeader(4, 1, "ascii") +
                               "nan NaN -nan\ninf -inf +inf\n1e60 -1e60 1e-60\n-nan(ind) 0 0\n");
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(std::isnan(cloud.xyz[i]));
  for (std::size_t i = 3; i < 8; ++i) EXPECT_TRUE(std::isinf(cloud.xyz[i])) << i;
  EXPECT_LT(cloud.xyz[7], 0.0f);
  EXPECT_EQ(cloud.xyz[8], 0.0f);
  EXPECT_TRUE(std::isnan(cloud.xyz[9]));
}

TEST_F(CloudFile, ReadsAndWritesTheSameNumbersInEveryLocale) {
  const test::CommaLocale locale;
  CloudData cloud = read(xyzHeader(1, 1, "ascii") + "1.5 2.5 12345.5\n");
  expectPoint(cloud, 0, 1.5f, 2.5f, 12345.5f);
  writePcd(dir_ / "out.pcd", cloud);
  const CloudData back = readCloudFile(dir_ / "out.pcd");
  EXPECT_EQ(back.xyz, cloud.xyz);
}

TEST_F(CloudFile, ReadsBinaryWithFieldsAtAnyPositionAndType) {
  std::string bytes = header("_ label z normals x y intensity rgba _", "1 2 8 4 4 8 4 4 1",
                             "U U F F F F F U U", "3 1 1 3 1 1 1 1 2", 2, 1, "binary");
  for (int i = 0; i < 2; ++i) {
    bytes += "pad";
    append<std::uint16_t>(bytes, static_cast<std::uint16_t>(7 + i));
    append(bytes, 3.25 + i);
    for (int c = 0; c < 3; ++c) append(bytes, 9.0f);
    append(bytes, 1.25f + static_cast<float>(i));
    append(bytes, 2.25 + i);
    append(bytes, 0.5f);
    append<std::uint32_t>(bytes, 0xFF102030u + static_cast<std::uint32_t>(i));
    bytes += "xx";
  }
  const CloudData cloud = read(bytes);
  expectPoint(cloud, 0, 1.25f, 2.25f, 3.25f);
  expectPoint(cloud, 1, 2.25f, 3.25f, 4.25f);
  EXPECT_EQ(cloud.labels, (std::vector<std::uint32_t>{7, 8}));
  EXPECT_EQ(cloud.colors, (std::vector<std::uint32_t>{0x102030, 0x102031}));
  EXPECT_EQ(cloud.intensities, (std::vector<float>{0.5f, 0.5f}));
}

TEST_F(CloudFile, LeavesOutChannelsNotAskedFor) {
  const std::string path = write(header("x y z rgb label intensity", "4 4 4 4 4 4", "F F F F U F",
                                        "1 1 1 1 1 1", 1, 1, "ascii") +
                                 "1 2 3 4.2108e+06 5 6\n");
  const CloudData all = readCloudFile(path);
  EXPECT_EQ(all.colors, std::vector<std::uint32_t>{4210800u});
  EXPECT_EQ(all.labels, std::vector<std::uint32_t>{5});
  EXPECT_EQ(all.intensities, std::vector<float>{6.0f});
  const CloudData bare = readCloudFile(path, CloudChannels::none());
  EXPECT_EQ(bare.xyz, all.xyz);
  EXPECT_TRUE(bare.colors.empty() && bare.labels.empty() && bare.intensities.empty());
}

TEST_F(CloudFile, ReadsCompressedFieldByField) {
  const CloudData cloud = read(compressedCloud(40));
  ASSERT_EQ(cloud.size(), 40u);
  for (std::size_t i = 0; i < 40; ++i)
    expectPoint(cloud, i, static_cast<float>(i / 8), 10.0f + static_cast<float>(i / 8),
                20.0f + static_cast<float>(i / 8));
  EXPECT_EQ(cloud.colors, std::vector<std::uint32_t>(40, 0xFF8000u));
}

TEST_F(CloudFile, ReadsTheViewpointAsSensorPose) {
  std::string text = xyzHeader(1, 1, "ascii") + "0 0 1\n";
  // Unnormalised on purpose: 90 degrees about z, as w x y z.
  text.replace(text.find("0 0 0 1 0 0 0"), 13, "1 2 3 2 0 0 2");
  const CloudData cloud = read(text);
  EXPECT_TRUE((cloud.T_world_sensor * Vector3(1, 0, 0)).isApprox(Vector3(1, 3, 3), 1e-12));
}

TEST_F(CloudFile, DoublesGetAnOriginWhereTheCloudIsFartherThanItIsLarge) {
  const auto cloudAt = [this](double x, double y, double z) {
    std::string text =
        "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 40\nHEIGHT 1\n"
        "POINTS 40\nDATA ascii\n";
    for (int i = 0; i < 40; ++i) {
      text += std::to_string(x - 120.5 * i) + " " + std::to_string(y + 0.125 * i) + " " +
              std::to_string(z) + "\n";
    }
    return read(text);
  };
  // Millimetres about the sensor, whichever point comes first: 2.4 m to one side, 2.2 to the other.
  const CloudData near = cloudAt(2400.0, 1100.0, -1500.25);
  EXPECT_EQ(Vector3::Zero(), near.origin);
  EXPECT_TRUE(near.T_world_sensor.translation().isZero(0.0));
  expectPoint(near, 0, 2400.0f, 1100.0f, -1500.25f);
  expectPoint(near, 39, -2299.5f, 1104.875f, -1500.25f);
  const CloudData far = cloudAt(500000.5, 4500000.25, 30.5);
  EXPECT_EQ(Vector3(500001.0, 4500000.0, 0.0), far.origin);
  EXPECT_EQ(far.origin, far.T_world_sensor.translation());
  expectPoint(far, 0, -0.5f, 0.25f, 30.5f);
}

TEST_F(CloudFile, ViewFollowsTheOrganization) {
  const CloudData cloud = read(xyzHeader(2, 2, "ascii") + "1 1 1\n2 2 2\n3 3 3\n4 4 4\n");
  const PointsView view = cloud.view();
  EXPECT_TRUE(view.isOrganized());
  EXPECT_EQ(view.width, 2u);
  EXPECT_EQ(view.height, 2u);
  EXPECT_EQ(view.point(2), Vector3(3, 3, 3));
  // Columns and rows, or a number and a stride? Neither.
  static_assert(!std::is_constructible_v<PointsView, const float*, int, int>);
}

TEST_F(CloudFile, WritesWhatItReads) {
  CloudData cloud;
  cloud.width = 3;
  cloud.height = 2;
  for (int i = 0; i < 18; ++i) cloud.xyz.push_back(0.1f * static_cast<float>(i) + 1e9f / 3.0f);
  cloud.xyz[4] = test::kNanFloat;
  cloud.xyz[5] = 1e-42f;
  cloud.colors = {0, 1, 0xFFFFFF, 0x102030, 4, 5};
  cloud.labels = {0, 1, 2, 0xFFFFFFFFu, 4, 5};
  cloud.intensities = {0, 0.1f, 2, 3, 4, -1e-9f};
  cloud.T_world_sensor.translation() = Vector3(0.1, -2, 1e5);
  cloud.T_world_sensor.linear() =
      Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  for (const bool channels : {true, false}) {
    CloudData out = cloud;
    if (!channels) out.colors.clear(), out.labels.clear(), out.intensities.clear();
    const std::string path = dir_ / "out.pcd";
    writePcd(path, out, Overwrite::Allow);
    const CloudData back = readCloudFile(path);
    EXPECT_EQ(back.width, 3u);
    EXPECT_EQ(back.height, 2u);
    ASSERT_EQ(back.xyz.size(), out.xyz.size());
    for (std::size_t i = 0; i < out.xyz.size(); ++i) {
      if (i == 4) {
        EXPECT_TRUE(std::isnan(back.xyz[i]));
      } else {
        EXPECT_EQ(back.xyz[i], out.xyz[i]);
      }
    }
    EXPECT_EQ(back.colors, out.colors);
    EXPECT_EQ(back.labels, out.labels);
    EXPECT_EQ(back.intensities, out.intensities);
    EXPECT_TRUE(back.T_world_sensor.isApprox(out.T_world_sensor, 1e-14));
  }
}

TEST_F(CloudFile, RefusesToWriteWhatItDoesNotRead) {
  CloudData cloud;
  cloud.width = 2;
  cloud.height = 1;
  cloud.xyz.resize(6);
  cloud.colors.resize(1);
  EXPECT_THROW(writePcd(dir_ / "out.pcd", cloud), InputError);
  cloud.colors.clear();
  cloud.width = 3;
  EXPECT_THROW(writePcd(dir_ / "out.pcd", cloud), InputError);
  cloud.width = 2;
  cloud.T_world_sensor.translation().x() = test::kNanFloat;
  EXPECT_THROW(writePcd(dir_ / "out.pcd", cloud), InputError);
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out.pcd"));
}

TEST_F(CloudFile, SaysWhatIsWrongWithThePath) {
  EXPECT_THROW(readCloudFile(dir_ / "missing.pcd"), IoError);
  EXPECT_THROW(readCloudFile(dir_.path()), IoError);
  EXPECT_THROW(readCloudFile("/dev/zero"), IoError);
  expectProblem("", "is empty");
  expectProblem(
      "\x7f"
      "ELF and so on",
      "neither a PCD nor a PLY file");
  expectProblem(std::string(100000, 'x'), "neither a PCD nor a PLY file");
  expectProblem("# only a comment\n", "neither a PCD nor a PLY file");
}

TEST_F(CloudFile, SaysWhatIsWrongWithTheHeader) {
  const std::string points = "1 2 3\n";
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = xyzHeader(1, 1, "ascii") + points;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  expectProblem(with("FIELDS x y z", "FIELDS x y w"), "no field 'z'");
  expectProblem(with("FIELDS x y z", "FIELDS x w z"), "no field 'y'");
  expectProblem(with("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1",
                     "FIELDS x y z x\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1"),
                "the field 'x' twice");
  expectProblem(with("TYPE F F F", "TYPE F F I"), "field 'z' is of type I4");
  expectProblem(with("TYPE F F F", "TYPE F F Q"), "do not exist together");
  expectProblem(with("SIZE 4 4 4", "SIZE 4 4 3"), "do not exist together");
  expectProblem(with("SIZE 4 4 4", "SIZE 4 4"), "SIZE has 2 entries for 3 fields");
  expectProblem(with("COUNT 1 1 1", "COUNT 1 1 2"), "must be single");
  expectProblem(with("COUNT 1 1 1", "COUNT 1 1 99999999999999"), "too many values");
  expectProblem(with("WIDTH 1", "WIDTH -1"), "no whole number");
  expectProblem(with("WIDTH 1", "WIDTH 99999999999999999999"), "no whole number");
  expectProblem(with("WIDTH 1", "WIDTH 2"), "is not POINTS 1");
  expectProblem(with("WIDTH 1\nHEIGHT 1", "WIDTH 4294967296\nHEIGHT 4294967296"),
                "contradicts itself");
  expectProblem(with("WIDTH 1", "WIDTH 1\nWIDTH 1"), "WIDTH twice");
  expectProblem(with("DATA ascii", "DATA zip"), "DATA must be");
  expectProblem(with("DATA ascii\n1 2 3\n", ""), "before the DATA line");
  expectProblem(with("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT 0 0 0 0 0 0 0"), "length 0");
  expectProblem(with("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT nan 0 0 1 0 0 0"), "no finite");
  expectProblem(with("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT 0 0 0"), "needs 7 numbers");
  expectProblem(with("HEIGHT 1", "COLOUR 1"), "'COLOUR' does not belong");
}

TEST_F(CloudFile, SaysWhatIsWrongWithTheData) {
  expectProblem(xyzHeader(0, 1, "ascii"), "holds no points");
  expectProblem(xyzHeader(1, 0, "binary"), "holds no points");
  expectProblem(xyzHeader(2, 1, "ascii") + "1.0 2.0 3.0\n", "announces 2 points, but holds 1");
  expectProblem(xyzHeader(1, 1, "ascii") + "1 2 3\n4 5 6\n", "more points than the announced 1");
  expectProblem(xyzHeader(1, 1, "ascii") + "1 2\n3 4\n", "2 values instead of 3");
  expectProblem(xyzHeader(1, 1, "ascii") + "1 2 3 4\n", "4 values instead of 3");
  expectProblem(xyzHeader(1, 1, "ascii") + "1 2 three\n", "line 12: 'three' is no number");
  expectProblem(xyzHeader(1, 1, "ascii") + "1,5 2 3\n", "'1,5' is no number");
  expectProblem(xyzHeader(2, 1, "binary") + std::string(23, 'x'), "23 bytes of data follow");
  expectProblem(xyzHeader(1, 1, "binary") + std::string(24, 'x'), "12 more bytes follow");
  const std::string one = xyzHeader(1, 1, "binary") + std::string(12, 'x');
  expectProblem(one + std::string(70000, '\0'), "70000 more bytes follow");
  // Old PCL fills up a page of memory.
  writeFileAtomically(dir_ / "padded.pcd", one + std::string(3000, '\0'));
  EXPECT_EQ(readCloudFile(dir_ / "padded.pcd").size(), 1u);
}

TEST_F(CloudFile, TakesNoMemoryForWhatAHeaderOnlyClaims) {
  const std::string huge =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2000000000\n"
      "HEIGHT 1\nPOINTS 2000000000\nDATA ";
  expectProblem(huge + "ascii\n1 2 3\n", "announces 2000000000 points");
  expectProblem(huge + "binary\n123456789012", "announces 2000000000 points");
  std::string packed = huge + "binary_compressed\n";
  append<std::uint32_t>(packed, 4);
  append<std::uint32_t>(packed, 0xFFFFFFFFu);
  expectProblem(packed + "abcd", "cannot hold");
  std::string beyond = huge;
  beyond.replace(beyond.find("WIDTH 2000000000\nHEIGHT 1"), 25, "WIDTH 4000000000\nHEIGHT 2");
  beyond.replace(beyond.find("POINTS 2000000000"), 17, "POINTS 8000000000");
  expectProblem(beyond + "binary\n123456789012", "more than can be handled");
}

TEST_F(CloudFile, RefusesCompressedSizesThatLie) {
  const std::string sound = compressedCloud(40);
  const std::size_t sizes = sound.find("binary_compressed\n") + 18;
  const auto with = [&](std::size_t at, std::uint32_t value) {
    std::string bytes = sound;
    std::memcpy(&bytes[at], &value, sizeof value);
    return bytes;
  };
  expectProblem(with(sizes, 1000000), "is cut short");
  expectProblem(with(sizes, 1), "cannot hold");
  expectProblem(with(sizes + 4, 641), "contradicts itself");
  expectProblem(with(sizes + 4, 639), "only 639 bytes");
  std::string garbled = sound;
  garbled[sizes + 8] = '\xff';
  EXPECT_NE(problemOf(garbled), "no problem");
}

TEST_F(CloudFile, InfoReadsTheHeaderOnly) {
  const CloudFileInfo pcd = readCloudFileInfo(write(compressedCloud(40)));
  EXPECT_EQ(pcd.format, CloudFormat::Pcd);
  EXPECT_EQ(pcd.encoding, "binary_compressed");
  EXPECT_EQ(pcd.width, 40u);
  EXPECT_EQ(pcd.height, 1u);
  EXPECT_EQ(pcd.fields, (std::vector<std::string>{"x", "y", "z", "rgb"}));
  const CloudFileInfo ply = readCloudFileInfo(
      write(plyHeader("ascii", "property float x\nproperty float y\nproperty float z\n") +
            "1 2 3\n4 5 6\n"));
  EXPECT_EQ(ply.format, CloudFormat::Ply);
  EXPECT_EQ(ply.width, 2u);
  EXPECT_THROW(readCloudFileInfo(write(xyzHeader(2, 1, "binary") + "1")), IoError);
}

TEST_F(CloudFile, ReadsRealClouds) {
  const std::string data = std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no real data beside the sources";
  const CloudData office = readCloudFile(data + "clouds_pcl/office1.pcd");
  EXPECT_EQ(office.width, 640u);
  EXPECT_EQ(office.height, 480u);
  EXPECT_EQ(office.colors.size(), office.size());
  std::size_t invalid = 0;
  for (std::size_t i = 0; i < office.size(); ++i) invalid += office.view().isMeasured(i) ? 0 : 1;
  EXPECT_EQ(invalid, 52744u);
  EXPECT_EQ(readCloudFile(data + "clouds_pcl/sac_plane_test.pcd").size(), 3283u);
  EXPECT_EQ(readCloudFile(data + "clouds_velodyne/street_scan.pcd").intensities.size(), 69088u);
  const CloudData labelled = readCloudFile(data + "labelled_mosd_tabletop/learn0.pcd");
  EXPECT_EQ(labelled.labels.size(), 307200u);
  EXPECT_EQ(readCloudFile(data + "labelled_synpeb/small_clean.pcd").size(), 10000u);
}

}  // namespace
}  // namespace planar_mapping::io
