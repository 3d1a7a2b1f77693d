// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.h"

#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping::python {
namespace {

std::string shapeText(const py::array& array) {
  return py::str(array.attr("shape"));
}

/// \throws TypeError unless it is an array (or a list) of real numbers
py::array numbersOf(const py::object& argument, const std::string& name) {
  py::array array = py::array::ensure(argument);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(name + " must be an array of numbers, not " +
                         std::string(py::str(py::type::of(argument).attr("__name__"))));
  }
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u')
    throw py::type_error(name + " must be an array of numbers, not of " +
                         std::string(py::str(array.dtype())));
  return array;
}

template <typename T>
py::array_t<T> packed(const py::array& array) {
  return py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
}

py::array_t<double> matrixOf(const py::object& argument, const std::string& name,
                             py::ssize_t side) {
  const py::array array = numbersOf(argument, name);
  if (array.ndim() != 2 || array.shape(0) != side || array.shape(1) != side)
    throw InputError(name + " must be a matrix of shape (" + std::to_string(side) + ", " +
                     std::to_string(side) + "), not " + shapeText(array));
  return packed<double>(array);
}

}  // namespace

void registerRows() {
  PYBIND11_NUMPY_DTYPE(CuboidRow, center, size, orientation, plane_id, probability, state);
  PYBIND11_NUMPY_DTYPE(PlaneRow, id, frames, normal, offset, rms);
  PYBIND11_NUMPY_DTYPE(SegmentRow, normal, offset, rms, inliers);
  PYBIND11_NUMPY_DTYPE(HitRow, distance, point, cuboid, state);
}

Points::Points(const py::object& argument, const std::string& name)
    : array_(numbersOf(argument, name)) {
  const py::ssize_t axes = array_.ndim();
  if (axes < 1 || axes > 2 || array_.shape(axes - 1) != 3)
    throw InputError(name + " must have the shape (N, 3), not " + shapeText(array_));
  is_float_ = py::isinstance<py::array_t<float>>(array_);
  if (!is_float_ && !py::isinstance<py::array_t<double>>(array_)) array_ = packed<double>(array_);
  data_ = static_cast<const char*>(array_.data());
  size_ = isSinglePoint() ? 1 : static_cast<std::size_t>(array_.shape(0));
  row_stride_ = isSinglePoint() ? 0 : array_.strides(0);
  column_stride_ = array_.strides(axes - 1);
}

Cloud::Cloud(const py::object& argument, const std::string& name)
    : array_(numbersOf(argument, name)) {
  constexpr py::ssize_t kFloat = sizeof(float);
  const py::ssize_t axes = array_.ndim();
  if (axes < 2 || axes > 3 || array_.shape(axes - 1) != 3)
    throw InputError(name + " must have the shape (N, 3), or (H, W, 3) if it is organized, not " +
                     shapeText(array_));
  for (py::ssize_t axis = 0; axis + 1 < axes; ++axis) shape_.push_back(array_.shape(axis));
  const py::ssize_t columns = shape_.back();
  const py::ssize_t rows = axes == 3 ? shape_.front() : 1;
  if (columns > 0 && rows > std::numeric_limits<int>::max() / columns)
    throw InputError(name + " has more than 2^31 points; divide it");
  const py::ssize_t stride = array_.strides(axes - 2);
  const bool in_place = py::isinstance<py::array_t<float>>(array_) &&
                        array_.strides(axes - 1) == kFloat && stride >= 3 * kFloat &&
                        stride % kFloat == 0 &&
                        (axes == 2 || array_.strides(0) == columns * stride);
  if (!in_place) array_ = packed<float>(array_);
  view_ = PointsView(static_cast<const float*>(array_.data()), static_cast<std::uint32_t>(columns),
                     static_cast<std::uint32_t>(rows),
                     in_place ? static_cast<std::size_t>(stride / kFloat) : 3);
}

