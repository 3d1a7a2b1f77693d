// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/map/planar_map.h"

// NumPy arrays as our types, and back. What is read in place is kept alive by the object that
// reads. Wrong shapes and values throw InputError, wrong types TypeError; both name the argument.
namespace planar_mapping::python {

namespace py = pybind11;

// The parts of the module _native; full docstrings are in planar_mapping/__init__.pyi and
// docs/tutorials/python.md.
void addErrors(py::module_& module);
void addClouds(py::module_& module);
void addMap(py::module_& module);
void addSequences(py::module_& module);

/// As NumPy has it, row by row.
using PoseMatrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

// The rows of the structured arrays; planar_mapping/__init__.pyi says what they mean.
struct CuboidRow {
  double center[3];
  double size[3];
  double orientation[4];
  std::int32_t plane_id;
  float probability;
  std::uint8_t state;
};
struct PlaneRow {
  std::int32_t id;
  std::uint32_t frames;
  double normal[3];
  double offset;
  double rms;
};
struct SegmentRow {
  double normal[3];
  double offset;
  double rms;
  std::int32_t inliers;
};
struct HitRow {
  double distance;
  double point[3];
  std::int32_t cuboid;
  std::uint8_t state;
};
/// Makes NumPy know them; once.
void registerRows();

/// (N, 3) or (3,) numbers, as questions have them: float32 and float64 of any strides in place.
class Points {
 public:
  Points(const py::object& argument, const std::string& name);

  std::size_t size() const { return size_; }
  bool isSinglePoint() const { return array_.ndim() == 1; }
  Vector3 operator[](std::size_t i) const { return is_float_ ? read<float>(i) : read<double>(i); }

 private:
  template <typename T>
  Vector3 read(std::size_t i) const {
    const char* row = data_ + static_cast<py::ssize_t>(i) * row_stride_;
    const auto at = [&](int k) {
      return static_cast<double>(*reinterpret_cast<const T*>(row + k * column_stride_));
    };
    return {at(0), at(1), at(2)};
  }

  py::array array_;
  const char* data_ = nullptr;
  std::size_t size_ = 0;
  py::ssize_t row_stride_ = 0;
  py::ssize_t column_stride_ = 0;
  bool is_float_ = false;
};

/// A cloud, (N, 3) or organized (H, W, 3): float32 in place if x y z are neighbours, else copied.
class Cloud {
 public:
  Cloud(const py::object& argument, const std::string& name);

  const PointsView& view() const { return view_; }
  /// (N) or (H, W).
  const std::vector<py::ssize_t>& shape() const { return shape_; }

 private:
  py::array array_;
  PointsView view_;
  std::vector<py::ssize_t> shape_;
};

/// A 4 x 4 matrix; None = identity.
Pose poseOf(const py::object& argument, const std::string& name);
/// Three numbers.
Vector3 vectorOf(const py::object& argument, const std::string& name);
/// A 3 x 3 camera matrix without skew, for images of this size.
PinholeCamera cameraOf(const py::object& argument, py::ssize_t height, py::ssize_t width);

py::array_t<double> toArray(const Pose& pose);
/// One copy, as a structured array.
py::array toArray(const std::vector<Cuboid>& cuboids);
py::array toArray(const std::vector<MapPlane>& planes);

/// An array over a vector's own memory.
template <typename T>
py::array_t<T> toArray(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto* owned = new std::vector<T>(std::move(values));
  const py::capsule keeper(owned, [](void* data) { delete static_cast<std::vector<T>*>(data); });
  return py::array_t<T>(std::move(shape), owned->data(), keeper);
}

/// The points of a file: (N, 3), or (H, W, 3) if they are organized.
inline py::array_t<float> pointsOf(io::CloudData cloud) {
  std::vector<py::ssize_t> shape = {static_cast<py::ssize_t>(cloud.size()), 3};
  if (cloud.height > 1) shape = {cloud.height, cloud.width, 3};
  return toArray(std::move(cloud.xyz), shape);
}

}  // namespace planar_mapping::python
