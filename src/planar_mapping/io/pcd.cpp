// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/cloud_layout.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

std::optional<ScalarType> scalarType(std::string_view type, std::uint64_t size) {
  const bool is_integer = type == "I" || type == "U";
  const bool known = (is_integer && (size == 1 || size == 2)) ||
                     ((is_integer || type == "F") && (size == 4 || size == 8));
  if (!known) return std::nullopt;
  return ScalarType{type[0], static_cast<std::uint8_t>(size)};
}

/// The header's lines by key, each with its words.
class Entries {
 public:
  Entries(const std::string& path, LineReader& lines) : path_(path) {
    std::string_view line;
    while (lines.next(line)) {
      std::string_view rest = line;
      const std::string_view key = takeWord(rest);
      if (key.empty() || key.front() == '#') continue;
      static constexpr const char* kKeys[] = {"VERSION",   "FIELDS", "COLUMNS", "SIZE",
                                              "TYPE",      "COUNT",  "WIDTH",   "HEIGHT",
                                              "VIEWPOINT", "POINTS", "DATA"};
      bool known = false;
      for (const char* name : kKeys) known = known || key == name;
      if (!known || lines.number() > kMaxHeaderLines)
        failAtLine(path, lines.number(),
                   quoted(key) + " does not belong into the header of a PCD file");
      std::vector<std::string> words;
      for (const std::string_view word : splitWords(rest)) words.emplace_back(word);
      const std::string name = key == "COLUMNS" ? "FIELDS" : std::string(key);
      if (!entries_.emplace(name, std::move(words)).second)
        failAtLine(path, lines.number(), name + " twice");
      if (key == "DATA") return;
    }
    throw IoError(path, "ends before the DATA line: cut short, or no PCD file");
  }

  bool has(const std::string& key) const { return entries_.count(key) != 0; }
  const std::vector<std::string>& words(const std::string& key) const {
    const auto entry = entries_.find(key);
    if (entry == entries_.end()) throw IoError(path_, "has no " + key + " line");
    return entry->second;
  }
  std::uint64_t number(const std::string& key) const {
    const std::vector<std::string>& values = words(key);
    if (values.size() != 1) throw IoError(path_, key + " needs one number");
    return parsed(key, values[0]);
  }
  /// A number per field; \p fallback for each where old versions leave the line out.
  std::vector<std::uint64_t> numbers(const std::string& key, std::size_t count,
                                     std::uint64_t fallback) const {
    if (!has(key)) return std::vector<std::uint64_t>(count, fallback);
    const std::vector<std::string>& values = perField(key, count);
    std::vector<std::uint64_t> all;
    for (const std::string& value : values) all.push_back(parsed(key, value));
    return all;
  }
  const std::vector<std::string>& perField(const std::string& key, std::size_t count) const {
    const std::vector<std::string>& values = words(key);
    if (values.size() != count)
      throw IoError(path_, key + " has " + std::to_string(values.size()) + " entries for " +
                               std::to_string(count) + " fields");
    return values;
  }

 private:
  std::uint64_t parsed(const std::string& key, const std::string& word) const {
    std::uint64_t value = 0;
    if (!parseNumber(word, value))
      throw IoError(path_, key + " " + quoted(word) + " is no whole number in range");
    return value;
  }

  std::string path_;
  std::map<std::string, std::vector<std::string>> entries_;
};

Pose viewpoint(const std::string& path, const Entries& entries) {
  if (!entries.has("VIEWPOINT")) return Pose::Identity();
  const std::vector<std::string>& words = entries.words("VIEWPOINT");
  if (words.size() != 7) throw IoError(path, "VIEWPOINT needs 7 numbers: tx ty tz qw qx qy qz");
  double v[7];
  for (std::size_t i = 0; i < 7; ++i) {
    if (!parseNumber(words[i], v[i]) || !std::isfinite(v[i]))
      throw IoError(path, "VIEWPOINT " + quoted(words[i]) + " is no finite number");
  }
  const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
  constexpr double kShortestQuaternion = 1e-6;  // its direction is not lost in rounding
  const double norm = rotation.norm();
  if (!(norm > kShortestQuaternion && norm < 1.0 / kShortestQuaternion))
    throw IoError(path, "VIEWPOINT has a quaternion of length 0");
  return poseOf(Vector3(v[0], v[1], v[2]), rotation);
}

}  // namespace

