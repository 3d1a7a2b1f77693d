// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation_run.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Parts of at most s along each axis.
std::vector<Cuboid> partsOf(const Cuboid& cuboid, double s) {
  Eigen::Vector3i counts;
  for (int axis = 0; axis < 3; ++axis) {
    counts[axis] = std::max(1, static_cast<int>(std::ceil(cuboid.size[axis] / s - 1e-9)));
  }
  Cuboid part = cuboid;
  part.size = cuboid.size.cwiseQuotient(counts.cast<double>());
  const Quaternion turn = cuboid.orientation.normalized();
  std::vector<Cuboid> parts;
  for (int x = 0; x < counts.x(); ++x) {
    for (int y = 0; y < counts.y(); ++y) {
      for (int z = 0; z < counts.z(); ++z) {
        const Vector3 offset =
            (Vector3(x, y, z) + Vector3::Constant(0.5)).cwiseProduct(part.size) - 0.5 * cuboid.size;
        part.center = cuboid.center + turn * offset;
        parts.push_back(part);
      }
    }
  }
  return parts;
}

Json cuboidJson(const Cuboid& c) {
  // A tenth of a millimetre is enough for a picture.
  const auto rounded = [](double value) { return std::round(value * 1e4) / 1e4; };
  const Quaternion q = c.orientation.normalized();
  return {rounded(c.center.x()), rounded(c.center.y()), rounded(c.center.z()), rounded(c.size.x()),
          rounded(c.size.y()),   rounded(c.size.z()),   rounded(q.x()),        rounded(q.y()),
          rounded(q.z()),        rounded(q.w())};
}

Json panelJson(const MethodMap& map, const std::string& name, double s,
               const evaluation::SurfaceTruth& truth) {
  Json right = Json::array();
  Json wrong = Json::array();
  for (const Cuboid& cuboid : map.cuboids) {
    const std::vector<Cuboid> parts = partsOf(cuboid, s);
    const auto isRight = [&](const Cuboid& part) { return truth.isNear(part.center, s); };
    if (std::all_of(parts.begin(), parts.end(), isRight)) {
      right.push_back(cuboidJson(cuboid));
      continue;
    }
    for (const Cuboid& part : parts) (isRight(part) ? right : wrong).push_back(cuboidJson(part));
  }
  Json json;
  json["title"] = name + " (s = " + formatNumber(s) + " m): " + std::to_string(map.cuboids.size()) +
                  " cells; red: " + std::to_string(wrong.size()) + " standard cells wrong";
  json["right"] = std::move(right);
  json["wrong"] = std::move(wrong);
  return json;
}

/// From behind and above the first frame of the place, along the way.
Json viewJson(const Pose& T_world_sensor) {
  constexpr double kBack = 0.4;  // metres, like the next three
  constexpr double kAbove = 0.9;
  constexpr double kAhead = 3.0;
  constexpr double kFocalAbove = 0.6;
  constexpr double kAngle = 0.95;  // radians
  Vector3 forward = T_world_sensor.linear().col(2);
  forward.z() = 0.0;
  forward.normalize();
  const Vector3 position = T_world_sensor.translation() - kBack * forward + Vector3(0, 0, kAbove);
  const Vector3 focal =
      T_world_sensor.translation() + kAhead * forward + Vector3(0, 0, kFocalAbove);
  Json json;
  json["position"] = {position.x(), position.y(), position.z()};
  json["focal_point"] = {focal.x(), focal.y(), focal.z()};
  json["angle_rad"] = kAngle;
  return json;
}

/// The places of one source, taken by threads one after the other.
class Evaluation {
 public:
  Evaluation(PlaceSource& source, std::string scene, const EvaluationJob& job, PlaceMaps* maps)
      : source_(source), job_(job), maps_(maps) {
    progress_.scene = std::move(scene);
    constexpr std::size_t kBaselines = 3;
    progress_.all =
        source.size() * job.methods.cells.size() * (kBaselines + job.methods.planar.size());
  }

  std::vector<evaluation::PlaceResult> execute() {
    std::vector<std::thread> helpers;
    for (int i = 1; i < job_.threads; ++i) helpers.emplace_back([this]() { work(); });
    work();
    for (std::thread& helper : helpers) helper.join();
    if (failure_) std::rethrow_exception(failure_);
    const bool nothing = std::all_of(results_.begin(), results_.end(),
                                     [](const auto& place) { return place.second.empty(); });
    if (nothing && !stopped()) {
      throw InputError(progress_.scene +
                       ": no point is left to be mapped at any place; look at the stages before "
                       "the one that finds planes");
    }
    std::vector<evaluation::PlaceResult> results;
    for (auto& [place, of_place] : results_) {
      std::move(of_place.begin(), of_place.end(), std::back_inserter(results));
    }
    return results;
  }

 private:
  void work() {
    try {
      while (!stopped()) {
        const std::unique_ptr<Place> place = source_.next();
        if (place == nullptr) return;
        judge(*place);
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
    }
  }

  void judge(const Place& place) {
    const auto done = [&]() { return countMap(place.number); };
    const bool wanted = maps_ != nullptr && maps_->cell > 0.0 && maps_->place == place.number;
    if (wanted) {
      maps_->truth = place.truth;
      for (const PreparedFrame& frame : place.frames) {
        maps_->poses.push_back(frame.frame.T_world_sensor);
      }
    }
    std::vector<evaluation::PlaceResult> results = judgeMethods(
        place, job_.methods, done, wanted ? &maps_->maps : nullptr, wanted ? maps_->cell : 0.0);
    for (evaluation::PlaceResult& result : results) result.scene = progress_.scene;
    const std::lock_guard<std::mutex> lock(mutex_);
    results_[place.number] = std::move(results);
  }

  bool countMap(std::size_t place) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++progress_.done;
    progress_.place = place;
    if (job_.progress) job_.progress(progress_);
    return !failure_ && !(job_.stop != nullptr && *job_.stop);
  }

  bool stopped() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return failure_ || (job_.stop != nullptr && *job_.stop);
  }

  PlaceSource& source_;
  const EvaluationJob& job_;
  PlaceMaps* maps_;
  std::mutex mutex_;
  EvaluationProgress progress_;
  std::exception_ptr failure_;
  std::map<std::size_t, std::vector<evaluation::PlaceResult>> results_;  ///< by place
};

}  // namespace

std::vector<evaluation::PlaceResult> evaluatePlaces(PlaceSource& source, const std::string& scene,
                                                    const EvaluationJob& job, PlaceMaps* maps) {
  return Evaluation(source, scene, job, maps).execute();
}

std::string artefactJson(const PlaceMaps& maps, const std::string& scene) {
  Json json;
  json["scene"] = scene;
  json["place"] = maps.place;
  json["cell_m"] = maps.cell;
  json["view"] = viewJson(maps.poses.front());
  json["panels"] = Json::array();
  for (const MethodMap& map : maps.maps) {
    const bool ours = map.method == "PG";
    if (!ours && map.method != "SG") continue;
    json["panels"].push_back(
        panelJson(map, ours ? "Planar map" : "Standard grid", maps.cell, *maps.truth));
  }
  return json.dump() + "\n";
}

}  // namespace planar_mapping::tools
