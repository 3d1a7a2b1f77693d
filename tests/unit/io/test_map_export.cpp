// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Which files are written, and that they are whole or not there. What is in them: tests/exports.
#include "planar_mapping/io/map_export.h"

#include <gtest/gtest.h>

#include <clocale>
#include <filesystem>
#include <string>
#include <vector>

#include "comma_locale.h"
#include "map_scene.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "temporary_directory.h"

namespace planar_mapping {
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
  EXPECT_EQ(io::exportFormats().size(), 16u);
  for (const io::ExportFormat& format : io::exportFormats()) {
    const std::string path = directory / nameFor(format);
    EXPECT_FALSE(format.readers.empty());
    io::exportMap(someMap(), path);
    for (const std::string& file : io::exportedFiles(path)) {
      EXPECT_GT(std::filesystem::file_size(file), 50u) << file;
    }
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
    for (const std::string& file : io::exportedFiles(directory / name)) {
      text += bytesOf(file);
    }
    return text;
  };
  const Vector3 utm(501000.0, 4500000.0, 0.5);
  for (const char* name : {"m.sdf", "office/", "m.urdf", "m.pgm", "m.bt", "m.ot", "m.ply", "m.obj",
                           "m.stl", "m.pcd"}) {
    EXPECT_NE(files(name, utm).find("origin_m 501000 4500000 0.5"), std::string::npos) << name;
    EXPECT_EQ(files(name, Vector3::Zero()).find("origin_m"), std::string::npos) << name;
  }
  EXPECT_NE(files("m.glb", utm).find("\"origin_m\":[501000,4500000,0.5]"), std::string::npos);
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
      for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(std::filesystem::exists(files[i]), i == existing) << files[i];
      }
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
  for (const char* frame_id : {"", "a b", "a,b", "a\"b", "a\nb"}) {
    refuses("m.csv", [&](io::ExportOptions& o) { o.frame_id = frame_id; });
  }
  refuses("m.bt", [](io::ExportOptions& o) { o.cell = -0.1; });
  refuses("m.bt", [](io::ExportOptions& o) { o.cell = NAN; });
  refuses("m.pcd", [](io::ExportOptions& o) { o.spacing = NAN; });
  refuses("m.pgm", [](io::ExportOptions& o) { o.band.low = 3.0; });
  refuses("m.pgm", [](io::ExportOptions& o) { o.band.high = NAN; });
  refuses("m.pgm", [](io::ExportOptions& o) { o.band.ground = INFINITY; });
}

TEST(MapExport, AnEmptyMapHasFilesToo) {
  const TemporaryDirectory directory;
  for (const io::ExportFormat& format : io::exportFormats()) {
    io::exportMap(PlanarMap(), directory / nameFor(format));
    for (const std::string& file : io::exportedFiles(directory / nameFor(format))) {
      EXPECT_TRUE(std::filesystem::exists(file)) << file;
    }
  }
}

void expectFiles(const std::string& path, const std::vector<std::string>& expected) {
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(bytesOf(io::exportedFiles(path)[i]), expected[i]) << path;
  }
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

}  // namespace
}  // namespace planar_mapping
