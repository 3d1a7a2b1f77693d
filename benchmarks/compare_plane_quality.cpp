// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Planes of labelled and of simulated clouds, found by us and by the peers, judged by the
// definitions of Hoover et al. at 80 % overlap: the tables of docs/results.md.
//   compare_plane_quality [REPETITIONS [SET ...]]     prints Markdown
//   PLANE_QUALITY_CSV=FILE ...                         writes all rows as CSV besides
//   PLANE_QUALITY_METHODS=TEXT ...                     only methods with TEXT in their names
//   PLANE_QUALITY_LEAST=POINTS ...                     least size in place of the sets' own
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/metrics/plane_quality.h"
#include "labelled_clouds.h"
#include "peer_planes.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/planes/multi_plane.h"

namespace {

using planar_mapping::MultiPlaneParams;
using planar_mapping::PlaneSegment;
using planar_mapping::StereoNoise;
using planar_mapping::evaluation::CoplanarParams;
using planar_mapping::evaluation::joinCoplanar;
using planar_mapping::evaluation::judgePlanes;
using planar_mapping::evaluation::PlaneQuality;
using planar_mapping::evaluation::PlaneTruth;
using planar_mapping::evaluation::Simulation;
using planar_mapping::evaluation::SimulationParams;
using planar_mapping::evaluation::splitFaces;
using planar_mapping::evaluation::truthOf;
using planar_mapping::test::LabelledCloud;

/// Clouds of one sensor and what all methods are told of it. Peers get the distances one after the
/// other, and of each the better result counts (by recall + precision).
struct Set {
  std::string name;
  std::vector<LabelledCloud> clouds;
  int min_inliers = 100;
  std::vector<double> distances = {0.05};
};

struct Method {
  std::string name;
  bool organized_only = false;
  std::function<std::vector<PlaneSegment>(const PeerTask&)> find;
  bool tuned = false;     ///< tries all distances, not the library's default alone
  bool shuffled = false;  ///< is given a list of points in any order
};

struct Row {
  PlaneQuality labels;  ///< every label is a plane, every segment too
  PlaneQuality faces;   ///< of both, every connected part of min_inliers points and more is one
  PlaneQuality joined;  ///< of both, what is coplanar is one; labels of min_inliers points and more
  std::vector<double> milliseconds;
  double distance = 0.0;
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<PlaneSegment> ours(const PeerTask& task) {
  MultiPlaneParams params;
  params.distance_threshold = task.distance;
  params.min_inliers = task.min_inliers;
  return planar_mapping::findPlanes(task.points, nullptr, params).planes;
}

/// A cloud without its rows: the points that are measured, in an order drawn at random.
struct Shuffled {
  std::vector<int> points;  ///< of the cloud
  std::vector<float> xyz;

