// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <utility>

#include "arrays.h"
#include "frames.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/export/exported_map.h"
#include "planar_mapping/io/export/map_export.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/plan/plan.h"

namespace planar_mapping::python {
namespace {

/// The map behind planar_mapping.PlanarMap. Work on it releases the interpreter's lock, so Python's
/// threads need one of its own: readers together, a writer alone. Functions given to it must not
/// touch Python objects.
class SharedMap {
 public:
  /// \param first  begins a map without frames: what was not set is found from it
  explicit SharedMap(PlanarMap map, std::optional<FrameInput> first = std::nullopt)
      : first_(std::move(first)), map_(std::move(map)) {}

  const std::optional<FrameInput>& first() const { return first_; }

  template <typename Function>
  auto read(Function function) const {
    const pybind11::gil_scoped_release released;
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    return function(map_);
  }
  template <typename Function>
  auto change(Function function) {
    const pybind11::gil_scoped_release released;
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    return function(map_);
  }

 private:
  std::optional<FrameInput> first_;
  PlanarMap map_;
  mutable std::shared_mutex mutex_;
};

using MapPointer = std::unique_ptr<SharedMap>;

MapPointer makeMap(std::optional<double> resolution, const std::string& profile, double max_range,
                   const py::object& up, bool unknown_space,
                   const std::optional<std::string>& unseen, std::optional<double> min_probability,
                   int threads) {
  PlanarMapParams params = PlanarMapParams::of(profileOf(profile));
  params.approximation.threads = threads;
  params.max_range = max_range;
  params.unknown_space = unknown_space;
  if (unseen)
    params.unseen =
        wordOf<Unseen>("unseen", *unseen, {{"unknown", Unseen::Unknown}, {"free", Unseen::Free}});
  if (min_probability) params.min_probability = *min_probability;
  params.validate();
  FrameInput first(params);
  if (resolution) first.setResolution(*resolution);
  if (!up.is_none()) first.setUpDirection(vectorOf(up, "up"));
  return std::make_unique<SharedMap>(PlanarMap(first.getParams()), first);
}

MapPointer load(const std::filesystem::path& path) {
  const py::gil_scoped_release released;
  return std::make_unique<SharedMap>(io::loadMap(path.string()));
}

io::Overwrite overwriteOf(bool allowed) {
  return allowed ? io::Overwrite::Allow : io::Overwrite::Refuse;
}

/// Rows of a plan, the row of smallest y first.
template <typename Value>
py::array_t<Value> gridOf(const Plan& plan, const std::vector<Value>& values) {
  py::array_t<Value> grid({plan.height, plan.width});
  std::copy(values.begin(), values.end(), grid.mutable_data());
  return grid;
}

/// Corners and triangles of all cuboids.
py::tuple meshOf(const SharedMap& self) {
  const std::vector<Cuboid> cuboids = self.read([](const PlanarMap& map) { return map.cuboids(); });
  std::vector<double> vertices;
  std::vector<std::int32_t> faces;
  for (const Cuboid& cuboid : cuboids) {
    const auto first = static_cast<std::int32_t>(vertices.size() / 3);
    for (const Vector3& corner : corners(cuboid))
      vertices.insert(vertices.end(), {corner.x(), corner.y(), corner.z()});
    for (const auto& triangle : io::kTriangles)
      for (const int corner : triangle) faces.push_back(first + corner);
  }
  const auto vertex_count = static_cast<py::ssize_t>(vertices.size() / 3);
  const auto face_count = static_cast<py::ssize_t>(faces.size() / 3);
  return py::make_tuple(toArray(std::move(vertices), {vertex_count, 3}),
                        toArray(std::move(faces), {face_count, 3}));
}

/// Of a box, and the indices of the cuboids that meet it.
py::tuple stateOf(const SharedMap& self, const py::object& low, const py::object& high) {
  const Vector3 lowest = vectorOf(low, "low"), highest = vectorOf(high, "high");
  BoxState box = self.read([&](const PlanarMap& map) { return stateOfBox(map, lowest, highest); });
  const auto count = static_cast<py::ssize_t>(box.cuboids.size());
  return py::make_tuple(static_cast<int>(box.state), toArray(std::move(box.cuboids), {count}));
}

void exportTo(const SharedMap& self, const std::filesystem::path& path, bool unknown, double cell,
              const RobotModel& robot, bool distance, bool surface, double spacing,
              const std::string& frame_id, bool overwrite) {
  io::ExportOptions options;
  options.unknown = unknown;
  options.cell = cell;
  options.robot = robot;
  options.distance = distance;
  options.points = surface ? io::ExportedPoints::Surface : io::ExportedPoints::Centers;
  options.spacing = spacing;
  options.frame_id = frame_id;
  options.overwrite = overwriteOf(overwrite);
  self.read([&](const PlanarMap& map) { io::exportMap(map, path.string(), options); });
}

FrameUpdate insertFrame(SharedMap& self, FrameInput& frame, const Segmentation* planes,
                        std::optional<double> distance_threshold, std::optional<int> min_inliers,
                        double timestamp) {
  frame.setTimestamp(timestamp);
  return self.change([&](PlanarMap& map) {
    if (map.frames() == 0 && self.first()) map = PlanarMap(frame.paramsOfMap());
    const CuboidApproximationParams& approximation = map.params().approximation;
    frame.setPlaneSearch(planes, distance_threshold, min_inliers, approximation.resolution);
    frame.search.threads = approximation.threads;
    return frame.insertInto(map);
  });
}

void setPose(FrameInput& frame, const py::object& T) {
  if (T.is_none()) return;
  frame.T_world_sensor = poseOf(T, "T");
  frame.setSensorPose(frame.T_world_sensor);
}

FrameUpdate insert(SharedMap& self, const py::object& xyz, const py::object& T,
                   const Segmentation* planes, std::optional<double> distance_threshold,
                   std::optional<int> min_inliers, double timestamp, const py::object& K,
                   const py::object& origin) {
  const Cloud cloud(xyz, "xyz");
  FrameInput frame = self.first().value_or(FrameInput());
  frame.points = cloud.view();
  setPose(frame, T);
  if (!origin.is_none()) {
    if (!T.is_none() || !K.is_none())
      throw InputError(
          "a cloud has the origin of its sensor, or a pose T and a camera K, not both");
    frame.setSensorOrigin(vectorOf(origin, "origin"));
  }
  if (!K.is_none()) {
    if (cloud.shape().size() != 2) throw InputError("K belongs to an organized cloud, (H, W, 3)");
    frame.setCamera(cameraOf(K, cloud.shape()[0], cloud.shape()[1]));
  }
  return insertFrame(self, frame, planes, distance_threshold, min_inliers, timestamp);
}

/// Metres of a depth image that cannot be: none of its measurements is nearer than \p max_depth, or
/// all are nearer than depth cameras measure.
void requireDepths(const io::CloudData& cloud, double depth_scale, double max_depth) {
  constexpr float kNearest = 0.01f;  // metres
  const PointsView points = cloud.view();
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0.0f;
  for (std::size_t i = 0; i < points.size; ++i) {
    if (!points.isMeasured(i)) continue;
    nearest = std::min(nearest, points[i][2]);
    farthest = std::max(farthest, points[i][2]);
  }
  const auto number = [](double value) { return std::string(py::str(py::float_(value))); };
  const std::string advice = "; is depth_scale = " + number(depth_scale) +
                             " (values a metre) right? None takes floats as metres, integers as "
                             "millimetres";
  if (farthest > 0.0f && nearest > max_depth)
    throw InputError("all depths are beyond max_depth = " + number(max_depth) +
                     " m, the nearest is " + number(nearest) + " m" + advice);
  if (farthest > 0.0f && farthest < kNearest)
    throw InputError("all depths are below 1 cm, the farthest is " + number(farthest) + " m" +
                     advice);
}

FrameUpdate insertDepth(SharedMap& self, const py::array& image, const py::object& K,
                        std::optional<double> depth_scale, const py::object& T, bool along_ray,
                        double max_depth, std::optional<double> distance_threshold,
                        std::optional<int> min_inliers, double timestamp) {
  if (image.ndim() != 2 || image.size() == 0)
    throw InputError("the depth image must have the shape (H, W), not " +
                     std::string(py::str(image.attr("shape"))));
  const PinholeCamera camera = cameraOf(K, image.shape(0), image.shape(1));
  const auto width = static_cast<std::uint32_t>(image.shape(1));
  const auto height = static_cast<std::uint32_t>(image.shape(0));
  const char kind = image.dtype().kind();
  const double scale = depth_scale.value_or(kind == 'f' ? 1.0 : 1000.0);
  const io::DepthProjector projector(camera, scale, along_ray);
  io::CloudData cloud;
  if (py::isinstance<py::array_t<std::uint16_t>>(image)) {
    const auto values = py::array_t<std::uint16_t, py::array::c_style>::ensure(image);
    projector.project({width, height, {values.data(), values.data() + values.size()}}, cloud);
  } else if (kind == 'f' || kind == 'i' || kind == 'u') {
    const auto values =
        py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(image);
    projector.project(values.data(), cloud);
  } else {
    throw py::type_error("the depth image must be of numbers, not of " +
                         std::string(py::str(image.dtype())));
  }
  FrameInput frame = self.first().value_or(FrameInput());
  frame.points = cloud.view();
  setPose(frame, T);
  frame.setCamera(camera);
  requirePositive("max_depth", max_depth, "m");
  requireDepths(cloud, scale, max_depth);
  frame.max_depth = max_depth;
  return insertFrame(self, frame, nullptr, distance_threshold, min_inliers, timestamp);
}

/// \param ask  what is asked of the map at each point
template <typename Value, typename Ask>
py::array askAt(const SharedMap& self, const py::object& argument, const Ask& ask) {
  const Points points(argument, "points");
  py::array_t<Value> values(static_cast<py::ssize_t>(points.size()));
  Value* out = values.mutable_data();
  self.read([&](const PlanarMap& map) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = ask(map, points[i]);
  });
  return std::move(values);
}

py::array state(const SharedMap& self, const py::object& points) {
  return askAt<std::uint8_t>(self, points, [](const PlanarMap& map, const Vector3& point) {
    return static_cast<std::uint8_t>(map.stateAt(point));
  });
}

py::array probability(const SharedMap& self, const py::object& points) {
  return askAt<double>(self, points, [](const PlanarMap& map, const Vector3& point) {
    return map.occupancyAt(point);
  });
}

HitRow hitOf(const std::optional<RayHit>& hit) {
  if (!hit) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    return {std::numeric_limits<double>::infinity(),
            {kNaN, kNaN, kNaN},
            -1,
            static_cast<std::uint8_t>(CellState::Free)};
  }
  return {hit->distance,
          {hit->point.x(), hit->point.y(), hit->point.z()},
          hit->cuboid,
          static_cast<std::uint8_t>(hit->state)};
}

