// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Cuboids of a 640 x 480 frame with its planes given, as a map of its own.
// Arguments: files or directories of real clouds to run as well (see io::Sequence).
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

constexpr std::uint32_t kColumns = 640;
constexpr std::uint32_t kRows = 480;

struct Frame {
  std::vector<float> points;  ///< x y z and one float of padding, as pcl::PointXYZ
  std::vector<PlaneSegment> planes;
  PointsView view() const { return PointsView(points.data(), kColumns, kRows, 4); }
};

/// A room seen by a camera: floor, three walls, a table and a shelf as planes, a ball and a heap of
/// clutter as the non-planar part; noise that grows with the square of the depth.
Frame generatedFrame() {
  struct Rectangle {
    Vector3 corner, a, b;
  };
  const std::array<Rectangle, 6> rectangles = {{{{-4, 1.2, 0}, {8, 0, 0}, {0, 0, 8}},
                                                {{-4, -2, 5.2}, {8, 0, 1.2}, {0, 3.2, 0}},
                                                {{-2.4, -2, 0}, {0, 3.2, 0}, {-0.3, 0, 8}},
                                                {{2.6, -2, 0}, {0, 3.2, 0}, {0.2, 0, 8}},
                                                {{-0.9, 0.45, 2.2}, {1.3, 0, 0.4}, {-0.3, 0, 0.9}},
                                                {{1.2, -0.6, 3.4}, {0.9, 0, -0.5}, {0, 1.2, 0}}}};
  Frame frame;
  frame.points.assign(std::size_t{4} * kColumns * kRows, 1.0f);
  frame.planes.resize(rectangles.size());
  for (std::size_t i = 0; i < rectangles.size(); ++i) {
    const Vector3 normal = rectangles[i].a.cross(rectangles[i].b).normalized();
    frame.planes[i].plane =
        orientedTowards({normal, -normal.dot(rectangles[i].corner)}, Vector3::Zero());
  }
  Random random;
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const Vector3 ray((column - 319.5) / 525.0, (row - 239.5) / 525.0, 1.0);
      double depth = std::numeric_limits<double>::infinity();
      int plane = -1;
      for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const Rectangle& r = rectangles[i];
        const double t = -frame.planes[i].plane.offset / frame.planes[i].plane.normal.dot(ray);
        const Vector3 d = t * ray - r.corner;
        const double u = d.dot(r.a) / r.a.squaredNorm();
        const double v = d.dot(r.b) / r.b.squaredNorm();
        if (!(t > 0.0) || t >= depth || u < 0.0 || u > 1.0 || v < 0.0 || v > 1.0) continue;
        depth = t;
        plane = static_cast<int>(i);
      }
      const Vector3 ball(-1.3, 0.6, 2.6);
      const double b = ray.dot(ball) / ray.squaredNorm();
      const double h2 = (b * ray - ball).squaredNorm();
      if (h2 < 0.16 && b < depth) {
        depth = b - std::sqrt((0.16 - h2) / ray.squaredNorm());
        plane = -1;
      }
      if (column > 420 && column < 560 && row > 330 && row < 440) {  // clutter on the floor
        depth = 2.6 + 0.15 * std::sin(0.13 * column) * std::cos(0.11 * row) +
                0.1 * std::sin(0.05 * (column + row));
        plane = -1;
      }
      depth += 0.0015 * depth * depth * random.normal();
      const std::size_t i = static_cast<std::size_t>(row) * kColumns + column;
      for (int k = 0; k < 3; ++k) {
        frame.points[4 * i + static_cast<std::size_t>(k)] = static_cast<float>(depth * ray[k]);
      }
      if (plane < 0) continue;
      const auto p = static_cast<std::size_t>(plane);
      if (std::abs(frame.planes[p].plane.signedDistance(depth * ray)) <= 0.05) {
        frame.planes[p].inliers.push_back(static_cast<int>(i));
      }
    }
  }
  return frame;
}

void approximate(benchmark::State& state, const PointsView& points,
                 const std::vector<PlaneSegment>& planes, Profile profile, double resolution,
                 const Vector3& up) {
  PlanarMapParams params = PlanarMapParams::of(profile);
  params.approximation.resolution = resolution;
  params.approximation.up = up;
  params.unknown_space = false;
  FrameObservation frame;
  frame.points = points;
  frame.planes = &planes;
  std::size_t cuboids = 0;
  for (auto _ : state) {
    PlanarMap map(params);
    map.insert(frame);
    cuboids = map.cuboids().size();
    benchmark::DoNotOptimize(cuboids);
  }
  state.counters["cuboids"] = static_cast<double>(cuboids);
}

void registerCloud(const std::string& name, std::shared_ptr<void> keep, const PointsView& points,
                   std::shared_ptr<const std::vector<PlaneSegment>> planes, const Vector3& up) {
  for (const Profile profile : {Profile::Compact, Profile::Paper}) {
    for (const int centimetres : {5, 10, 20}) {
      const std::string full = "approximate/" + name +
                               (profile == Profile::Paper ? "/paper/" : "/compact/") +
                               std::to_string(centimetres) + "cm";
      benchmark::RegisterBenchmark(full.c_str(), [=](benchmark::State& state) {
        benchmark::DoNotOptimize(keep);
        approximate(state, points, *planes, profile, 0.01 * centimetres, up);
      })->Unit(benchmark::kMillisecond);
    }
  }
}

void registerReal(const std::string& path) {
  const io::Sequence sequence({path});
  auto cloud = std::make_shared<io::CloudData>(sequence.read(0, io::CloudChannels::none()).cloud);
  MultiPlaneParams params;
  params.min_inliers = 1000;
  auto planes = std::make_shared<std::vector<PlaneSegment>>(
      findPlanes(cloud->view(), nullptr, params).planes);
  const std::string name = path.substr(path.find_last_of('/', path.size() - 2) + 1);
  const Vector3 up = cloud->height > 1 ? Vector3(0, -1, 0) : Vector3(0, 0, 1);
  registerCloud(name, cloud, cloud->view(), planes, up);
}

}  // namespace
}  // namespace planar_mapping

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  auto frame = std::make_shared<planar_mapping::Frame>(planar_mapping::generatedFrame());
  auto planes = std::make_shared<std::vector<planar_mapping::PlaneSegment>>(frame->planes);
  planar_mapping::registerCloud("generated_640x480", frame, frame->view(), planes, {0, -1, 0});
  for (int i = 1; i < argc; ++i) planar_mapping::registerReal(argv[i]);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