  explicit Shuffled(const planar_mapping::PointsView& cloud) : points(finiteOf(cloud)) {
    planar_mapping::Random random;
    for (std::size_t i = points.size(); i > 1; --i)
      std::swap(points[i - 1], points[random.below(static_cast<std::uint32_t>(i))]);
    for (const int i : points) {
      const float* p = cloud[static_cast<std::size_t>(i)];
      xyz.insert(xyz.end(), p, p + 3);
    }
  }
  /// Inliers become points of the cloud.
  void name(std::vector<PlaneSegment>& found) const {
    for (PlaneSegment& segment : found) {
      segment.patches.clear();
      for (int& inlier : segment.inliers) inlier = points[static_cast<std::size_t>(inlier)];
      std::sort(segment.inliers.begin(), segment.inliers.end());
    }
  }
};

Row measure(const Set& set, const Method& method, double distance, int repetitions) {
  Row row;
  row.distance = distance;
  for (const LabelledCloud& cloud : set.clouds) {
    PeerTask task;
    task.points = cloud.view();
    task.distance = distance;
    task.min_inliers = set.min_inliers;
    std::vector<PlaneSegment> found;
    std::optional<Shuffled> shuffled;
    if (method.shuffled) {
      shuffled.emplace(cloud.view());
      task.points = planar_mapping::PointsView(shuffled->xyz.data(), shuffled->points.size());
    }
    for (int i = 0; i < repetitions; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      found = method.find(task);
      const std::chrono::duration<double, std::milli> taken =
          std::chrono::steady_clock::now() - begin;
      row.milliseconds.push_back(taken.count());
    }
    if (shuffled) shuffled->name(found);
    row.labels.add(judgePlanes(cloud.truth, found));
    const CoplanarParams coplanar;
    const PlaneTruth large =
        truthOf(cloud.view(), cloud.truth.labels, cloud.truth.planes, set.min_inliers);
    row.faces.add(judgePlanes(splitFaces(cloud.view(), large, set.min_inliers),
                              splitFaces(cloud.view(), found, set.min_inliers)));
    row.joined.add(judgePlanes(joinCoplanar(cloud.view(), large, coplanar),
                               joinCoplanar(cloud.view(), found, coplanar)));
  }
  return row;
}

Row best(const Set& set, const Method& method, int repetitions) {
  if (!method.tuned) return measure(set, method, 0.05, repetitions);
  Row result;
  double most = -1.0;
  for (const double distance : set.distances) {
    Row row = measure(set, method, distance, repetitions);
    const double quality = row.labels.recall() + row.labels.precision();
    if (quality <= most) continue;
    most = quality;
    result = std::move(row);
  }
  return result;
}

void writeCsv(std::FILE* csv, const Set& set, const Method& method, const char* unit,
              const PlaneQuality& q, const Row& row) {
  if (csv == nullptr) return;
  std::fprintf(csv, "%s,\"%s\",%s,%.3f,%d,%d,%d,%.4f,%.4f,%d,%d,%d,%d,%.3f,%.4f,%.2f\n",
               set.name.c_str(), method.name.c_str(), unit, row.distance, q.true_planes, q.segments,
               q.correct, q.recall(), q.precision(), q.over, q.under, q.missed, q.noise,
               q.meanAngle() * 180.0 / M_PI, q.pointRecall(), median(row.milliseconds));
  std::fflush(csv);
}

void compare(const Set& set, const std::vector<Method>& methods, int repetitions, std::FILE* csv) {
  if (set.clouds.empty()) return;
  std::printf("\n### %s\n\n", set.name.c_str());
  std::printf(
      "| method | d, m | found / labels | recall | precision | over | under | missed | noise "
      "| angle, deg | point recall | faces: recall | precision | joined: recall | precision | ms "
      "|\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Method& method : methods) {
    if (method.organized_only && set.clouds.front().height < 2) continue;
    const Row row = best(set, method, repetitions);
    const PlaneQuality& q = row.labels;
    std::printf(
        "| %s | %.3f | %d / %d | %.3f | %.3f | %d | %d | %d | %d | %.2f | %.3f | %.3f | %.3f "
        "| %.3f | %.3f | %.1f |\n",
        method.name.c_str(), row.distance, q.correct, q.true_planes, q.recall(), q.precision(),
        q.over, q.under, q.missed, q.noise, q.meanAngle() * 180.0 / M_PI, q.pointRecall(),
        row.faces.recall(), row.faces.precision(), row.joined.recall(), row.joined.precision(),
        median(row.milliseconds));
    std::fflush(stdout);
    writeCsv(csv, set, method, "labels", row.labels, row);
    writeCsv(csv, set, method, "faces", row.faces, row);
    writeCsv(csv, set, method, "joined", row.joined, row);
  }
}

std::vector<Set> allSets(const std::vector<std::string>& wanted) {
  const auto want = [&](const std::string& name) {
    return wanted.empty() || std::find(wanted.begin(), wanted.end(), name) != wanted.end();
  };
  std::vector<Set> sets;
  for (const char* name : {"spiral_stairs_noisy", "polyhedra_clean", "small_clean"}) {
    if (!want(name)) continue;
    Set set{name, {}, 100, {0.05, 0.02, 0.005}};
    if (!planar_mapping::test::isMissing("labelled_synpeb")) {
      set.clouds.push_back(planar_mapping::test::readSynpeb(name));
    }
    sets.push_back(std::move(set));
  }
  if (want("icl_frame") && !planar_mapping::test::isMissing("labelled_icl_frame")) {
    sets.push_back({"icl_frame", {planar_mapping::test::readIclFrame()}, 100, {0.05, 0.02, 0.005}});
  }
  if (want("mosd_tabletop") && !planar_mapping::test::isMissing("labelled_mosd_tabletop")) {
    sets.push_back({"mosd_tabletop",
                    {planar_mapping::test::readTabletop("learn0"),
                     planar_mapping::test::readTabletop("test16")},
                    100,
                    {0.02}});
  }
  if (want("room_frame")) {
    Set set{"room_frame", {}, 1000, {0.05}};
    for (const std::uint64_t seed : {100, 101, 102}) {
      set.clouds.push_back(planar_mapping::test::roomFrame(seed));
    }
    sets.push_back(std::move(set));
  }
  for (const char* scene : {"room", "corridor", "outdoor"}) {
    if (!want(scene)) continue;
    SimulationParams params;
    params.scene = scene;
    const Simulation simulation(params);
    Set set{scene, {}, 1000, {0.05}};
    for (const std::size_t frame : {1, 7}) {
      set.clouds.push_back(planar_mapping::test::simulatedFrame(simulation, frame, 1000));
    }
    sets.push_back(std::move(set));
  }
  return sets;
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 1;
  std::vector<Method> methods = {{"planar_mapping, defaults", false, ours, false},
                                 {"planar_mapping, shuffled", false, ours, false, true},
                                 {"planar_mapping, d as the peers", false, ours, true}};
  for (const std::vector<Peer>& peers : {pclPeers(), cgalPeers()}) {
    for (const Peer& peer : peers) {
      methods.push_back({peer.name, peer.organized_only, peer.find, true});
    }
  }
  if (const char* wanted = std::getenv("PLANE_QUALITY_METHODS")) {
    methods.erase(std::remove_if(methods.begin(), methods.end(),
                                 [&](const Method& method) {
                                   return method.name.find(wanted) == std::string::npos;
                                 }),
                  methods.end());
  }
  const char* least = std::getenv("PLANE_QUALITY_LEAST");
  const char* path = std::getenv("PLANE_QUALITY_CSV");
  std::FILE* csv = path != nullptr ? std::fopen(path, "w") : nullptr;
  if (csv != nullptr) {
    std::fprintf(csv,
                 "set,method,unit,distance_m,true,segments,correct,recall,precision,over,"
                 "under,missed,noise,angle_deg,point_recall,median_ms\n");
  }
  for (Set& set : allSets(std::vector<std::string>(argv + std::min(argc, 2), argv + argc))) {
    if (least != nullptr) set.min_inliers = std::max(3, std::atoi(least));
    compare(set, methods, repetitions, csv);
  }
  if (csv != nullptr) std::fclose(csv);
  return 0;
}
