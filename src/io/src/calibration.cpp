// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/calibration.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <limits>
#include <set>

#include "planar_mapping/core/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "text_lines.h"
#include "text_out.h"

namespace planar_mapping {
namespace io {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 20;
constexpr double kLargestImage = 65535;

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {
    const std::vector<std::uint8_t> bytes = readWholeFile(path, kLargestFile);
    try {
      root_ = YAML::Load(std::string(bytes.begin(), bytes.end()));
    } catch (const YAML::Exception& error) {
      fail(error.mark, error.msg);
    }
    if (!root_.IsMap()) throw IoError(path, "is no calibration: it holds no 'key: value' lines");
    std::set<std::string> seen;
    for (const auto& entry : root_) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      static const std::set<std::string> kKeys = {"image_width", "image_height", "fx",
                                                  "fy",          "cx",           "cy",
                                                  "baseline_m",  "cx_right",     "depth_scale"};
      if (kKeys.count(key) == 0) fail(entry.first.Mark(), "unknown key " + quoted(key));
      if (!seen.insert(key).second) fail(entry.first.Mark(), "key '" + key + "' twice");
    }
  }

  bool has(const char* key) const { return static_cast<bool>(root_[key]); }

  double number(const char* key, double low, double high) const {
    const YAML::Node node = root_[key];
    if (!node) throw IoError(path_, std::string("has no key '") + key + "'");
    double value = 0.0;
    if (!node.IsScalar() || !parseNumber(node.Scalar(), value))
      fail(node.Mark(), std::string(key) + " is no number");
    if (!(value >= low && value <= high)) {
      std::string range = "[";
      appendNumber(range, low);
      range += ", ";
      appendNumber(range, high);
      fail(node.Mark(),
           std::string(key) + " = " + quoted(node.Scalar()) + " is not in " + range + "]");
    }
    return value;
  }
  int integer(const char* key) const {
    const double value = number(key, 1, kLargestImage);
    if (value != std::floor(value))
      fail(root_[key].Mark(), std::string(key) + " is no whole number");
    return static_cast<int>(value);
  }

 private:
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& problem) const {
    throw IoError(path_, "line " + std::to_string(mark.line + 1) + ": " + problem);
  }

  std::string path_;
  YAML::Node root_;
};

}  // namespace

Calibration readCalibration(const std::string& path) {
  const Reader reader(path);
  constexpr double kTiny = 1e-9;
  constexpr double kHuge = 1e9;
  Calibration calibration;
  calibration.camera.width = reader.integer("image_width");
  calibration.camera.height = reader.integer("image_height");
  calibration.camera.fx = reader.number("fx", kTiny, kHuge);
  calibration.camera.fy = reader.number("fy", kTiny, kHuge);
  calibration.camera.cx = reader.number("cx", -kHuge, kHuge);
  calibration.camera.cy = reader.number("cy", -kHuge, kHuge);
  if (reader.has("baseline_m")) calibration.baseline = reader.number("baseline_m", kTiny, kHuge);
  calibration.cx_right =
      reader.has("cx_right") ? reader.number("cx_right", -kHuge, kHuge) : calibration.camera.cx;
  if (reader.has("depth_scale"))
    calibration.depth_scale = reader.number("depth_scale", kTiny, kHuge);
  return calibration;
}

std::string toYaml(const Calibration& calibration) {
  std::string text;
  const auto add = [&text](const char* key, double value) {
    text += std::string(key) + ": ";
    appendNumber(text, value);
    text += '\n';
  };
  add("image_width", calibration.camera.width);
  add("image_height", calibration.camera.height);
  add("fx", calibration.camera.fx);
  add("fy", calibration.camera.fy);
  add("cx", calibration.camera.cx);
  add("cy", calibration.camera.cy);
  if (calibration.baseline) {
    add("baseline_m", *calibration.baseline);
    if (calibration.cx_right != calibration.camera.cx) add("cx_right", calibration.cx_right);
  }
  if (calibration.depth_scale) add("depth_scale", *calibration.depth_scale);
  return text;
}

}  // namespace io
}  // namespace planar_mapping
