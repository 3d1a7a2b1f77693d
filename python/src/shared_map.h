// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <mutex>
#include <shared_mutex>
#include <utility>

#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::python {

/// The map behind planar_mapping.PlanarMap. Work on it releases the interpreter's lock, so Python's
/// threads need one of its own: readers together, a writer alone. Functions given to it must not
/// touch Python objects.
class SharedMap {
 public:
  explicit SharedMap(PlanarMap map) : map_(std::move(map)) {}

  template <typename Function>
  auto read(Function function) const {
    const pybind11::gil_scoped_release released;
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    return function(map_);
  }
  template <typename Function>
  auto change(Function function) {
    const pybind11::gil_scoped_release released;
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    return function(map_);
  }

 private:
  PlanarMap map_;
  mutable std::shared_mutex mutex_;
};

}  // namespace planar_mapping::python
