// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "planar_mapping/atlas/atlas_localizer.h"
#include "planar_mapping/atlas/atlas_parts.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/keyframe_maker.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::python {
namespace {

/// A planar_mapping.PlanarMap, whose class is another module's: from the bytes of its file.
py::object pythonMapOf(const PlanarMap& map) {
  const std::vector<std::uint8_t> bytes = [&map]() {
    const py::gil_scoped_release released;
    return map.serialize();
  }();
  const py::object type = py::module_::import("planar_mapping._native").attr("PlanarMap");
  py::object made = type.attr("__new__")(type);
  made.attr("__setstate__")(py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  return made;
}

template <typename T>
py::array_t<T> copyOf(const T* values, std::vector<py::ssize_t> shape) {
  return py::array_t<T>(std::move(shape), values);
}

py::dict rowOf(const AtlasSession& session) {
  py::dict row;
  row["id"] = session.id;
  row["source"] = session.source;
  row["configuration"] = session.configuration;
  return row;
}

py::dict rowOf(const Submap& submap) {
  py::dict row;
  row["id"] = submap.id;
  row["session"] = submap.session;
  row["component"] = submap.component;
  row["T"] = toArray(submap.T_world_submap);
  row["map"] = pythonMapOf(*submap.map);
  return row;
}

py::dict rowOf(const Keyframe& keyframe) {
  const auto features = static_cast<py::ssize_t>(keyframe.sightings.size());
  const auto across = static_cast<py::ssize_t>(keyframe.cells_across);
  const auto cells = static_cast<py::ssize_t>(keyframe.inverse_depths.size());
  const FeatureCamera& camera = keyframe.camera;
  const double K[] = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  py::dict row;
  row["id"] = keyframe.id;
  row["submap"] = keyframe.submap;
  row["frame"] = keyframe.frame;
  row["source"] = keyframe.source;
  row["timestamp"] = keyframe.timestamp;
  row["T"] = toArray(keyframe.T_submap_keyframe);
  row["K"] = copyOf(K, {3, 3});
  row["size"] = py::make_tuple(keyframe.width, keyframe.height);
  row["features"] =
      copyOf(reinterpret_cast<const double*>(keyframe.sightings.data()), {features, 3});
  row["descriptors"] = copyOf(keyframe.descriptors.data(),
                              {features, static_cast<py::ssize_t>(keyframe.descriptor_bytes)});
  row["inverse_depths"] = copyOf(keyframe.inverse_depths.data(),
                                 {across > 0 ? cells / across : py::ssize_t{0}, across});
  row["thumbnail"] = py::bytes(reinterpret_cast<const char*>(keyframe.thumbnail.data()),
                               keyframe.thumbnail.size());
  std::vector<double> points;
  for (const std::int16_t value : keyframe.points) points.push_back(keyframe.point_step * value);
  row["points"] = copyOf(points.data(), {static_cast<py::ssize_t>(points.size() / 3), 3});
  row["is_scan"] = keyframe.is_scan;
  return row;
}

void addEvidence(const LinkEvidence& evidence, py::dict& row) {
  row["inliers"] = evidence.inliers;
  row["matches"] = evidence.matches;
  row["off_plane"] = evidence.off_plane;
  row["log_odds"] = evidence.log_odds;
  row["agreement"] = evidence.agreement;
  row["seen_through"] = evidence.seen_through;
}

py::dict rowOf(const Link& link) {
  const auto keyframe = [](std::int64_t id) {
    return id < 0 ? py::object(py::none()) : py::int_(id);
  };
  py::dict row;
  row["id"] = link.id;
  row["kind"] = wordOf(link.kind);
  row["state"] = wordOf(link.state);
  row["from_submap"] = link.from_submap;
  row["to_submap"] = link.to_submap;
  row["from_keyframe"] = keyframe(link.from_keyframe);
  row["to_keyframe"] = keyframe(link.to_keyframe);
  row["T"] = toArray(link.T_to_from);
  row["covariance"] = copyOf(link.covariance.data(), {6, 6});
  addEvidence(link.evidence, row);
  row["residual"] = link.residual;
  return row;
}

/// (H, W) or (H, W, 3) bytes as a gray image.
io::Image grayOf(const py::array& array) {
  if (!py::isinstance<py::array_t<std::uint8_t>>(array))
    throw py::type_error("the image must be of uint8, not of " +
                         std::string(py::str(array.dtype())));
  const bool is_color = array.ndim() == 3 && array.shape(2) == 3;
  if ((array.ndim() != 2 && !is_color) || array.size() == 0)
    throw InputError("the image must have the shape (H, W) or (H, W, 3), not " +
                     std::string(py::str(array.attr("shape"))));
  const auto values = py::array_t<std::uint8_t, py::array::c_style>::ensure(array);
  return io::toGray({static_cast<int>(array.shape(1)),
                     static_cast<int>(array.shape(0)),
                     is_color ? 3 : 1,
                     {values.data(), values.data() + values.size()}});
}

py::dict rowOf(const Place& place) {
  py::dict row;
  row["component"] = place.component;
  row["session"] = place.session;
  row["submap"] = place.submap;
  row["keyframe"] = place.keyframe;
  row["T"] = toArray(place.T_world_sensor);
  row["covariance"] = copyOf(place.covariance.data(), {6, 6});
  addEvidence(place.evidence, row);
  return row;
}

/// The file as it was when it was read, or solved.
class AtlasFile {
 public:
  explicit AtlasFile(const std::filesystem::path& path) : path_(path.string()) {
    const py::gil_scoped_release released;
    data_ = loadAtlas(path_, 0);
  }

  template <auto Rows>
  py::list rows() const {
    py::list list;
    for (const auto& row : data_.*Rows) list.append(rowOf(row));
    return list;
  }
  py::object map(std::optional<std::int64_t> component) const {
    const PlanarMap joined = [&]() {
      const py::gil_scoped_release released;
      return joinSubmaps(data_, chosen(component));
    }();
    return pythonMapOf(joined);
  }
  py::tuple trajectory(std::optional<std::int64_t> component) const {
    const std::vector<io::StampedPose> poses = keyframePoses(data_, chosen(component));
    const auto count = static_cast<py::ssize_t>(poses.size());
    py::array_t<double> times(count);
    py::array_t<double> matrices({count, py::ssize_t{4}, py::ssize_t{4}});
    for (py::ssize_t i = 0; i < count; ++i) {
      times.mutable_at(i) = poses[static_cast<std::size_t>(i)].timestamp;
      PoseMatrix::Map(matrices.mutable_data() + 16 * i) =
          poses[static_cast<std::size_t>(i)].pose.matrix();
    }
    return py::make_tuple(times, matrices);
  }
  std::vector<std::int64_t> solve(const std::vector<std::int64_t>& without_loops,
                                  const std::vector<std::int64_t>& with_loops) {
    const py::gil_scoped_release released;
    AtlasStore store = AtlasStore::open(path_, AtlasAccess::Write);
    AtlasData data = store.load(0);
    setLoopStates(data, without_loops, LinkState::Refused);
    setLoopStates(data, with_loops, LinkState::Used);
    const PoseGraphResult result = solvePoseGraph(data);
    store.update(data);
    localizer_.reset();
    data_ = std::move(data);
    return result.moved;
  }
  py::object localize(const py::array& image, const py::object& xyz, const py::object& K) {
    const io::Image gray = grayOf(image);
    const Cloud cloud(xyz, "xyz");
    FeatureCamera camera;
    camera.setPinhole(cameraOf(K, gray.height, gray.width));
    return placeOf(makeKeyframe(gray, cloud.view(), camera));
  }
  py::object localizeScan(const py::object& xyz) {
    return placeOf(makeKeyframe(Cloud(xyz, "xyz").view(), true));
  }
  std::string text() const {
    return "<Atlas of " + std::to_string(data_.submaps.size()) + " submaps, " +
           std::to_string(data_.keyframes.size()) + " keyframes, " +
           std::to_string(data_.links.size()) + " links>";
  }

 private:
  py::object placeOf(const Keyframe& frame) {
    if (!localizer_) localizer_ = std::make_unique<AtlasLocalizer>(data_);
    const std::optional<Place> place = localizer_->find(frame);
    return place ? py::object(rowOf(*place)) : py::none();
  }
  /// None is that of the first submap.
  std::int64_t chosen(std::optional<std::int64_t> component) const {
    if (data_.submaps.empty()) throw InputError(path_ + ": has no submaps");
    const std::vector<std::int64_t> all = componentsOf(data_);
    if (component && std::find(all.begin(), all.end(), *component) == all.end())
      throw InputError(path_ + ": has no component " + std::to_string(*component));
    return component.value_or(all.front());
  }

  std::string path_;
  AtlasData data_;
  std::unique_ptr<AtlasLocalizer> localizer_;  ///< of data_, once a frame was asked for
};

}  // namespace
}  // namespace planar_mapping::python

PYBIND11_MODULE(_atlas, module) {
  using namespace planar_mapping;
  using namespace planar_mapping::python;
  using namespace py::literals;
  py::module_::import("planar_mapping._native");  // its errors
  py::class_<AtlasFile>(module, "Atlas")
      .def(py::init<const std::filesystem::path&>(), "path"_a)
      .def("sessions", &AtlasFile::rows<&AtlasData::sessions>)
      .def("submaps", &AtlasFile::rows<&AtlasData::submaps>)
      .def("keyframes", &AtlasFile::rows<&AtlasData::keyframes>)
      .def("links", &AtlasFile::rows<&AtlasData::links>)
      .def("map", &AtlasFile::map)
      .def("trajectory", &AtlasFile::trajectory)
      .def("solve", &AtlasFile::solve)
      .def("localize", &AtlasFile::localize)
      .def("localize_scan", &AtlasFile::localizeScan)
      .def("__repr__", &AtlasFile::text);
}
