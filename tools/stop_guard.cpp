// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "stop_guard.h"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "commands.h"

namespace planar_mapping::tools {

StopGuard::StopGuard(const std::atomic<bool>& stop, std::string output)
    : stop_(stop), output_(std::move(output)), thread_([this] { watch(); }) {}

StopGuard::~StopGuard() {
  over_ = true;
  thread_.join();
}

void StopGuard::watch() {
  constexpr auto kPeriod = std::chrono::milliseconds(20);
  constexpr int kPatience = 40;  // periods
  std::size_t frames = 0;
  for (int waited = 0; !over_; std::this_thread::sleep_for(kPeriod)) {
    if (!stop_) frames = frames_;
    // The frame in work has ended since the signal: the rest is saving.
    if (!stop_ || saving_ || frames_ != frames) {
      waited = 0;
      continue;
    }
    if (++waited < kPatience) continue;
    std::error_code ignored;
    const bool has_map = std::filesystem::exists(output_ + "/map.pmap", ignored);
    std::cerr << "planar_map: interrupted within a frame that takes longer than a second; "
              << (has_map ? "what was saved before is in " + output_ + ", --resume continues it"
                          : "nothing was saved before")
              << std::endl;
    std::_Exit(kInterrupted);
  }
}

}  // namespace planar_mapping::tools
