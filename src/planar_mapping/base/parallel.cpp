// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/base/parallel.h"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace planar_mapping {
namespace {

/// Whether this thread works on a chunk: calls from there run inline.
thread_local bool in_chunk = false;

/// One call of parallelFor(), on the stack of its caller.
class Job {
 public:
  Job(std::size_t chunks, std::size_t workers, const std::function<void(std::size_t)>& body)
      : free_places(workers - 1), body_(body), failures_(chunks) {}

  bool hasChunks() const { return next_ < failures_.size(); }
  /// Begins one chunk after the other until none is left.
  void work() {
    in_chunk = true;
    for (std::size_t chunk = next_++; chunk < failures_.size(); chunk = next_++) {
      try {
        body_(chunk);
      } catch (...) {
        failures_[chunk] = std::current_exception();
      }
    }
    in_chunk = false;
  }
  void rethrowFirst() const {
    for (const std::exception_ptr& failure : failures_) {
      if (failure) std::rethrow_exception(failure);
    }
  }

  std::size_t free_places;  ///< for workers beside the caller
  std::size_t helpers = 0;  ///< workers that are in work() now

 private:
  const std::function<void(std::size_t)>& body_;
  std::vector<std::exception_ptr> failures_;  ///< one place a chunk
  std::atomic<std::size_t> next_{0};
};

/// Threads that wait for jobs of any caller. Started when first wanted and never joined: a program
/// may end at any moment.
class Pool {
 public:
  void run(Job& job) {
    std::unique_lock<std::mutex> lock(mutex_);
    startThreads(job.free_places);
    jobs_.push_back(&job);
    has_job_.notify_all();
    lock.unlock();
    job.work();
    lock.lock();
    jobs_.erase(std::find(jobs_.begin(), jobs_.end(), &job));
    is_done_.wait(lock, [&job] { return job.helpers == 0; });
  }

 private:
  void startThreads(std::size_t count) {
    try {
      for (; threads_ < count; ++threads_) std::thread([this] { serve(); }).detach();
    } catch (const std::exception&) {  // the system has no more threads; those there are do it all
    }
  }
  [[noreturn]] void serve() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      const auto found = std::find_if(jobs_.begin(), jobs_.end(), [](const Job* job) {
        return job->free_places > 0 && job->hasChunks();
      });
      if (found == jobs_.end()) {
        has_job_.wait(lock);
        continue;
      }
      Job& job = **found;
      --job.free_places;
      ++job.helpers;
      lock.unlock();
      job.work();
      lock.lock();
      if (--job.helpers == 0) is_done_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable has_job_;
  std::condition_variable is_done_;
  std::vector<Job*> jobs_;
  std::size_t threads_ = 0;
};

std::atomic<Pool*> the_pool{nullptr};

/// A child process has none of the threads, and perhaps a locked mutex: it gets a pool of its own.
Pool& pool() {
  static const int prepared = [] {
    the_pool = new Pool;
    return ::pthread_atfork(nullptr, nullptr, [] { the_pool = new Pool; });
  }();
  static_cast<void>(prepared);
  return *the_pool;
}

}  // namespace

int resolveThreads(int threads) {
  if (threads > 0) return threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallelFor(std::size_t chunks, int threads, const std::function<void(std::size_t)>& body) {
  const std::size_t workers = std::min(chunks, static_cast<std::size_t>(resolveThreads(threads)));
  if (workers <= 1 || in_chunk) {
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) body(chunk);
    return;
  }
  Job job(chunks, workers, body);
  pool().run(job);
  job.rethrowFirst();
}

}  // namespace planar_mapping
