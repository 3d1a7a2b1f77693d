// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What is read of files frame by frame, and poses of clouds that have none.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "arrays.h"
#include "paths.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/localization/registration/surface_map.h"

namespace planar_mapping::python {
namespace {

using namespace py::literals;
using Path = std::filesystem::path;

py::array_t<double> matrixOf(const PinholeCamera& camera) {
  py::array_t<double> K({3, 3});
  auto at = K.mutable_unchecked<2>();
  const double rows[3][3] = {{camera.fx, 0.0, camera.cx}, {0.0, camera.fy, camera.cy}, {0, 0, 1}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) at(i, j) = rows[i][j];
  return K;
}

py::tuple readPoses(const Path& path) {
  io::Trajectory read;
  {
    const py::gil_scoped_release released;
    read = io::readTrajectory(path.string());
  }
  const auto count = static_cast<py::ssize_t>(read.poses.size());
  py::array_t<double> times(count);
  py::array_t<double> poses({count, py::ssize_t{4}, py::ssize_t{4}});
  for (py::ssize_t i = 0; i < count; ++i) {
    const io::StampedPose& stamped = read.poses[static_cast<std::size_t>(i)];
    times.mutable_at(i) = stamped.timestamp;
    PoseMatrix::Map(poses.mutable_data(i)) = stamped.pose.matrix();
  }
  return py::make_tuple(times, poses);
}

py::dict toDict(const io::Calibration& calibration) {
  const PinholeCamera& camera = calibration.camera;
  return py::dict("K"_a = matrixOf(camera), "size"_a = py::make_tuple(camera.width, camera.height),
                  "baseline"_a = calibration.baseline, "depth_scale"_a = calibration.depth_scale,
                  "along_ray"_a = calibration.depth_along_ray,
                  "rectified"_a = !calibration.distortion && !calibration.unrectified);
}

io::Sequence openSequence(const py::object& inputs, const std::optional<Path>& poses,
                          const std::optional<Path>& calibration, double scale) {
  io::SequenceOptions options;
  options.poses_file = poses.value_or(Path()).string();
  options.calibration_file = calibration.value_or(Path()).string();
  options.scale = scale;
  const std::vector<std::string> paths = pathsOf(inputs);
  const py::gil_scoped_release released;
  return io::Sequence(paths, options);
}

py::object imageOf(io::Image image) {
  if (image.empty()) return py::none();
  std::vector<py::ssize_t> shape = {image.height, image.width};
  if (image.channels > 1) shape.push_back(image.channels);
  return toArray(std::move(image.pixels), shape);
}

py::dict frameOf(const io::Sequence& self, py::ssize_t index) {
  const auto count = static_cast<py::ssize_t>(self.size());
  if (index < 0) index += count;
  if (index < 0 || index >= count) throw py::index_error("a sequence of " + std::to_string(count));
  io::Frame frame;
  {
    const py::gil_scoped_release released;
    frame = self.read(static_cast<std::size_t>(index), io::CloudChannels::none());
  }
  py::object xyz = py::none();
  if (frame.cloud.size() > 0) xyz = pointsOf(std::move(frame.cloud));
  return py::dict(
      "name"_a = frame.name, "timestamp"_a = frame.timestamp,
      "T"_a = frame.T_world_sensor ? py::object(toArray(*frame.T_world_sensor)) : py::none(),
      "K"_a = frame.camera ? py::object(matrixOf(*frame.camera)) : py::none(), "xyz"_a = xyz,
      "left"_a = imageOf(std::move(frame.left)), "right"_a = imageOf(std::move(frame.right)));
}

/// Poses of clouds, one after the other.
class Odometry {
 public:
  Odometry(bool scanner, std::optional<double> cell)
      : params_(scanner ? SurfaceMapParams::ofScanner() : SurfaceMapParams()),
        chooses_cell_(!cell) {
    if (cell) params_.cell = *cell;
    params_.validate();
  }

  py::object add(const py::object& xyz, const py::object& guess) {
    const Cloud cloud(xyz, "xyz");
    // Without a guess the sensor goes on as it moved between the last two clouds.
    const Pose expected = guess.is_none() ? last_ * motion_ : poseOf(guess, "guess");
    const std::optional<Pose> pose = place(cloud.view(), expected);
    if (!pose) return py::none();
    return toArray(*pose);
  }

 private:
  std::optional<Pose> place(const PointsView& points, const Pose& expected) {
    const py::gil_scoped_release released;
    Pose pose = expected;
    if (!map_) {
      if (chooses_cell_) params_.cell = surfaceCellFor(points, params_);
      map_.emplace(params_);
      last_ = pose;
    } else {
      const CloudRegistration found = map_->locate(points, expected, lost_);
      if (!found.found) {
        ++lost_;
        return std::nullopt;
      }
      pose = found.T_world_sensor;
    }
    motion_ = lost_ > 0 ? Pose::Identity() : last_.inverse() * pose;
    lost_ = 0;
    last_ = pose;
    map_->insert(points, pose);
    return pose;
  }

  SurfaceMapParams params_;
  bool chooses_cell_;
  std::optional<SurfaceMap> map_;
  Pose last_ = Pose::Identity();
  Pose motion_ = Pose::Identity();
  int lost_ = 0;
};

}  // namespace

void addSequences(py::module_& module) {
  module.def("read_poses", &readPoses, "path"_a);
  module.def(
      "read_calibration",
      [](const Path& path) { return toDict(io::readCalibration(path.string())); }, "path"_a);
  py::class_<io::Sequence>(module, "Sequence")
      .def(py::init(&openSequence), "inputs"_a, py::kw_only(), "poses"_a = py::none(),
           "calibration"_a = py::none(), "scale"_a = 1.0)
      .def("__len__", &io::Sequence::size)
      .def("__getitem__", &frameOf, "index"_a)
      .def_property_readonly("layout", &io::Sequence::layout)
      .def_property_readonly("notes", &io::Sequence::notes)
      .def_property_readonly("calibration",
                             [](const io::Sequence& self) {
                               return self.calibration() ? py::object(toDict(*self.calibration()))
                                                         : py::none();
                             })
      .def("__repr__", [](const io::Sequence& self) {
        return "<Sequence: " + self.layout() + ", " + std::to_string(self.size()) + " frames>";
      });
  py::class_<Odometry>(module, "Odometry")
      .def(py::init<bool, std::optional<double>>(), py::kw_only(), "scanner"_a = false,
           "cell"_a = py::none())
      .def("add", &Odometry::add, "xyz"_a, "guess"_a = py::none());
}

}  // namespace planar_mapping::python
