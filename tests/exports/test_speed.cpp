// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Figures of docs/exports.md.
#include <cstdio>
#include <ctime>

#include "export_scene.h"

namespace planar_mapping {
namespace {

double processorSeconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

TEST(ExportSpeed, TwentyThousandCuboidsTakeLessThanASecond) {
#ifdef PLANAR_MAPPING_SANITIZED
  GTEST_SKIP() << "time of instrumented code says nothing";
#endif
  const io::ExportedMap map = test::manyExported(20000);
  const std::pair<const char*, test::Exported::Write> formats[] = {
      {"m.csv", io::writeCsv},   {"m.sdf", io::writeSdf},     {"m/", io::writeModelFolder},
      {"m.urdf", io::writeUrdf}, {"m.scene", io::writeScene}, {"m.pgm", io::writePgm},
      {"m.vtp", io::writeVtp},   {"m.glb", io::writeGlb},     {"m.ply", io::writePly},
      {"m.obj", io::writeObj},   {"m.stl", io::writeStl},     {"m.pcd", io::writePoints}};
  for (const auto& [name, write] : formats) {
    const double start = processorSeconds();
    const test::Exported file(write, map, name);
    const double seconds = processorSeconds() - start;
    std::size_t bytes = 0;
    for (const std::string& path : io::exportedFiles(file.path()))
      bytes += std::filesystem::file_size(path);
    std::printf("%-8s %6.0f ms %10zu bytes\n", name, 1e3 * seconds, bytes);
    EXPECT_LT(seconds, 1.0) << name;
  }
}

}  // namespace
}  // namespace planar_mapping
