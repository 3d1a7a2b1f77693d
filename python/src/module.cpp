// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "module.h"

#include "arrays.h"
#include "planar_mapping/core/geometry/cuboid.h"

PYBIND11_MODULE(_native, module) {
  using namespace planar_mapping;
  module.attr("__version__") = PLANAR_MAPPING_VERSION;
  module.attr("FREE") = static_cast<int>(CellState::Free);
  module.attr("OCCUPIED") = static_cast<int>(CellState::Occupied);
  module.attr("UNKNOWN") = static_cast<int>(CellState::Unknown);
  python::registerRows();
  python::addErrors(module);
  python::addClouds(module);
  python::addMap(module);
}
