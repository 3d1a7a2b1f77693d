// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>

#include "arrays.h"
#include "frames.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/depth_image.h"

namespace planar_mapping::python {
namespace {

Segmentation segment(const py::object& xyz, std::optional<double> distance_threshold,
                     std::optional<int> min_inliers, int max_planes, const std::string& method,
                     std::uint64_t seed, int threads) {
  const Cloud cloud(xyz, "xyz");
  MultiPlaneParams params;
  params.max_planes = max_planes;
  params.method = wordOf<PlaneSearchMethod>("method", method,
                                            {{"automatic", PlaneSearchMethod::Automatic},
                                             {"multi_ransac", PlaneSearchMethod::MultiRansac},
                                             {"sequential", PlaneSearchMethod::Sequential},
                                             {"organized", PlaneSearchMethod::Organized}});
  params.seed = seed;
  params.threads = threads;
  Segmentation result;
  result.shape = cloud.shape();
  result.points = cloud.view().size;
  const py::gil_scoped_release released;
  const Indices usable = usablePoints(cloud.view());
  const CloudScale scale = scaleOf(cloud.view(), usable);
  params.distance_threshold = distance_threshold.value_or(automaticThreshold(scale));
  params.min_inliers = min_inliers.value_or(automaticSmallestPlane(scale));
  result.planes = findPlanes(cloud.view(), &usable, params).planes;
  return result;
}

py::array planesOf(const Segmentation& segmentation) {
  py::array_t<SegmentRow> rows(static_cast<py::ssize_t>(segmentation.planes.size()));
  SegmentRow* row = rows.mutable_data();
  for (const PlaneSegment& segment : segmentation.planes) {
    Vector3::Map(row->normal) = segment.plane.normal;
    row->offset = segment.plane.offset;
    row->rms = segment.rms;
    row->inliers = static_cast<std::int32_t>(segment.inliers.size());
    ++row;
  }
  return std::move(rows);
}

py::array labelsOf(const Segmentation& segmentation) {
  std::vector<std::int32_t> labels(segmentation.points, -1);
  for (std::size_t k = 0; k < segmentation.planes.size(); ++k) {
    for (const int i : segmentation.planes[k].inliers)
      labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(k);
  }
  return toArray(std::move(labels), segmentation.shape);
}

/// Indices into the cloud, in the segmentation's own memory.
py::array inliersOf(const py::object& self, std::size_t plane) {
  const auto& segmentation = self.cast<const Segmentation&>();
  if (plane >= segmentation.planes.size()) throw py::index_error("there is no such plane");
  const Indices& inliers = segmentation.planes[plane].inliers;
  py::array_t<int> view({static_cast<py::ssize_t>(inliers.size())}, inliers.data(), self);
  view.attr("flags").attr("writeable") = false;
  return std::move(view);
}

py::array approximate(const py::object& xyz, const py::object& T, std::optional<double> resolution,
                      const Segmentation* planes, const std::string& profile, const py::object& up,
                      std::optional<double> distance_threshold, std::optional<int> min_inliers,
                      int threads) {
  const Cloud cloud(xyz, "xyz");
  PlanarMapParams params = PlanarMapParams::of(profileOf(profile));
  params.unknown_space = false;
  params.approximation.threads = threads;
  params.validate();
  FrameInput frame(params);
  frame.points = cloud.view();
  frame.T_world_sensor = poseOf(T, "T");
  if (resolution) frame.setResolution(*resolution);
  if (!up.is_none()) frame.setUpDirection(vectorOf(up, "up"));
  params = frame.paramsOfMap();
  frame.setPlaneSearch(planes, distance_threshold, min_inliers, params.approximation.resolution);
  frame.search.threads = threads;
  std::vector<Cuboid> cuboids;
  {
    const py::gil_scoped_release released;
    PlanarMap map(params);
    frame.insertInto(map);
    cuboids = map.cuboids();
  }
  return toArray(cuboids);
}

py::tuple readCloud(const std::filesystem::path& path) {
  io::CloudData cloud;
  {
    const py::gil_scoped_release released;
    cloud = io::readCloudFile(path.string(), io::CloudChannels::none());
  }
  const py::array_t<double> T = toArray(cloud.T_world_sensor);
  return py::make_tuple(pointsOf(std::move(cloud)), T);
}

py::array readDepth(const std::filesystem::path& path) {
  io::DepthImage image;
  {
    const py::gil_scoped_release released;
    image = io::readDepthPng(path.string());
  }
  return toArray(std::move(image.values), {image.height, image.width});
}

}  // namespace

Profile profileOf(const std::string& word) {
  return wordOf<Profile>("profile", word,
                         {{"compact", Profile::Compact}, {"paper", Profile::Paper}});
}

void FrameInput::setPlaneSearch(const Segmentation* planes,
                                std::optional<double> distance_threshold,
                                std::optional<int> min_inliers, double resolution) {
  find_planes = planes == nullptr;
  if (!find_planes) {
    if (planes->points != points.size)
      throw InputError("planes are of a cloud of " + std::to_string(planes->points) +
                       " points, this one has " + std::to_string(points.size));
    setPlanes(planes->planes);
    return;
  }
  search.distance_threshold = distance_threshold.value_or(0.5 * resolution);
  CloudScale scale;
  scale.points = usablePoints(points).size();
  search.min_inliers = min_inliers.value_or(automaticSmallestPlane(scale));
  search.validate();
}

FrameUpdate FrameInput::insertInto(PlanarMap& map) {
  std::vector<float> seen;  // for the search: planes that are given are those of the cloud as it is
  if (find_planes && getSensorOrigin()) {
    seen = seenFrom(*getSensorOrigin(), points);
    points.data = seen.data();
    points.stride = 3;
    T_world_sensor = Eigen::Translation3d(*getSensorOrigin());
    setSensorOrigin(std::nullopt);
  }
  Indices usable = usablePoints(points);
  if (max_depth > 0.0) {
    const auto too_far = [this](int i) {
      return points[static_cast<std::size_t>(i)][2] > max_depth;
    };
    usable.erase(std::remove_if(usable.begin(), usable.end(), too_far), usable.end());
  }
  const std::size_t lost = points.size - usable.size();
  if (find_planes) setPlanes(findPlanes(points, &usable, search).planes);
  FrameUpdate update = MappingInput::insertInto(map, points, &usable, T_world_sensor, 0);
  update.dropped_points += lost;
  return update;
}

void addClouds(py::module_& module) {
  using namespace py::literals;
  py::class_<Segmentation>(module, "Segmentation")
      .def_property_readonly("planes", &planesOf)
      .def_property_readonly("labels", &labelsOf)
      .def("inliers", &inliersOf, "plane"_a)
      .def("__len__", [](const Segmentation& self) { return self.planes.size(); })
      .def("__repr__", [](const Segmentation& self) {
        return "<Segmentation of " + detail::counted(self.points, "point") + ": " +
               detail::counted(self.planes.size(), "plane") + ">";
      });
  module.def("segment", &segment, "xyz"_a, py::kw_only(), "distance_threshold"_a = py::none(),
             "min_inliers"_a = py::none(), "max_planes"_a = 0, "method"_a = "automatic",
             "seed"_a = MultiPlaneParams().seed, "threads"_a = 1,
             "Finds the planes of a cloud, (N, 3) or organized (H, W, 3), metres.");
  module.def("approximate", &approximate, "xyz"_a, "T"_a = py::none(), py::kw_only(),
             "resolution"_a = py::none(), "planes"_a = py::none(), "profile"_a = "compact",
             "up"_a = py::none(), "distance_threshold"_a = py::none(), "min_inliers"_a = py::none(),
             "threads"_a = 1, "The cuboids of one cloud, as a structured array.");
  module.def("read_cloud", &readCloud, "path"_a,
             "Reads a PCD or PLY file: its points and the pose of its sensor.");
  module.def("read_depth", &readDepth, "path"_a, "Reads a PNG of 16 bits: (H, W), uint16.");
}

}  // namespace planar_mapping::python
