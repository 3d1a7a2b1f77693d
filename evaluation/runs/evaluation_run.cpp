// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/runs/evaluation_run.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping::tools {

namespace {

/// The places of one source, taken by threads one after the other.
class Evaluation {
 public:
  Evaluation(PlaceSource& source, std::string scene, const EvaluationJob& job)
      : source_(source), job_(job) {
    progress_.scene = std::move(scene);
    constexpr std::size_t kBaselines = 3;
    progress_.all =
        source.size() * job.methods.cells.size() * (kBaselines + job.methods.planar.size());
  }

  std::vector<evaluation::PlaceResult> execute() {
    parallelFor(static_cast<std::size_t>(job_.threads), job_.threads,
                [this](std::size_t) { work(); });
    if (failure_) std::rethrow_exception(failure_);
    const bool nothing = std::all_of(results_.begin(), results_.end(),
                                     [](const auto& place) { return place.second.empty(); });
    if (nothing && !stopped())
      throw InputError(progress_.scene +
                       ": no point is left to be mapped at any place; look at the stages before "
                       "the one that finds planes");
    std::vector<evaluation::PlaceResult> results;
    for (auto& [place, of_place] : results_)
      std::move(of_place.begin(), of_place.end(), std::back_inserter(results));
    return results;
  }

