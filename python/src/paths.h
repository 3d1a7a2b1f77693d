// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <string>
#include <vector>

namespace planar_mapping::python {

/// One path, or a sequence of them.
inline std::vector<std::string> pathsOf(const pybind11::object& paths) {
  using Path = std::filesystem::path;
  if (pybind11::isinstance<pybind11::str>(paths) || pybind11::hasattr(paths, "__fspath__"))
    return {paths.cast<Path>().string()};
  std::vector<std::string> list;
  for (const pybind11::handle path : paths) list.push_back(path.cast<Path>().string());
  return list;
}

}  // namespace planar_mapping::python
