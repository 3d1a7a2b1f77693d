// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Figures of one block of core on scenes that chose none of its constants, for
// scripts/sensitivity.py:
//   sensitivity_figures
//   metric|metric_white|disparity|disparity_white|unorganized|ransac|features|ground|upright|scale
//   sensitivity_figures labelled         the planes of docs/results.md, which chose some of them
//   sensitivity_figures walk DIR SEED    writes a sequence of stereo images and clouds
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "evaluation/metrics/plane_quality.h"
#include "evaluation/metrics/simulated_features.h"
#include "evaluation/simulation/simulation.h"
#include "labelled_clouds.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/ground/ground.h"
#include "planar_mapping/ground/up.h"
#include "planar_mapping/planes/multi_plane.h"

namespace {

using namespace planar_mapping;
using evaluation::PlaneQuality;
using evaluation::Scene;
using evaluation::SceneObject;
using evaluation::Shape;
using evaluation::Simulation;

struct Cloud {
  std::string name;
  std::vector<float> xyz;
  std::vector<int> labels;  ///< index into planes or -1
  std::vector<Plane> planes;
  std::uint32_t width = 0, height = 0;
  Pose T_world_camera = Pose::Identity();
  std::optional<StereoNoise> noise;
  std::vector<KeyFeature> features;

  PointsView view() const { return PointsView(xyz.data(), width, height, 3); }
};

/// A world drawn by its seed, so that it chose nothing: a room, or a place between walls without a
/// ceiling, with boxes turned any way, a ramp, columns and a ball; the camera walks an arc.
Scene randomScene(std::uint64_t seed, int frames, double step) {
  Random random(seed, 17);
  const bool room = random.uniform(0.0, 1.0) < 0.6;
  const Vector3 size(random.uniform(4.0, room ? 7.0 : 16.0), random.uniform(3.5, 6.0),
                     room ? random.uniform(2.3, 3.2) : random.uniform(1.0, 4.0));
  Scene scene;
  scene.name = room ? "room" : "yard";
  const auto add = [&](Shape shape, const Vector3& middle, const Vector3& extent, double yaw,
                       double tilt) {
    SceneObject object;
    object.name = "object";
    object.shape = shape;
    object.size = extent;
    object.T_world_object.translation() = middle;
    object.T_world_object.linear() =
        (Eigen::AngleAxisd(yaw, Vector3::UnitZ()) * Eigen::AngleAxisd(tilt, Vector3::UnitY()))
            .toRotationMatrix();
    object.material.color =
        0x606060 + static_cast<std::uint32_t>(random.uniform(0.0, 90.0)) * 0x10101;
    object.material.texture = random.uniform(0.3, 1.0);
    object.material.posters = random.uniform(0.0, 0.4);
    scene.objects.push_back(object);
  };
  const Vector3 middle(0.0, 0.0, 0.5 * size.z());
  add(Shape::Box, {0.0, 0.0, -0.05}, {size.x() + 1, size.y() + 1, 0.1}, 0.0, 0.0);
  if (room) add(Shape::Box, {0.0, 0.0, size.z() + 0.05}, {size.x() + 1, size.y() + 1, 0.1}, 0, 0);
  for (const double side : {-0.5, 0.5}) {
    add(Shape::Box, middle + Vector3(0.0, side * (size.y() + 0.2), 0.0),
        {size.x() + 0.4, 0.2, size.z()}, 0.0, 0.0);
    add(Shape::Box, middle + Vector3(side * (size.x() + 0.2), 0.0, 0.0), {0.2, size.y(), size.z()},
        0.0, 0.0);
  }
  for (int i = 0; i < 9; ++i) {
    const Vector3 extent(random.uniform(0.15, 1.2), random.uniform(0.15, 1.0),
                         random.uniform(0.1, 1.8));
    const Vector3 place(random.uniform(-0.1, 0.45) * size.x(),
                        random.uniform(-0.45, 0.45) * size.y(), 0.5 * extent.z());
    add(Shape::Box, place, extent, random.uniform(0.0, 3.0), i == 0 ? 0.3 : 0.0);
  }
  for (int i = 0; i < 2; ++i) {
    const double width = random.uniform(0.15, 0.5);
    const double length = random.uniform(0.5, 2.0);
    add(Shape::Cylinder,
        {random.uniform(0.0, 0.45) * size.x(), random.uniform(-0.4, 0.4) * size.y(), 0.5 * length},
        {width, width, length}, 0.0, 0.0);
  }
  add(Shape::Sphere, {0.3 * size.x(), random.uniform(-0.3, 0.3) * size.y(), 0.3}, {0.6, 0.6, 0.6},
      0.0, 0.0);
  const double height = random.uniform(0.35, 1.3);
  const double pitch = random.uniform(0.0, 0.25);
  const double turn = random.uniform(-0.1, 0.1);
  for (int i = 0; i < frames; ++i) {
    const double yaw = turn * i;
    const Vector3 forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                          -std::sin(pitch));
    const Vector3 right = forward.cross(Vector3::UnitZ()).normalized();
    Pose pose = Pose::Identity();
    pose.linear().col(0) = right;
    pose.linear().col(1) = forward.cross(right);
    pose.linear().col(2) = forward;
    pose.translation() = Vector3(-0.42 * size.x() + step * i, 0.05 * i, height);
    scene.path.push_back(pose);
  }
  scene.camera_height = height;
  scene.rotate(random.uniform(0.0, 3.0));
  return scene;
}