Pose poseOf(const py::object& argument, const std::string& name) {
  Pose pose = Pose::Identity();
  if (argument.is_none()) return pose;
  const py::array_t<double> array = matrixOf(argument, name, 4);
  const auto matrix = PoseMatrix::Map(array.data());
  if (matrix.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0))
    throw InputError(name + " is no rigid motion: its last row is not 0 0 0 1");
  pose.matrix().topRows<3>() = matrix.topRows<3>();
  requireRigid(name.c_str(), pose);
  return pose;
}

Vector3 vectorOf(const py::object& argument, const std::string& name) {
  const Points points(argument, name);
  if (!points.isSinglePoint()) throw InputError(name + " must be three numbers");
  return points[0];
}

PinholeCamera cameraOf(const py::object& argument, py::ssize_t height, py::ssize_t width) {
  const py::array_t<double> matrix = matrixOf(argument, "K", 3);
  const auto at = matrix.unchecked<2>();
  if (at(0, 1) != 0.0 || at(1, 0) != 0.0 || at(2, 0) != 0.0 || at(2, 1) != 0.0 || at(2, 2) != 1.0)
    throw InputError("K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]; images are rectified");
  const PinholeCamera camera{
      at(0, 0), at(1, 1), at(0, 2), at(1, 2), static_cast<int>(width), static_cast<int>(height)};
  if (!std::isfinite(camera.cx) || !std::isfinite(camera.cy))
    throw InputError("the principal point of K is not finite");
  // A principal point is near the middle; a cropped image moves it, but hardly along both axes.
  constexpr double kMinScale = 2.0 / 3.0, kMaxScale = 3.0 / 2.0;
  const double columns = 2.0 * camera.cx + 1.0, rows = 2.0 * camera.cy + 1.0;
  const auto is_other = [](double of_K, double of_image) {
    return of_K < kMinScale * of_image || of_K > kMaxScale * of_image;
  };
  if (camera.fx > 0.0 && camera.fy > 0.0 && is_other(columns, camera.width) &&
      is_other(rows, camera.height))
    throw InputError("K is of images of another size: its principal point (" +
                     std::string(py::str(py::float_(camera.cx))) + ", " +
                     std::string(py::str(py::float_(camera.cy))) + ") is the middle of about " +
                     std::to_string(std::lround(columns)) + " x " +
                     std::to_string(std::lround(rows)) + " pixels, the image has " +
                     std::to_string(width) + " x " + std::to_string(height));
  return camera;
}

py::array_t<double> toArray(const Pose& pose) {
  py::array_t<double> matrix({4, 4});
  PoseMatrix::Map(matrix.mutable_data()) = pose.matrix();
  return matrix;
}

py::array toArray(const std::vector<Cuboid>& cuboids) {
  py::array_t<CuboidRow> rows(static_cast<py::ssize_t>(cuboids.size()));
  CuboidRow* row = rows.mutable_data();
  for (const Cuboid& cuboid : cuboids) {
    Vector3::Map(row->center) = cuboid.center;
    Vector3::Map(row->size) = cuboid.size;
    Vector4::Map(row->orientation) = cuboid.orientation.coeffs();
    row->plane_id = cuboid.plane_id;
    row->probability = cuboid.probability;
    row->state = static_cast<std::uint8_t>(cuboid.state);
    ++row;
  }
  return std::move(rows);
}

py::array toArray(const std::vector<MapPlane>& planes) {
  py::array_t<PlaneRow> rows(static_cast<py::ssize_t>(planes.size()));
  PlaneRow* row = rows.mutable_data();
  for (const MapPlane& plane : planes) {
    row->id = plane.id;
    row->frames = plane.frames;
    Vector3::Map(row->normal) = plane.plane.normal;
    row->offset = plane.plane.offset;
    row->rms = plane.rms();
    ++row;
  }
  return std::move(rows);
}

}  // namespace planar_mapping::python
