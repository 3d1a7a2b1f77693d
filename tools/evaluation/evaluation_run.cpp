// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation_run.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <map>
#include <mutex>

#include "planar_mapping/core/base/detail/parallel.h"
#include "planar_mapping/core/base/error.h"

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

}  // namespace

std::vector<evaluation::PlaceResult> evaluatePlaces(PlaceSource& source, const std::string& scene,
                                                    const EvaluationJob& job) {
  return Evaluation(source, scene, job).execute();
}

}  // namespace planar_mapping::tools