Simulation simulation(std::uint64_t seed, int frames, double step, int width, bool images,
                      bool white = false) {
  evaluation::SimulationParams params;
  if (white) params.sensor.correlated_fraction = params.sensor.disparity_step_px = 0.0;
  params.width = width;
  params.height = width * 3 / 4;
  params.seed = seed;
  params.images = images;
  return Simulation(params, randomScene(seed, frames, step));
}

Cloud simulate(std::uint64_t seed, bool white) {
  const Simulation world = simulation(seed, 3, 0.5, 640, false, white);
  evaluation::SimulatedFrame frame = world.frame(1);
  Cloud cloud;
  cloud.name = world.scene().name;
  cloud.T_world_camera = frame.T_world_camera;
  cloud.noise = StereoNoise{world.params().sensor.baseline, world.params().camera().fx, 0.5};
  for (const std::uint32_t label : frame.labels) {
    cloud.labels.push_back(static_cast<int>(label) - 1);
  }
  const Pose T_camera_world = frame.T_world_camera.inverse();
  for (const Plane& plane : world.planes()) {
    cloud.planes.push_back(transformed(plane, T_camera_world));
  }
  evaluation::SimulatedFeatureParams feature_params;
  feature_params.seed = seed;
  evaluation::SimulatedFeatures features(world, feature_params);
  cloud.features = features.next(frame);
  cloud.xyz = std::move(frame.xyz);
  cloud.width = static_cast<std::uint32_t>(world.params().width);
  cloud.height = static_cast<std::uint32_t>(world.params().height);
  return cloud;
}

/// Reads or writes the values of a cloud as they are in memory.
template <typename Value>
void transfer(std::FILE* file, bool reads, std::vector<Value>& values) {
  std::size_t size = values.size();
  const auto once = [&](void* data, std::size_t bytes) {
    const std::size_t done =
        reads ? std::fread(data, 1, bytes, file) : std::fwrite(data, 1, bytes, file);
    if (done != bytes) throw std::runtime_error("a kept scene is incomplete");
  };
  once(&size, sizeof(size));
  values.resize(size);
  once(values.data(), size * sizeof(Value));
}

/// Kept in the folder SENSITIVITY_SCENES where that is set: drawing takes longer than what is
/// measured. \param white noise of single pixels, not of their surroundings
Cloud simulated(std::uint64_t seed, bool white = false) {
  const char* folder = std::getenv("SENSITIVITY_SCENES");
  if (folder == nullptr) return simulate(seed, white);
  const std::string path = std::string(folder) + "/" + std::to_string(seed) + (white ? "w" : "");
  const std::string written = path + "." + std::to_string(getpid());
  std::FILE* file = std::fopen(path.c_str(), "rb");
  const bool reads = file != nullptr;
  Cloud cloud;
  if (!reads) {
    cloud = simulate(seed, white);
    file = std::fopen(written.c_str(), "wb");
    if (file == nullptr) throw std::runtime_error("cannot write " + path);
  }
  std::vector<Pose> pose = {cloud.T_world_camera};
  std::vector<StereoNoise> noise(1);
  if (!reads) noise[0] = *cloud.noise;
  transfer(file, reads, cloud.xyz);
  transfer(file, reads, cloud.labels);
  transfer(file, reads, cloud.planes);
  transfer(file, reads, cloud.features);
  transfer(file, reads, pose);
  transfer(file, reads, noise);
  std::fclose(file);
  if (!reads) std::rename(written.c_str(), path.c_str());
  cloud.T_world_camera = pose[0];
  cloud.noise = noise[0];
  cloud.width = 640;
  cloud.height = 480;
  return cloud;
}

