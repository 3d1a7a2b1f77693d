// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <string>
#include <thread>

namespace planar_mapping::tools {

/// Obeys a signal within a second where the frame in work takes longer: ends the program with
/// kInterrupted. What was saved before stays, and --resume repeats the frames since.
class StopGuard {
 public:
  /// \param stop    set by the signal
  /// \param output  directory of the results, for the message
  StopGuard(const std::atomic<bool>& stop, std::string output);
  ~StopGuard();
  StopGuard(const StopGuard&) = delete;
  StopGuard& operator=(const StopGuard&) = delete;

  /// A frame is done: the run has seen the signal, or will before the next one.
  void frameDone() { ++frames_; }
  /// While this is true files are being saved, which is waited for.
  std::atomic<bool>& saving() { return saving_; }

 private:
  void watch();

  const std::atomic<bool>& stop_;
  const std::string output_;
  std::atomic<std::size_t> frames_{0};
  std::atomic<bool> saving_{false};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace planar_mapping::tools