py::array castRays(const SharedMap& self, const py::object& from, const py::object& along,
                   double range, bool through_unknown) {
  const Points origins(from, "origins");
  const Points directions(along, "directions");
  const std::size_t count = std::max(origins.size(), directions.size());
  if ((origins.size() != count && !origins.isSinglePoint()) ||
      (directions.size() != count && !directions.isSinglePoint())) {
    throw InputError("there are " + std::to_string(origins.size()) + " origins, but " +
                     std::to_string(directions.size()) + " directions");
  }
  const UnknownSpaceIs unknown =
      through_unknown ? UnknownSpaceIs::Transparent : UnknownSpaceIs::AnObstacle;
  py::array_t<HitRow> hits(static_cast<py::ssize_t>(count));
  HitRow* out = hits.mutable_data();
  self.read([&](const PlanarMap& map) {
    for (std::size_t i = 0; i < count; ++i) {
      try {
        const Vector3 origin = origins[origins.isSinglePoint() ? 0 : i];
        const Vector3 direction = directions[directions.isSinglePoint() ? 0 : i];
        const std::optional<RayHit> hit = castRay(map, origin, direction, range, unknown);
        out[i] = hitOf(hit);
        if (!hit && through_unknown)
          out[i].state = static_cast<std::uint8_t>(stateAlong(map, origin, direction, range));
      } catch (const ParameterError& error) {
        throw ParameterError("ray " + std::to_string(i) + ": " + error.what());
      }
    }
  });
  return std::move(hits);
}