/// Every \p step-th finite point, not organized.
Cloud thinned(const Cloud& from, std::size_t step) {
  Cloud cloud;
  cloud.name = from.name;
  cloud.planes = from.planes;
  for (std::size_t i = 0, k = 0; i < from.labels.size(); ++i) {
    if (!from.view().isMeasured(i) || k++ % step != 0) continue;
    cloud.xyz.insert(cloud.xyz.end(), from.view()[i], from.view()[i] + 3);
    cloud.labels.push_back(from.labels[i]);
  }
  cloud.width = static_cast<std::uint32_t>(cloud.labels.size());
  cloud.height = 1;
  return cloud;
}

void planes(const std::vector<Cloud>& clouds, const MultiPlaneParams& base, double fraction) {
  PlaneQuality all;
  double ms = 0.0;
  for (const Cloud& cloud : clouds) {
    MultiPlaneParams params = base;
    if (base.noise) params.noise = cloud.noise;
    const auto finite = usablePoints(cloud.view()).size();
    params.min_inliers = std::max(20, static_cast<int>(fraction * static_cast<double>(finite)));
    const auto begin = std::chrono::steady_clock::now();
    const PlaneSet set = segmentPlanes(cloud.view(), nullptr, cloud.features, params);
    ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    const PlaneQuality quality = judgePlanes(
        evaluation::truthOf(cloud.view(), cloud.labels, cloud.planes, params.min_inliers),
        set.planes);
    all.add(quality);
  }
  std::printf(
      "planes %d\nrecall %.4f\nprecision %.4f\npoints_found %.4f\nangle_deg %.4f\nms %.1f\n",
      all.segments, all.recall(), all.precision(), all.pointRecall(),
      all.meanAngle() * 180.0 / M_PI, ms);
}

/// As compare_plane_quality judges them: labels, each set on its own.
void labelled() {
  const auto judge = [](const std::vector<test::LabelledCloud>& clouds, const std::string& name,
                        int min_inliers) {
    PlaneQuality all;
    for (const test::LabelledCloud& cloud : clouds) {
      MultiPlaneParams params;
      params.min_inliers = min_inliers;
      all.add(judgePlanes(cloud.truth, findPlanes(cloud.view(), nullptr, params).planes));
    }
    std::printf("%s_recall %.4f\n%s_precision %.4f\n%s_points %.4f\n%s_angle %.3f\n", name.c_str(),
                all.recall(), name.c_str(), all.precision(), name.c_str(), all.pointRecall(),
                name.c_str(), all.meanAngle() * 180.0 / M_PI);
  };
  for (const char* name : {"spiral_stairs_noisy", "polyhedra_clean", "small_clean"}) {
    judge({test::readSynpeb(name)}, name, 100);
  }
  judge({test::readIclFrame()}, "icl_frame", 100);
  judge({test::readTabletop("learn0"), test::readTabletop("test16")}, "tabletop", 100);
  judge({test::roomFrame(100), test::roomFrame(101), test::roomFrame(102)}, "room_frame", 1000);
  for (const char* scene : {"room", "corridor", "outdoor"}) {
    evaluation::SimulationParams params;
    params.scene = scene;
    const Simulation world(params);
    judge({test::simulatedFrame(world, 1, 1000), test::simulatedFrame(world, 7, 1000)}, scene,
          1000);
  }
}

void ground(const std::vector<Cloud>& clouds) {
  double right = 0.0, found = 0.0, truth = 0.0, height = 0.0, ms = 0.0;
  for (const Cloud& cloud : clouds) {
    for (const bool known : {false, true}) {
      GroundParams params;
      params.up = cloud.T_world_camera.linear().transpose() * Vector3::UnitZ();
      const double above = cloud.T_world_camera.translation().z();
      if (known) params.camera_height = above;
      params.noise = cloud.noise;
      const auto begin = std::chrono::steady_clock::now();
      const Ground result = findGround(cloud.view(), nullptr, params);
      ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
                .count();
      height += result.found ? std::fabs(result.height - above) : 1.0;
      for (std::size_t i = 0; i < cloud.labels.size(); ++i) {
        if (!cloud.view().isMeasured(i)) continue;
        bool is = false;
        if (cloud.labels[i] >= 0) {
          const Plane& plane = cloud.planes[static_cast<std::size_t>(cloud.labels[i])];
          is = std::fabs(plane.normal.dot(*params.up)) > 0.99 &&
               std::fabs(std::fabs(plane.offset) - above) < 0.01;
        }
        const bool said = result.found && result.is_ground[i] != 0;
        truth += is ? 1.0 : 0.0;
        found += said ? 1.0 : 0.0;
        right += is && said ? 1.0 : 0.0;
      }
    }
  }
  std::printf("recall %.4f\nprecision %.4f\nheight_error_m %.4f\nms %.1f\n", right / truth,
              right / std::max(1.0, found), height / static_cast<double>(2 * clouds.size()), ms);
}