 private:
  void work() {
    try {
      while (!stopped()) {
        const std::unique_ptr<Place> place = source_.next();
        if (place == nullptr) return;
        evaluate(*place);
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
    }
  }

  void evaluate(const Place& place) {
    const auto done = [&]() { return countMap(place.number); };
    std::vector<evaluation::PlaceResult> results = evaluateMethods(place, job_.methods, done);
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
  std::mutex mutex_;
  EvaluationProgress progress_;
  std::exception_ptr failure_;
  std::map<std::size_t, std::vector<evaluation::PlaceResult>> results_;  ///< by place
};

/// What the stages up to the planes make of a frame.
void copyPreparation(const Frame& from, Frame& to) {
  to.cloud = from.cloud;
  to.indices = from.indices;
  to.ground = from.ground;
  to.planes = from.planes;
  to.assumed = from.assumed;
}

/// Stands where the preparing stages stood and gives back what they have left.
class PreparedStage : public Stage {
 public:
  /// \param replaced the preparing stages, for what they say of every cloud
  explicit PreparedStage(std::vector<ConfiguredStage> replaced) : replaced_(std::move(replaced)) {}
  void declare(ParameterTable&) override {}
  void adapt(const CloudScale& scale) override {
    for (ConfiguredStage& stage : replaced_) stage.stage->adapt(scale);
  }
  void limit(CloudScale& scale) const override {
    for (const ConfiguredStage& stage : replaced_) stage.stage->limit(scale);
  }
  void process(Frame& frame) override { copyPreparation(*prepared_, frame); }
  /// What the preparing stages have left of them is for the maps.
  bool usesKeyFeatures(const Frame&) const override { return true; }
  void set(const Frame& prepared) { prepared_ = &prepared; }

 private:
  std::vector<ConfiguredStage> replaced_;
  const Frame* prepared_ = nullptr;
};

/// Keeps a frame as the stages for planes have left it.
class RecordingStage : public Stage {
 public:
  void declare(ParameterTable&) override {}
  void process(Frame& frame) override { copyPreparation(frame, *record_); }
  void set(Frame& record) { record_ = &record; }

 private:
  Frame* record_ = nullptr;
};

/// \return the stage, which the configuration owns
template <typename NewStage>
NewStage& insert(std::vector<ConfiguredStage>& stages,
                 std::vector<ConfiguredStage>::iterator before, StageKind kind, NewStage stage) {
  ConfiguredStage configured;
  configured.name = "evaluation";
  configured.kind = kind;
  configured.stage = std::make_unique<NewStage>(std::move(stage));
  return static_cast<NewStage&>(*stages.insert(before, std::move(configured))->stage);
}

bool findsPlanes(const ConfiguredStage& stage) {
  return stage.kind == StageKind::Planes;
}

/// What planes depend on beside the points. A length that is `auto` follows the cell size.
std::string planeStagesText(const Configuration& configuration) {
  std::string text = std::to_string(static_cast<int>(configuration.settings.profile)) + " " +
                     std::to_string(configuration.settings.seed);
  for (const ConfiguredStage& stage : configuration.stages) {
    if (!findsPlanes(stage) || !stage.enabled) continue;
    text += "\n" + stage.name;
    for (const Parameter& parameter : stage.parameters.parameters())
      text += " " + parameter.name + "=" + toYaml(parameter.get());
  }
  if (text.find("_m=auto") == std::string::npos) return text;
  for (const ConfiguredStage& stage : configuration.stages) {
    if (const std::optional<double> cell = stage.stage->resolution())
      text += "\ncell " + formatNumber(*cell);
  }
  return text;
}

/// The stages that remove points and are enabled; empty ones are left in their place.
std::vector<ConfiguredStage> takePointStages(Configuration& configuration) {
  std::vector<ConfiguredStage> taken;
  for (ConfiguredStage& stage : configuration.stages) {
    if (stage.kind == StageKind::Points && stage.enabled) taken.push_back(std::move(stage));
  }
  return taken;
}

}  // namespace

std::vector<evaluation::PlaceResult> evaluatePlaces(PlaceSource& source, const std::string& scene,
                                                    const EvaluationJob& job) {
  return Evaluation(source, scene, job).execute();
}

int minPointsPerCell(const Configuration& configuration) {
  PlanarMapParams params;
  for (const ConfiguredStage& stage : configuration.stages) {
    if (stage.enabled) stage.stage->configureMap(params);
  }
  return params.approximation.min_points_per_cell;
}

PlanarRun PlanarRuns::make(Configuration configuration) {
  std::vector<ConfiguredStage> preparing = takePointStages(configuration);
  keepMappingStages(configuration);
  const auto [known, is_new] = planes_.try_emplace(planeStagesText(configuration));
  Planes& planes = known->second;
  auto& stages = configuration.stages;
  RecordingStage* recording = nullptr;
  if (is_new) {
    const auto last = std::find_if(stages.rbegin(), stages.rend(), findsPlanes);
    recording = &insert(stages, last.base(), StageKind::Planes, RecordingStage());
    planes.frames.resize(place_.frames.size());
  } else {
    stages.erase(std::remove_if(stages.begin(), stages.end(), findsPlanes), stages.end());
  }
  PreparedStage& prepared =
      insert(stages, stages.begin(), StageKind::Points, PreparedStage(std::move(preparing)));

  Pipeline pipeline(std::move(configuration));
  if (place_.mean_up) pipeline.setMeanUp(*place_.mean_up);
  PlanarRun run;
  for (std::size_t i = 0; i < place_.frames.size(); ++i) {
    if (is_new) recording->set(planes.frames[i]);
    prepared.set(is_new ? place_.frames[i].frame : planes.frames[i]);
    Frame frame = place_.frames[i].frame;
    const StopWatch watch;
    pipeline.process(frame);  // and the count of cuboids, which no stage's time holds
    run.time_ms += watch.milliseconds() - frame.stage_ms.front();
    for (std::size_t k = 1; is_new && k < frame.stage_ms.size(); ++k) {
      if (findsPlanes(pipeline.configuration().stages[k])) planes.time_ms += frame.stage_ms[k];
    }
  }
  run.map = pipeline.map();
  const StopWatch watch;
  run.map.cuboids();
  run.time_ms += watch.milliseconds();
  if (!is_new) run.time_ms += planes.time_ms;
  return run;
}

std::vector<Variant> ablationVariants() {
  // One line an idea; the keys are those of `planar_map stages --describe NAME`.
  return {
      {"exact cover", {"planar_cuboid_approximation.absorption_cells=0"}},
      {"no choice per region", {"planar_cuboid_approximation.rectangle_cells=0"}},
      {"no hole filling", {"planar_cuboid_approximation.hole_size_m=0.000001"}},
      {"no noise model", {"planar_cuboid_approximation.noise=none"}},
      {"no doubt in first sights", {"planar_cuboid_approximation.first_belief=1"}},
      {"no misses", {"planar_cuboid_approximation.miss_factor=1"}},
      {"no fraction of a full cell", {"planar_cuboid_approximation.min_cell_fraction=0"}},
      {"surfaces without noise", {"planar_cuboid_approximation.surface_factor=0"}},
      {"strips without noise", {"planar_cuboid_approximation.rim_pixels=1000"}},
      {"no beliefs of features", {"kl_occupancy.enabled=false"}},
      {"no update of beliefs", {"kl_occupancy.update=none"}},
      {"no planes", {"multi_plane_segmentation.enabled=false"}},
  };
}

std::vector<Variant> regimeVariants() {
  const std::string stage = "planar_cuboid_approximation.";
  std::vector<Variant> variants;
  for (const bool raw : {false, true}) {
    for (const bool exact : {true, false}) {
      for (const bool boxes : {true, false}) {
        Variant variant{boxes ? "boxes" : "planes", {}};
        if (boxes) variant.assignments.emplace_back("multi_plane_segmentation.enabled=false");
        if (exact) {
          variant.name += "_exact";
          for (const char* one : {"absorption_cells=0", "hole_size_m=0.000001"})
            variant.assignments.push_back(stage + one);
        }
        if (raw) {
          variant.name += "_raw";
          variant.assignments.emplace_back("kl_occupancy.enabled=false");
          for (const char* one : {"first_belief=1", "min_cell_fraction=0", "noise=none"})
            variant.assignments.push_back(stage + one);
        }
        if (!variant.assignments.empty()) variants.push_back(std::move(variant));
      }
    }
  }
  return variants;
}

std::vector<evaluation::PlaceResult> withoutMethods(
    const std::vector<evaluation::PlaceResult>& results, const std::vector<std::string>& methods) {
  std::vector<evaluation::PlaceResult> kept;
  for (const evaluation::PlaceResult& result : results) {
    if (std::find(methods.begin(), methods.end(), result.method) == methods.end())
      kept.push_back(result);
  }
  return kept;
}

}  // namespace planar_mapping::tools
