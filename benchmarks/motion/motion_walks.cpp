// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Walks with an RGB-D camera in simulated rooms that are hard for motion estimation, as sequence
// folders for scripts/motion_table.py:
//
//   motion_walks DIRECTORY [SEED]
//
// turn_10 ... turn_60: a furnished room, turning by so many degrees a frame; blur, dark, people:
// turn_10 with what the name says; doors: along a wall with identical doors; plain: a corridor
// without any texture.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/simulation/image_renderer.h"
#include "evaluation/simulation/ray_caster.h"
#include "evaluation/simulation/scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/pose_file.h"

namespace {

using namespace planar_mapping;
using namespace planar_mapping::evaluation;

constexpr double kDepthScale = 1000.0;
constexpr int kFrames = 13;

struct Walk {
  std::string name;
  Scene scene;  ///< with its path
  int blurred_px = 0;
  bool dark = false;  ///< every fourth frame
};

/// At height z, looking along yaw.
Pose lookFrom(double x, double y, double z, double yaw) {
  Matrix3 R;
  R << std::sin(yaw), 0.0, std::cos(yaw), -std::cos(yaw), 0.0, std::sin(yaw), 0.0, -1.0, 0.0;
  Pose pose = Pose::Identity();
  pose.linear() = R;
  pose.translation() = Vector3(x, y, z);
  return pose;
}

SceneObject box(const std::string& name, const Vector3& low, const Vector3& size,
                const Material& material) {
  SceneObject object;
  object.name = name;
  object.size = size;
  object.T_world_object.translation() = low + 0.5 * size;
  object.material = material;
  return object;
}

Scene turningScene(double degrees, double phase) {
  Scene scene = makeScene("room", kFrames);
  scene.path.clear();
  for (int i = 0; i < kFrames; ++i) {
    const double yaw = phase + i * degrees * M_PI / 180.0;
    scene.path.push_back(lookFrom(0.4 * std::cos(0.5 * yaw), 0.4 * std::sin(0.5 * yaw), 1.25, yaw));
  }
  return scene;
}

/// A long wall along x with the same door every metre and a half, seen from 2 m.
Scene doorScene() {
  Scene scene;
  scene.name = "doors";
  const Material wall{0xC8C8C8, Pattern::Plain, 0.0};
  scene.objects.push_back(
      box("floor", {-5, -3, -0.1}, {30, 6, 0.1}, {0x909090, Pattern::Plain, 0}));
  scene.objects.push_back(box("wall", {-5, 2, 0}, {30, 0.2, 2.6}, wall));
  for (int i = 0; i < 18; ++i) {
    const double x = -4.0 + 1.5 * i;
    scene.objects.push_back(
        box("door", {x, 1.97, 0}, {0.9, 0.03, 2.1}, {0x704020, Pattern::Plain, 0}));
    scene.objects.push_back(
        box("handle", {x + 0.75, 1.92, 1}, {0.1, 0.05, 0.04}, {0x202020, Pattern::Plain, 0}));
    scene.objects.push_back(
        box("plate", {x + 0.3, 1.95, 1.5}, {0.3, 0.02, 0.1}, {0xF0F0F0, Pattern::Plain, 0}));
  }
  for (int i = 0; i < kFrames; ++i) scene.path.push_back(lookFrom(0.7 * i, 0.0, 1.25, M_PI / 2));
  return scene;
}

Scene plainScene() {
  Scene scene;
  scene.name = "plain";
  const Material plain{0xC0C0C0, Pattern::Plain, 0.0};
  scene.objects.push_back(box("floor", {-3, -1, -0.1}, {40, 2, 0.1}, plain));
  scene.objects.push_back(box("ceiling", {-3, -1, 2.5}, {40, 2, 0.1}, plain));
  scene.objects.push_back(box("left", {-3, 1, 0}, {40, 0.1, 2.5}, plain));
  scene.objects.push_back(box("right", {-3, -1.1, 0}, {40, 0.1, 2.5}, plain));
  for (int i = 0; i < kFrames; ++i) scene.path.push_back(lookFrom(0.4 * i, 0.0, 1.25, 0.0));
  return scene;
}

/// One after the other crosses the view, a different place in each frame.
void addPeople(Scene& scene, Random& random) {
  for (int i = 0; i < kFrames; ++i) {
    const Pose& camera = scene.path[static_cast<std::size_t>(i)];
    const Vector3 place =
        camera * Vector3(random.uniform(-0.5, 0.5), 0.0, random.uniform(1.0, 1.6));
    SceneObject person = box("person", {place.x() - 0.2, place.y() - 0.15, 0.0}, {0.4, 0.3, 1.75},
                             {0x305080, Pattern::Speckles, 1.0});
    person.first_frame = person.last_frame = i;
    scene.objects.push_back(person);
  }
}

/// Mean along the rows: what a turn does during the exposure.
void blur(io::Image& image, int pixels) {
  const io::Image sharp = image;
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      int sum = 0;
      for (int k = 0; k < pixels; ++k) {
        const int from = std::clamp(column + k - pixels / 2, 0, image.width - 1);
        sum += sharp.pixels[static_cast<std::size_t>(row * image.width + from)];
      }
      image.pixels[static_cast<std::size_t>(row * image.width + column)] =
          static_cast<std::uint8_t>(sum / pixels);
    }
  }
}