void upright(const std::vector<Cloud>& clouds) {
  double error = 0.0;
  int found = 0;
  for (const Cloud& cloud : clouds) {
    for (const double turn : {-0.55, -0.2, 0.1, 0.4}) {
      const Matrix3 turned = Eigen::AngleAxisd(turn, Vector3(0.6, 0.0, 0.8)).toRotationMatrix();
      Cloud tilted = cloud;
      for (std::size_t i = 0; i < cloud.labels.size(); ++i) {
        const Vector3 p = turned * cloud.view().point(i);
        for (int axis = 0; axis < 3; ++axis) tilted.xyz[3 * i + axis] = static_cast<float>(p[axis]);
      }
      MultiPlaneParams params;
      params.min_inliers = 600;
      const Upright up =
          findUpright(findPlanes(tilted.view(), nullptr, params).planes, -Vector3::UnitY());
      const Vector3 true_up =
          turned * (cloud.T_world_camera.linear().transpose() * Vector3::UnitZ());
      found += up.found ? 1 : 0;
      error += std::acos(std::min(1.0, true_up.dot(up.up))) * 180.0 / M_PI;
    }
  }
  std::printf("found %d\nerror_deg %.3f\n", found, error / static_cast<double>(4 * clouds.size()));
}

void scale(const std::vector<Cloud>& clouds) {
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    const Cloud& cloud = clouds[k];
    const CloudScale of = scaleOf(cloud.view(), usablePoints(cloud.view()));
    std::printf(
        "spacing_%zu %.4f\nnoise_%zu %.4f\nresolution_%zu %.3f\noptical_%zu %d\nmerged_%zu %d\n", k,
        of.spacing, k, of.noise, k, automaticResolution(of), k, of.optical ? 1 : 0, k,
        isMerged(thinned(cloud, 1).view(), nullptr) ? 1 : 0);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  MultiPlaneParams params;
  const auto scenes = [](std::size_t step, bool white = false) {
    std::vector<Cloud> clouds;
    for (const std::uint64_t seed : {941, 942, 943, 944, 945, 946}) {
      clouds.push_back(simulated(seed, white));
      if (step > 0) clouds.back() = thinned(clouds.back(), step);
    }
    return clouds;
  };
  const bool white = what == "metric_white" || what == "disparity_white";
  if (what == "metric" || what == "metric_white") {
    params.method = PlaneSearchMethod::Organized;
    planes(scenes(0, white), params, 0.003);
  } else if (what == "disparity" || what == "disparity_white") {
    params.method = PlaneSearchMethod::Disparity;
    params.noise = StereoNoise{};
    planes(scenes(0, white), params, 0.003);
  } else if (what == "unorganized") {
    params.method = PlaneSearchMethod::Sequential;
    planes(scenes(2), params, 0.003);
  } else if (what == "ransac") {
    params.method = PlaneSearchMethod::MultiRansac;
    planes(scenes(70), params, 0.01);
  } else if (what == "features") {
    params.noise = StereoNoise{};
    params.source = PlaneSource::Features;
    planes(scenes(0), params, 0.003);
  } else if (what == "ground") {
    ground(scenes(0));
  } else if (what == "upright") {
    upright({simulated(947), simulated(948)});
  } else if (what == "scale") {
    scale({simulated(943), thinned(simulated(944), 30), simulated(945), simulated(946)});
  } else if (what == "labelled") {
    labelled();
  } else if (what == "walk" && argc > 3) {
    const Simulation walk = simulation(std::strtoull(argv[3], nullptr, 10), 6, 0.25, 320, true);
    evaluation::writeSequence(walk, argv[2], true);
  } else {
    std::fprintf(stderr,
                 "usage: sensitivity_figures "
                 "metric|metric_white|disparity|disparity_white|unorganized|ransac|features|ground|"
                 "upright|scale|walk DIR SEED\n");
    return 2;
  }
  return 0;
}
