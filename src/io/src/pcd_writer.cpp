// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/cloud_file.h"
#include "text_lines.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kRecordsABlock = 8192;

std::string headerOf(const CloudData& cloud) {
  struct Field {
    bool present;
    const char* name;
    const char* type;
  };
  const Field fields[] = {{true, "x", "F"},
                          {true, "y", "F"},
                          {true, "z", "F"},
                          {!cloud.colors.empty(), "rgb", "U"},
                          {!cloud.labels.empty(), "label", "U"},
                          {!cloud.intensities.empty(), "intensity", "F"}};
  std::string names, sizes, types, counts;
  for (const Field& field : fields) {
    if (!field.present) continue;
    names += std::string(" ") + field.name;
    sizes += " 4";
    types += std::string(" ") + field.type;
    counts += " 1";
  }
  std::string text = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS" + names +
                     "\nSIZE" + sizes + "\nTYPE" + types + "\nCOUNT" + counts + "\nWIDTH " +
                     std::to_string(cloud.width) + "\nHEIGHT " + std::to_string(cloud.height) +
                     "\nVIEWPOINT";
  const Eigen::Quaterniond q(Eigen::Matrix3d(cloud.T_world_sensor.linear()));
  const Vector3 t = cloud.T_world_sensor.translation();
  for (const double value : {t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z()}) {
    append(text, ' ', value);
  }
  return text + "\nPOINTS " + std::to_string(cloud.size()) + "\nDATA binary\n";
}

void writePoints(AtomicFile& file, const CloudData& cloud) {
  const std::size_t words = 3 + (cloud.colors.empty() ? 0u : 1u) +
                            (cloud.labels.empty() ? 0u : 1u) +
                            (cloud.intensities.empty() ? 0u : 1u);
  if (words == 3) {
    file.write(cloud.xyz.data(), cloud.xyz.size() * sizeof(float));
    return;
  }
  std::vector<std::uint32_t> block(words * std::min(kRecordsABlock, cloud.size()));
  for (std::size_t first = 0; first < cloud.size(); first += kRecordsABlock) {
    const std::size_t count = std::min(kRecordsABlock, cloud.size() - first);
    std::uint32_t* out = block.data();
    for (std::size_t i = first; i < first + count; ++i) {
      std::memcpy(out, &cloud.xyz[3 * i], 3 * sizeof(float));
      out += 3;
      if (!cloud.colors.empty()) *out++ = cloud.colors[i];
      if (!cloud.labels.empty()) *out++ = cloud.labels[i];
      if (!cloud.intensities.empty()) std::memcpy(out++, &cloud.intensities[i], sizeof(float));
    }
    file.write(block.data(), count * words * sizeof(std::uint32_t));
  }
}

}  // namespace

void writePcd(const std::string& path, const CloudData& cloud, Overwrite overwrite) {
  const std::size_t count = cloud.size();
  const auto fits = [count](std::size_t channel) { return channel == 0 || channel == count; };
  if (cloud.xyz.size() != 3 * count || count != std::size_t{cloud.width} * cloud.height ||
      !fits(cloud.colors.size()) || !fits(cloud.labels.size()) || !fits(cloud.intensities.size()))
    throw InputError("a cloud whose channels differ in length cannot be written to " + path);
  requirePose(cloud.T_world_sensor, "the cloud for " + path);
  AtomicFile file(path, overwrite);
  file.write(headerOf(cloud));
  writePoints(file, cloud);
  file.commit();
}

}  // namespace planar_mapping::io
