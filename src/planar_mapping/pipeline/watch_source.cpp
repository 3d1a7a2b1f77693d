// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/watch_source.h"

#include <chrono>
#include <filesystem>
#include <thread>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/sequence_source.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr Seconds kSettled{0.3};  // a file that was not changed for so long is complete

/// Looks at a folder again and again, so that looking takes a fifth of the time at most.
class Patience {
 public:
  explicit Patience(const WatchOptions& watch) : watch_(watch), start_(Clock::now()) {}

  bool isStopped() const { return watch_.stop != nullptr && *watch_.stop; }
  bool isOver() const {
    return isStopped() ||
           (watch_.idle > 0.0 && Seconds(Clock::now() - start_).count() > watch_.idle);
  }
  void wait(Clock::time_point look_start) const {
    constexpr Seconds kPeriod{0.05};
    const Seconds look = Clock::now() - look_start;
    std::this_thread::sleep_for(std::max<Seconds>(kPeriod, 4.0 * look));
  }

 private:
  const WatchOptions& watch_;
  Clock::time_point start_;
};

bool isComplete(const io::Sequence& sequence, std::size_t index) {
  for (const std::string& file : sequence.files(index)) {
    std::error_code error;
    const fs::file_time_type changed = fs::last_write_time(file, error);
    if (error) return false;
    const Seconds age = fs::file_time_type::clock::now() - changed;
    // A clock elsewhere that runs ahead must not stop the map.
    if (age < kSettled && age > -kSettled) return false;
  }
  return true;
}

}  // namespace

io::Sequence waitForFrames(const std::vector<std::string>& inputs,
                           const io::SequenceOptions& options, const WatchOptions& watch) {
  const Patience patience(watch);
  io::SequenceOptions growing = options;
  growing.growing = true;
  for (const std::string& input : inputs) {
    if (!fs::is_directory(input)) throw IoError(input, "there is no such folder to watch");
  }
  std::string missing = "no frame came";
  for (;;) {
    const Clock::time_point start = Clock::now();
    try {
      io::Sequence sequence(inputs, growing);
      if (sequence.size() > 0 && isComplete(sequence, 0)) return sequence;
    } catch (const IoError& error) {
      missing = error.what();  // not yet there, perhaps
    }
    if (patience.isOver())
      throw InputError(inputs.front() + ": no frame to map " +
                       (patience.isStopped() ? "until it was stopped" : "came in time") + " (" +
                       missing + ")");
    patience.wait(start);
  }
}

WatchSource::WatchSource(const Configuration& configuration, const WatchOptions& watch)
    : inputs_(configuration.inputs),
      options_(sequenceOptions(configuration)),
      watch_(watch),
      selection_(configuration.frames),
      with_images_(usesImages(configuration)),
      sequence_(waitForFrames(inputs_, options_, watch)),
      next_(static_cast<std::size_t>(selection_.first)) {
  options_.growing = true;
}

std::vector<std::string> WatchSource::notes() const {
  return {sequence_.layout() + ", watched for new frames"};
}

std::optional<Frame> WatchSource::next() {
  const Patience patience(watch_);
  for (;;) {
    const Clock::time_point start = Clock::now();
    const bool ends = selection_.last >= 0 && next_ >= static_cast<std::size_t>(selection_.last);
    if (ends || patience.isStopped()) return std::nullopt;
    if (next_ < sequence_.size() && isComplete(sequence_, next_)) {
      last_ = sequence_.path(next_);
      Frame frame = readFrame(sequence_, next_, with_images_);
      next_ += static_cast<std::size_t>(selection_.step);
      return frame;
    }
    if (patience.isOver()) return std::nullopt;
    patience.wait(start);
    try {
      sequence_ = io::Sequence(inputs_, options_);
    } catch (const IoError&) {
      continue;  // a list that is just being written
    }
    // Frames that came late before the last one move it on.
    const std::size_t step = static_cast<std::size_t>(selection_.step);
    while (next_ >= step && next_ - step < sequence_.size() && !last_.empty() &&
           sequence_.path(next_ - step) < last_)
      ++next_;
  }
}

}  // namespace planar_mapping
