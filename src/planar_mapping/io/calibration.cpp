// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/calibration.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 20;
constexpr double kLargestImage = 65535;
constexpr double kTiny = 1e-9;
constexpr double kHuge = 1e9;
constexpr double kLongestBaseline = 100.0;  // metres: farther apart is no stereo camera

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {
    const std::string text = readWholeText(path, kLargestFile);
    try {
      root_ = YAML::Load(text);
    } catch (const YAML::Exception& error) {
      fail(error.mark, error.msg);
    }
    if (!root_.IsMap()) throw IoError(path, "is no calibration: it holds no 'key: value' lines");
    std::set<std::string> seen;
    for (const auto& entry : root_) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      static const std::set<std::string> kKeys = {
          "image_width", "image_height", "fx",       "fy",       "cx",       "cy",
          "baseline_m",  "cx_right",     "fx_right", "fy_right", "cy_right", "depth_scale",
          "k1",          "k2",           "p1",       "p2",       "k3",       "k1_right",
          "k2_right",    "p1_right",     "p2_right", "k3_right", "rotation", "translation_m",
          "depth_along"};
      if (kKeys.count(key) == 0) {
        fail(entry.first.Mark(),
             "unknown key " + quoted(key) +
                 "; a calibration has image_width, image_height, fx, fy, cx, cy and depth_scale "
                 "(depth images) or baseline_m (rectified pairs); pairs that are not rectified "
                 "have rotation, translation_m (what stereoRectify() takes as R and T, in metres), "
                 "fx_right, fy_right, cx_right, cy_right and k1, k2, p1, p2, k3, k1_right and so "
                 "on in its place");
      }
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
    if (!(value >= low && value <= high))
      fail(node.Mark(),
           concatenated(key, " = ", quoted(node.Scalar()), " is not in [", low, ", ", high, ']'));
    return value;
  }
  double number(const std::string& key, double low, double high, double absent) const {
    return has(key.c_str()) ? number(key.c_str(), low, high) : absent;
  }
  std::vector<double> numbers(const char* key, std::size_t count) const {
    const YAML::Node node = root_[key];
    if (!node) throw IoError(path_, std::string("has no key '") + key + "'");
    std::vector<double> values(count);
    bool sound = node.IsSequence() && node.size() == count;
    for (std::size_t i = 0; sound && i < count; ++i)
      sound = node[i].IsScalar() && parseNumber(node[i].Scalar(), values[i]) &&
              std::isfinite(values[i]);
    if (!sound)
      fail(node.Mark(), std::string(key) + " is no list of " + std::to_string(count) + " numbers");
    return values;
  }
  [[noreturn]] void fail(const char* key, const std::string& problem) const {
    fail(root_[key].Mark(), problem);
  }
  bool isOneOf(const char* key, const std::string& yes, const std::string& no) const {
    const YAML::Node node = root_[key];
    const std::string value = node.IsScalar() ? node.Scalar() : "";
    if (value != yes && value != no) fail(key, std::string(key) + " is " + no + " or " + yes);
    return value == yes;
  }
  int integer(const char* key) const {
    const double value = number(key, 1, kLargestImage);
    if (value != std::floor(value))
      fail(root_[key].Mark(), std::string(key) + " is no whole number");
    return static_cast<int>(value);
  }

 private:
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& problem) const {
    failAtLine(path_, static_cast<std::size_t>(mark.line + 1), problem);
  }

  std::string path_;
  YAML::Node root_;
};

struct LensKey {
  const char* key;
  double LensDistortion::*value;
};
constexpr LensKey kLensKeys[] = {{"k1", &LensDistortion::k1},
                                 {"k2", &LensDistortion::k2},
                                 {"p1", &LensDistortion::p1},
                                 {"p2", &LensDistortion::p2},
                                 {"k3", &LensDistortion::k3}};

LensDistortion readDistortion(const Reader& reader, const std::string& suffix) {
  constexpr double kLargest = 1e6;
  LensDistortion lens;
  for (const auto& [key, value] : kLensKeys)
    lens.*value = reader.number(key + suffix, -kLargest, kLargest, 0.0);
  return lens;
}

UnrectifiedPair readUnrectified(const Reader& reader, const PinholeCamera& left) {
  UnrectifiedPair pair;
  pair.left = readDistortion(reader, "");
  pair.right = readDistortion(reader, "_right");
  pair.right_camera = left;
  pair.right_camera.fx = reader.number("fx_right", kTiny, kHuge, left.fx);
  pair.right_camera.fy = reader.number("fy_right", kTiny, kHuge, left.fy);
  pair.right_camera.cx = reader.number("cx_right", -kHuge, kHuge, left.cx);
  pair.right_camera.cy = reader.number("cy_right", -kHuge, kHuge, left.cy);
  const std::vector<double> rotation = reader.numbers("rotation", 9);
  const std::vector<double> translation = reader.numbers("translation_m", 3);
  Matrix3 R;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = rotation[static_cast<std::size_t>(i)];
  const std::optional<Matrix3> exact = rotationOf(R);
  if (!exact) reader.fail("rotation", "rotation is no rotation matrix");
  pair.T_right_left.linear() = *exact;
  pair.T_right_left.translation() = Vector3(translation[0], translation[1], translation[2]);
  const double baseline = pair.T_right_left.translation().norm();
  if (!(baseline >= kTiny && baseline <= kLongestBaseline))
    reader.fail("translation_m", "translation_m is no baseline: its length is 0 or beyond 100 m");
  return pair;
}