CloudHeader readPcdHeader(InputFile& file, LineReader& lines) {
  const std::string& path = file.path();
  const Entries entries(path, lines);
  CloudHeader header;
  header.format = CloudFormat::Pcd;
  header.data_position = lines.position();

  const std::vector<std::string>& names = entries.words("FIELDS");
  if (names.empty()) throw IoError(path, "has no fields");
  // Version 0.5 knew neither COUNT nor, in some writers, SIZE and TYPE.
  const std::vector<std::uint64_t> counts = entries.numbers("COUNT", names.size(), 1);
  const std::vector<std::uint64_t> sizes = entries.numbers("SIZE", names.size(), 4);
  const std::vector<std::string> types = entries.has("TYPE")
                                             ? entries.perField("TYPE", names.size())
                                             : std::vector<std::string>(names.size(), "F");
  for (std::size_t i = 0; i < names.size(); ++i) {
    CloudField field;
    field.name = names[i];
    field.count = counts[i];
    const bool padding = names[i] == "_";
    const std::optional<ScalarType> type = scalarType(types[i], sizes[i]);
    if (!type && !padding)
      throw IoError(path, "field '" + names[i] + "' has TYPE " + quoted(types[i]) + " and SIZE " +
                              std::to_string(sizes[i]) + ", which do not exist together");
    field.type = type.value_or(ScalarType{'U', 1});
    if (padding && !type) {
      if (sizes[i] > std::numeric_limits<std::uint32_t>::max() ||
          counts[i] > std::numeric_limits<std::uint32_t>::max())
        throw IoError(path, "a point has too many values");
      field.count = sizes[i] * counts[i];
    }
    header.fields.push_back(field);
  }
  if (!entries.has("WIDTH") && !entries.has("POINTS"))
    throw IoError(path, "has neither WIDTH nor POINTS line");
  header.width = entries.number(entries.has("WIDTH") ? "WIDTH" : "POINTS");
  header.height = entries.has("HEIGHT") ? entries.number("HEIGHT") : 1;
  if (entries.has("POINTS")) {
    const std::uint64_t points = entries.number("POINTS");
    const bool product_fits = header.width == 0 || header.height <= UINT64_MAX / header.width;
    if (!product_fits || points != header.width * header.height)
      throw IoError(path, "contradicts itself: WIDTH " + std::to_string(header.width) +
                              " times HEIGHT " + std::to_string(header.height) + " is not POINTS " +
                              std::to_string(points));
  }

  header.T_world_sensor = viewpoint(path, entries);
  const std::vector<std::string>& data = entries.words("DATA");
  if (data.size() != 1 ||
      (data[0] != "ascii" && data[0] != "binary" && data[0] != "binary_compressed"))
    throw IoError(path, "DATA must be ascii, binary or binary_compressed");
  header.encoding = data[0];
  return header;
}

namespace {

constexpr std::size_t kRecordsABlock = 8192;  // written at once

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
  for (const double value : {t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z()})
    append(text, ' ', value);
  return text + "\nPOINTS " + std::to_string(cloud.size()) + "\nDATA binary\n";
}

void writePoints(AtomicFile& file, const CloudData& cloud) {
  const std::size_t words = 3 + (cloud.colors.empty() ? 0u : 1u) +
                            (cloud.labels.empty() ? 0u : 1u) +
                            (cloud.intensities.empty() ? 0u : 1u);
  if (words == 3) return file.write(cloud.xyz.data(), cloud.xyz.size() * sizeof(float));
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
