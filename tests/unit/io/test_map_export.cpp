// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Which files are written, and that they are whole or not there. What is in them: tests/exports.
#include <gtest/gtest.h>

#include <clocale>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include "cloud_file_bytes.h"
#include "cloud_file_fixture.h"
#include "comma_locale.h"
#include "map_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/export/map_export.h"
#include "planar_mapping/io/map_file.h"
#include "temporary_directory.h"

namespace planar_mapping::io {
namespace {

const PlanarMap& someMap() {
  static const PlanarMap map = test::mapOfFrames(1);
  return map;
}

std::string nameFor(const io::ExportFormat& format) {
  return format.extension == "/" ? "model/" : "m" + format.extension;
}

std::string bytesOf(const std::string& path) {
  const std::vector<std::uint8_t> bytes = io::readWholeFile(path);
  return {bytes.begin(), bytes.end()};
}

TEST(MapExport, WritesEveryFormat) {
  const TemporaryDirectory directory;
  EXPECT_EQ(io::exportFormats().size(), 19u);
  for (const io::ExportFormat& format : io::exportFormats()) {
    const std::string path = directory / nameFor(format);
    EXPECT_FALSE(format.readers.empty());
    io::exportMap(someMap(), path);
    for (const std::string& file : io::exportedFiles(path))
      EXPECT_GT(std::filesystem::file_size(file), 50u) << file;
  }
  EXPECT_EQ(io::loadMap(directory / "m.pmap").serialize(), someMap().serialize());
}

TEST(MapExport, KnowsTheFilesBesideTheFirst) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(io::exportedFiles("a.b/m.pgm"), (Names{"a.b/m.pgm", "a.b/m.yaml"}));
  EXPECT_EQ(io::exportedFiles("m.obj"), (Names{"m.obj", "m.mtl"}));
  EXPECT_EQ(io::exportedFiles("office/"), (Names{"office/model.sdf", "office/model.config"}));
  EXPECT_EQ(io::exportedFiles("m.ot"), Names{"m.ot"});
  for (const char* path : {"m.docx", "m", "", ".", "m.PLY"}) {
    EXPECT_THROW(io::exportedFiles(path), ParameterError) << path;
    EXPECT_THROW(io::exportMap(someMap(), path), ParameterError) << path;
  }
}

TEST(MapExport, OriginIsSaidWhereThereIsOne) {
  const TemporaryDirectory directory;
  const auto files = [&](const std::string& name, const Vector3& origin) {
    PlanarMapParams params;
    params.origin = origin;
    io::ExportOptions options;
    options.overwrite = io::Overwrite::Allow;
    io::exportMap(PlanarMap(params), directory / name, options);
    std::string text;
    for (const std::string& file : io::exportedFiles(directory / name)) text += bytesOf(file);
    return text;
  };
  const Vector3 utm(501000.0, 4500000.0, 0.5);
  for (const char* name : {"m.sdf", "office/", "m.urdf", "m.pgm", "m.bt", "m.ot", "m.ply", "m.obj",
                           "m.stl", "m.pcd"}) {
    EXPECT_NE(files(name, utm).find("origin_m 501000 4500000 0.5"), std::string::npos) << name;
    EXPECT_EQ(files(name, Vector3::Zero()).find("origin_m"), std::string::npos) << name;
  }
  EXPECT_NE(files("m.glb", utm).find("\"origin_m\":[501000.0,4500000.0,0.5]"), std::string::npos);
  EXPECT_NE(files("m.json", utm).find("\"origin_m\": [501000, 4500000, 0.5]"), std::string::npos);
  EXPECT_EQ(files("m.glb", Vector3::Zero()).find("origin_m"), std::string::npos);
}

TEST(MapExport, UnknownSpaceIsWrittenWhenAskedFor) {
  const TemporaryDirectory directory;
  for (const char* name : {"m.csv", "m.sdf", "m.urdf", "m.scene", "m.vtp", "m.glb", "m.ply",
                           "m.obj", "m.stl", "m.pcd"}) {
    io::ExportOptions options;
    io::exportMap(someMap(), directory / name, options);
    const auto occupied = std::filesystem::file_size(directory / name);
    options.unknown = true;
    options.overwrite = io::Overwrite::Allow;
    io::exportMap(someMap(), directory / name, options);
    EXPECT_GT(std::filesystem::file_size(directory / name), occupied) << name;
  }
}

TEST(MapExport, AFileThatExistsIsKeptAndNothingElseAppears) {
  for (const io::ExportFormat& format : io::exportFormats()) {
    const std::size_t count = io::exportedFiles(nameFor(format)).size();
    for (std::size_t existing = 0; existing < count; ++existing) {
      const TemporaryDirectory directory;
      const std::string path = directory / nameFor(format);
      const std::vector<std::string> files = io::exportedFiles(path);
      if (path.back() == '/') std::filesystem::create_directory(path);
      io::writeFileAtomically(files[existing], "mine");
      EXPECT_THROW(io::exportMap(someMap(), path), IoError) << path;
      EXPECT_EQ(bytesOf(files[existing]), "mine");
      for (std::size_t i = 0; i < count; ++i)
        EXPECT_EQ(std::filesystem::exists(files[i]), i == existing) << files[i];
      const std::filesystem::path folder = std::filesystem::path(files[existing]).parent_path();
      EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1) << folder;
      io::ExportOptions options;
      options.overwrite = io::Overwrite::Allow;
      io::exportMap(someMap(), path, options);
      EXPECT_NE(bytesOf(files[existing]), "mine") << files[existing];
    }
  }
}

