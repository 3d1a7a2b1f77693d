// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>
#include <thread>

namespace planar_mapping {

/// Whether more than twice as many programs as processors wanted to run in the last minute. What a
/// program takes then says nothing about it: even its processor time grows, for caches and memory
/// are shared. A test run with as many jobs as processors stays below.
inline bool machineIsBusy() {
  double load = 0.0;
  if (::getloadavg(&load, 1) != 1) return false;
  return load > 2.0 * std::thread::hardware_concurrency();
}

}  // namespace planar_mapping
