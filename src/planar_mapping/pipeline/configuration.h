// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace planar_mapping {

/// A stage with its parameters set.
struct ConfiguredStage {
  std::string name;
  StageKind kind = StageKind::Any;
  /// `enabled: false` keeps a stage in the file, to be switched on by --set, but leaves it out.
  bool enabled = true;
  std::unique_ptr<Stage> stage;
  ParameterTable parameters;
};

/// Every N-th frame of [first, last); last < 0 = to the end.
struct FrameSelection {
  std::int64_t first = 0;
  std::int64_t last = -1;
  std::int64_t step = 1;
  std::string text() const;
};

/// A configuration file, read and checked.
struct Configuration {
  static constexpr int kVersion = 1;

  std::string path;  ///< of the file
  RunSettings settings;
  std::vector<std::string> inputs;  ///< absolute, or relative to the working directory
  std::string poses;                ///< TUM or KITTI file; empty = of the input, if any
  std::string calibration;          ///< a calib.yaml; empty = of the input
  double scale = 1.0;               ///< metres a unit of the clouds of files
  /// Where the sensor stood, if the clouds are in the coordinates of the world, metres.
  std::optional<Vector3> sensor_origin;
  FrameSelection frames;
  std::vector<std::string> plugins;  ///< shared libraries, absolute
  std::vector<ConfiguredStage> stages;
  /// Stages that are left out because their plugins were not loaded; empty in a configuration that
  /// can be run.
  std::vector<std::string> unknown_stages;
};

/// What may be done with the plugins that a configuration names: their code runs with the rights
/// of the program as soon as they are loaded.
enum class Plugins : std::uint8_t {
  Load,    ///< once all that can be checked without them is free of problems
  Ignore,  ///< see Configuration::unknown_stages
};

/// Whether any enabled stage is of this kind.
PLANAR_MAPPING_EXPORT bool hasStage(const Configuration& configuration, StageKind kind);
/// Whether any enabled stage may look at the images of frames.
PLANAR_MAPPING_EXPORT bool usesImages(const Configuration& configuration);
/// Whether any enabled stage of this kind has this word for a key.
PLANAR_MAPPING_EXPORT bool hasStageWith(const Configuration& configuration, StageKind kind,
                                        const std::string& key, const std::string& word);

/// What the command line says on top of the file.
struct ConfigurationOverrides {
  std::vector<std::string> assignments;  ///< "stage.key=value" or "key=value"
  std::string assigned_by = "--set ";    ///< stands before an assignment in messages
  std::optional<std::string> profile;
};

/// Where a configuration is: \p name itself, or, if it has no folder and there is no such file in
/// the working directory, the ready configuration of that name that came with the library
/// (share/planar_mapping/config above its folder); \p name if there is none.
PLANAR_MAPPING_EXPORT std::string findConfiguration(const std::string& name);

/// Reads a configuration file and checks all of it.
/// Plugins are named by an absolute path, or by the name of a file beside the configuration.
/// \param path  a file, or the name of a ready configuration: findConfiguration()
/// \param table the stages there are; those of plugins that are loaded are added to it
/// \throws ConfigError with every problem as `file:line:col: ...`
PLANAR_MAPPING_EXPORT Configuration loadConfiguration(const std::string& path, StageTable& table,
                                                      const ConfigurationOverrides& overrides = {},
                                                      Plugins plugins = Plugins::Load);
/// As above, from text; \p path is for messages and relative paths only.
PLANAR_MAPPING_EXPORT Configuration parseConfiguration(const std::string& text,
                                                       const std::string& path, StageTable& table,
                                                       const ConfigurationOverrides& overrides = {},
                                                       Plugins plugins = Plugins::Load);

/// The whole configuration as YAML, every value written out; reading it gives the same run.
PLANAR_MAPPING_EXPORT std::string effectiveYaml(const Configuration& configuration);
/// Its text without the number of threads, which changes nothing in a map.
PLANAR_MAPPING_EXPORT std::string withoutThreads(std::string effective_yaml);

/// "first:last:step" with any part left out, as in "10:", ":100:2", "5".
/// \throws InputError
PLANAR_MAPPING_EXPORT FrameSelection parseFrameSelection(const std::string& text);

}  // namespace planar_mapping
