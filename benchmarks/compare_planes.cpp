// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// MultiPlaneSACSegmentation and PCL's own loop side by side on generated clouds whose planes are
// known: methods alternate within each repetition, medians are printed.
//   compare_planes [REPETITIONS]
#include <dlfcn.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "peer_pcl.h"
#include "planar_mapping/geometry/plane.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "plane_scenes.h"

namespace {

using planar_mapping::PlaneSegment;
using planar_mapping::PlaneSet;
using planar_mapping::test::makeRoom;
using planar_mapping::test::PlaneScene;
using planar_mapping::test::PlaneScore;
using planar_mapping::test::RoomKind;
using planar_mapping::test::scorePlanes;

constexpr float kDistance = 0.05f;
constexpr float kRestFraction = 0.3f;  // as in PCL's tutorial

struct Method {
  std::string name;
  std::function<PlaneSet(const PlaneScene&, int min_inliers, double& milliseconds)> run;
};

double millisecondsOf(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

PlaneSet ours(const PlaneScene& scene, int min_inliers, double& milliseconds) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (std::size_t i = 0; i < scene.size(); ++i) {
    cloud->push_back({scene.xyz[3 * i], scene.xyz[3 * i + 1], scene.xyz[3 * i + 2]});
  }
  planar_mapping::MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setDistanceThreshold(kDistance);
  segmentation.setMinInliers(min_inliers);
  segmentation.setInputCloud(cloud);
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  milliseconds = millisecondsOf([&] { segmentation.segment(inliers, planes); });
  PlaneSet set;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const std::vector<float>& v = planes[k].values;
    PlaneSegment segment;
    segment.plane = planar_mapping::planeFromCoefficients(v[0], v[1], v[2], v[3]);
    segment.inliers = inliers[k].indices;
    set.planes.push_back(segment);
  }
  return set;
}

/// The peer's time includes making its cloud, a few per cent of it.
Method peer(const std::string& name, const std::string& library) {
  void* handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) return {name, nullptr};
  const auto planes_of = reinterpret_cast<decltype(&peerPclPlanes)>(dlsym(handle, "peerPclPlanes"));
  return {name, [planes_of](const PlaneScene& scene, int min_inliers, double& milliseconds) {
            constexpr int kMaxPlanes = 60;
            std::vector<int> labels(scene.size());
            std::vector<float> coefficients(4 * kMaxPlanes);
            int found = 0;
            milliseconds = millisecondsOf([&] {
              found = planes_of(scene.xyz.data(), static_cast<int>(scene.size()), kDistance,
                                kRestFraction, min_inliers, kMaxPlanes, labels.data(),
                                coefficients.data());
            });
            PlaneSet set;
            for (int k = 0; k < found; ++k) {
              const float* v = coefficients.data() + 4 * k;
              PlaneSegment segment;
              segment.plane = planar_mapping::planeFromCoefficients(v[0], v[1], v[2], v[3]);
              for (std::size_t i = 0; i < labels.size(); ++i) {
                if (labels[i] == k) segment.inliers.push_back(static_cast<int>(i));
              }
              set.planes.push_back(segment);
            }
            return set;
          }};
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void compare(const std::string& cloud, const std::vector<Method>& methods, int seeds,
             int repetitions, const std::function<PlaneScene(int)>& make) {
  std::vector<std::vector<double>> times(methods.size());
  std::vector<PlaneScore> sums(methods.size());
  for (int seed = 0; seed < seeds; ++seed) {
    const PlaneScene scene = make(seed);
    const int min_inliers = std::max(20, static_cast<int>(scene.size() / 300));
    for (int repetition = 0; repetition < repetitions; ++repetition) {
      for (std::size_t m = 0; m < methods.size(); ++m) {
        double milliseconds = 0.0;
        const PlaneSet found = methods[m].run(scene, min_inliers, milliseconds);
        times[m].push_back(milliseconds);
        if (repetition > 0) continue;
        const PlaneScore score = scorePlanes(scene, found);
        sums[m].recall += score.recall / seeds;
        sums[m].precision += score.precision / seeds;
      }
    }
  }
  for (std::size_t m = 0; m < methods.size(); ++m) {
    std::printf("%-10s %-16s %10.2f %8.3f %10.3f\n", cloud.c_str(), methods[m].name.c_str(),
                median(times[m]), sums[m].recall, sums[m].precision);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 3;
  std::vector<Method> methods{{"planar_mapping", ours}};
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2")) methods.push_back(peer("PCL, AVX2 build", PEER_PCL_AVX2));
#endif
  methods.push_back(peer("PCL, plain build", PEER_PCL_PLAIN));
  for (const Method& method : methods) {
    if (method.run) continue;
    std::fprintf(stderr, "compare_planes: the peer '%s' cannot be loaded\n", method.name.c_str());
    return 1;
  }
  std::printf("%-10s %-16s %10s %8s %10s\n", "cloud", "method", "median ms", "recall", "precision");
  compare("room", methods, 3, repetitions,
          [](int seed) { return makeRoom(210000, 0.3, 0.0015, seed, RoomKind::Dense); });
  compare("sparse", methods, 20, repetitions,
          [](int seed) { return makeRoom(600, 0.3, 0.0015, seed, RoomKind::Features); });
  compare("sparseh", methods, 20, repetitions,
          [](int seed) { return makeRoom(600, 0.6, 0.002, seed, RoomKind::UnevenFeatures); });
  return 0;
}