bool hasLens(const Reader& reader) {
  return std::any_of(std::begin(kLensKeys), std::end(kLensKeys),
                     [&](const LensKey& lens) { return reader.has(lens.key); });
}

/// Keys that mean something only beside rotation and translation_m; those of one lens also beside
/// depth_scale.
void refuseUnrectifiedKeys(const Reader& reader) {
  std::vector<const char*> keys = {"fx_right", "fy_right", "cy_right", "k1_right", "k2_right",
                                   "p1_right", "p2_right", "k3_right", "rotation"};
  if (!reader.has("depth_scale")) {
    for (const LensKey& lens : kLensKeys) keys.push_back(lens.key);
  }
  for (const char* key : keys) {
    if (reader.has(key))
      reader.fail(key, std::string(key) +
                           " belongs to a pair that is not rectified, which also has rotation and "
                           "translation_m");
  }
}

}  // namespace

Calibration readCalibration(const std::string& path) {
  const Reader reader(path);
  Calibration calibration;
  calibration.camera.width = reader.integer("image_width");
  calibration.camera.height = reader.integer("image_height");
  calibration.camera.fx = reader.number("fx", kTiny, kHuge);
  calibration.camera.fy = reader.number("fy", kTiny, kHuge);
  calibration.camera.cx = reader.number("cx", -kHuge, kHuge);
  calibration.camera.cy = reader.number("cy", -kHuge, kHuge);
  // A cut image may lack its principal point; one far from it is of another image.
  const PinholeCamera& camera = calibration.camera;
  if (!(std::abs(camera.cx - 0.5 * camera.width) <= camera.width))
    reader.fail("cx", "cx is far outside an image " + std::to_string(camera.width) + " wide");
  if (!(std::abs(camera.cy - 0.5 * camera.height) <= camera.height))
    reader.fail("cy", "cy is far outside an image " + std::to_string(camera.height) + " high");
  if (reader.has("baseline_m"))
    calibration.baseline = reader.number("baseline_m", kTiny, kLongestBaseline);
  calibration.cx_right = reader.number("cx_right", -kHuge, kHuge, camera.cx);
  if (reader.has("depth_scale"))
    calibration.depth_scale = reader.number("depth_scale", kTiny, kHuge);
  if (reader.has("depth_along"))
    calibration.depth_along_ray = reader.isOneOf("depth_along", "ray", "axis");
  if (reader.has("translation_m")) {
    if (reader.has("baseline_m"))
      reader.fail("baseline_m", "baseline_m of a pair that is not rectified is translation_m");
    calibration.unrectified = readUnrectified(reader, calibration.camera);
    calibration.baseline = calibration.unrectified->T_right_left.translation().norm();
  } else {
    refuseUnrectifiedKeys(reader);
    if (hasLens(reader)) calibration.distortion = readDistortion(reader, "");
  }
  return calibration;
}

std::string toYaml(const Calibration& calibration) {
  std::string text;
  const auto add = [&text](const std::string& key, double value) {
    append(text, key, ": ", value, '\n');
  };
  add("image_width", calibration.camera.width);
  add("image_height", calibration.camera.height);
  add("fx", calibration.camera.fx);
  add("fy", calibration.camera.fy);
  add("cx", calibration.camera.cx);
  add("cy", calibration.camera.cy);
  const auto addLens = [&add](const LensDistortion& lens, const std::string& suffix) {
    for (const auto& [key, value] : kLensKeys) add(key + suffix, lens.*value);
  };
  if (calibration.distortion) addLens(*calibration.distortion, "");
  if (calibration.unrectified) {
    const UnrectifiedPair& pair = *calibration.unrectified;
    addLens(pair.left, "");
    addLens(pair.right, "_right");
    add("fx_right", pair.right_camera.fx);
    add("fy_right", pair.right_camera.fy);
    add("cx_right", pair.right_camera.cx);
    add("cy_right", pair.right_camera.cy);
    const auto addList = [&text](const char* key, const double* values, int count) {
      append(text, key, ": [", values[0]);
      for (int i = 1; i < count; ++i) append(text, ", ", values[i]);
      text += "]\n";
    };
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = pair.T_right_left.linear();
    const Vector3 t = pair.T_right_left.translation();
    addList("rotation", R.data(), 9);
    addList("translation_m", t.data(), 3);
  } else if (calibration.baseline) {
    add("baseline_m", *calibration.baseline);
    if (calibration.cx_right != calibration.camera.cx) add("cx_right", calibration.cx_right);
  }
  if (calibration.depth_scale) add("depth_scale", *calibration.depth_scale);
  if (calibration.depth_along_ray) text += "depth_along: ray\n";
  return text;
}

}  // namespace planar_mapping::io
