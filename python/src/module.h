// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

// The parts of the module _native; full docstrings are in planar_mapping/__init__.pyi and
// docs/tutorials/python.md.
namespace planar_mapping::python {

void addErrors(pybind11::module_& module);
void addClouds(pybind11::module_& module);
void addMap(pybind11::module_& module);

}  // namespace planar_mapping::python
