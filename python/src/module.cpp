// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <filesystem>
#include <string>

#include "arrays.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::python {
namespace {

namespace py = pybind11;

// Set when the module is imported, and never freed: an error may come until the interpreter ends.
PyObject* error_type = nullptr;
PyObject* input_error = nullptr;
PyObject* parameter_error = nullptr;
PyObject* config_error = nullptr;
PyObject* io_error = nullptr;
PyObject* missing_file_error = nullptr;

PyObject* addType(py::module_& module, const char* name, const char* meaning, PyObject* base,
                  PyObject* builtin) {
  const py::tuple bases = builtin == nullptr
                              ? py::make_tuple(py::handle(base))
                              : py::make_tuple(py::handle(base), py::handle(builtin));
  const std::string full_name = std::string("planar_mapping.") + name;
  PyObject* type = PyErr_NewExceptionWithDoc(full_name.c_str(), meaning, bases.ptr(), nullptr);
  if (type == nullptr) throw py::error_already_set();
  module.add_object(name, type);
  return type;
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const ConfigError& error) {
    const py::object instance = py::handle(config_error)(error.what());
    instance.attr("problems") = error.problems();
    PyErr_SetObject(config_error, instance.ptr());
  } catch (const InputError& error) {
    PyErr_SetString(input_error, error.what());
  } catch (const ParameterError& error) {
    PyErr_SetString(parameter_error, error.what());
  } catch (const IoError& error) {
    std::error_code ignored;
    const auto type = std::filesystem::status(error.path(), ignored).type();
    PyErr_SetString(type == std::filesystem::file_type::not_found ? missing_file_error : io_error,
                    error.what());
  } catch (const Error& error) {
    PyErr_SetString(error_type, error.what());
  }
}

}  // namespace

void addErrors(py::module_& module) {
  error_type = addType(module, "Error", "Whatever planar_mapping raises on purpose.",
                       PyExc_Exception, nullptr);
  input_error =
      addType(module, "InputError", "Input that cannot be used.", error_type, PyExc_ValueError);
  parameter_error = addType(module, "ParameterError", "A parameter outside its range.", error_type,
                            PyExc_ValueError);
  config_error = addType(module, "ConfigError", "A bad configuration; problems lists why.",
                         error_type, PyExc_ValueError);
  io_error = addType(module, "IoError", "A file that cannot be read or written.", error_type,
                     PyExc_OSError);
  missing_file_error = addType(module, "MissingFileError", "There is no such file.", io_error,
                               PyExc_FileNotFoundError);
  addType(module, "OutputExistsError", "There are results already.", io_error,
          PyExc_FileExistsError);
  py::register_exception_translator(&translate);
}

}  // namespace planar_mapping::python

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
  python::addSequences(module);
}
