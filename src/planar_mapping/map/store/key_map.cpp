// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/key_map.h"

#include <chrono>
#include <random>

namespace planar_mapping::detail {
namespace {

std::uint64_t makeSeed() {
  try {
    std::random_device device;
    return (static_cast<std::uint64_t>(device()) << 32u) | device();
  } catch (const std::exception&) {  // no source of randomness: the clock is the next best
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  }
}

}  // namespace

// No result depends on it: entries are kept in the order of insertion.
const std::uint64_t kHashSeed = makeSeed();

}  // namespace planar_mapping::detail