void write(const Walk& walk, const std::string& directory, std::uint64_t seed) {
  const PinholeCamera camera{500.0, 500.0, 319.5, 239.5, 640, 480};
  const std::string folder = directory + "/" + walk.name;
  std::filesystem::create_directories(folder + "/rgb");
  std::filesystem::create_directories(folder + "/depth");
  io::Calibration calibration;
  calibration.camera = camera;
  calibration.depth_scale = kDepthScale;
  io::writeFileAtomically(folder + "/calib.yaml", io::toYaml(calibration), io::Overwrite::Allow);
  std::vector<io::StampedPose> poses;
  Random random(seed);
  for (int i = 0; i < kFrames; ++i) {
    const Pose& pose = walk.scene.path[static_cast<std::size_t>(i)];
    RenderParams params;
    params.frame = i;
    const Rendering view = render(walk.scene, camera, pose, params);
    ImageSensorParams sensor;
    sensor.seed = seed + static_cast<std::uint64_t>(i);
    io::Image image = renderImage(walk.scene, view, pose, params, sensor);
    if (walk.blurred_px > 1) blur(image, walk.blurred_px);
    if (walk.dark && i % 4 == 3) {
      for (std::uint8_t& pixel : image.pixels) pixel = static_cast<std::uint8_t>(pixel / 24);
    }
    io::DepthImage depth;
    depth.width = 640;
    depth.height = 480;
    for (const float z : view.depth) {  // noise of a structured-light camera
      const double noise = 0.0015 * double{z} * double{z} * random.uniform(-1.7, 1.7);
      const double value = z > 0.4f && z < 8.0f ? std::round(kDepthScale * (z + noise)) : 0.0;
      depth.values.push_back(static_cast<std::uint16_t>(value));
    }
    char name[16];
    std::snprintf(name, sizeof name, "/%06d.png", i);
    io::writeImage(folder + "/rgb" + name, image, io::Overwrite::Allow);
    io::writeDepthPng(folder + "/depth" + name, depth, io::Overwrite::Allow);
    poses.push_back({0.1 * i, pose});
  }
  io::writeTumPoses(folder + "/poses.txt", poses, io::Overwrite::Allow);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') {
    std::fprintf(stderr, "usage: motion_walks DIRECTORY [SEED]\n");
    return 2;
  }
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  Random random(seed);
  try {
    std::vector<Walk> walks;
    const double phase = random.uniform(0.0, 2.0 * M_PI);
    for (const int degrees : {10, 20, 30, 45, 60}) {
      walks.push_back({"turn_" + std::to_string(degrees), turningScene(degrees, phase)});
    }
    walks.push_back({"blur", turningScene(10, phase), 13});
    walks.push_back({"dark", turningScene(10, phase), 0, true});
    walks.push_back({"people", turningScene(10, phase)});
    addPeople(walks.back().scene, random);
    walks.push_back({"doors", doorScene()});
    walks.push_back({"plain", plainScene()});
    for (const Walk& walk : walks) write(walk, argv[1], seed);
  } catch (const Error& error) {
    std::fprintf(stderr, "motion_walks: %s\n", error.what());
    return 4;
  }
  return 0;
}