py::tuple trajectory(const SharedMap& self) {
  const auto poses = self.read([](const PlanarMap& map) { return map.trajectory(); });
  const auto count = static_cast<py::ssize_t>(poses.size());
  py::array_t<double> times(count);
  py::array_t<double> matrices({count, py::ssize_t{4}, py::ssize_t{4}});
  for (py::ssize_t i = 0; i < count; ++i) {
    const auto& [time, pose] = poses[static_cast<std::size_t>(i)];
    times.mutable_at(i) = time;
    PoseMatrix::Map(matrices.mutable_data() + 16 * i) = pose.matrix();
  }
  return py::make_tuple(times, matrices);
}

py::object bounds(const SharedMap& self) {
  Vector3 low, high;
  if (!self.read([&](const PlanarMap& map) { return map.bounds(low, high); })) return py::none();
  py::array_t<double> corners({2, 3});
  Vector3::Map(corners.mutable_data()) = low;
  Vector3::Map(corners.mutable_data() + 3) = high;
  return std::move(corners);
}

py::array_t<double> origin(const SharedMap& self) {
  const Vector3 at = self.read([](const PlanarMap& map) { return map.params().origin; });
  return py::array_t<double>(3, at.data());
}

FrameUpdate merge(SharedMap& self, const SharedMap& other, const py::object& T) {
  const Pose T_map_other = poseOf(T, "T");
  const PlanarMap copy = other.read([](const PlanarMap& map) { return map; });
  return self.change([&](PlanarMap& map) {
    if (map.frames() == 0 && self.first()) map = PlanarMap(copy.params());
    return map.merge(copy, T_map_other);
  });
}

