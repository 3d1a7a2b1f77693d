// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The module _run: what brings PCL and OpenCV along is loaded when run() is first called.
#include <pcl/console/print.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "paths.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/output.h"
#include "planar_mapping/pipeline/ready_configuration.h"
#include "planar_mapping/pipeline/runner.h"

namespace planar_mapping::python {
namespace {

namespace py = pybind11;

using Path = std::filesystem::path;

/// As YAML has it: sequences, also those of NumPy, in brackets.
std::string yamlOf(py::object value) {
  if (py::hasattr(value, "tolist")) value = value.attr("tolist")();
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::str>(value) || !py::isinstance<py::sequence>(value)) return py::str(value);
  std::string list;
  for (const py::handle item : value)
    list += (list.empty() ? "" : ", ") + yamlOf(py::reinterpret_borrow<py::object>(item));
  return "[" + list + "]";
}

/// "stage.key=value".
std::vector<std::string> assignmentsOf(const py::dict& settings) {
  std::vector<std::string> assignments;
  for (const auto& [key, value] : settings)
    assignments.push_back(std::string(py::str(key)) + "=" +
                          yamlOf(py::reinterpret_borrow<py::object>(value)));
  return assignments;
}

py::object run(const std::optional<Path>& config, const py::object& inputs, const Path& out,
               const std::optional<Path>& poses, const py::dict& settings,
               const std::optional<std::string>& profile, const std::optional<std::string>& frames,
               const std::optional<int>& threads, const std::optional<std::uint64_t>& seed,
               bool overwrite, bool resume, const py::object& progress) {
  ConfigurationOverrides overrides;
  std::string name = config ? config->string() : "";
  if (!config) {  // as the command does
    io::SequenceOptions options;
    options.poses_file = poses.value_or(Path()).string();
    ReadyConfiguration ready = readyConfigurationFor(io::Sequence(pathsOf(inputs), options));
    name = ready.name;
    overrides.assignments = std::move(ready.assignments);
  }
  for (std::string& assignment : assignmentsOf(settings))
    overrides.assignments.push_back(std::move(assignment));
  overrides.assigned_by = "settings: ";
  if (threads) overrides.assignments.push_back("threads=" + std::to_string(*threads));
  if (seed) overrides.assignments.push_back("seed=" + std::to_string(*seed));
  overrides.profile = profile;
  StageTable table;
  registerBuiltinStages(table);
  Configuration configuration = loadConfiguration(name, table, overrides);
  configuration.inputs = pathsOf(inputs);
  configuration.poses = poses.value_or(Path()).string();
  if (frames) configuration.frames = parseFrameSelection(*frames);

  std::atomic<bool> stop{false};
  std::optional<py::error_already_set> raised;
  RunOptions options;
  options.output = out.string();
  options.overwrite = overwrite;
  options.resume = resume;
  options.stop = &stop;
  // Between frames: has Ctrl-C been pressed, and what does the caller's function say? What either
  // raises ends the run after this frame, and is raised when the results are saved.
  options.progress = [&](std::size_t done, std::size_t all, const FrameReport& report) {
    const py::gil_scoped_acquire locked;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (progress.is_none()) return;
      using namespace py::literals;
      progress(done, all,
               py::dict("source"_a = report.source, "planes"_a = report.planes,
                        "cuboids"_a = report.cuboids, "frame_ms"_a = report.frame_ms));
    } catch (py::error_already_set& error) {
      if (!raised) raised.emplace(error);
      stop = true;
    }
  };
  // What there is to say comes as an error or a warning of ours.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  RunResult result;
  {
    const py::gil_scoped_release released;
    result = runPipeline(std::move(configuration), options);
  }
  if (raised) throw std::move(*raised);
  for (const std::string& warning : result.warnings) {
    if (PyErr_WarnEx(PyExc_RuntimeWarning, warning.c_str(), 2) != 0) throw py::error_already_set();
  }
  return py::module_::import("json").attr("loads")(result.metrics_json);
}

// Types of _native; borrowed for good.
PyObject* io_error = nullptr;
PyObject* output_exists_error = nullptr;

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const OutputExistsError& error) {
    PyErr_SetString(output_exists_error, error.what());
  } catch (const OutputError& error) {
    PyErr_SetString(io_error, error.what());
  }
}

}  // namespace
}  // namespace planar_mapping::python

PYBIND11_MODULE(_run, module) {
  using namespace planar_mapping::python;
  using namespace py::literals;
  const py::module_ native = py::module_::import("planar_mapping._native");
  io_error = py::object(native.attr("IoError")).release().ptr();
  output_exists_error = py::object(native.attr("OutputExistsError")).release().ptr();
  py::register_exception_translator(&translate);
  module.def("run", &run, "config"_a, "inputs"_a, "out"_a, py::kw_only(), "poses"_a = py::none(),
             "settings"_a = py::dict(), "profile"_a = py::none(), "frames"_a = py::none(),
             "threads"_a = py::none(), "seed"_a = py::none(), "overwrite"_a = false,
             "resume"_a = false, "progress"_a = py::none());
}