TEST(MapExport, FullDiskLeavesNothingBehind) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_THROW(io::exportMap(someMap(), "/dev/full/m.csv"), IoError);
  EXPECT_THROW(io::exportMap(someMap(), "/proc/m.csv"), IoError);
  EXPECT_THROW(io::exportMap(someMap(), "/proc/model/"), IoError);
}

TEST(MapExport, OptionsOutOfRangeAreRefused) {
  const TemporaryDirectory directory;
  const auto refuses = [&](const char* name, const auto& change) {
    io::ExportOptions options;
    change(options);
    EXPECT_THROW(io::exportMap(someMap(), directory / name, options), ParameterError) << name;
    EXPECT_FALSE(std::filesystem::exists(directory / name));
  };
  for (const char* frame_id : {"", "a b", "a,b", "a\"b", "a\nb"})
    refuses("m.csv", [&](io::ExportOptions& o) { o.frame_id = frame_id; });
  refuses("m.bt", [](io::ExportOptions& o) { o.cell = -0.1; });
  refuses("m.bt", [](io::ExportOptions& o) { o.cell = NAN; });
  refuses("m.pcd", [](io::ExportOptions& o) { o.spacing = NAN; });
  refuses("m.pgm", [](io::ExportOptions& o) { o.robot.max_step = 3.0; });
  refuses("m.pgm", [](io::ExportOptions& o) { o.robot.height = NAN; });
  refuses("m.pgm", [](io::ExportOptions& o) { o.robot.radius = INFINITY; });
}

TEST(MapExport, AnEmptyMapHasFilesToo) {
  const TemporaryDirectory directory;
  for (const io::ExportFormat& format : io::exportFormats()) {
    io::exportMap(PlanarMap(), directory / nameFor(format));
    for (const std::string& file : io::exportedFiles(directory / nameFor(format)))
      EXPECT_TRUE(std::filesystem::exists(file)) << file;
  }
}

void expectFiles(const std::string& path, const std::vector<std::string>& expected) {
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(bytesOf(io::exportedFiles(path)[i]), expected[i]) << path;
}

TEST(MapExport, DoesNotDependOnTheLocale) {
  const TemporaryDirectory directory;
  io::ExportOptions options;
  options.overwrite = io::Overwrite::Allow;
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const io::ExportFormat& format : io::exportFormats()) {
    const std::string path = directory / nameFor(format);
    io::exportMap(someMap(), path);
    std::vector<std::string> expected;
    for (const std::string& file : io::exportedFiles(path)) expected.push_back(bytesOf(file));
    for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8"}) {
      if (std::setlocale(LC_ALL, name) == nullptr) continue;
      io::exportMap(someMap(), path, options);
      expectFiles(path, expected);
    }
    std::setlocale(LC_ALL, before.c_str());
    const test::CommaLocale locale;
    io::exportMap(someMap(), path, options);
    expectFiles(path, expected);
  }
}

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
}  // namespace planar_mapping::io