MapPointer copyOf(const SharedMap& self) {
  return std::make_unique<SharedMap>(self.read([](const PlanarMap& map) { return map; }),
                                     self.first());
}

py::bytes serialize(const SharedMap& self) {
  const auto bytes = self.read([](const PlanarMap& map) { return map.serialize(); });
  return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

MapPointer deserialize(const py::bytes& bytes) {
  const auto text = static_cast<std::string_view>(bytes);
  const py::gil_scoped_release released;
  return std::make_unique<SharedMap>(
      PlanarMap::deserialize(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

/// What a function of the map gives, copied without the interpreter's lock: another thread may
/// change the map.
template <auto Function>
auto resultOf(const SharedMap& self) {
  return self.read([](const PlanarMap& map) { return (map.*Function)(); });
}

/// A property of the map that is a number.
template <auto Function>
auto number() {
  return [](const SharedMap& self) { return resultOf<Function>(self); };
}

/// A list of the map as a structured array.
template <auto Function>
auto rows() {
  return [](const SharedMap& self) { return toArray(resultOf<Function>(self)); };
}

std::string textOf(const SharedMap& self) {
  return self.read([](const PlanarMap& map) {
    return "<PlanarMap of " + detail::counted(map.frames(), "frame") + ": " +
           detail::counted(map.planes().size(), "plane") + ", " +
           detail::counted(map.cuboidCount(), "cuboid") + ">";
  });
}

}  // namespace

void addMap(py::module_& module) {
  using namespace py::literals;
  py::class_<FrameUpdate>(module, "FrameUpdate")
      .def_readonly("planes_new", &FrameUpdate::planes_new)
      .def_readonly("planes_matched", &FrameUpdate::planes_matched)
      .def_readonly("planes_merged", &FrameUpdate::planes_merged)
      .def_readonly("cells_added", &FrameUpdate::cells_added)
      .def_readonly("cells_removed", &FrameUpdate::cells_removed)
      .def_readonly("dropped_points", &FrameUpdate::dropped_points)
      .def("__repr__", [](const FrameUpdate& self) {
        return "<FrameUpdate: planes_new=" + std::to_string(self.planes_new) +
               " planes_matched=" + std::to_string(self.planes_matched) +
               " cells_added=" + std::to_string(self.cells_added) +
               " cells_removed=" + std::to_string(self.cells_removed) + ">";
      });
  const RobotModel usual;
  py::class_<RobotModel>(module, "Robot", "The robot that a plan is made for; metres, radians.")
      .def(py::init([](double height, double radius, double max_step, double max_slope,
                       double camera_height) {
             const RobotModel robot{height, radius, max_step, max_slope, camera_height};
             robot.validate();
             return robot;
           }),
           py::kw_only(), "height"_a = usual.height, "radius"_a = usual.radius,
           "max_step"_a = usual.max_step, "max_slope"_a = usual.max_slope,
           "camera_height"_a = usual.camera_height)
      .def_readwrite("height", &RobotModel::height)
      .def_readwrite("radius", &RobotModel::radius)
      .def_readwrite("max_step", &RobotModel::max_step)
      .def_readwrite("max_slope", &RobotModel::max_slope)
      .def_readwrite("camera_height", &RobotModel::camera_height);
  py::class_<Plan>(module, "Plan", "A storey from above: 0 free, 100 occupied, -1 unknown.")
      .def_readonly("cell", &Plan::cell)
      .def_readonly("floor", &Plan::floor)
      .def_readonly("note", &Plan::note)
      .def_property_readonly("origin",
                             [](const Plan& p) { return std::pair(p.origin.x(), p.origin.y()); })
      .def_property_readonly("values", [](const Plan& p) { return gridOf(p, p.values); })
      .def_property_readonly("heights", [](const Plan& p) { return gridOf(p, p.heights); })
      .def(
          "distances", [](const Plan& p) { return gridOf(p, p.distances()); },
          "Metres to the nearest occupied cell.")
      .def("is_standable", &Plan::isStandable, "x"_a, "y"_a);
  py::class_<SharedMap>(module, "PlanarMap", "A map of planar cuboids; world frame, z up, metres.")
      .def(py::init(&makeMap), "resolution"_a = py::none(), py::kw_only(), "profile"_a = "compact",
           "max_range"_a = 0.0, "up"_a = py::none(), "unknown_space"_a = true,
           "unseen"_a = py::none(), "min_probability"_a = py::none(), "threads"_a = 1)
      .def_static("load", &load, "path"_a, "Reads a .pmap file; the map uses all cores.")
      .def(
          "save",
          [](const SharedMap& self, const std::filesystem::path& path, bool overwrite) {
            if (path.has_extension() && path.extension() != ".pmap")
              throw ParameterError(path.string() +
                                   ": a map is saved as *.pmap; export() has other formats");
            self.read([&](const PlanarMap& map) {
              io::saveMap(map, path.string(), overwriteOf(overwrite));
            });
          },
          "path"_a, py::kw_only(), "overwrite"_a = false, "Writes a .pmap file.")
      .def("export", &exportTo, "path"_a, py::kw_only(), "unknown"_a = false, "cell"_a = 0.0,
           "robot"_a = RobotModel(), "distance"_a = false, "surface"_a = false, "spacing"_a = 0.0,
           "frame_id"_a = "map", "overwrite"_a = false,
           "Writes a file for other programs, as `planar_map convert` does.")
      .def(
          "insert", &insert, "xyz"_a, "T"_a = py::none(), py::kw_only(), "planes"_a = py::none(),
          "distance_threshold"_a = py::none(), "min_inliers"_a = py::none(), "timestamp"_a = 0.0,
          "K"_a = py::none(), "origin"_a = py::none(),
          "Adds a cloud of the sensor's frame, T = T_world_sensor; or of the world with the origin "
          "of its rays.")
      .def(
          "insert_depth", &insertDepth, "image"_a, "K"_a, "depth_scale"_a = py::none(),
          "T"_a = py::none(), py::kw_only(), "along_ray"_a = false, "max_depth"_a = 8.0,
          "distance_threshold"_a = py::none(), "min_inliers"_a = py::none(), "timestamp"_a = 0.0,
          "Adds a depth image of a pinhole camera; T = T_world_camera. Values are depths along the "
          "camera's axis, with along_ray distances along the rays of the pixels.")
      .def("merge", &merge, "other"_a, "T"_a = py::none(), "Adds another map; T = T_map_other.")
      .def(
          "finished",
          [](const SharedMap& self) {
            return std::make_unique<SharedMap>(
                self.read([](const PlanarMap& map) { return map.finished(); }));
          },
          "The map without what only further frames need.")
      .def(
          "plans",
          [](const SharedMap& self, const RobotModel& robot, double cell) {
            return self.read([&](const PlanarMap& map) { return plansOf(map, robot, cell); });
          },
          "robot"_a = RobotModel(), "cell"_a = 0.0, "The plans of all storeys, the lowest first.")
      .def(
          "plan",
          [](const SharedMap& self, const RobotModel& robot, double cell, std::size_t storey) {
            return self.read(
                [&](const PlanarMap& map) { return plansOf(map, robot, cell).at(storey); });
          },
          "robot"_a = RobotModel(), "cell"_a = 0.0, "storey"_a = 0, "The plan of a storey.")
      .def("cuboids", rows<&PlanarMap::cuboids>(), "Occupied cuboids.")
      .def("unknown_cuboids", rows<&PlanarMap::unknownCuboids>(),
           "Unknown space as axis-aligned cuboids.")
      .def("free_cuboids", rows<&PlanarMap::freeCuboids>(), "Space that a measurement passed.")
      .def("mesh", &meshOf)
      .def("state_of_box", &stateOf, "low"_a, "high"_a)
      .def("planes", rows<&PlanarMap::planes>(), "Planes, world frame.")
      .def("trajectory", &trajectory, "Time stamps (N) and sensor poses (N, 4, 4).")
      .def("bounds", &bounds, "Corners (2, 3) of the box around the cuboids, or None.")
      .def("state", &state, "points"_a, "FREE, OCCUPIED or UNKNOWN at each of (N, 3) points.")
      .def("probability", &probability, "points"_a,
           "Belief that each of (N, 3) points is occupied.")
      .def("cast_rays", &castRays, "origins"_a, "directions"_a, "range"_a = 100.0, py::kw_only(),
           "through_unknown"_a = false, "Where each ray first meets what is not free.")
      .def_property_readonly("frames", number<&PlanarMap::frames>())
      .def_property_readonly("is_finished", number<&PlanarMap::isFinished>())
      .def_property_readonly("unknown_cells", number<&PlanarMap::unknownCells>())
      .def_property_readonly("memory_bytes", number<&PlanarMap::memoryBytes>())
      .def_property_readonly("origin", &origin)
      .def_property_readonly("resolution",
                             [](const SharedMap& self) {
                               return self.read([](const PlanarMap& map) {
                                 return map.params().approximation.resolution;
                               });
                             })
      .def("__len__", number<&PlanarMap::cuboidCount>())
      .def("__copy__", &copyOf)
      .def("__deepcopy__", [](const SharedMap& self, const py::dict&) { return copyOf(self); })
      .def("__repr__", &textOf)
      .def(py::pickle(&serialize, &deserialize));
}

}  // namespace planar_mapping::python
